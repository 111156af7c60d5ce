//! Data of every kind: each is marked by reading and by writing and matches, or is refused with a
//! sentence.

use gdal::{
    Dataset, DatasetOptions, DriverManager, GdalOpenFlags,
    spatial_ref::SpatialRef,
    vector::{
        FieldDefn, Geometry, LayerAccess, LayerOptions, OGRFieldType, OGRwkbGeometryType, sql::Dialect,
    },
};
use meshmark_host_tests::{
    contents::{self, lengths, moves},
    plugin::{self, Host},
};

/// A map of one layer.
struct Map {
    file: &'static str,
    layer: &'static str,
    srs: &'static str,
    /// Well-known texts; an empty one stands for a null geometry.
    features: Vec<String>,
    /// The value of the field `名称` in every feature.
    name: &'static str,
    first_fid: i64,
}

impl Map {
    fn new(srs: &'static str, features: Vec<String>) -> Self {
        Map { file: "map.gpkg", layer: "map", srs, features, name: "", first_fid: 1 }
    }

    fn write(&self, host: &Host) {
        let path = host.path(self.file);
        let mut dataset =
            DriverManager::get_driver_by_name("GPKG").unwrap().create_vector_only(&path).unwrap();
        let srs = SpatialRef::from_definition(self.srs).unwrap();
        let mut transaction = dataset.start_transaction().unwrap();
        let ty = OGRwkbGeometryType::wkbUnknown;
        let options = LayerOptions { name: self.layer, srs: Some(&srs), ty, options: None };
        let layer = transaction.create_layer(options).unwrap();
        FieldDefn::new("名称", OGRFieldType::OFTString).unwrap().add_to_layer(&layer).unwrap();
        for wkt in &self.features {
            let mut feature = gdal::vector::Feature::new(layer.defn()).unwrap();
            if !wkt.is_empty() {
                feature.set_geometry(Geometry::from_wkt(wkt).unwrap()).unwrap();
            }
            feature.set_field_string(0, self.name).unwrap();
            feature.create(&layer).unwrap();
        }
        transaction.commit().unwrap();
        dataset.close().unwrap();
        self.number(&path);
    }

    fn number(&self, path: &std::path::Path) {
        let open_flags = GdalOpenFlags::GDAL_OF_UPDATE | GdalOpenFlags::GDAL_OF_VECTOR;
        let dataset = Dataset::open_ex(path, DatasetOptions { open_flags, ..Default::default() }).unwrap();
        let sql = format!("UPDATE \"{}\" SET fid = fid + {}", self.layer, self.first_fid - 1);
        dataset.execute_sql(sql, None, Dialect::DEFAULT).unwrap();
        dataset.close().unwrap();
    }
}

/// Marks by reading and by writing, which gives the same map, verifies both, and returns the RMS
/// length of the moves in CRS units.
#[track_caller]
fn marks(map: &Map) -> f64 {
    let host = Host::new();
    map.write(&host);
    let before = contents::read(&host.path(map.file));
    host.mark("GPKG", "read.gpkg", map.file, &["-oo", "RECORD=read.json"]).succeeds();
    host.matches(map.file, &["--record", "read.json", "read.gpkg"]);
    let read = contents::read(&host.path("read.gpkg"));
    let (rms, _) = lengths(&moves(&before, &read)); // ids, attributes, Z, M and structure stay
    host.create("out.gpkg", map.file, &[]).succeeds();
    host.matches("ref.gpkg", &["--record", "record.json", "out.gpkg"]);
    assert!(contents::read(&host.path("out.gpkg")) == read);
    assert!(contents::read(&host.path("ref.gpkg")) == before);
    rms
}

/// Asserts that reading and writing refuse the map with these words, and write nothing.
#[track_caller]
fn refuses(map: &Map, words: &str) {
    let host = Host::new();
    map.write(&host);
    let before = host.files();
    let read = host.mark("GPKG", "read.gpkg", map.file, &["-oo", "RECORD=read.json"]);
    let write = host.create("out.gpkg", map.file, &[]);
    for run in [read, write] {
        assert_eq!(run.code, Some(1), "{}", run.stderr);
        assert!(run.stderr.contains(words), "{}", run.stderr);
    }
    assert!(host.files() == before, "{:?}", host.names());
}

// --- maps ----------------------------------------------------------------------------------------

