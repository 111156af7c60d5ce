//! `meshmark compare`: which layers are counterparts, and what is refused.

mod common;

use common::{ended, fixture};
use serde_json::Value;
use std::{path::Path, process::Command};
use tempfile::TempDir;

const REFERENCE: &str = "kotka.gpkg";
const MARKED: &str = "vectors/fingerprint/marked.gpkg";

/// Runs `ogr2ogr` in a folder; the source is a fixture.
fn convert(folder: &TempDir, source: &str, arguments: &[&str]) {
    let [options @ .., target] = arguments else { panic!("there is a target") };
    let mut command = Command::new("ogr2ogr");
    command.args(["-q"]).args(options).arg(target).arg(fixture(source)).arg("buildings");
    let (code, text) = ended(command.current_dir(folder).output().unwrap());
    assert_eq!(code, Some(0), "{text}");
}

fn compare(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    ended(command.current_dir(folder).arg("compare").args(arguments).output().unwrap())
}

#[test]
fn two_shapefiles_are_compared_whatever_the_names_of_their_layers() {
    let folder = tempfile::tempdir().unwrap();
    convert(&folder, REFERENCE, &["before.shp"]);
    convert(&folder, MARKED, &["after.shp"]);
    let (code, text) = compare(folder.path(), &["--json", "before.shp", "after.shp"]);
    assert_eq!(code, Some(0), "{text}");
    let figures: Value = serde_json::from_str(&text).unwrap();
    assert!(figures["displacement"]["rms_m"].as_f64().unwrap() > 0.05, "{text}");
}

#[test]
fn several_layers_correspond_by_name_in_any_order_and_those_without_a_counterpart_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let map = |file: &str, source: &str, names: [&str; 2]| {
        let [first, second] = names;
        convert(&folder, source, &["-nln", first, file]);
        convert(&folder, source, &["-update", "-nln", second, file]);
    };
    map("before.gpkg", REFERENCE, ["a", "b"]);
    map("after.gpkg", MARKED, ["b", "a"]);
    map("other.gpkg", MARKED, ["a", "c"]);
    let (code, text) = compare(folder.path(), &["before.gpkg", "after.gpkg"]);
    assert_eq!(code, Some(0), "{text}");
    let (code, text) = compare(folder.path(), &["before.gpkg", "other.gpkg"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("(only the reference has \"b\", only the marked map has \"c\"):"), "{text}");
    assert!(!text.contains("vertices"), "{text}");
}

#[test]
fn a_precision_that_is_no_grid_is_refused() {
    for precision in ["nan", "inf", "0", "-1"] {
        let (code, text) = compare(Path::new("."), &["--precision", precision, "before.gpkg", "after.gpkg"]);
        assert!(code == Some(2) && text.contains("give a number greater than 0"), "{precision}: {text}");
    }
}
