//! A series of editions: what did not change moves as before, everybody's copy of any edition names
//! its recipient, and what does not belong together is refused.

use meshmark_host_tests::{
    attacks::Map,
    editions::{common, next, places},
    plugin::{Host, Run},
};
use serde_json::Value;
use std::{collections::BTreeMap, fs};

/// Three editions of a map, 1.gpkg to 3.gpkg, of which every third feature changes; the copies of ACME
/// are copy1.gpkg to copy3.gpkg.
fn series() -> Host {
    let host = Host::new();
    host.copy("kotka.gpkg", "1.gpkg");
    for number in 1..3 {
        let edition = Map::read(&host.path(&format!("{number}.gpkg"))).unwrap();
        next(&edition, 0.35, number).write(&host.path(&format!("{}.gpkg", number + 1))).unwrap();
    }
    mark(&host, "copy1.gpkg", "1.gpkg", &["RECORD=1.json"]).succeeds();
    let second = ["BASE=1.json", "BASE_REFERENCE=1.gpkg", "RECORD=2.json"];
    mark(&host, "copy2.gpkg", "2.gpkg", &second).succeeds();
    let third = ["BASE=2.json", "BASE_REFERENCE=2.gpkg,1.gpkg", "RECORD=3.json"];
    mark(&host, "copy3.gpkg", "3.gpkg", &third).succeeds();
    host
}

fn mark(host: &Host, copy: &str, source: &str, options: &[&str]) -> Run {
    let options: Vec<&str> = options.iter().flat_map(|option| ["-oo", option]).collect();
    host.mark("GPKG", copy, source, &options)
}

fn moved(host: &Host, edition: usize, copy: &str) -> BTreeMap<[u64; 2], [f64; 2]> {
    let map = |name: &str| Map::read(&host.path(name)).unwrap();
    places(&map(&format!("{edition}.gpkg")), &map(copy)).unwrap()
}

const ALL: [&str; 4] = ["--reference", "2.gpkg", "--reference", "1.gpkg"];

#[test]
fn unchanged_vertices_stay_and_every_edition_names_its_recipient() {
    let host = series();
    let copies = [1, 2, 3].map(|number| moved(&host, number, &format!("copy{number}.gpkg")));
    for (earlier, later) in [(0, 1), (1, 2), (0, 2)] {
        let [shared, equal] = common(&copies[earlier], &copies[later]);
        assert_eq!(shared, equal, "of {}", copies[later].len());
        assert!(5 * shared > 2 * copies[later].len() && shared < copies[later].len());
    }
    let report = host.matches("3.gpkg", &[&ALL[..], &["--record", "3.json", "copy3.gpkg"]].concat());
    let of_whole = report["p_value_log10"].as_f64().unwrap();
    assert!(of_whole < -30.0, "{of_whole}");
    let record: Value = serde_json::from_slice(&fs::read(host.path("3.json")).unwrap()).unwrap();
    let [parts, bases] = ["parts", "bases"].map(|field| record[field].as_array().unwrap().len());
    assert_eq!((parts, bases), (3, 2), "each edition has enough new vertices");
    // An older copy carries a share of the same evidence.
    host.matches("3.gpkg", &[&ALL[..], &["--record", "3.json", "copy1.gpkg"]].concat());
    let (run, _) = host.verify("3.gpkg", &["--record", "3.json", "copy3.gpkg"]);
    assert_eq!(run.code, Some(4), "{}", run.stderr);
    assert!(run.stderr.contains("no map given is the reference of a base"), "{}", run.stderr);
}

