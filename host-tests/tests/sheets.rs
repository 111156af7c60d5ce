//! Sheets of a map that are marked apart: they agree on what they share, a leak of several of them
//! names its recipient, and a plan that does not fit is refused.

use meshmark_host_tests::{
    attacks::Map,
    editions::{common, places},
    plugin::{Host, Run},
};
use serde_json::Value;
use std::{collections::BTreeMap, fs};

const NAMES: [&str; 2] = ["west", "east"];

/// The middle of the map, and its extent.
const MIDDLE: f64 = 385_820.0;
const WIDE: [f64; 4] = [380_000.0, 6_660_000.0, 390_000.0, 6_680_000.0];

/// A town in two sheets, west.gpkg and east.gpkg in the folder `sheets`, which both have the features at
/// their border.
fn sheets() -> Host {
    let host = Host::new();
    host.copy("helsinki.gpkg", "map.gpkg");
    fs::create_dir(host.path("sheets")).unwrap();
    let [left, bottom, right, top] = WIDE;
    for (name, [from, to]) in NAMES.iter().zip([[left, MIDDLE], [MIDDLE, right]]) {
        let corners = [from, bottom, to, top].map(|value| value.to_string());
        let target = format!("sheets/{name}.gpkg");
        let arguments = ["-spat", &corners[0], &corners[1], &corners[2], &corners[3], &target, "map.gpkg"];
        host.run("ogr2ogr", &arguments).succeeds();
    }
    host
}

fn plan(host: &Host, arguments: &[&str]) -> Run {
    host.run(host.meshmark().to_str().unwrap(), &[&["plan"], arguments].concat())
}

fn mark(host: &Host, copy: &str, sheet: &str, options: &[&str]) -> Run {
    let options: Vec<&str> = options.iter().flat_map(|option| ["-oo", option]).collect();
    host.mark("GPKG", copy, &format!("sheets/{sheet}.gpkg"), &options)
}

/// Marks both sheets by the plan `plan.json`, the eastern one first.
fn marked() -> Host {
    let host = sheets();
    plan(&host, &["sheets", "-o", "plan.json"]).succeeds();
    fs::create_dir(host.path("records")).unwrap();
    for name in NAMES.iter().rev() {
        let record = format!("RECORD=records/{name}.json");
        mark(&host, &format!("{name}.gpkg"), name, &[&record, "SHEETS=plan.json"]).succeeds();
    }
    host
}

fn moved(host: &Host, sheet: &str, copy: &str) -> BTreeMap<[u64; 2], [f64; 2]> {
    let map = |name: &str| Map::read(&host.path(name)).unwrap();
    places(&map(&format!("sheets/{sheet}.gpkg")), &map(copy)).unwrap()
}

fn record(host: &Host, sheet: &str) -> Value {
    serde_json::from_slice(&fs::read(host.path(&format!("records/{sheet}.json"))).unwrap()).unwrap()
}

/// Joins maps as layers of one name.
fn join(host: &Host, joined: &str, maps: [&str; 2]) {
    for map in maps {
        host.run("ogr2ogr", &["-append", joined, map]).succeeds();
    }
}

#[test]
fn sheets_agree_on_what_they_share_and_a_leak_of_both_names_its_recipient() {
    let host = marked();
    let [west, east] = NAMES.map(|name| moved(&host, name, &format!("{name}.gpkg")));
    let [shared, equal] = common(&west, &east);
    assert!(shared > 100 && shared == equal, "{equal} of {shared}");
    let stay = |places: &BTreeMap<[u64; 2], [f64; 2]>| {
        places.iter().filter(|(from, to)| **from == to.map(f64::to_bits)).count()
    };
    assert!(2 * stay(&west) < west.len() && 2 * stay(&east) < east.len());
    let census = &record(&host, "west")["census"];
    let total: u64 = census.as_object().unwrap().values().map(|count| count.as_u64().unwrap()).sum();
    assert_eq!(total as usize, west.len());
    assert!(census["anchored"].as_u64().unwrap() as usize >= shared && census["standing"] == 0, "{census}");

    join(&host, "source.gpkg", ["sheets/west.gpkg", "sheets/east.gpkg"]);
    join(&host, "leak.gpkg", ["west.gpkg", "east.gpkg"]);
    let meshmark = host.meshmark();
    let compared = host.run(meshmark.to_str().unwrap(), &["compare", "--json", "source.gpkg", "leak.gpkg"]);
    let compared: Value = serde_json::from_str(&compared.succeeds().stdout).unwrap();
    assert_eq!((&compared["overlaps"]["new"], &compared["crossings"]["new"]), (&0.into(), &0.into()));

    for name in NAMES {
        let record = format!("records/{name}.json");
        host.matches(&format!("sheets/{name}.gpkg"), &["--record", &record, "leak.gpkg"]);
    }
    let both = ["--reference", "sheets/east.gpkg", "--records", "records", "leak.gpkg"];
    let report = host.matches("sheets/west.gpkg", &both);
    let list = report["candidates"]["list"].as_array().unwrap();
    let p = |entry: &Value| entry["p_value_log10"].as_f64().unwrap();
    assert!(list.len() == 2 && list.iter().all(|entry| p(entry) < -12.0), "{list:?}");
}

