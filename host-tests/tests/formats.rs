//! Every useful format, end to end: marked by GDAL's own programs, read by `meshmark verify`.

use meshmark_host_tests::plugin::{Host, fixture};
use std::fs;

fn kotka() -> String {
    fixture("kotka.gpkg").display().to_string()
}

/// The selection of a layer without attributes, for formats with a fixed set of them.
const BARE: [&str; 2] = ["-sql", "SELECT geom FROM buildings"];
const LAYER: [&str; 1] = ["buildings"];

// --- reading -------------------------------------------------------------------------------------

/// A map in one format, made from a GeoPackage, marked by reading into the same format.
struct Read {
    format: &'static str,
    /// The ending of the file name.
    ending: &'static str,
    /// The selection from the GeoPackage.
    source: &'static [&'static str],
    /// Options for making such a file.
    options: &'static [&'static str],
    /// Open options for reading it through MESHMARK.
    open: &'static [&'static str],
}

/// LIBKML writes no invalid polygon.
const LINES: [&str; 2] = ["-nlt", "MULTILINESTRING"];
const PLAIN: Read = Read { format: "", ending: "", source: &LAYER, options: &[], open: &[] };
/// These formats do not name their CRS.
const CRS: [&str; 2] = ["-oo", "SRS=EPSG:3067"];

/// From GDAL 3.11 on, the column is named after that of the source, and only one named `WKT` is
/// read again.
const AS_WKT: [&str; 4] = ["-lco", "GEOMETRY=AS_WKT", "-lco", "GEOMETRY_NAME=WKT"];

const READ: &[Read] = &[
    Read { format: "GPKG", ending: ".gpkg", ..PLAIN },
    Read { format: "ESRI Shapefile", ending: "", source: &[], ..PLAIN }, // all layers, in a folder
    Read { format: "ESRI Shapefile", ending: ".shp", ..PLAIN },
    Read { format: "ESRI Shapefile", ending: ".shz", ..PLAIN },
    Read { format: "ESRI Shapefile", ending: ".shp.zip", ..PLAIN },
    Read { format: "GeoJSON", ending: ".geojson", ..PLAIN },
    Read { format: "GeoJSON", ending: "-7946.geojson", options: &["-lco", "RFC7946=YES"], ..PLAIN },
    Read { format: "GeoJSONSeq", ending: ".geojsonl", ..PLAIN },
    Read { format: "FlatGeobuf", ending: ".fgb", ..PLAIN },
    Read { format: "GML", ending: ".gml", ..PLAIN },
    Read { format: "GML", ending: "-2.gml", options: &["-dsco", "FORMAT=GML2"], ..PLAIN },
    Read { format: "KML", ending: ".kml", source: &BARE, ..PLAIN },
    Read { format: "LIBKML", ending: ".kmz", source: &BARE, options: &LINES, ..PLAIN },
    Read { format: "MapInfo File", ending: ".tab", ..PLAIN },
    Read { format: "MapInfo File", ending: ".mif", open: &CRS, ..PLAIN },
    Read { format: "DXF", ending: ".dxf", source: &BARE, open: &CRS, ..PLAIN },
    Read { format: "CSV", ending: ".csv", options: &AS_WKT, open: &CRS, ..PLAIN },
    Read { format: "SQLite", ending: ".sqlite", ..PLAIN },
    Read { format: "SQLite", ending: "-spatialite.sqlite", options: &["-dsco", "SPATIALITE=YES"], ..PLAIN },
];

#[test]
fn a_map_in_any_format_is_marked_by_reading_and_verifies_in_the_same_format() {
    for Read { format, ending, source, options, open } in READ {
        let host = Host::new();
        let (map, marked) = (format!("map{ending}"), format!("marked{ending}"));
        let from = kotka();
        let make = [&["-f", format, &map, &from][..], source, options].concat();
        host.run("ogr2ogr", &make).succeeds();
        // Attributes that the format adds cannot always be written again.
        let again = [&["-oo", "RECORD=record.json"][..], options, open].concat();
        let run = host.mark(format, &marked, &map, &again);
        assert_eq!(run.code, Some(0), "{marked}: {}", run.stderr);
        assert!(run.errors().is_empty() && !run.stderr.contains("MESHMARK"), "{marked}: {}", run.stderr);
        host.matches(&map, &["--record", "record.json", &marked]);
    }
}