/// Returns a number in 0..1 that depends on `i` alone.
fn scattered(i: usize) -> f64 {
    (i as f64 * 0.618_033_988_749_894_9 + (i * i % 97) as f64 * 0.013).fract()
}

/// Returns the corners of `count` houses along streets, metres east and north of the first.
fn houses(count: usize) -> Vec<[[f64; 2]; 4]> {
    let house = |i: usize| {
        let (x, y) = ((i % 12) as f64 * 40.0, (i / 12) as f64 * 50.0);
        let (width, depth) = (8.0 + 10.0 * scattered(i), 9.0 + 8.0 * scattered(i + 500));
        let (sin, cos) = (scattered(i + 900) * 0.5).sin_cos();
        [[0.0, 0.0], [width, 0.0], [width, depth], [0.0, depth]]
            .map(|[u, v]| [x + u * cos - v * sin, y + u * sin + v * cos])
    };
    (0..count).map(house).collect()
}

/// A number of houses that is enough for the default patch.
const MANY: usize = 240;

type Projection<'a> = &'a dyn Fn([f64; 2]) -> [f64; 2];

/// Returns a map from metres to the CRS of a test map.
fn at(origin: [f64; 2], scale: [f64; 2]) -> impl Fn([f64; 2]) -> [f64; 2] {
    move |[x, y]| [origin[0] + x * scale[0], origin[1] + y * scale[1]]
}

/// Returns the map from metres to degrees at a place on the earth.
fn degrees(lon: f64, lat: f64) -> impl Fn([f64; 2]) -> [f64; 2] {
    at([lon, lat], [1.0 / (111_320.0 * lat.to_radians().cos()), 1.0 / 111_320.0])
}

fn list(points: &[[f64; 2]], place: Projection, more: &str) -> String {
    let text = |&point: &[f64; 2]| {
        let [x, y] = place(point);
        format!("{x:?} {y:?}{more}")
    };
    points.iter().map(text).collect::<Vec<_>>().join(",")
}

/// Returns houses as polygons.
fn polygons(place: Projection) -> Vec<String> {
    houses(MANY)
        .iter()
        .map(|[a, b, c, d]| format!("POLYGON (({}))", list(&[*a, *b, *c, *d, *a], place, "")))
        .collect()
}

/// Returns each house in this shape, where `{open}` stands for its corners and `{ring}` for the
/// closed ring.
fn shapes(template: &str, more: &str) -> Vec<String> {
    let place = at([385_000.0, 6_671_000.0], [1.0, 1.0]);
    let shape = |house: &[[f64; 2]; 4]| {
        let ring = [&house[..], &house[..1]].concat();
        template.replace("{ring}", &list(&ring, &place, more)).replace("{open}", &list(house, &place, more))
    };
    houses(MANY).iter().map(shape).collect()
}

// --- kinds ---------------------------------------------------------------------------------------

#[test]
fn every_geometry_type_with_and_without_z_and_m() {
    for (template, more) in [
        ("MULTIPOINT ({open})", ""),
        ("MULTIPOLYGON Z ((({ring})))", " 12.5"),
        ("LINESTRING M ({open})", " 7"),
        ("MULTILINESTRING ZM (({open}))", " 12.5 7"),
    ] {
        let rms = marks(&Map::new("EPSG:3067", shapes(template, more)));
        assert!((0.05..0.2).contains(&rms), "{template}: {rms} m");
    }
}

#[test]
fn surfaces_stay_surfaces() {
    marks(&Map::new("EPSG:3067", triangles()));
}

fn triangles() -> Vec<String> {
    let place = at([385_000.0, 6_671_000.0], [1.0, 1.0]);
    let surface = |[a, b, c, d]: &[[f64; 2]; 4]| {
        let triangle = |corners: [[f64; 2]; 4]| format!("(({}))", list(&corners, &place, " 3"));
        format!("TIN Z ({}, {})", triangle([*a, *b, *c, *a]), triangle([*a, *c, *d, *a]))
    };
    houses(MANY).iter().map(surface).collect()
}

