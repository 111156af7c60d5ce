//! Suspects with coordinates that mean no place, and with features that cannot be read: they are
//! left out and named, and the rest is examined.

mod common;

use common::{assert_answer, fixture, verify, write};
use gdal::Dataset;
use meshmark_dataset::{Selection, survey};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};
use tempfile::TempDir;

const CRS: &str = r#""crs":{"type":"name","properties":{"name":"EPSG:3067"}}"#;

fn marked() -> Vec<[f64; 2]> {
    let map = survey(&Dataset::open(fixture("vectors/marked.gpkg")).unwrap(), &Selection::default()).unwrap();
    map.data.vertices.coords().to_vec()
}

/// A GeoJSON feature.
fn feature(kind: &str, coordinates: &str) -> String {
    format!(
        r#"{{"type":"Feature","properties":{{}},"geometry":{{"type":"{kind}","coordinates":{coordinates}}}}}"#
    )
}

/// Asserts a match that leaves out so much.
fn assert_match(suspect: &Path, left_out: &str) {
    let (code, text) = verify(suspect);
    assert!(code == Some(0) && text.contains(left_out), "{}: {code:?}\n{text}", suspect.display());
}

/// The marked buildings in degrees, with one feature more.
fn in_degrees(folder: &TempDir, name: &str, more: &str) -> PathBuf {
    let path = folder.path().join(name);
    let converted = Command::new("ogr2ogr")
        .args(["-f", "GeoJSON", "-t_srs", "EPSG:4326"])
        .args([&path, &fixture("vectors/marked.gpkg")])
        .arg("buildings")
        .status();
    assert!(converted.unwrap().success());
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("\"features\": [", &format!("\"features\": [ {more},"), 1)).unwrap();
    path
}

#[test]
fn a_point_that_is_no_place_is_left_out_whatever_its_numbers_are() {
    let folder = TempDir::new().unwrap();
    for (i, place) in
        ["[26.9,1e20]", "[1e20,60]", "[26.9,95]", "[1e12,60]", "[-3601,60]", "[1e300,1e300]", "[1e400,60]"]
            .into_iter()
            .enumerate()
    {
        let suspect = in_degrees(&folder, &format!("{i}.geojson"), &feature("Point", place));
        // GDAL 3.12 refuses a file with a number that no float can hold.
        match Command::new("ogrinfo").arg("-so").arg(&suspect).status().unwrap().success() {
            true => {
                assert_match(&suspect, "left out:     1 coordinate pair of the suspect (layer \"buildings\"")
            }
            false => assert_answer(&suspect, 5, "Failed to read GeoJSON data"),
        }
    }
}