#[test]
fn a_recipient_who_is_new_to_the_series_has_a_fingerprint_in_old_parts_too() {
    let host = series();
    fs::create_dir(host.path("records")).unwrap();
    fs::copy(host.path("3.json"), host.path("records/acme.json")).unwrap();
    let options = ["RECIPIENT=New Ltd", "BASE=2.json", "BASE_REFERENCE=1.gpkg,2.gpkg"];
    let options = [&options[..], &["KEY=key.json", "RECORD=records/new.json"]].concat();
    let options: Vec<&str> = options.iter().flat_map(|option| ["-oo", option]).collect();
    host.run("ogr2ogr", &[&["-f", "GPKG", "new.gpkg", "MESHMARK:3.gpkg"], &options[..]].concat()).succeeds();
    let report = host
        .matches("3.gpkg", &[&ALL[..], &["--records", "records", "--show-recipients", "new.gpkg"]].concat());
    let list = report["candidates"]["list"].as_array().unwrap();
    assert_eq!((&list[0]["recipient"], list.len()), (&"New Ltd".into(), 2));
    assert!(list[1]["p_value_log10"].as_f64().unwrap() > -6.0, "{report:#}");
    let [shared, equal] = common(&moved(&host, 3, "new.gpkg"), &moved(&host, 3, "copy3.gpkg"));
    // Attached vertices and a few that are held are the rest.
    assert!(equal < shared / 4, "{equal} of {shared}");
}

#[test]
fn the_write_side_and_distribute_make_the_copies_of_the_read_side() {
    let host = series();
    let options = ["-dsco", "BASE=1.json", "-dsco", "BASE_REFERENCE=1.gpkg"];
    host.create("written.gpkg", "2.gpkg", &options).succeeds();
    let of_driver = moved(&host, 2, "copy2.gpkg");
    assert_eq!(moved(&host, 2, "written.gpkg"), of_driver);
    fs::create_dir(host.path("first")).unwrap();
    fs::copy(host.path("1.json"), host.path("first/acme.json")).unwrap();
    fs::write(host.path("list.csv"), "recipient\nACME GmbH\n").unwrap();
    let command = ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "second"];
    let command = [&command[..], &["--base", "first", "--base-reference", "1.gpkg", "2.gpkg"]].concat();
    let distribute = || host.run(host.meshmark().to_str().unwrap(), &command);
    assert!(distribute().succeeds().stdout.starts_with("1 copy written"));
    assert_eq!(moved(&host, 2, "second/acme-gmbh-f384e512.gpkg"), of_driver);
    assert!(distribute().succeeds().stdout.contains("1 copy there already"));
    // Without the base it would be another copy.
    let other = host.run(host.meshmark().to_str().unwrap(), &[&command[..7], &["2.gpkg"]].concat());
    assert!(
        other.code == Some(2) && other.stderr.contains("is not the record of this map"),
        "{}",
        other.stderr
    );
}

#[test]
fn a_base_that_does_not_belong_to_the_edition_is_refused_and_nothing_is_written() {
    let host = series();
    host.copy("helsinki.gpkg", "town.gpkg");
    mark(&host, "town_copy.gpkg", "town.gpkg", &["RECORD=town.json"]).succeeds();
    mark(&host, "coded.gpkg", "1.gpkg", &["CODE=LDPC", "RECORD=coded.json"]).succeeds();
    host.run("ogr2ogr", &["-t_srs", "EPSG:3857", "mercator.gpkg", "1.gpkg"]).succeeds();
    mark(&host, "mercator_copy.gpkg", "mercator.gpkg", &["RECORD=mercator.json"]).succeeds();
    let record = fs::read_to_string(host.path("1.json")).unwrap();
    let commitment = record.split("\"key_commitment\": \"").nth(1).unwrap();
    let other = record.replace(&commitment[..64], &"ab".repeat(32));
    fs::write(host.path("other_key.json"), other).unwrap();
    fs::write(host.path("cut.json"), &record[..record.len() / 2]).unwrap();
    fs::create_dir(host.path("empty")).unwrap();
    let one = "BASE_REFERENCE=1.gpkg";
    for (options, words) in [
        (&["BASE=1.json"][..], "BASE is given without BASE_REFERENCE"),
        (&[one], "BASE_REFERENCE is given without BASE"),
        (&["BASE=1.json", "BASE_REFERENCE=3.gpkg"], "no map given is the reference of a base"),
        (&["BASE=1.json", "BASE_REFERENCE=lost.gpkg"], "BASE_REFERENCE=lost.gpkg cannot be read"),
        (&["BASE=1.json", "BASE_REFERENCE=MESHMARK:1.gpkg"], "marked view"),
        (&["BASE=lost.json", one], "BASE=lost.json cannot be read"),
        (&["BASE=cut.json", one], "BASE=cut.json is no base: malformed record"),
        (&["BASE=key.json", one], "BASE=key.json is no base: malformed record"),
        (&["BASE=empty", one], "BASE=empty is a folder without records"),
        (&["BASE=coded.json", one], "BASE=coded.json is the record of a message"),
        (&["BASE=other_key.json", one], "BASE=other_key.json was made with another key"),
        (&["BASE=town.json", "BASE_REFERENCE=town.gpkg"], "no vertex of the map is in the references"),
        (&["BASE=mercator.json", "BASE_REFERENCE=mercator.gpkg"], "is of a map in another CRS"),
        (&["BASE=1.json", one, "AMPLITUDE=0.2"], "made with AMPLITUDE=0.1, and this edition is marked with"),
        (&["BASE=1.json", one, "PRECISION=0.01"], "made without PRECISION, and this edition is marked with"),
        (&["BASE=1.json", one, "CODE=LDPC"], "BASE is for fingerprints"),
    ] {
        let before = host.files();
        let run = mark(&host, "out.gpkg", "2.gpkg", &[options, &["RECORD=out.json"]].concat());
        assert!(run.code.is_some_and(|code| code != 0), "{options:?}");
        let [error] = run.errors()[..] else { panic!("one failure, not {:?}", run.stderr) };
        assert!(error.contains(words), "{options:?}: {error}");
        assert!(host.files() == before, "{options:?}");
    }
}