#[test]
fn a_zipped_shapefile_is_read_where_it_is() {
    let host = Host::new();
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", "map.shz", &kotka(), "buildings"]).succeeds();
    fs::rename(host.path("map.shz"), host.path("map.zip")).unwrap();
    host.mark("GPKG", "marked.gpkg", "/vsizip/map.zip", &["-oo", "RECORD=record.json"]).succeeds();
    host.matches("/vsizip/map.zip", &["--record", "record.json", "marked.gpkg"]);
}

/// Places of a map in its attributes would undo the mark.
#[test]
fn a_csv_file_leaves_no_unmarked_coordinates_among_the_attributes() {
    let host = Host::new();
    let from = kotka();
    let make = [&["-f", "CSV", "map.csv", &from, "buildings"][..], &AS_WKT].concat();
    host.run("ogr2ogr", &make).succeeds();
    host.mark("GPKG", "marked.gpkg", "map.csv", &CRS).succeeds();
    let layer = host.run("ogrinfo", &["-so", "marked.gpkg", "map"]).succeeds().stdout;
    assert!(layer.contains("osm_id: String") && !layer.contains("WKT: String"), "{layer}");

    // A host that opens the file itself reads them, and passes them on.
    let (plain, typed) = (&AS_WKT[..], &[&AS_WKT[..], &["-lco", "CREATE_CSVT=YES"][..]].concat());
    for (attribute, written, open) in [
        ("WKT", plain, &[][..]),
        ("shape", plain, &["-oo", "GEOM_POSSIBLE_NAMES=shape"][..]),
        ("shape", &typed[..], &[][..]),
    ] {
        let host = Host::new();
        let csv = [&["-f", "CSV", "map.csv", &from, "buildings"][..], written].concat();
        host.run("ogr2ogr", &csv).succeeds();
        let text = fs::read_to_string(host.path("map.csv")).unwrap();
        fs::write(host.path("map.csv"), text.replacen("WKT", attribute, 1)).unwrap();
        let open = [&["-a_srs", "EPSG:3067"][..], open].concat();
        let run = host.create("out.gpkg", "map.csv", &open).succeeds();
        let (warnings, expected) = (run.warnings(), format!("attribute \"{attribute}\""));
        let says = |w: &&str| w.contains(&expected) && w.contains("KEEP_GEOM_COLUMNS=NO");
        assert_eq!(warnings.iter().filter(|w| says(w)).count(), 1, "{written:?}: {}", run.stderr);
        let more = ["-dsco", "REFERENCE=b.gpkg", "-dsco", "RECORD=b.json", "-oo", "KEEP_GEOM_COLUMNS=NO"];
        let run = host.create("b_out.gpkg", "map.csv", &[&more[..], &open].concat()).succeeds();
        assert!(run.warnings().is_empty(), "{written:?}: {}", run.stderr);
    }
}

// --- writing -------------------------------------------------------------------------------------

const IN_DEGREES: [&str; 3] = ["buildings", "-t_srs", "EPSG:4326"];

#[test]
fn these_formats_are_written_marked_and_verify() {
    let cases: &[(&str, &[&str])] = &[
        ("out.gpkg", &LAYER),
        ("out.shp", &LAYER),
        ("out.shz", &LAYER),
        ("out.shp.zip", &LAYER),
        ("out.fgb", &LAYER),
        ("out.geojson", &LAYER),
        ("out.geojson", &["buildings", "-t_srs", "EPSG:4326", "-lco", "RFC7946=YES"]),
        ("out.geojson", &["buildings", "-t_srs", "EPSG:4326", "-lco", "COORDINATE_PRECISION=7"]),
        ("out.geojsonl", &IN_DEGREES),
        ("out.txt", &["buildings", "-t_srs", "EPSG:4326", "-dsco", "FORMAT=GeoJSONSeq", "-lco", "RS=YES"]),
    ];
    for (target, more) in cases {
        let host = Host::new();
        let run = host.create(target, &kotka(), more).succeeds();
        assert!(!run.stderr.contains("MESHMARK"), "{target}: {}", run.stderr);
        host.matches("ref.gpkg", &["--record", "record.json", target]);
        let is_ours = |name: &String| ["key.json", "record.json", "ref.gpkg"].contains(&name.as_str());
        let written: Vec<_> = host.names().into_iter().filter(|name| !is_ours(name)).collect();
        assert!(written.iter().all(|name| name.starts_with("out.")), "{target}: {written:?}");
        assert!(written.contains(&target.to_string()), "{written:?}");
    }
}

