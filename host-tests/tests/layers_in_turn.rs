//! OpenStreetMap files, of which GDAL's driver returns the features of all layers in turn: no
//! feature is lost in comparison with plain `ogr2ogr`.

use gdal::{Dataset, vector::LayerAccess};
use meshmark_host_tests::plugin::Host;
use std::{
    collections::BTreeMap,
    fmt::Write as _,
    fs,
    io::{BufRead, BufReader, Read},
    process::{Command, Stdio},
};

const INTERLEAVED: [[(&str, &str); 1]; 2] =
    [[("OGR_INTERLEAVED_READING", "NO")], [("OGR_INTERLEAVED_READING", "YES")]];

/// Writes a street through `shops` shops, with a house for every fifth, a lake for every fiftieth,
/// routes and sites: features in each of the five layers.
fn write_osm(host: &Host, name: &str, shops: usize) {
    let mut text = String::from("<osm version=\"0.6\">\n");
    for i in 1..=shops {
        let bend = (i * i % 101) as f64 * 1e-6;
        let (lon, lat) = (25.0 + (i % 330) as f64 * 4e-4 + bend, 60.0 + (i / 330) as f64 * 3e-4 + bend);
        let tag = format!("<tag k=\"shop\" v=\"s{i}\"/>");
        writeln!(text, "<node id=\"{i}\" lat=\"{lat:.7}\" lon=\"{lon:.7}\">{tag}</node>").unwrap();
    }
    let mut number = 0;
    let mut way = |text: &mut String, nodes: &[usize], tag: &str| {
        number += 1;
        let nodes: String = nodes.iter().map(|node| format!("<nd ref=\"{node}\"/>")).collect();
        writeln!(text, "<way id=\"{number}\">{nodes}{tag}</way>").unwrap();
        number
    };
    for i in 1..shops {
        way(&mut text, &[i, i + 1], "<tag k=\"highway\" v=\"service\"/>");
    }
    let ring = |i: usize| [i, i + 1, i + 331, i];
    for i in (1..shops - 331).step_by(5) {
        way(&mut text, &ring(i), "<tag k=\"building\" v=\"yes\"/>");
    }
    let lakes: Vec<_> = (3..shops - 331).step_by(50).map(|i| way(&mut text, &ring(i), "")).collect();
    let mut relation = 0;
    let mut relate = |members: &str, tags: &str| {
        relation += 1;
        writeln!(text, "<relation id=\"{relation}\">{members}{tags}</relation>").unwrap();
    };
    for way in lakes {
        let tags = "<tag k=\"type\" v=\"multipolygon\"/><tag k=\"natural\" v=\"water\"/>";
        relate(&format!("<member type=\"way\" ref=\"{way}\" role=\"outer\"/>"), tags);
        let street = format!("<member type=\"way\" ref=\"{}\" role=\"\"/>", way % (shops - 1) + 1);
        relate(&street, "<tag k=\"type\" v=\"route\"/>");
        relate(&street, "<tag k=\"type\" v=\"site\"/>");
    }
    fs::write(host.path(name), text + "</osm>\n").unwrap();
}

/// Returns the number of features in each layer of a file.
fn counts(host: &Host, name: &str) -> BTreeMap<String, u64> {
    let dataset = Dataset::open(host.path(name)).unwrap();
    dataset.layers().map(|layer| (layer.name(), layer.feature_count())).collect()
}

#[test]
fn all_features_of_a_small_file_come_out_whatever_the_configuration() {
    let host = Host::new();
    write_osm(&host, "map.osm", 2000);
    host.run("ogr2ogr", &["-f", "GPKG", "plain.gpkg", "map.osm"]).succeeds();
    let plain = counts(&host, "plain.gpkg");
    assert!(plain.len() == 5 && plain.values().all(|&count| count > 20), "{plain:?}");
    for (number, configuration) in INTERLEAVED.iter().enumerate() {
        let (marked, record) = (format!("marked{number}.gpkg"), format!("RECORD=record{number}.json"));
        let options = ["-oo", "KEY=key.json", "-oo", "RECIPIENT=ACME GmbH", "-oo", &record];
        let arguments = [&["-f", "GPKG", &marked, "MESHMARK:map.osm"][..], &options].concat();
        host.run_with("ogr2ogr", &arguments, configuration).succeeds();
        assert_eq!(counts(&host, &marked), plain);
        let record = format!("record{number}.json");
        // The reference is also read completely.
        let report = host.matches("map.osm", &["--record", &record, &marked]);
        assert_eq!(report["vertices"]["reference"], 2000);
    }
}

