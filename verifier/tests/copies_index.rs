//! `meshmark records`: who received which copy.

mod common;

use common::{ended, fixture};
use serde_json::{Value, json};
use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::Command,
    time::{Duration, SystemTime},
};

/// This is the SHA-256 of "abc" (FIPS 180-4).
const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

fn records(folder: &Path) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    ended(command.arg("records").arg(folder).output().unwrap())
}

/// The rows of the table by record, each value by its column.
fn rows(table: &str) -> BTreeMap<String, BTreeMap<String, String>> {
    let mut table = csv::Reader::from_reader(table.as_bytes());
    let rows = table.deserialize().map(|row: csv::Result<BTreeMap<String, String>>| row.unwrap());
    rows.map(|row| (row["record"].clone(), row)).collect()
}

/// Writes the record of the vectors with other values.
fn write(path: &Path, changes: &[(&str, Value)]) {
    let text = fs::read_to_string(fixture("vectors/fingerprint/record.json")).unwrap();
    let mut record: Value = serde_json::from_str(&text).unwrap();
    for (pointer, value) in changes {
        *record.pointer_mut(pointer).unwrap() = value.clone();
    }
    fs::write(path, record.to_string()).unwrap();
}

#[test]
fn every_record_is_a_row_that_says_whether_the_copy_is_the_recorded_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let of_abc = [("/copy/file_sha256", json!(ABC))];
    write(&path("a.b.json"), &of_abc);
    fs::write(path("a.b.gpkg"), "abc").unwrap();
    fs::write(path("a.b.gpkg-journal"), "of nobody").unwrap();
    let day = SystemTime::UNIX_EPOCH + Duration::from_secs(86_400 * 365);
    fs::File::options().write(true).open(path("a.b.gpkg")).unwrap().set_modified(day).unwrap();
    write(&path("changed.json"), &of_abc);
    fs::write(path("changed.shp.zip"), "abcd").unwrap();
    write(&path("lost.json"), &[of_abc[0].clone(), ("/recipient", json!("Häuser, \"GmbH\""))]);
    write(&path("plain.json"), &[]);
    fs::write(path("plain.geojson"), "abc").unwrap();
    fs::copy(fixture("vectors/record.json"), path("old.json")).unwrap();
    fs::write(path("settings.json"), "{}").unwrap();
    let (code, text) = records(folder.path());
    assert_eq!(code, Some(0), "{text}");
    let (table, warning) = text.split_at(text.find("meshmark: ").unwrap());
    assert!(warning.contains("settings.json is no record"), "{warning}");
    let rows = rows(table);
    let column = |name: &str| {
        ["a.b.json", "changed.json", "lost.json", "old.json", "plain.json"]
            .map(|row| rows[row][name].as_str())
    };
    assert_eq!(rows.len(), 5);
    assert_eq!(column("state"), ["recorded", "changed", "absent", "absent", "undigested"]);
    assert_eq!(column("copy"), ["a.b.gpkg", "changed.shp.zip", "", "", "plain.geojson"]);
    let other = column("copy_sha256")[1];
    assert_eq!(column("copy_sha256"), [ABC, other, ABC, "", ABC]);
    assert!(other.len() == 64 && other != ABC);
    assert_eq!((column("written")[0], column("recipient")[2]), ("1971-01-01", "Häuser, \"GmbH\""));
    assert!(column("edition_sha256").iter().all(|digest| *digest == column("edition_sha256")[0]));
    assert_eq!(column("earlier_editions"), ["0"; 5]);
}

#[test]
fn a_folder_that_is_missing_or_has_no_record_or_a_damaged_one_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(records(&folder.path().join("none")).0, Some(5));
    let (code, text) = records(folder.path());
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("has no record"), "{text}");
    fs::write(folder.path().join("a.json"), "{\"meshmark_record\": 2}").unwrap();
    let (code, text) = records(folder.path());
    assert!(code == Some(2) && text.contains("a.json"), "{text}");
}

#[test]
fn what_cannot_be_read_is_named_and_the_rest_is_listed() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for name in ["a.json", "z.json"] {
        write(&path(name), &[]);
    }
    fs::write(path("damaged.json"), "{\"meshmark_record\": 2}").unwrap();
    let (code, text) = records(folder.path());
    assert_eq!(code, Some(2), "{text}");
    let (table, faults) = text.split_at(text.find("meshmark: ").unwrap());
    assert_eq!(rows(table).into_keys().collect::<Vec<_>>(), ["a.json", "z.json"]);
    assert!(faults.lines().count() == 1 && faults.contains("damaged.json: malformed record"), "{faults}");

    fs::remove_file(path("damaged.json")).unwrap();
    std::os::unix::fs::symlink("nowhere.json", path("lost.json")).unwrap();
    let (made, text) = ended(Command::new("mkfifo").arg(path("pipe.json")).output().unwrap());
    assert_eq!(made, Some(0), "{text}");
    fs::create_dir(path("folder.json")).unwrap();
    let (code, text) = records(folder.path());
    assert_eq!(code, Some(5), "{text}");
    let (table, faults) = text.split_at(text.find("meshmark: ").unwrap());
    assert_eq!(rows(table).len(), 2);
    assert!(faults.contains("lost.json") && faults.contains("pipe.json"), "{faults}");
    assert_eq!(faults.lines().count(), 2, "{faults}");
}

#[test]
fn names_are_given_to_programs_as_they_are_and_do_not_control_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let name = "AC\u{1b}[2J\u{202e}ME";
    write(&folder.path().join("a.json"), &[("/recipient", json!(name))]);
    let (code, table) = records(folder.path());
    assert!(code == Some(0) && table.contains(name), "{table}");
    let command = format!("{} records {}", env!("CARGO_BIN_EXE_meshmark"), folder.path().display());
    let mut script = Command::new("script");
    let (code, shown) = ended(script.args(["-qec", &command, "/dev/null"]).output().unwrap());
    assert!(code == Some(0) && shown.contains(r"AC\u{1b}[2J\u{202e}ME"), "{shown}");
    assert!(!shown.contains(['\u{1b}', '\u{202e}']), "{shown}");
}
