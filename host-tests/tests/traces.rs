//! Unmarked coordinates in what marking leaves as it is: attributes, foreign members of GeoJSON,
//! layers that are not marked.

use base64::{Engine, engine::general_purpose::STANDARD};
use gdal::vector::Geometry;
use meshmark_host_tests::plugin::{Host, fixture};
use serde_json::{Map, Value, json};
use std::fs;

/// The first words after the names, in all warnings of traces.
const WARNED: &str = "with them anybody can undo the mark";

/// A building of the map: its number, and its outline in the CRS of the map and in degrees.
struct Building<'a> {
    number: usize,
    geometry: &'a Value,
    degrees: &'a Value,
}

impl Building<'_> {
    fn corner(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.geometry["coordinates"][0][0][axis].as_f64().unwrap())
    }

    fn wkt(&self) -> String {
        Geometry::from_geojson(&self.geometry.to_string()).unwrap().wkt().unwrap()
    }

    fn wkb(&self) -> Vec<u8> {
        Geometry::from_geojson(&self.geometry.to_string()).unwrap().wkb().unwrap()
    }
}

/// A host with the buildings of a map as GeoJSON in two CRS, `m.geojson` and `deg.geojson`.
struct Buildings {
    host: Host,
    metres: Value,
    degrees: Value,
}

impl Buildings {
    fn new() -> Self {
        let host = Host::new();
        fs::write(host.path("list.csv"), "recipient\nACME\n").unwrap();
        let from = fixture("kotka.gpkg").display().to_string();
        let make = ["-f", "GeoJSON", "-lco", "COORDINATE_PRECISION=12"];
        host.run("ogr2ogr", &[&make[..], &["m.geojson", &from, "buildings"]].concat()).succeeds();
        let degrees = ["deg.geojson", &from, "buildings", "-t_srs", "EPSG:4326"];
        host.run("ogr2ogr", &[&make[..], &degrees].concat()).succeeds();
        let [metres, degrees] = ["m.geojson", "deg.geojson"]
            .map(|name| serde_json::from_str(&fs::read_to_string(host.path(name)).unwrap()).unwrap());
        Buildings { host, metres, degrees }
    }

    /// Writes `map.geojson`, whose features are changed by `change`.
    fn write(&self, change: impl Fn(&Building, &mut Value)) {
        let mut map = self.metres.clone();
        let features = map["features"].as_array_mut().unwrap();
        for (number, feature) in features.iter_mut().enumerate() {
            let geometry = feature["geometry"].clone();
            let degrees = &self.degrees["features"][number]["geometry"];
            change(&Building { number, geometry: &geometry, degrees }, feature);
        }
        fs::write(self.host.path("map.geojson"), map.to_string()).unwrap();
    }

    /// Marks `source` in all three ways with an option ATTRIBUTES; returns exit codes and messages.
    fn marked(&self, source: &str, format: &str, attributes: &str) -> [(Option<i32>, String); 3] {
        let host = &self.host;
        let ending = if format == "GPKG" { ".gpkg" } else { ".geojson" };
        let target = |way: &str| format!("{way}{ending}");
        let option = format!("ATTRIBUTES={attributes}");
        let read = host.mark(format, &target("read"), source, &["-oo", &option]);
        let written = host.create(&target("written"), source, &["-dsco", &option]);
        let command = host.meshmark().display().to_string();
        let distribute =
            ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "out"];
        let how = ["-f", format, "--attributes", attributes, source];
        let distributed = host.run(&command, &[&distribute[..], &how].concat());
        [read, written, distributed].map(|run| (run.code, run.stderr))
    }

    /// Removes what [`Buildings::marked`] wrote.
    fn clear(&self) {
        let made = ["read.", "written.", "ref.gpkg", "record.json"];
        for name in self.host.names().iter().filter(|name| made.iter().any(|made| name.starts_with(made))) {
            fs::remove_file(self.host.path(name)).unwrap();
        }
        drop(fs::remove_dir_all(self.host.path("out")));
    }
}

