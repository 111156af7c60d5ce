//! Metres are measured on the ground at the vertex: the scale of a projected CRS varies over a
//! large map.

use meshmark_host_tests::plugin::Host;
use serde_json::{Value, json};
use std::fs;

/// Writes a GeoJSON file of EPSG:3857 with a line through these places.
fn write_line(host: &Host, name: &str, places: &[[f64; 2]]) {
    let geometry = json!({ "type": "LineString", "coordinates": places });
    let feature = json!({ "type": "Feature", "properties": {}, "geometry": geometry });
    let crs = json!({ "type": "name", "properties": { "name": "urn:ogc:def:crs:EPSG::3857" } });
    let text =
        json!({ "type": "FeatureCollection", "name": "line", "crs": crs, "features": [feature] }).to_string();
    fs::write(host.path(name), text).unwrap();
}

/// Returns a host with Helsinki in EPSG:3857, and a point at this place in degrees.
fn town_and_point(longitude: f64, latitude: f64) -> Host {
    let host = Host::new();
    host.copy("helsinki.gpkg", "town.gpkg");
    let place = [longitude.to_string(), latitude.to_string()];
    let csv = format!("x,y\n{},{}\n", place[0], place[1]);
    fs::write(host.path("point.csv"), csv).unwrap();
    let point = ["-oo", "X_POSSIBLE_NAMES=x", "-oo", "Y_POSSIBLE_NAMES=y", "-a_srs", "EPSG:4326"];
    host.run("ogr2ogr", &["map.gpkg", "town.gpkg", "-t_srs", "EPSG:3857"]).succeeds();
    host.run("ogr2ogr", &[&point[..], &["point.gpkg", "point.csv"]].concat()).succeeds();
    let append = ["-update", "map.gpkg", "point.gpkg", "-t_srs", "EPSG:3857"];
    host.run("ogr2ogr", &append).succeeds();
    host
}

#[test]
fn a_message_is_refused_on_a_map_with_a_point_near_the_pole_which_is_named() {
    let host = town_and_point(27.0, 89.99);
    let before = host.files();
    let run = host.mark("GPKG", "marked.gpkg", "map.gpkg", &["-oo", "CODE=LDPC"]);
    let [error] = run.errors()[..] else { panic!("{}", run.stderr) };
    assert_ne!(run.code, Some(0));
    for word in ["the scale of EPSG:3857 differs by", "%", "the shortest at the vertex (3005", "without CODE"]
    {
        assert!(error.contains(word), "{word} is not in: {error}");
    }
    let written = host.create("out.gpkg", "map.gpkg", &["-dsco", "CODE=LDPC"]);
    assert!(
        written.code != Some(0) && written.stderr.contains("the scale of EPSG:3857 differs"),
        "{}",
        written.stderr
    );
    fs::write(host.path("list.csv"), "recipient\nACME\n").unwrap();
    let command = host.meshmark();
    let arguments = ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "out"];
    let more = ["--code", "LDPC", "-f", "GPKG", "map.gpkg"];
    let run = host.run(command.to_str().unwrap(), &[&arguments[..], &more].concat());
    assert!(run.code != Some(0) && run.stderr.contains("the scale of EPSG:3857 differs"), "{}", run.stderr);
    fs::remove_file(host.path("list.csv")).unwrap();
    assert!(host.files() == before, "nothing is written");
    // Such a map may carry a mark of an earlier version.
    let (run, report) = host.verify("map.gpkg", &["--recipient", "ACME GmbH", "map.gpkg"]);
    assert_eq!((run.code, &report["verdict"]), (Some(1), &Value::from("no-match")), "{}", run.stderr);
}