#[test]
fn curves_stay_curves() {
    let place = at([385_000.0, 6_671_000.0], [1.0, 1.0]);
    let arc = |points: &[[f64; 2]]| format!("CIRCULARSTRING ({})", list(points, &place, ""));
    let line = |[a, b, c, d]: &[[f64; 2]; 4]| {
        format!("COMPOUNDCURVE ({}, ({}))", arc(&[*a, *b, *c]), list(&[*c, *d], &place, ""))
    };
    let area = |[a, b, c, d]: &[[f64; 2]; 4]| format!("CURVEPOLYGON ({})", arc(&[*a, *b, *c, *d, *a]));
    marks(&Map::new("EPSG:3067", houses(MANY).iter().map(line).collect()));
    marks(&Map::new("EPSG:3067", houses(MANY).iter().map(area).collect()));
}

#[test]
fn mixed_geometries_null_and_empty_ones_in_one_layer() {
    let place = at([385_000.0, 6_671_000.0], [1.0, 1.0]);
    let mixed = |(i, house): (usize, &[[f64; 2]; 4])| {
        let ring = list(&[&house[..], &house[..1]].concat(), &place, "");
        let open = list(house, &place, "");
        match i % 6 {
            0 => format!("POLYGON (({ring}))"),
            1 => format!("LINESTRING ({open})"),
            2 => format!("MULTIPOINT ({open})"),
            3 => {
                format!("GEOMETRYCOLLECTION (POLYGON (({ring})), POINT ({}))", list(&house[..1], &place, ""))
            }
            4 => "POLYGON EMPTY".into(),
            _ => String::new(),
        }
    };
    marks(&Map::new("EPSG:3067", houses(MANY + 120).iter().enumerate().map(mixed).collect()));
}

#[test]
fn feet_are_moved_by_metres() {
    let feet = 0.3048;
    let rms = marks(&Map::new("EPSG:2263", polygons(&at([987_000.0, 211_000.0], [1.0 / feet, 1.0 / feet]))));
    assert!((0.05..0.2).contains(&(rms * feet)), "{rms} feet");
}

#[test]
fn coordinates_far_from_the_origin() {
    for origin in [[1.5e7, -1.2e7], [-1e7, 9.9e6]] {
        let rms = marks(&Map::new("EPSG:3857", polygons(&at(origin, [1.0, 1.0]))));
        assert!(rms > 0.05, "{rms}");
    }
}

#[test]
fn polar_latitudes() {
    marks(&Map::new("EPSG:4326", polygons(&degrees(15.0, 78.2))));
    marks(&Map::new("EPSG:4326", polygons(&degrees(-40.0, 89.9))));
    marks(&Map::new("EPSG:4326", polygons(&degrees(166.7, -77.85))));
    // This map surrounds the pole.
    marks(&Map::new("EPSG:3995", polygons(&at([-300.0, -400.0], [1.0, 1.0]))));
    marks(&Map::new("EPSG:3031", polygons(&at([300_000.0, -1_300_000.0], [1.0, 1.0]))));
}

#[test]
fn both_sides_of_the_180th_meridian() {
    // Half of the map lies on either side, as formats require, or all of it east of 180°, in
    // longitudes beyond 180.
    let fiji = degrees(179.998, -16.8);
    let wrapped = |point| {
        let [lon, lat] = fiji(point);
        [if lon > 180.0 { lon - 360.0 } else { lon }, lat]
    };
    let (east, west): (Vec<_>, Vec<_>) =
        polygons(&wrapped).into_iter().partition(|wkt| wkt.contains("-179."));
    let east: Vec<_> =
        east.into_iter().filter(|wkt| !wkt.contains("(179.") && !wkt.contains(",179.")).collect();
    assert!(east.len() > 50 && west.len() > 50);
    let split = [east, west].concat();
    marks(&Map::new("EPSG:4326", split));
    marks(&Map::new("EPSG:4326", polygons(&fiji)));
    marks(&Map::new("EPSG:3832", polygons(&at([3_339_000.0, -1_800_000.0], [1.0, 1.0]))));
}

#[test]
fn names_in_any_script() {
    let map = Map {
        file: "Kartta – 地図 ñ.gpkg",
        layer: "rakennukset ä 建物",
        name: "Ελλάδα \u{1f5fa}",
        ..Map::new("EPSG:3067", shapes("POLYGON (({ring}))", ""))
    };
    marks(&map);
}

