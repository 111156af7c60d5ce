//! A map that is cut into parts: every way of marking cuts it alike, a copy names its recipient, and what
//! does not belong together is refused.

use meshmark_host_tests::{
    attacks::Map,
    editions::{common, next, places},
    plugin::{Host, Run},
};
use serde_json::{Value, json};
use std::{collections::BTreeMap, fs};

/// The smallest one that PATCH_SIZE allows: the map has three parts.
const PART_SIZE: &str = "1920";

/// A town of 4 719 vertices, map.gpkg, and its marked copy with the record copy.json.
fn marked() -> Host {
    let host = Host::new();
    host.copy("helsinki.gpkg", "map.gpkg");
    mark(&host, "copy.gpkg", "map.gpkg", &["RECORD=copy.json", &format!("PART_SIZE={PART_SIZE}")]).succeeds();
    host
}

fn mark(host: &Host, copy: &str, source: &str, options: &[&str]) -> Run {
    let options: Vec<&str> = options.iter().flat_map(|option| ["-oo", option]).collect();
    host.mark("GPKG", copy, source, &options)
}

fn moved(host: &Host, source: &str, copy: &str) -> BTreeMap<[u64; 2], [f64; 2]> {
    let map = |name: &str| Map::read(&host.path(name)).unwrap();
    places(&map(source), &map(copy)).unwrap()
}

fn json(host: &Host, name: &str) -> Value {
    serde_json::from_slice(&fs::read(host.path(name)).unwrap()).unwrap()
}

fn meshmark(host: &Host, arguments: &[&str]) -> Run {
    host.run(host.meshmark().to_str().unwrap(), arguments)
}

#[test]
fn a_copy_in_parts_names_its_recipient_and_nothing_new_crosses() {
    let host = marked();
    let record = json(&host, "copy.json");
    assert_eq!(record["mark"]["part_size"].to_string(), PART_SIZE);
    let parts = record["parts"].as_array().unwrap();
    let of_parts: u64 = parts.iter().map(|part| part["vertices"].as_u64().unwrap()).sum();
    assert_eq!((parts.len(), of_parts), (3, record["reference"]["vertices"].as_u64().unwrap()));
    let census = record["census"].as_object().unwrap();
    assert_eq!(census.values().map(|count| count.as_u64().unwrap()).sum::<u64>(), of_parts);
    let compared = meshmark(&host, &["compare", "--json", "map.gpkg", "copy.gpkg"]).succeeds();
    let compared: Value = serde_json::from_str(&compared.stdout).unwrap();
    let of = |pointer: &str| compared.pointer(pointer).unwrap();
    assert_eq!((of("/overlaps/new"), of("/crossings/new")), (&json!(0), &json!(0)));

    let report = host.matches("map.gpkg", &["--record", "copy.json", "copy.gpkg"]);
    assert_eq!(report["parameters"]["part_size"].to_string(), PART_SIZE);
    let flags = ["--recipient", "ACME GmbH", "--part-size", PART_SIZE, "copy.gpkg"];
    host.matches("map.gpkg", &flags);
    host.matches("map.gpkg", &[&["--record", "copy.json"], &flags[..]].concat());
    // The borders are part of the mark.
    let whole = [&flags[..2], &flags[4..]].concat();
    assert_ne!(host.verify("map.gpkg", &whole).1["verdict"], "match");

    // A folder with records of the same map in parts and in one.
    fs::create_dir(host.path("records")).unwrap();
    fs::copy(host.path("copy.json"), host.path("records/parts.json")).unwrap();
    mark(&host, "whole.gpkg", "map.gpkg", &["RECORD=records/whole.json"]).succeeds();
    assert!(json(&host, "records/whole.json")["mark"].get("part_size").is_none());
    for (copy, record) in [("copy.gpkg", "parts.json"), ("whole.gpkg", "whole.json")] {
        let candidates = &host.matches("map.gpkg", &["--records", "records", copy])["candidates"];
        assert_eq!((&candidates["tried"], &candidates["list"][0]["record"]), (&json!(2), &json!(record)));
    }
}

#[test]
fn every_way_of_marking_cuts_alike() {
    let host = marked();
    let first = moved(&host, "map.gpkg", "copy.gpkg");
    let option = format!("PART_SIZE={PART_SIZE}");
    host.create("written.gpkg", "map.gpkg", &["-dsco", &option]).succeeds();
    assert_eq!(moved(&host, "map.gpkg", "written.gpkg"), first);
    // Rounded, it is read back.
    mark(&host, "rounded.gpkg", "map.gpkg", &[&option, "PRECISION=0.001"]).succeeds();
    fs::write(host.path("list.csv"), "recipient\nÖster AB\nACME GmbH\n").unwrap();
    let command = ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "copies"];
    let with = |part_size| meshmark(&host, &[&command[..], &["--part-size", part_size, "map.gpkg"]].concat());
    assert!(with(PART_SIZE).succeeds().stdout.starts_with("2 copies written"));
    assert_eq!(moved(&host, "map.gpkg", "copies/acme-gmbh-f384e512.gpkg"), first);
    let [mut expected, mut found] =
        ["copy.json", "copies/acme-gmbh-f384e512.json"].map(|name| json(&host, name));
    for record in [&mut expected, &mut found] {
        // The digests of files differ, as another program writes them.
        record["copy"] = Value::Null;
        record["reference"]["file_sha256"] = Value::Null;
    }
    assert_eq!(found, expected);
    host.matches("map.gpkg", &["--records", "copies", "copy.gpkg"]);
    assert!(with(PART_SIZE).succeeds().stdout.contains("2 copies there already"));
    let other = with("2400");
    assert!(
        other.code == Some(2) && other.stderr.contains("is not the record of this map"),
        "{}",
        other.stderr
    );
}