#[test]
fn the_record_of_another_copy_of_the_same_edition_is_no_base_of_it() {
    let host = series();
    fs::create_dir(host.path("records")).unwrap();
    for number in 1..3 {
        fs::copy(host.path(&format!("{number}.json")), host.path(&format!("records/{number}.json"))).unwrap();
    }
    let options = ["BASE=records", "BASE_REFERENCE=1.gpkg", "RECORD=records/again.json"];
    for _ in 0..2 {
        let run = mark(&host, "again.gpkg", "2.gpkg", &options);
        run.succeeds();
        assert_eq!(moved(&host, 2, "again.gpkg"), moved(&host, 2, "copy2.gpkg"));
        fs::remove_file(host.path("again.gpkg")).unwrap();
    }
    let record: Value = serde_json::from_slice(&fs::read(host.path("records/again.json")).unwrap()).unwrap();
    assert_eq!(record["bases"].as_array().unwrap().len(), 1);
    let mut alone: Value = serde_json::from_slice(&fs::read(host.path("2.json")).unwrap()).unwrap();
    alone["bases"] = serde_json::json!([]);
    fs::write(host.path("alone.json"), alone.to_string()).unwrap();
    for (source, options, words) in [
        ("1.gpkg", ["BASE=1.json", "BASE_REFERENCE=1.gpkg"], "BASE=1.json is of this very edition"),
        (
            "3.gpkg",
            ["BASE=alone.json", "BASE_REFERENCE=2.gpkg"],
            "names parts that are not those of its reference",
        ),
    ] {
        let before = host.files();
        let run = mark(&host, "out.gpkg", source, &options);
        let [error] = run.errors()[..] else { panic!("one failure, not {:?}", run.stderr) };
        assert!(error.contains(words), "{options:?}: {error}");
        assert!(host.files() == before, "{options:?}");
    }
}

#[test]
fn the_reference_of_a_base_is_not_overwritten() {
    let host = Host::new();
    host.copy("kotka.gpkg", "1.gpkg");
    host.copy("kotka.gpkg", "2.gpkg");
    mark(&host, "copy1.gpkg", "1.gpkg", &["RECORD=1.json"]).succeeds();
    let before = host.files();
    let base = ["-dsco", "BASE=1.json", "-dsco", "BASE_REFERENCE=1.gpkg", "-dsco", "OVERWRITE=YES"];
    let run = host.create("1.gpkg", "2.gpkg", &base);
    assert!(run.stderr.contains("BASE_REFERENCE and the target are the same file"), "{}", run.stderr);
    assert!(host.files() == before);
    let options = ["-overwrite", "-oo", "BASE=1.json", "-oo", "BASE_REFERENCE=1.gpkg"];
    let run = host.mark("GPKG", "1.gpkg", "2.gpkg", &options);
    assert!(run.stderr.contains("BASE_REFERENCE and the output are the same file"), "{}", run.stderr);
    assert!(host.files() == before);
}
