//! The command line, pinned: exact stdout, stderr and exit code of tests/cmd/*.toml.
//!
//! All cases run in one folder of small files; [`make_files`] describes each of them. `[..]`
//! stands for what may differ between machines, `...` for such lines. After a change that is meant,
//! copy the new output from the failing test.

use meshmark_core::key::SecretKey;
use std::{
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

const MESHMARK: &str = env!("CARGO_BIN_EXE_meshmark");

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures")
}

#[test]
fn the_command_line_is_as_written() {
    let folder = tempfile::tempdir().unwrap();
    make_files(folder.path());
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cmd");
    assert!(cases.read_dir().unwrap().count() > 50, "trycmd is content with no case at all");
    // Here trycmd runs a case that names no folder.
    std::env::set_current_dir(folder.path()).unwrap();
    trycmd::TestCases::new()
        .default_bin_path(MESHMARK)
        .env("GDAL_DRIVER_PATH", "none") // the verifier needs no plugin
        .case(cases.join("*.toml"))
        .run();
}

/// What the cases work on: the test vectors, and files that are wrong in one way each.
fn make_files(folder: &Path) {
    let copy = |from: &str, to: &str| {
        fs::copy(fixtures().join(from), folder.join(to)).unwrap();
    };
    copy("kotka.gpkg", "reference.gpkg");
    copy("kotka.gpkg", "unmarked.gpkg");
    copy("helsinki.gpkg", "another_map.gpkg");
    for file in ["key.json", "record.json", "marked.gpkg"] {
        copy(&format!("vectors/{file}"), file);
    }
    copy("vectors/fingerprint/record.json", "record_of_a_fingerprint.json");
    copy("vectors/fingerprint/marked.gpkg", "fingerprint.gpkg");
    let write = |file: &str, bytes: &[u8]| fs::write(folder.join(file), bytes).unwrap();
    let (key, record) = (read(folder, "key.json"), read(folder, "record.json"));
    write("another_key.json", SecretKey::from_bytes([1; 32]).to_json().as_bytes());
    write("changed_key.json", key.replace("000102", "000103").as_bytes());
    write("record_of_another_reference.json", record.replace("ce0eba", "ce0ebb").as_bytes());
    write("record_of_another_message.json", record.replace("095abf", "f95abf").as_bytes());
    write("record_of_another_recipient.json", record.replace("ACME GmbH", "Another Ltd").as_bytes());
    write("record_of_a_later_version.json", record.replace("_record\": 1", "_record\": 3").as_bytes());
    write("record_with_a_negative_amplitude.json", record.replace("0.1,", "-0.1,").as_bytes());
    write("record_with_a_comment.json", record.replacen("{", "{ \"comment\": \"\",", 1).as_bytes());
    for key in ["key.json", "another_key.json", "changed_key.json"] {
        fs::set_permissions(folder.join(key), Permissions::from_mode(0o600)).unwrap();
    }
    make_records(folder, &record);
    write("text.txt", b"This is no map.\n");
    write("table.csv", b"name,height\nTown hall,20\n");
    write("empty.svg", b"<svg/>");
    write("small.csv", b"id,WKT\n1,\"LINESTRING (385000 6672000,385010 6672000,385010 6672020)\"\n");
    write("degrees.csv", b"id,WKT\n1,\"LINESTRING (24.9 60.1,24.91 60.1,24.92 60.2)\"\n");
    write("far.csv", b"id,WKT\n1,\"LINESTRING (385000 6672000,385010 6672000,1e308 6672020)\"\n");
    write("list.csv", b"ACME GmbH\nOther Ltd\n\nACME GmbH\n");
    write("one.csv", b"recipient\nACME GmbH\n");
    write("empty.csv", b"\n");
    // A foreign file, and a finished copy.
    for name in ["taken", "copies"] {
        fs::create_dir_all(folder.join(name)).unwrap();
        copy("vectors/marked.gpkg", &format!("{name}/acme-gmbh-f384e512.gpkg"));
    }
    copy("vectors/record.json", "copies/acme-gmbh-f384e512.json");
    let reprojected = ["-q", "-t_srs", "EPSG:3857", "in_another_crs.gpkg", "marked.gpkg"];
    let status = Command::new("ogr2ogr").args(reprojected).current_dir(folder).status();
    assert!(status.unwrap().success());
    write("truncated.gpkg", &fs::read(folder.join("marked.gpkg")).unwrap()[..100_000]);
    write(
        "marked.vrt",
        b"<OGRVRTDataSource><OGRVRTLayer name='roads'><SrcDataSource relativeToVRT='1'>marked.gpkg\
          </SrcDataSource></OGRVRTLayer></OGRVRTDataSource>",
    );
}