#[test]
fn a_sheet_is_marked_again_alone_by_every_way_alike() {
    let host = marked();
    let first = moved(&host, "west", "west.gpkg");
    mark(&host, "again.gpkg", "west", &["SHEETS=plan.json"]).succeeds();
    assert_eq!(moved(&host, "west", "again.gpkg"), first);
    host.create("written.gpkg", "sheets/west.gpkg", &["-dsco", "SHEETS=plan.json"]).succeeds();
    assert_eq!(moved(&host, "west", "written.gpkg"), first);
    fs::write(host.path("list.csv"), "recipient\nACME GmbH\n").unwrap();
    let command = ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "copies"];
    let command = [&command[..], &["--sheets", "plan.json", "sheets/west.gpkg"]].concat();
    let distribute = || host.run(host.meshmark().to_str().unwrap(), &command);
    assert!(distribute().succeeds().stdout.starts_with("1 copy written"));
    assert_eq!(moved(&host, "west", "copies/acme-gmbh-f384e512.gpkg"), first);
    assert!(distribute().succeeds().stdout.contains("1 copy there already"));
    let without = host.run(host.meshmark().to_str().unwrap(), &[&command[..7], &command[9..]].concat());
    assert_eq!(without.code, Some(2), "{}", without.stderr);
    // The plan depends on nothing but the sheets.
    plan(&host, &["sheets/west.gpkg", "sheets/east.gpkg", "-o", "again.json"]).succeeds();
    assert_eq!(fs::read(host.path("again.json")).unwrap(), fs::read(host.path("plan.json")).unwrap());
}

#[test]
fn the_next_edition_of_a_sheet_stands_on_the_one_before_and_fits_its_neighbour() {
    let host = marked();
    fs::create_dir(host.path("before")).unwrap();
    fs::rename(host.path("sheets/west.gpkg"), host.path("before/west.gpkg")).unwrap();
    let sql = ["-where", "fid % 20 > 0", "sheets/west.gpkg", "before/west.gpkg"];
    host.run("ogr2ogr", &sql).succeeds();
    plan(&host, &["sheets", "-o", "next.json"]).succeeds();
    let options = ["BASE=records/west.json", "BASE_REFERENCE=before/west.gpkg", "SHEETS=next.json"];
    let options = [&options[..], &["RECORD=records/next.json"]].concat();
    mark(&host, "next.gpkg", "west", &options).succeeds();
    let next = moved(&host, "west", "next.gpkg");
    let map = |name: &str| Map::read(&host.path(name)).unwrap();
    let before = places(&map("before/west.gpkg"), &map("west.gpkg")).unwrap();
    let [shared, equal] = common(&before, &next);
    assert!(shared == equal && shared == next.len(), "{equal} of {shared} of {}", next.len());
    let [shared, equal] = common(&next, &moved(&host, "east", "east.gpkg"));
    assert!(shared > 100 && shared == equal);
    let references = ["--reference", "before/west.gpkg", "--record", "records/next.json", "next.gpkg"];
    host.matches("sheets/west.gpkg", &references);
}