#[test]
fn an_edition_rests_on_a_base_in_parts() {
    let host = marked();
    let edition = next(&Map::read(&host.path("map.gpkg")).unwrap(), 0.1, 3);
    edition.write(&host.path("next.gpkg")).unwrap();
    let base = ["BASE=copy.json", "BASE_REFERENCE=map.gpkg"];
    mark(&host, "next_copy.gpkg", "next.gpkg", &[&base[..], &["RECORD=next.json"]].concat()).succeeds();
    let [shared, equal] =
        common(&moved(&host, "map.gpkg", "copy.gpkg"), &moved(&host, "next.gpkg", "next_copy.gpkg"));
    assert!(shared > 3000 && shared == equal, "{equal} of {shared}");
    assert_eq!(json(&host, "next.json")["bases"][0]["part_size"].to_string(), PART_SIZE);
    host.matches("next.gpkg", &["--reference", "map.gpkg", "--record", "next.json", "next_copy.gpkg"]);
    let both = mark(&host, "no.gpkg", "next.gpkg", &[&base[..], &["PART_SIZE=9000"]].concat());
    assert!(both.stderr.contains("PART_SIZE and BASE are both given"), "{}", both.stderr);
    assert!(!host.path("no.gpkg").exists());
}

#[test]
fn a_part_size_that_makes_no_parts_is_refused_and_so_is_a_record_of_other_parts() {
    let host = marked();
    for (option, words) in [
        ("PART_SIZE=1919", "use at least 1920, or 0 for one part"),
        ("PART_SIZE=-1", "PART_SIZE=-1 is not a whole number"),
    ] {
        let refused = mark(&host, "no.gpkg", "map.gpkg", &[option]);
        assert!(refused.code != Some(0) && refused.stderr.contains(words), "{}", refused.stderr);
        assert!(!host.path("no.gpkg").exists());
    }
    let mut record = json(&host, "copy.json");
    record["mark"]["part_size"] = json!(2400);
    fs::write(host.path("other.json"), record.to_string()).unwrap();
    let (run, _) = host.verify("map.gpkg", &["--record", "other.json", "copy.gpkg"]);
    assert!(run.code == Some(4) && run.stderr.contains("parts"), "{:?} {}", run.code, run.stderr);
    let (run, _) = host.verify("map.gpkg", &["--record", "copy.json", "--part-size", "2400", "copy.gpkg"]);
    assert!(run.code == Some(2) && run.stderr.contains("--part-size 2400"), "{}", run.stderr);

    // Nothing would stand where the record says it does.
    let whole = json(&host, "copy.json");
    let mut fewer = whole.clone();
    fewer["parts"].as_array_mut().unwrap().pop();
    let mut renamed = whole;
    renamed["parts"][1]["sha256"] = json!("0".repeat(64));
    next(&Map::read(&host.path("map.gpkg")).unwrap(), 0.1, 3).write(&host.path("next.gpkg")).unwrap();
    for changed in [record, fewer, renamed] {
        fs::write(host.path("other.json"), changed.to_string()).unwrap();
        let refused = mark(&host, "no.gpkg", "next.gpkg", &["BASE=other.json", "BASE_REFERENCE=map.gpkg"]);
        let words = "names parts that are not those of its reference";
        assert!(refused.code != Some(0) && refused.stderr.contains(words), "{}", refused.stderr);
        assert!(!host.path("no.gpkg").exists());
    }
}

#[test]
fn a_map_in_parts_leaves_nothing_among_temporary_files_and_is_not_marked_without_a_folder_for_them() {
    let host = Host::new();
    host.copy("helsinki.gpkg", "map.gpkg");
    fs::create_dir(host.path("scratch")).unwrap();
    let mark = |folder: &str| {
        let part_size = format!("PART_SIZE={PART_SIZE}");
        let arguments = ["-f", "GPKG", "copy.gpkg", "MESHMARK:map.gpkg", "-oo", "KEY=key.json", "-oo"];
        let arguments = [&arguments[..], &["RECIPIENT=ACME GmbH", "-oo", &part_size]].concat();
        host.run_with("ogr2ogr", &arguments, &[("TMPDIR", host.path(folder).to_str().unwrap())])
    };
    let refused = mark("none");
    let words = ["a temporary file in", "No such file or directory", "TMPDIR"];
    let has_all = words.iter().all(|words| refused.stderr.contains(words));
    assert!(refused.code != Some(0) && has_all, "{}", refused.stderr);
    assert!(!host.path("copy.gpkg").exists());
    mark("scratch").succeeds();
    assert_eq!(fs::read_dir(host.path("scratch")).unwrap().count(), 0);
    assert_eq!(moved(&host, "map.gpkg", "copy.gpkg"), moved(&marked(), "map.gpkg", "copy.gpkg"));
}
