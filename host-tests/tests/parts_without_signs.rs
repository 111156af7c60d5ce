//! A part of a map in which too few vertices are free for the mark: whoever exports it is told.

use meshmark_host_tests::plugin::{Host, Run};
use std::fs;

const PART_SIZE: &str = "1920";
/// The line is most of the map beside the town of 4 719 vertices.
const LINE: u64 = 4000;

/// Returns a host with a map of a town and, a kilometre beside it, a straight line of as many vertices.
fn town_and_line() -> Host {
    let host = Host::new();
    host.copy("helsinki.gpkg", "map.gpkg");
    let places: Vec<String> = (0..LINE).map(|at| format!("{} 6672000", 388_000 + at)).collect();
    fs::write(host.path("line.csv"), format!("id,WKT\n1,\"LINESTRING ({})\"\n", places.join(", "))).unwrap();
    let add = [
        "-update",
        "map.gpkg",
        "line.csv",
        "-a_srs",
        "EPSG:3067",
        "-nln",
        "line",
        "-oo",
        "KEEP_GEOM_COLUMNS=NO",
    ];
    host.run("ogr2ogr", &add).succeeds();
    host
}

fn assert_warned(text: &str, [part_size, patch_size]: [&str; 2]) {
    let line = text.lines().find(|line| line.contains("stay unmarked")).expect(text);
    let words: Vec<&str> = line.split(' ').collect();
    let at = words.iter().position(|word| *word == "of").expect(line);
    let number = |word: &str| word.trim_matches(|c: char| !c.is_ascii_digit()).parse::<u64>().expect(line);
    let (signless, vertices) = (number(words[at - 1]), number(words[at + 1]));
    assert!((LINE / 2..=LINE + 1000).contains(&signless) && vertices == 4719 + LINE, "{line}");
    assert!(line.contains(&format!("raise {part_size} or lower {patch_size}")), "{line}");
}

#[test]
fn every_way_of_marking_warns_of_vertices_that_stay_unmarked() {
    let host = town_and_line();
    let option = format!("PART_SIZE={PART_SIZE}");
    let mark = |copy: &str, more: &[&str]| -> Run { host.mark("GPKG", copy, "map.gpkg", more).succeeds() };
    let read = mark("read.gpkg", &["-oo", &option]);
    assert_warned(&read.warnings().join("\n"), ["PART_SIZE", "PATCH_SIZE"]);
    let written = host.create("written.gpkg", "map.gpkg", &["-dsco", &option]).succeeds();
    assert_warned(&written.warnings().join("\n"), ["PART_SIZE", "PATCH_SIZE"]);
    fs::write(host.path("list.csv"), "recipient\nÖster AB\nACME GmbH\n").unwrap();
    let command = ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "copies"];
    let command = [&command[..], &["--part-size", PART_SIZE, "map.gpkg"]].concat();
    let many = host.run(host.meshmark().to_str().unwrap(), &command).succeeds();
    assert_warned(&many.stderr, ["--part-size", "--patch-size"]);
    assert_eq!(many.stderr.matches("stay unmarked").count(), 1, "{}", many.stderr);

    let whole = mark("whole.gpkg", &[]);
    assert!(!whole.stderr.contains("stay unmarked"), "{}", whole.stderr);
    host.copy("helsinki.gpkg", "town.gpkg");
    let town = host.mark("GPKG", "town_copy.gpkg", "town.gpkg", &["-oo", &option]).succeeds();
    assert!(!town.stderr.contains("stay unmarked"), "{}", town.stderr);
}