#[test]
fn ids_that_no_double_can_hold() {
    for first_fid in [(1 << 53) - 100, i64::MAX - MANY as i64] {
        marks(&Map { first_fid, ..Map::new("EPSG:3067", shapes("POLYGON (({ring}))", "")) });
    }
}

#[test]
fn one_feature_of_very_many_vertices_and_very_many_points() {
    let corners: Vec<[f64; 2]> = houses(5_000).into_iter().flatten().collect();
    let place = at([385_000.0, 6_671_000.0], [1.0, 1.0]);
    marks(&Map::new("EPSG:3067", vec![format!("LINESTRING ({})", list(&corners, &place, ""))]));
    let points = corners.iter().map(|corner| format!("POINT ({})", list(&[*corner], &place, ""))).collect();
    marks(&Map::new("EPSG:3067", points));
}

#[test]
fn a_map_smaller_than_its_mark_is_refused() {
    for srs in ["EPSG:3067", "EPSG:4326"] {
        let map = Map::new(srs, polygons(&at([0.0, 0.0], [1e-9, 1e-9])));
        refuses(&map, "lower TOLERANCE and AMPLITUDE");
    }
}

#[test]
fn layers_whose_crs_differ_only_in_heights_are_marked_together() {
    let host = Host::new();
    let fixture = plugin::fixture("helsinki.gpkg").display().to_string();
    for (layer, srs) in [("buildings", "EPSG:3067"), ("roads", "EPSG:3903"), ("landuse", "EPSG:3067+3900")] {
        let more = ["-update", "map.gpkg", &fixture, layer, "-a_srs", srs, "-nlt", "CONVERT_TO_LINEAR"];
        let skip = usize::from(!host.path("map.gpkg").exists());
        host.run("ogr2ogr", &more[skip..]).succeeds();
    }
    host.mark("GPKG", "read.gpkg", "map.gpkg", &["-oo", "RECORD=read.json"]).succeeds();
    let report = host.matches("map.gpkg", &["--record", "read.json", "read.gpkg"]);
    assert_eq!(report["parameters"]["crs"], "EPSG:3067");
    let (read, map) = (contents::read(&host.path("read.gpkg")), contents::read(&host.path("map.gpkg")));
    let (_, longest) = lengths(&moves(&map, &read));
    assert!(longest > 0.0 && longest < 0.76, "{longest}");
    host.create("out.gpkg", "map.gpkg", &["-dsco", "SRS=EPSG:3067"]).succeeds();
    assert!(contents::read(&host.path("out.gpkg")) == read);
    host.run("ogr2ogr", &["-t_srs", "EPSG:3857", "moved.gpkg", "read.gpkg"]).succeeds();
    host.matches("map.gpkg", &["--record", "read.json", "moved.gpkg"]);
    // Another CRS without a code is named in a few words.
    let more = ["-update", "map.gpkg", &fixture, "amenities", "-t_srs", "EPSG:3857+3900"];
    host.run("ogr2ogr", &more).succeeds();
    let run = host.mark("GPKG", "mixed.gpkg", "map.gpkg", &[]);
    let words =
        "(EPSG:3067) and \"amenities\" (WGS 84 / Pseudo-Mercator + N2000 height) are not in the same CRS";
    assert!(run.code == Some(1) && run.stderr.contains(words), "{}", run.stderr);
}

#[test]
fn a_coordinate_further_away_than_any_place_is_found_by_layer_and_feature_in_every_way() {
    let places = [("EPSG:3067", "1e308 2"), ("EPSG:3067", "3 -1e308"), ("EPSG:3067", "3 1e31")];
    for (srs, bad) in places.into_iter().chain([("EPSG:3067", "1e20 4"), ("EPSG:4326", "25 1e20")]) {
        let mut features: Vec<String> = (0..9).map(|i| format!("POINT ({i} {})", 50 + i * i % 7)).collect();
        features[7] = format!("POINT ({bad})");
        let map = Map::new(srs, features);
        let words = "layer \"map\", feature 8: the coordinates (";
        refuses(&map, words);
        let host = Host::new();
        map.write(&host);
        std::fs::write(host.path("list.csv"), "recipient\nACME GmbH\n").unwrap();
        let before = host.files();
        let list = ["--key", "key.json", "--recipients", "list.csv", "--output-dir", "out", "map.gpkg"];
        let run = host.run(host.meshmark().to_str().unwrap(), &[&["distribute"], &list[..]].concat());
        assert!(run.code == Some(5) && run.stderr.contains(words), "{bad}: {}", run.stderr);
        assert!(run.stderr.contains("further away than any place") && run.stderr.contains("leave it out"));
        assert!(host.files() == before, "{bad}: {:?}", host.names());
    }
}

