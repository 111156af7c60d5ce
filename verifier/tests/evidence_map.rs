//! `meshmark verify --evidence-map`: the file a GIS shows.

use gdal::{Dataset, vector::LayerAccess};
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures").join(name)
}

/// Writes the map of the evidence in `suspect`.
fn run(suspect: &Path, map: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_meshmark"))
        .args(["verify", "--json"])
        .args(more)
        .arg("--key")
        .arg(fixture("vectors/key.json"))
        .arg("--record")
        .arg(fixture("vectors/record.json"))
        .arg("--reference")
        .arg(fixture("kotka.gpkg"))
        .arg("--evidence-map")
        .arg(map)
        .arg(suspect)
        .output()
        .unwrap()
}

/// The same, and the numbers of vertices that the report names.
fn verify(suspect: &Path, map: &Path, more: &[&str]) -> [u64; 2] {
    let output = run(suspect, map, more);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
    ["matched", "reference"].map(|name| report["vertices"][name].as_u64().unwrap())
}

/// Numbers of an SQL query.
fn numbers<const N: usize>(map: &Path, query: &str) -> [f64; N] {
    let dataset = Dataset::open(map).unwrap();
    let mut rows = dataset.execute_sql(query, None, gdal::vector::sql::Dialect::DEFAULT).unwrap().unwrap();
    let row = rows.features().next().unwrap();
    std::array::from_fn(|field| row.field_as_double(field).unwrap().unwrap())
}

#[test]
fn every_matched_vertex_is_there_and_every_patch_has_its_score() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.gpkg");
    let [matched, reference] = verify(&fixture("vectors/marked.gpkg"), &map, &[]);
    let [rows, least, most, off] = numbers(
        &map,
        "SELECT count(*), min(weight), max(weight), max(abs(weight * 10 - round(weight * 10))) FROM matched_vertices",
    );
    assert_eq!(rows as u64, matched);
    assert!(least >= 0.0 && most == 1.0 && off < 1e-9, "{least} {most} {off}");
    let [all, found, least] = numbers(&map, "SELECT sum(vertices), sum(found), min(score) FROM patches");
    assert_eq!([found as u64, all as u64], [matched, reference]);
    assert!(least > 10.0, "every patch of a whole copy shows the mark: {least}");
    let layers = Dataset::open(&map).unwrap();
    assert_eq!(layers.layer_count(), 2);
    let crs = layers.layer_by_name("patches").unwrap().spatial_ref().unwrap();
    assert_eq!(crs.auth_code().unwrap(), 3067);
    let names: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["map.gpkg"]);
}

#[test]
fn exact_displacements_are_lines_and_come_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.gpkg");
    let exact = ["--exact-displacements"];
    let [matched, _] = verify(&fixture("vectors/marked.gpkg"), &map, &exact);
    let [rows, least_m, most_m, off] = numbers(
        &map,
        "SELECT count(*), min(moved_m), max(moved_m), max(abs(moved_m * moved_m - dx_m * dx_m - dy_m * dy_m)) \
         FROM vertex_displacements",
    );
    assert_eq!(rows as u64, matched);
    assert!(least_m >= 0.0 && most_m <= 0.75 && off < 1e-12, "no vertex of the fixture moved further");
    assert_eq!(Dataset::open(&map).unwrap().layer_count(), 2);
    let warned = run(&fixture("vectors/marked.gpkg"), &folder.path().join("again.gpkg"), &exact).stderr;
    let warned = String::from_utf8(warned).unwrap();
    assert!(warned.contains("keep the report and the evidence map as secret as the records"), "{warned}");
}

#[test]
fn equal_evidence_makes_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = ["a.gpkg", "b.gpkg"].map(|name| {
        verify(&fixture("vectors/marked.gpkg"), &folder.path().join(name), &[]);
        fs::read(folder.path().join(name)).unwrap()
    });
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn a_suspect_that_is_elsewhere_makes_patches_without_vertices() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.gpkg");
    verify(&fixture("helsinki.gpkg"), &map, &[]);
    let [patches, found, scores] = numbers(&map, "SELECT count(*), sum(found), count(score) FROM patches");
    assert!(patches > 0.0 && found == 0.0 && scores == 0.0);
    assert_eq!(numbers(&map, "SELECT count(*) FROM matched_vertices"), [0.0]);
}

#[test]
#[cfg(unix)]
fn a_link_to_nowhere_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.gpkg");
    std::os::unix::fs::symlink("nowhere.gpkg", &map).unwrap();
    assert_eq!(run(&fixture("vectors/marked.gpkg"), &map, &[]).status.code(), Some(2));
    assert!(map.is_symlink());
}