#[test]
fn other_formats_are_refused_with_a_way_to_them() {
    let remedy = "write a GPKG and convert it, or mark by reading";
    let cases: &[(&str, &[&str], [&str; 2])] = &[
        ("out.gml", &LAYER, ["extension \"gml\"", remedy]),
        ("out.kml", &IN_DEGREES, ["extension \"kml\"", remedy]),
        ("out.kml", &["buildings", "-dsco", "FORMAT=LIBKML"], ["FORMAT=LIBKML", remedy]),
        ("out.tab", &LAYER, ["extension \"tab\"", remedy]),
        ("out.dxf", &BARE, ["extension \"dxf\"", remedy]),
        ("out.csv", &["buildings", "-lco", "GEOMETRY=AS_WKT"], ["extension \"csv\"", remedy]),
        ("out.sqlite", &LAYER, ["extension \"sqlite\"", remedy]),
        ("out.zip", &LAYER, ["extension \"zip\"", remedy]),
        ("PG:dbname=map", &LAYER, ["PG:dbname=map: a name without extension", remedy]),
        ("PG:dbname=map", &["buildings", "-dsco", "FORMAT=PostgreSQL"], ["FORMAT=PostgreSQL", remedy]),
        (
            "out.geojson",
            &["buildings", "-lco", "RFC7946=YES"],
            ["\"buildings\" is not in WGS 84", "-t_srs EPSG:4326"],
        ),
        ("out.geojsonl", &LAYER, ["GeoJSONSeq would bring it", "-t_srs EPSG:4326"]),
        ("out.geojsonl", &["-t_srs", "EPSG:4326"], ["GeoJSONSeq holds one layer", "write a GeoPackage"]),
    ];
    for (target, more, words) in cases {
        let host = Host::new();
        let run = host.create(target, &kotka(), more);
        assert_eq!(run.code, Some(1), "{target}: {}", run.stderr);
        for word in words {
            assert!(run.stderr.contains(word), "{target}: {word:?} is not in: {}", run.stderr);
        }
        assert_eq!(host.names(), ["key.json"], "{target}");
    }
}

/// Tests the remedy of the refusal.
#[test]
fn a_marked_map_that_is_converted_carries_the_message() {
    let host = Host::new();
    host.create("out.gpkg", &kotka(), &BARE).succeeds();
    let cases = [
        ("KML", "out.kml"),
        ("GML", "out.gml"),
        ("MapInfo File", "out.tab"),
        ("DXF", "out.dxf"),
        ("SQLite", "out.sqlite"),
    ];
    for (format, target) in cases {
        let run = host.run("ogr2ogr", &["-f", format, target, "out.gpkg"]);
        assert_eq!(run.code, Some(0), "{target}: {}", run.stderr);
        host.matches("ref.gpkg", &["--record", "record.json", target]);
    }
}