/// A folder of three records that are good for the test vectors' key and map, and of four files
/// that are not.
fn make_records(folder: &Path, record: &str) {
    let key = SecretKey::from_json(&read(folder, "key.json")).unwrap();
    let of = |recipient: &str| {
        let message = key.recipient_message(recipient).to_hex();
        record.replace("ACME GmbH", recipient).replace("095abfcd9510d386660bcc7d0e7b8760", &message)
    };
    fs::create_dir_all(folder.join("records")).unwrap();
    fs::create_dir_all(folder.join("no_records")).unwrap();
    fs::create_dir_all(folder.join("one_record")).unwrap();
    fs::write(folder.join("one_record/acme.json"), record).unwrap();
    fs::write(folder.join("one_record/notes.txt"), "no record").unwrap();
    fs::write(folder.join("one_record/no_record.json"), "[1]").unwrap();
    fs::create_dir_all(folder.join("records_of_layers")).unwrap();
    fs::write(folder.join("records_of_layers/acme.json"), record).unwrap();
    let of_layer = record.replace("\"layers\": null", "\"layers\": [\"streets\"]");
    assert_ne!(of_layer, record);
    fs::write(folder.join("records_of_layers/streets.json"), of_layer).unwrap();
    for (file, text) in [
        ("acme.json", record.to_string()),
        ("other.json", of("Another Ltd")),
        ("third.json", of("Third SARL").replace("\"amplitude_m\": 0.1,", "\"amplitude_m\": 0.2,")),
        ("another_key.json", record.replace("434471506306423b", "0000000000000000")),
        ("another_reference.json", record.replace("ce0eba", "ce0ebb")),
        ("changed.json", record.replace("ACME GmbH", "Another Ltd")),
        ("no_record.json", "[1]".into()),
        ("notes.txt", "no record either".into()),
    ] {
        fs::write(folder.join("records").join(file), text).unwrap();
    }
}

fn read(folder: &Path, file: &str) -> String {
    fs::read_to_string(folder.join(file)).unwrap()
}

fn keygen(path: &Path) -> Output {
    Command::new(MESHMARK).arg("keygen").arg(path).output().unwrap()
}

#[test]
#[cfg(unix)]
fn only_its_owner_can_read_a_new_key_and_no_two_keys_are_equal() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let make = |file: &str| {
        let path = folder.path().join(file);
        assert!(keygen(&path).status.success());
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        SecretKey::from_json(&fs::read_to_string(&path).unwrap()).unwrap().id()
    };
    assert_ne!(make("a.json"), make("b.json"));
}

#[test]
#[cfg(target_os = "linux")]
fn an_answer_may_stay_unread_and_says_when_it_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let keygen = |name: &str, stdout: Stdio| {
        let mut command = Command::new(MESHMARK);
        let output = command.arg("keygen").arg(folder.path().join(name)).stdout(stdout).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    assert_eq!(keygen("a.json", writer.into()), (Some(0), String::new()));
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let (code, error) = keygen("b.json", full.into());
    assert!(code == Some(7) && error.starts_with("meshmark: the answer cannot be printed: "), "{error}");
}

#[test]
fn an_existing_file_keeps_its_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("key.json");
    fs::write(&path, "an old key").unwrap();
    assert_eq!(keygen(&path).status.code(), Some(2));
    assert_eq!(fs::read_to_string(&path).unwrap(), "an old key");
}

#[test]
fn no_output_holds_the_secret() {
    let folder = tempfile::tempdir().unwrap();
    make_files(folder.path());
    let secret = "000102030405060708090a0b0c0d0e0f";
    assert!(read(folder.path(), "key.json").contains(secret));
    for arguments in [
        "verify --key key.json --reference text.txt marked.gpkg",
        "verify --key changed_key.json --reference reference.gpkg marked.gpkg",
        "verify --key key.json --reference reference.gpkg --recipient A --json marked.gpkg",
    ] {
        let output =
            Command::new(MESHMARK).current_dir(folder.path()).args(arguments.split(' ')).output().unwrap();
        let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
        assert!(!text.is_empty() && !text.to_lowercase().contains(&secret[4..20]), "{text}");
    }
}