#[test]
fn a_plan_that_does_not_fit_is_refused_and_nothing_is_written() {
    let host = marked();
    let text = fs::read_to_string(host.path("plan.json")).unwrap();
    fs::write(host.path("later.json"), text.replace("\"meshmark_plan\": 1", "\"meshmark_plan\": 9")).unwrap();
    fs::write(host.path("cut.json"), &text[..text.len() / 2]).unwrap();
    fs::write(host.path("mercator.json"), text.replace("EPSG:3067", "EPSG:3857")).unwrap();
    host.copy("kotka.gpkg", "kotka.gpkg");
    plan(&host, &["sheets/east.gpkg", "kotka.gpkg", "-o", "east.json"]).succeeds();
    for (options, words) in [
        (&["SHEETS=lost.json"][..], "SHEETS=lost.json cannot be read"),
        (&["SHEETS=cut.json"], "SHEETS=cut.json is no plan: malformed plan"),
        (&["SHEETS=key.json"], "SHEETS=key.json is no plan: malformed plan"),
        (&["SHEETS=later.json"], "version 9 instead of 1"),
        (&["SHEETS=mercator.json"], "is of sheets in another CRS (EPSG:3857) than this map (EPSG:3067)"),
        (&["SHEETS=east.json"], "SHEETS=east.json has no sheet with the vertices of this map"),
        (&["SHEETS=plan.json", "LAYERS=buildings"], "has no sheet with the vertices of this map"),
        (&["SHEETS=plan.json", "TOLERANCE=0.5"], "made with TOLERANCE=0.75, and this sheet is marked with"),
        (
            &["SHEETS=plan.json", "PRECISION=0.01"],
            "in place, and PRECISION would round it: leave PRECISION out",
        ),
        (&["SHEETS=plan.json", "CODE=LDPC"], "SHEETS is for fingerprints"),
    ] {
        let before = host.files();
        let run = mark(&host, "out.gpkg", "west", &[options, &["RECORD=out.json"]].concat());
        assert!(run.code.is_some_and(|code| code != 0), "{options:?}");
        let [error] = run.errors()[..] else { panic!("one failure, not {:?}", run.stderr) };
        assert!(error.contains(words), "{options:?}: {error}");
        assert!(host.files() == before, "{options:?}");
    }
    let run = host.create("plan.json", "sheets/west.gpkg", &["-dsco", "SHEETS=plan.json"]);
    assert!(run.code != Some(0) && fs::read_to_string(host.path("plan.json")).unwrap() == text);
}

#[test]
fn sheets_that_do_not_belong_together_are_not_planned() {
    let host = sheets();
    fs::create_dir(host.path("empty")).unwrap();
    fs::write(host.path("there.json"), "{}").unwrap();
    host.run("ogr2ogr", &["-t_srs", "EPSG:3857", "mercator.gpkg", "sheets/west.gpkg"]).succeeds();
    host.copy("helsinki.gpkg", "same.gpkg");
    let west = Map::read(&host.path("sheets/west.gpkg")).unwrap();
    let rounded = west.map_coords(|at| at.map(|value| (value * 100.0).round() / 100.0));
    rounded.write(&host.path("rounded.gpkg")).unwrap();
    let (west, east) = ("sheets/west.gpkg", "sheets/east.gpkg");
    for (arguments, code, words) in [
        (&["empty", "-o", "plan.json"][..], 2, "the folder empty has no sheet"),
        (&["lost", west, "-o", "plan.json"], 5, "the sheet lost cannot be opened"),
        (&["sheets", "-o", "there.json"], 2, "a plan is never overwritten"),
        (&[west, "key.json", "-o", "plan.json"], 5, "the sheet key.json cannot be opened"),
        (&[west, "MESHMARK:sheets/east.gpkg", "-o", "plan.json"], 2, "is a marked view already"),
        (&["mercator.gpkg", east, "-o", "plan.json"], 4, "are not in the same CRS"),
        (&["map.gpkg", "same.gpkg", "-o", "plan.json"], 4, "have the same vertices"),
        (&["rounded.gpkg", east, "-o", "plan.json"], 4, "disagree on"),
        (&["sheets", "--tolerance", "0", "-o", "plan.json"], 2, "--tolerance 0 is not a number"),
        (
            &[west, west, "-o", "plan.json"],
            2,
            "west.gpkg is one sheet, and a plan is about what several share",
        ),
    ] {
        let before = host.files();
        let run = plan(&host, arguments);
        assert_eq!(run.code, Some(code), "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(words) && run.stderr.lines().count() == 1, "{}", run.stderr);
        assert!(host.files() == before, "{arguments:?}");
    }
    // What a folder has besides may be a sheet.
    fs::create_dir(host.path("sheets/north")).unwrap();
    fs::write(host.path("sheets/south.gml"), "").unwrap();
    let run = plan(&host, &["sheets", "-o", "plan.json"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    for skipped in ["sheets/north", "sheets/south.gml"] {
        assert!(run.stderr.contains(&format!("{skipped} is not planned")), "{}", run.stderr);
    }
}