/// Returns a grid of houses, some of whose marked longitudes lie just beside a round number, where
/// GDAL ends numbers early.
fn houses_on_a_round_meridian() -> String {
    let house = |number: u32| {
        let jitter = |n: u32| f64::from(number * 7919 % 101 + n * 13) * 1e-7;
        let (x, y) = (27.0 + (f64::from(number % 3) - 1.0) * 2e-4, 60.0 + f64::from(number / 3) * 2e-4);
        let ring =
            [(x, y + jitter(1)), (x + 1e-4, y + jitter(2)), (x + 1e-4, y + 8e-5), (x, y + 8e-5 + jitter(3))];
        let ring: Vec<_> = ring.iter().chain(&ring[..1]).map(|(x, y)| format!("[{x}, {y}]")).collect();
        let geometry = format!(r#"{{"type": "Polygon", "coordinates": [[{}]]}}"#, ring.join(", "));
        format!(r#"{{"type": "Feature", "properties": {{"n": {number}}}, "geometry": {geometry}}}"#)
    };
    let houses: Vec<_> = (0..600).map(house).collect();
    format!(r#"{{"type": "FeatureCollection", "features": [{}]}}"#, houses.join(",\n"))
}

#[test]
fn any_number_of_digits_that_leaves_the_message_readable_is_written() {
    let host = Host::new();
    fs::write(host.path("map.geojson"), houses_on_a_round_meridian()).unwrap();
    let digits =
        |option: &str, counts: &[u32]| counts.iter().map(|n| format!("{option}={n}")).collect::<Vec<_>>();
    let decimals = digits("COORDINATE_PRECISION", &[7, 8, 9, 10, 12, 15, 17]);
    let figures = digits("SIGNIFICANT_FIGURES", &[10, 11, 13, 17]);
    let in_metres = ["-t_srs", "EPSG:3067"].as_slice();
    let cases = [
        ("geojson", ["-lco", "RFC7946=YES"].as_slice(), decimals.clone()),
        ("geojsonl", &[], decimals),
        ("geojson", in_metres, digits("COORDINATE_PRECISION", &[2, 6, 8, 9, 12])),
        ("geojson", in_metres, figures.clone()),
        ("geojson", &[], figures),
    ];
    for (number, (ending, options, digits)) in cases.into_iter().enumerate() {
        for digits in digits {
            let target = format!("{number}-{digits}.{ending}");
            let reference = format!("REFERENCE={target}.gpkg");
            let record = format!("RECORD={target}.record.json");
            let own = ["-lco", &digits, "-dsco", &reference, "-dsco", &record];
            let options: Vec<_> = options.iter().chain(&own).copied().collect();
            let run = host.create(&target, "map.geojson", &options);
            assert_eq!(run.code, Some(0), "{target}: {}", run.stderr);
        }
    }
}

#[test]
fn too_few_digits_for_the_message_are_refused_by_their_name() {
    let cases = [
        ("COORDINATE_PRECISION=4", "written with 4 decimals", "raise COORDINATE_PRECISION"),
        ("COORDINATE_PRECISION=1", "written with 1 decimal", "raise COORDINATE_PRECISION"),
        ("SIGNIFICANT_FIGURES=5", "written with 5 significant figures", "raise SIGNIFICANT_FIGURES"),
    ];
    for (digits, said, remedy) in cases {
        let host = Host::new();
        fs::write(host.path("map.geojson"), houses_on_a_round_meridian()).unwrap();
        let run = host.create("out.geojson", "map.geojson", &["-lco", digits]);
        assert_eq!(run.code, Some(1), "{digits}: {}", run.stderr);
        assert!(run.stderr.contains(said) && run.stderr.contains(remedy), "{digits}: {}", run.stderr);
        assert!(!run.stderr.contains("1 decimals"), "{digits}: {}", run.stderr);
        assert_eq!(host.names(), ["key.json", "map.geojson"], "{digits}");
    }
}

/// Writes a copy of kotka's buildings in which some features have a null geometry and one has an
/// empty one.
fn with_null_and_empty(host: &Host) {
    host.run("ogr2ogr", &["map.gpkg", &kotka(), "buildings"]).succeeds();
    let null = "INSERT INTO buildings (geom) VALUES (NULL), (NULL), (ST_GeomFromText('POLYGON EMPTY'))";
    host.run("ogrinfo", &["-q", "-dialect", "SQLite", "-sql", null, "map.gpkg"]);
}

#[test]
fn features_that_a_format_leaves_out_are_counted_and_the_remedy_helps() {
    let host = Host::new();
    with_null_and_empty(&host);
    fs::write(host.path("list.csv"), "recipient\nACME GmbH\n").unwrap();
    let list = [
        "distribute",
        "--key",
        "key.json",
        "--recipients",
        "list.csv",
        "--output-dir",
        "out",
        "-f",
        "FlatGeobuf",
    ];
    let command = host.meshmark();
    let distributed = host.run(command.to_str().unwrap(), &[&list[..], &["map.gpkg"]].concat());
    for (way, run) in [("writing", host.create("out.fgb", "map.gpkg", &[])), ("distribute", distributed)] {
        assert!(run.code != Some(0), "{way}: {}", run.stderr);
        if run.stderr.contains("NULL geometry not supported") {
            continue; // GDAL 3.10 refuses them itself
        }
        for word in ["\"buildings\"", "3 of them with a null or empty geometry", "NOT ST_IsEmpty(geom)"] {
            assert!(run.stderr.contains(word), "{way}: {word:?} is not in: {}", run.stderr);
        }
    }
    assert!(!host.names().iter().any(|name| name.ends_with(".fgb")), "{:?}", host.names());
    host.create("out.fgb", "map.gpkg", &["-where", "NOT ST_IsEmpty(geom)"]).succeeds();
}