#[test]
fn layers_of_a_large_file_are_not_given_up() {
    let host = Host::new();
    // GDAL keeps 100 000 features of layers that are not read yet.
    write_osm(&host, "map.osm", 101_000);
    host.run("ogr2ogr", &["-f", "GPKG", "plain.gpkg", "map.osm"]).succeeds();
    host.mark("GPKG", "marked.gpkg", "map.osm", &["-oo", "RECORD=record.json"]).succeeds();
    assert_eq!(counts(&host, "marked.gpkg"), counts(&host, "plain.gpkg"));
    host.matches("map.osm", &["--record", "record.json", "marked.gpkg"]);
}

#[test]
fn filters_and_chosen_layers_read_what_they_read_of_the_marked_map() {
    let host = Host::new();
    write_osm(&host, "map.osm", 2000);
    host.mark("GPKG", "marked.gpkg", "map.osm", &[]).succeeds();
    let cases: [&[&str]; 4] = [
        &["lines"],
        &["lines", "points", "-where", "osm_id <> '5'"],
        &["-spat", "25.01", "60", "25.1", "60.001"],
        &["multipolygons", "-spat", "25.01", "60", "25.1", "60.001", "-where", "building = 'yes'"],
    ];
    for (number, case) in cases.iter().enumerate() {
        let (direct, after) = (format!("direct{number}.gpkg"), format!("after{number}.gpkg"));
        host.mark("GPKG", &direct, "map.osm", case).succeeds();
        host.run("ogr2ogr", &[&["-f", "GPKG", &after, "marked.gpkg"][..], case].concat()).succeeds();
        assert_eq!(counts(&host, &direct), counts(&host, &after), "{case:?}");
    }
}

#[test]
fn distribute_hands_out_all_features() {
    let host = Host::new();
    write_osm(&host, "map.osm", 2000);
    host.run("ogr2ogr", &["-f", "GPKG", "plain.gpkg", "map.osm"]).succeeds();
    fs::write(host.path("list.csv"), "recipient\nACME GmbH\n").unwrap();
    let (command, list) = (host.meshmark(), ["--recipients", "list.csv", "--output-dir", "out"]);
    let arguments = [&["distribute", "--key", "key.json", "-f", "GPKG"][..], &list, &["map.osm"]].concat();
    host.run(command.to_str().unwrap(), &arguments).succeeds();
    let written = fs::read_dir(host.path("out")).unwrap().map(|entry| entry.unwrap().path());
    let copies: Vec<_> = written.filter(|path| path.extension().is_some_and(|e| e == "gpkg")).collect();
    let [copy] = &copies[..] else { panic!("one copy, not {copies:?}") };
    assert_eq!(counts(&host, copy.to_str().unwrap()), counts(&host, "plain.gpkg"));
}

/// A pipe that is not emptied delays the reader, so that the file changes before the end of
/// the map.
#[test]
fn a_file_that_changes_while_it_is_read_ends_ogr2ogr_with_a_failure() {
    let host = Host::new();
    write_osm(&host, "map.osm", 20_000);
    let mut ogr2ogr = Command::new("ogr2ogr")
        .args(["-f", "GeoJSONSeq", "/vsistdout/", "MESHMARK:map.osm"])
        .args(["-oo", "KEY=key.json", "-oo", "RECIPIENT=ACME GmbH"])
        .env("GDAL_DRIVER_PATH", host.plugins())
        .current_dir(host.folder())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut features = BufReader::new(ogr2ogr.stdout.take().unwrap());
    features.read_line(&mut String::new()).unwrap();
    fs::OpenOptions::new().append(true).open(host.path("map.osm")).unwrap().set_len(1000).unwrap();
    features.read_to_end(&mut Vec::new()).unwrap();
    let output = ogr2ogr.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && stderr.contains("map.osm was changed"), "{stderr}");
}