#[test]
fn a_bad_vertex_in_every_feature_hides_no_other_vertex() {
    let folder = TempDir::new().unwrap();
    let line = |ends: &[[f64; 2]], bad: &str| {
        let [[ax, ay], [bx, by]] = [ends[0], ends[ends.len() - 1]];
        feature("LineString", &format!("[[{ax},{ay}],[{bad},6711000],[{bx},{by}]]"))
    };
    for (name, bad) in [("far.geojson", "1e300"), ("beyond_the_earth.geojson", "5e8")] {
        let lines: Vec<String> = marked().chunks(2).map(|ends| line(ends, bad)).collect();
        let text = format!(r#"{{"type":"FeatureCollection",{CRS},"features":[{}]}}"#, lines.join(","));
        assert_answer(&write(&folder, name, &text), 0, "MATCH");
    }
}

#[test]
fn far_points_in_a_table_without_a_crs_neither_stall_nor_hide_the_mark() {
    let folder = TempDir::new().unwrap();
    let mut rows: Vec<String> = marked().iter().map(|[x, y]| format!("{x},{y}")).collect();
    for far in ["1e11,-1e11", "nan,0", "inf,0", "1e29,-1e29", "0,9e11"] {
        rows.push(far.into());
    }
    assert_answer(&write(&folder, "points.csv", &format!("x,y\n{}\n", rows.join("\n"))), 0, "MATCH");
}

/// The marked map with one more road, of these bytes.
fn with_road(folder: &TempDir, name: &str, geometry: &[u8]) -> PathBuf {
    let path = folder.path().join(format!("{name}.gpkg"));
    fs::copy(fixture("vectors/marked.gpkg"), &path).unwrap();
    let database = rusqlite::Connection::open(&path).unwrap();
    let mut triggers = database.prepare("SELECT name FROM sqlite_master WHERE type = 'trigger'").unwrap();
    let triggers: Vec<String> =
        triggers.query_map((), |row| row.get(0)).unwrap().collect::<Result<_, _>>().unwrap();
    for trigger in triggers {
        database.execute_batch(&format!("DROP TRIGGER \"{trigger}\"")).unwrap();
    }
    database.execute("INSERT INTO roads (fid, geom) VALUES (99999, ?)", [geometry]).unwrap();
    path
}

/// A line in the coding of a GeoPackage.
fn line(points: &[[f64; 2]]) -> Vec<u8> {
    let numbers = points.iter().flatten().flat_map(|number| number.to_le_bytes());
    let counted = [&[1, 2, 0, 0, 0][..], &(points.len() as u32).to_le_bytes()].concat();
    geopackage(&counted.into_iter().chain(numbers).collect::<Vec<u8>>())
}

fn geopackage(wkb: &[u8]) -> Vec<u8> {
    [b"GP\x00\x01", &3067u32.to_le_bytes()[..], wkb].concat()
}

#[test]
fn a_line_with_a_bad_end_loses_that_end() {
    let folder = TempDir::new().unwrap();
    let there = [497_000.0, 6_711_000.0];
    for (name, x) in [("nan", f64::NAN), ("infinite", f64::INFINITY), ("far", 1e31), ("not_here", 1e9)] {
        let suspect = with_road(&folder, name, &line(&[[x, 6_711_000.0], there]));
        assert_match(&suspect, "left out:     1 coordinate pair of the suspect (layer \"roads\"");
    }
}

#[test]
fn a_feature_that_cannot_be_read_is_left_out_and_named() {
    let folder = TempDir::new().unwrap();
    let cut = line(&[[497_000.0, 6_711_000.0], [497_001.0, 6_711_000.0]]);
    for (name, geometry) in [
        ("count", geopackage(b"\x01\x02\x00\x00\x00\xff\xff\xff\x7f")),
        ("cut", cut[..cut.len() - 3].to_vec()),
        ("kind", geopackage(b"\x01\x63\x00\x00\x00\x01\x00\x00\x00")),
        ("nested", geopackage(&[1, 7, 0, 0, 0, 1, 0, 0, 0].repeat(1000))),
        ("text", b"LINESTRING (1 2, 3 4)".to_vec()),
    ] {
        let suspect = with_road(&folder, name, &geometry);
        assert_match(&suspect, "left out:     1 feature of the suspect (layer \"roads\", feature 99999: ");
    }
}

#[test]
fn empty_and_degenerate_geometries_are_no_faults() {
    let folder = TempDir::new().unwrap();
    let there = [497_000.0, 6_711_000.0];
    for (name, geometry) in [
        ("no_points", line(&[])),
        ("one_point", line(&[there])),
        ("same_point", line(&[there; 4])),
        ("empty_ring", geopackage(b"\x01\x03\x00\x00\x00\x01\x00\x00\x00\x00\x00\x00\x00")),
        ("empty_point", geopackage(&[&[1, 1, 0, 0, 0][..], &[f64::NAN.to_le_bytes(); 2].concat()].concat())),
    ] {
        let (code, text) = verify(&with_road(&folder, name, &geometry));
        assert!(code == Some(0) && !text.contains("left out"), "{name}: {code:?}\n{text}");
    }
}