#[test]
fn a_fingerprint_follows_the_scale_from_town_to_pole() {
    let host = town_and_point(27.0, 89.99);
    host.mark("GPKG", "marked.gpkg", "map.gpkg", &["-oo", "RECORD=record.json"]).succeeds();
    host.create("written.gpkg", "map.gpkg", &["-dsco", "RECORD=written.json"]).succeeds();
    let same = |name: &str| host.run("ogrinfo", &["-q", "-al", name]).succeeds().stdout;
    assert_eq!(same("marked.gpkg"), same("written.gpkg"));
    let command = host.meshmark();
    // In metres of its own CRS the town moves as far as was asked for.
    for file in ["map", "marked"] {
        let (from, to) = (format!("{file}.gpkg"), format!("{file}-3067.gpkg"));
        host.run("ogr2ogr", &[&to, &from, "buildings", "-t_srs", "EPSG:3067"]).succeeds();
    }
    let run =
        host.run(command.to_str().unwrap(), &["compare", "--json", "map-3067.gpkg", "marked-3067.gpkg"]);
    let compared: Value = serde_json::from_str(&run.succeeds().stdout).unwrap();
    let moved = |figure: &str| compared["displacement"][figure].as_f64().unwrap();
    assert!((0.05..0.12).contains(&moved("rms_m")) && moved("max_m") < 0.76, "{compared}");
    host.matches("map.gpkg", &["--record", "record.json", "marked.gpkg"]);
    host.matches("map.gpkg", &["--recipient", "ACME GmbH", "marked.gpkg"]);
    host.matches("map.gpkg", &["--record", "record.json", "marked-3067.gpkg"]);
}

#[test]
fn the_same_map_in_degrees_is_marked_within_the_tolerance() {
    let host = town_and_point(27.0, 89.9);
    host.run("ogr2ogr", &["degrees.gpkg", "map.gpkg", "-t_srs", "EPSG:4326"]).succeeds();
    host.mark("GPKG", "marked.gpkg", "degrees.gpkg", &["-oo", "RECORD=record.json"]).succeeds();
    let record: Value = serde_json::from_slice(&fs::read(host.path("record.json")).unwrap()).unwrap();
    let moved = |figure: &str| record["displacement"][figure].as_f64().unwrap();
    assert!((0.05..0.15).contains(&moved("rms_m")) && moved("max_m") <= 0.75, "{record}");
}

#[test]
fn a_map_over_which_the_scale_differs_little_is_measured_where_the_vertex_is() {
    // The scale of EPSG:3857 is that of the latitude: from 60.1° to 61.5° it falls by 4 %.
    let host = town_and_point(25.0, 61.5);
    host.mark("GPKG", "marked.gpkg", "map.gpkg", &["-oo", "RECORD=record.json"]).succeeds();
    host.matches("map.gpkg", &["--record", "record.json", "marked.gpkg"]);
    let record: Value = serde_json::from_slice(&fs::read(host.path("record.json")).unwrap()).unwrap();
    let command = host.meshmark();
    let run = host.run(command.to_str().unwrap(), &["compare", "--json", "map.gpkg", "marked.gpkg"]);
    let compared: Value = serde_json::from_str(&run.succeeds().stdout).unwrap();
    assert_eq!(record["displacement"], compared["displacement"]);
    // In metres of its own CRS the town moves equally far.
    for file in ["map", "marked"] {
        let (from, to) = (format!("{file}.gpkg"), format!("{file}-3067.gpkg"));
        host.run("ogr2ogr", &[&to, &from, "-t_srs", "EPSG:3067"]).succeeds();
    }
    let run =
        host.run(command.to_str().unwrap(), &["compare", "--json", "map-3067.gpkg", "marked-3067.gpkg"]);
    let in_metres: Value = serde_json::from_str(&run.succeeds().stdout).unwrap();
    let max_m = |compared: &Value| compared["displacement"]["max_m"].as_f64().unwrap();
    let (on_ground, expected) = (max_m(&compared), max_m(&in_metres));
    assert!((on_ground / expected - 1.0).abs() < 2e-3, "{on_ground} {expected}");
}

#[test]
fn a_comparison_measures_every_vertex_where_it_is() {
    let host = Host::new();
    let equator_and_sixty_degrees = [[0.0, 0.0], [0.0, 8_399_737.889_818]];
    write_line(&host, "before.geojson", &equator_and_sixty_degrees);
    write_line(&host, "after.geojson", &equator_and_sixty_degrees.map(|[x, y]| [x + 1.0, y]));
    let command = host.meshmark();
    let run = host.run(command.to_str().unwrap(), &["compare", "--json", "before.geojson", "after.geojson"]);
    let compared: Value = serde_json::from_str(&run.succeeds().stdout).unwrap();
    let moved = |figure: &str| compared["displacement"][figure].as_f64().unwrap();
    // A unit is 1 m at the equator; at 60° it is half a metre on a sphere and 0.5013 m on the
    // ellipsoid.
    assert!((moved("max_m") - 1.0).abs() < 1e-3, "{compared}");
    let rms_m = ((1.0 + 0.5013f64.powi(2)) / 2.0).sqrt();
    assert!((moved("rms_m") - rms_m).abs() < 1e-3, "{compared}");
}