/// Adds attributes to a feature.
fn add(feature: &mut Value, attributes: Value) {
    let Value::Object(attributes) = attributes else { panic!("{attributes}") };
    feature["properties"].as_object_mut().unwrap().extend::<Map<String, Value>>(attributes);
}

fn rounded(number: &Value, decimals: i32) -> f64 {
    let grid = 10f64.powi(decimals);
    (number.as_f64().unwrap() * grid).round() / grid
}

/// The attributes with traces, and the names that a warning has.
type Kind = (&'static str, &'static str, fn(&Building) -> Value);

const KINDS: &[Kind] = &[
    ("numbers", r#"attributes "X", "Y""#, |b| json!({"X": b.corner()[0], "h": 3.5, "Y": b.corner()[1]})),
    ("numbers as text", r#"attributes "east", "north""#, |b| {
        let [x, y] = b.corner().map(|number| format!("{number:.3}").replace('.', ","));
        json!({"north": y, "east": x})
    }),
    ("degrees of six decimals", r#"attributes "lat", "lon""#, |b| {
        let [lon, lat] = [0, 1].map(|axis| rounded(&b.degrees["coordinates"][0][0][axis], 6));
        json!({"lat": lat, "lon": lon})
    }),
    ("GeoJSON", r#"attribute "g""#, |b| json!({"g": b.geometry.to_string()})),
    ("GeoJSON in degrees", r#"attribute "g""#, |b| json!({"g": b.degrees.to_string()})),
    ("EWKT", r#"attribute "g""#, |b| json!({"g": format!("SRID=3067;{}", b.wkt())})),
    ("hexadecimal WKB", r#"attribute "g""#, |b| json!({"g": meshmark_core::hex::encode(&b.wkb())})),
    ("base64 of WKB", r#"attribute "g""#, |b| json!({"g": STANDARD.encode(b.wkb())})),
    (
        "WKT of the last building",
        r#"attribute "g""#,
        |b| json!({"g": if b.number < 150 { Value::Null } else { b.wkt().into() }}),
    ),
    ("a list", r#"attribute "at""#, |b| json!({"at": b.corner()})),
    (
        "two at once",
        r#"attributes "a", "b", "c""#,
        |b| json!({"a": b.corner()[1], "b": b.corner()[0], "c": format!("{:?}", b.corner())}),
    ),
];

#[test]
fn coordinates_in_attributes_are_warned_of_by_name_on_all_three_ways() {
    let map = Buildings::new();
    for (kind, names, attributes) in KINDS {
        map.write(|building, feature| add(feature, attributes(building)));
        for (code, said) in map.marked("map.geojson", "GPKG", "WARN") {
            assert_eq!((code, said.matches(WARNED).count()), (Some(0), 1), "{kind}: {said}");
            assert!(said.contains(names), "{kind}: {said}");
        }
        map.clear();
    }
}

#[test]
fn a_map_with_coordinates_in_attributes_is_refused_on_request() {
    let map = Buildings::new();
    let (_, names, attributes) = KINDS[0];
    map.write(|building, feature| add(feature, attributes(building)));
    let before = map.host.files();
    for (code, said) in map.marked("map.geojson", "GPKG", "REFUSE") {
        assert!(code.is_some_and(|code| code != 0) && said.contains(names), "{said}");
        assert!(said.contains("REFUSE marks no such map"), "{said}");
    }
    assert!(map.host.files() == before, "{:?}", map.host.names());
}

#[test]
fn other_numbers_and_texts_are_no_traces() {
    let map = Buildings::new();
    map.write(|building, feature| {
        let [x, y] = building.corner();
        let n = building.number as f64;
        let beside = format!("POINT ({} {})", x + 3.0 + n * 0.37, y - 4.0 + n * 0.73);
        add(
            feature,
            json!({"label": beside, "height": 3.1 + n, "x": x.floor(), "id": 6_710_000 + building.number}),
        );
        add(
            feature,
            json!({"street": format!("Rannantie {n}"), "built": "1999-12-31", "list": [n, 2.0 * n, 0.5]}),
        );
        add(feature, json!({"degrees": format!("{:.4} {:.4}", 26.9 + n / 1e4, 60.4 + n / 1e4)}));
    });
    for (code, said) in map.marked("map.geojson", "GPKG", "REFUSE") {
        assert!(code == Some(0) && !said.contains(WARNED), "{said}");
    }
}

#[test]
fn foreign_members_are_compared_with_the_vertices_whatever_their_keys() {
    let map = Buildings::new();
    for named in ["corner", "coordinates"] {
        map.write(|building, feature| feature["foreign"] = json!({named: building.corner()}));
        for (code, said) in map.marked("map.geojson", "GeoJSON", "WARN") {
            assert!(code == Some(0) && said.matches("in foreign members").count() == 1, "{said}");
        }
        map.clear();
        let before = map.host.files();
        for (code, said) in map.marked("map.geojson", "GeoJSON", "REFUSE") {
            assert!(code != Some(0) && said.contains("in foreign members"), "{said}");
        }
        assert!(map.host.files() == before, "{:?}", map.host.names());
    }
}

#[test]
fn a_table_with_geometries_as_blobs_is_a_trace() {
    let map = Buildings::new();
    let from = fixture("kotka.gpkg");
    fs::copy(&from, map.host.path("map.gpkg")).unwrap();
    for sql in [
        "CREATE TABLE backup (fid INTEGER PRIMARY KEY, shape BLOB)",
        "INSERT INTO backup SELECT fid, geom FROM buildings",
        "INSERT INTO gpkg_contents (table_name, identifier, data_type) VALUES ('backup', 'backup', 'attributes')",
    ] {
        map.host.run("ogrinfo", &["-q", "map.gpkg", "-sql", sql]).succeeds();
    }
    for (code, said) in map.marked("map.gpkg", "GPKG", "WARN") {
        let named = said.contains(r#"layer "backup" has the coordinates of"#)
            && said.contains(r#"attribute "shape""#);
        assert!(code == Some(0) && named && said.matches(WARNED).count() == 1, "{said}");
    }
}

#[test]
fn a_layer_that_is_left_out_and_has_the_same_vertices_is_a_trace() {
    let map = Buildings::new();
    let host = &map.host;
    let from = fixture("kotka.gpkg").display().to_string();
    host.run("ogr2ogr", &["-f", "GPKG", "map.gpkg", &from, "buildings", "roads"]).succeeds();
    let copy =
        ["-update", "-f", "GPKG", "map.gpkg", &from, "buildings", "-nln", "outlines", "-t_srs", "EPSG:4326"];
    host.run("ogr2ogr", &copy).succeeds();
    let read = host.mark("GPKG", "read.gpkg", "map.gpkg", &["-oo", "LAYERS=buildings"]);
    let written = host.create("written.gpkg", "map.gpkg", &["-dsco", "LAYERS=buildings"]);
    for said in [read.succeeds().stderr, written.succeeds().stderr] {
        assert_eq!(said.matches("in common with marked layers").count(), 1, "{said}");
        assert!(
            said.contains(r#"layer "outlines" is not marked"#) && said.contains("add it to LAYERS"),
            "{said}"
        );
    }
    let command = host.meshmark().display().to_string();
    let distribute = ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "out"];
    let how = ["--layers", "buildings", "--attributes", "refuse", "map.gpkg"];
    let run = host.run(&command, &[&distribute[..], &how].concat());
    assert!(run.code != Some(0) && run.stderr.contains("add it to --layers"), "{}", run.stderr);
    assert!(!host.path("out").exists());
}