#[test]
fn a_layer_with_a_comma_or_quotes_in_its_name_is_named_in_quotes() {
    let host = Host::new();
    host.copy("helsinki.gpkg", "plain.gpkg");
    for (layer, name) in [("buildings", "a,b"), ("roads", "say \"c\"")] {
        let more = ["-update", "map.gpkg", "plain.gpkg", layer, "-nln", name];
        host.run("ogr2ogr", &more[usize::from(!host.path("map.gpkg").exists())..]).succeeds();
    }
    for (number, layers) in [r#""a,b""#, r#"say "c", "a,b""#, r#""say ""c""""#].iter().enumerate() {
        let option = format!("LAYERS={layers}");
        let (copy, record) = (format!("{number}.gpkg"), format!("{number}.json"));
        let options = ["-oo", &option, "-oo", &format!("RECORD={record}")];
        host.mark("GPKG", &copy, "map.gpkg", &options).succeeds();
        host.matches("map.gpkg", &["--record", &record, &copy]);
        host.matches("map.gpkg", &["--recipient", "ACME GmbH", "--layers", layers, &copy]);
        let compare = ["compare", "--layers", layers, "map.gpkg", &copy];
        host.run(host.meshmark().to_str().unwrap(), &compare).succeeds();
    }
    let run = host.mark("GPKG", "none.gpkg", "map.gpkg", &["-oo", "LAYERS=a,b"]);
    let words = r#"the map has no layer "a": LAYERS may name "a,b", say "c""#;
    assert!(run.code == Some(1) && run.stderr.contains(words), "{}", run.stderr);
}

#[test]
fn a_csv_file_with_two_columns_of_coordinates_is_marked_and_verified_as_the_page_on_formats_says() {
    let page = include_str!("../../docs/formats.md");
    let block = |kind: &str| {
        let (_, rest) = page.split_once(&format!("```{kind}\n")).expect("the page has it");
        rest.split_once("```").expect("it ends").0
    };
    let host = Host::new();
    let place = degrees(24.9, 60.1);
    let row = |i: usize| {
        let [lon, lat] = place([scattered(i) * 2000.0, scattered(i + 7777) * 2000.0]);
        format!("p{i},{lon:.6},{lat:.6}\n")
    };
    let rows: String = (0..700).map(row).collect();
    std::fs::write(host.path("points.csv"), format!("name,lon,lat\n{rows}")).unwrap();
    std::fs::write(host.path("points.vrt"), block("xml")).unwrap();
    host.mark("GPKG", "marked.gpkg", "points.vrt", &["-oo", "RECORD=acme.json"]).succeeds();
    host.matches("points.vrt", &["--record", "acme.json", "marked.gpkg"]);
    let fields =
        host.run("ogrinfo", &["-so", "-q", "marked.gpkg", "-sql", "SELECT * FROM points"]).succeeds();
    assert!(!fields.stdout.contains("lon") && !fields.stdout.contains("lat:"), "{}", fields.stdout);
    let meshmark = host.meshmark();
    host.run(meshmark.to_str().unwrap(), &["compare", "points.vrt", "marked.gpkg"]).succeeds();
    // The leaked file is a table of two columns again.
    let leak = ["-f", "CSV", "xy.csv", "marked.gpkg", "-lco", "GEOMETRY=AS_XY"];
    host.run("ogr2ogr", &leak).succeeds();
    let xy = std::fs::read_to_string(host.path("xy.csv")).unwrap();
    std::fs::write(host.path("suspect.csv"), xy.replacen("X,Y", "lon,lat", 1)).unwrap();
    host.matches("points.vrt", &["--record", "acme.json", "suspect.csv"]);
    std::fs::write(host.path("suspect.csv"), xy.replacen("X,Y", "right,up", 1)).unwrap();
    let convert: Vec<&str> = block("sh").split_whitespace().collect();
    host.run(convert[0], &convert[1..]).succeeds();
    host.matches("points.vrt", &["--record", "acme.json", "suspect.gpkg"]);
}
