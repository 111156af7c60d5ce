//! `meshmark distribute` gives the same records and maps as `ogr2ogr` through the driver.

use meshmark_host_tests::{
    contents::{self, FeatureContents},
    faults::{Distribution, Fault},
    plugin::{Host, Run},
};
use serde_json::Value;
use std::fs;

const RECIPIENTS: [(&str, &str); 2] =
    [("ACME GmbH", "acme-gmbh-f384e512"), ("Öster AB", "öster-ab-5b966f44")];

/// Returns a host with a list of the recipients and a copy of a fixture.
fn host() -> Host {
    let host = Host::new();
    fs::write(host.path("list.csv"), "recipient\nACME GmbH\nÖster AB\n").unwrap();
    host.copy("kotka.gpkg", "map.gpkg");
    host
}

fn distribute(host: &Host, folder: &str, map: &str, more: &[&str], threads: &str) -> Run {
    let mut arguments =
        vec!["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", folder, map];
    arguments.extend(more);
    host.run_with(host.meshmark().to_str().unwrap(), &arguments, &[("GDAL_NUM_THREADS", threads)])
}

/// Returns what `ogrinfo` prints of the layers of a map, without its name.
fn summary(host: &Host, map: &str) -> String {
    let text = host.run("ogrinfo", &["-al", "-so", map]).succeeds().stdout;
    text.lines().filter(|line| !line.starts_with("INFO: ")).collect::<Vec<_>>().join("\n")
}

/// Adds data that a copy might lose: ids with gaps, fields of all kinds with widths, nulls, a
/// table, heights.
fn enrich(host: &Host) {
    let sql = |sql: &str| drop(host.run("ogrinfo", &["-q", "map.gpkg", "-sql", sql]).succeeds());
    sql("UPDATE buildings SET fid = fid + 1000 WHERE fid % 3 = 0");
    for field in [
        "yes BOOLEAN",
        "small SMALLINT DEFAULT 7",
        "code TEXT(7)",
        "day DATE",
        "at DATETIME",
        "raw BLOB",
        "ratio FLOAT",
    ] {
        sql(&format!("ALTER TABLE buildings ADD COLUMN {field}"));
    }
    sql(
        "UPDATE buildings SET yes = 1, code = 'x', day = '2024-02-29', at = '2024-02-29T12:00:00.000Z', raw = x'00ff', \
         ratio = 0.1 WHERE fid % 2 = 0",
    );
    sql("UPDATE roads SET geom = NULL WHERE fid = 5");
    fs::write(host.path("notes.csv"), "id,note\n1,a\n2,\n").unwrap();
    let line = r#"{"type":"Feature","properties":{},"geometry":{"type":"LineString",
        "coordinates":[[497000,6710700,1.5],[497010,6710710,2.5]]}}"#;
    fs::write(host.path("heights.geojson"), line).unwrap();
    let arc = "CIRCULARSTRING (497000 6710700,497001 6710703,497010 6710700)";
    let arcs = format!("id,WKT\n1,\"{arc}\"\n2,\"CIRCULARSTRING EMPTY\"\n3,\n");
    fs::write(host.path("arcs.csv"), arcs).unwrap();
    host.run("ogr2ogr", &["-update", "map.gpkg", "notes.csv"]).succeeds();
    let curved = ["arcs.csv", "-oo", "KEEP_GEOM_COLUMNS=NO", "-a_srs", "EPSG:3067", "-nlt", "CIRCULARSTRING"];
    host.run("ogr2ogr", &[&["-update", "map.gpkg"], &curved[..]].concat()).succeeds();
    host.run("ogr2ogr", &["-update", "-a_srs", "EPSG:3067", "map.gpkg", "heights.geojson"]).succeeds();
}

/// Returns the result of an SQL statement on a GeoPackage, one value a line.
fn answer(host: &Host, map: &str, sql: &str) -> String {
    let text = host.run("ogrinfo", &["-q", map, "-sql", sql]).succeeds().stdout;
    text.lines().filter_map(|line| Some(line.split_once(" = ")?.1)).collect::<Vec<_>>().join("\n")
}

/// Asserts that every geometry has the same bytes in both, including its header, and that the
/// indexes of the first are sound, hold the features of the second's, and have boxes that are no
/// larger.
fn bytes_and_indexes_agree(host: &Host, copy: &str, driver: &str) {
    for layer in ["buildings", "roads", "heights", "arcs"] {
        let bytes = format!("SELECT hex(geom) AS h FROM {layer} WHERE geom NOT NULL ORDER BY fid");
        assert!(answer(host, copy, &bytes) == answer(host, driver, &bytes), "{layer}");
        let has_index = format!("SELECT HasSpatialIndex('{layer}', 'geom')");
        assert_eq!(answer(host, copy, &has_index), "1", "{layer}");
        assert_eq!(answer(host, copy, &format!("SELECT rtreecheck('rtree_{layer}_geom')")), "ok", "{layer}");
        let table = format!("rtree_{layer}_geom");
        let ids = format!("SELECT id FROM {table} ORDER BY id");
        assert_eq!(answer(host, copy, &ids), answer(host, driver, &ids), "{layer}");
        let outside = format!(
            "SELECT count(*) FROM {layer} t JOIN {table} r ON t.fid = r.id WHERE minx > ST_MinX(geom) OR maxx < \
             ST_MaxX(geom) OR miny > ST_MinY(geom) OR maxy < ST_MaxY(geom)"
        );
        assert_eq!(answer(host, copy, &outside), "0", "{layer}");
        let sides = format!("SELECT minx, -maxx AS x, miny, -maxy AS y FROM {table} ORDER BY id");
        let [ours, gdal] = [copy, driver].map(|map| answer(host, map, &sides));
        let numbers = |text: &str| text.lines().map(|n| n.parse().unwrap()).collect::<Vec<f64>>();
        assert!(numbers(&ours).iter().zip(numbers(&gdal)).all(|(ours, gdal)| *ours >= gdal), "{layer}");
    }
}

/// Returns a record without the digests of its files, of which that of the copy must be right: a
/// copy that is not one file, or that another program writes, has none.
fn without_digests(host: &Host, record: &str, copy: &str) -> Value {
    let mut record: Value = serde_json::from_slice(&fs::read(host.path(record)).unwrap()).unwrap();
    let of_copy = record["copy"]["file_sha256"].take();
    match copy {
        "" => assert!(of_copy.is_null(), "{of_copy}"),
        copy => assert_eq!(of_copy, host.run("sha256sum", &[copy]).succeeds().stdout[..64]),
    }
    record["reference"]["file_sha256"].take();
    record
}

#[test]
fn records_and_geopackages_are_those_of_the_driver() {
    let host = host();
    enrich(&host);
    let done = distribute(&host, "out", "map.gpkg", &["-f", "GPKG", "--amplitude", "0.12"], "2").succeeds();
    assert_eq!(done.stdout, "2 copies written to out\n");
    for (recipient, stem) in RECIPIENTS {
        let (copy, subject) = (format!("out/{stem}.gpkg"), format!("RECIPIENT={recipient}"));
        let options =
            ["-oo", "KEY=key.json", "-oo", &subject, "-oo", "AMPLITUDE=0.12", "-oo", "RECORD=driver.json"];
        let line = [&["-f", "GPKG", "driver.gpkg", "MESHMARK:map.gpkg"], &options[..]].concat();
        host.run("ogr2ogr", &line).succeeds();
        assert_eq!(
            without_digests(&host, &format!("out/{stem}.json"), &copy),
            without_digests(&host, "driver.json", "")
        );
        assert!(contents::read(&host.path(&copy)) == contents::read(&host.path("driver.gpkg")));
        assert_eq!(summary(&host, &copy), summary(&host, "driver.gpkg"));
        bytes_and_indexes_agree(&host, &copy, "driver.gpkg");
        host.matches("map.gpkg", &["--record", &format!("out/{stem}.json"), &copy]);
        for name in ["driver.gpkg", "driver.json"] {
            fs::remove_file(host.path(name)).unwrap();
        }
    }
}

#[test]
fn one_layer_goes_into_every_format_as_by_the_driver() {
    let host = host();
    host.run("ogr2ogr", &["-f", "GPKG", "one.gpkg", "map.gpkg", "buildings", "-t_srs", "EPSG:4326"])
        .succeeds();
    for (format, ending) in
        [("ESRI Shapefile", "shp"), ("FlatGeobuf", "fgb"), ("GeoJSON", "geojson"), ("GeoJSONSeq", "geojsonl")]
    {
        let options = ["--layers", "buildings", "--format", format];
        distribute(&host, ending, "one.gpkg", &options, "2").succeeds();
        let (recipient, stem) = RECIPIENTS[0];
        let (driver, record) = (format!("driver.{ending}"), format!("RECORD={ending}.json"));
        let subject = format!("RECIPIENT={recipient}");
        host.run(
            "ogr2ogr",
            &[
                "-f",
                format,
                &driver,
                "MESHMARK:one.gpkg",
                "-oo",
                "KEY=key.json",
                "-oo",
                &subject,
                "-oo",
                "LAYERS=buildings",
                "-oo",
                &record,
            ],
        )
        .succeeds();
        let copy = if ending == "shp" { String::new() } else { format!("{ending}/{stem}.{ending}") };
        let [ours, driver_s] = [format!("{ending}/{stem}.json"), format!("{ending}.json")];
        assert_eq!(without_digests(&host, &ours, &copy), without_digests(&host, &driver_s, ""));
        let features = |name: &str| -> Vec<FeatureContents> {
            let features =
                contents::read(&host.path(name)).into_iter().flat_map(|layer| layer.features).collect();
            if format == "FlatGeobuf" { in_any_order(features) } else { features }
        };
        assert!(features(&format!("{ending}/{stem}.{ending}")) == features(&driver), "{format}");
    }
    let refused = distribute(&host, "many", "map.gpkg", &["-f", "FlatGeobuf"], "2");
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("the map map.gpkg: FlatGeobuf holds one layer"), "{}", refused.stderr);
    assert!(!host.path("many").exists());
}

/// Returns features sorted and without numbers: FlatGeobuf orders features by place, here before
/// the mark and in the driver after it.
fn in_any_order(mut features: Vec<FeatureContents>) -> Vec<FeatureContents> {
    features.iter_mut().for_each(|feature| feature.fid = None);
    features.sort_by(|a, b| a.attributes.cmp(&b.attributes));
    features
}

#[test]
fn names_that_geopackage_has_for_itself_are_names_like_others() {
    let host = host();
    let sql = "SELECT osm_id AS fid, 'x' AS geom, name AS ogr_style FROM buildings";
    host.run("ogr2ogr", &["-f", "GeoJSON", "buildings.geojson", "map.gpkg", "buildings"]).succeeds();
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", "gpkg_a.shp", "buildings.geojson", "-sql", sql]).succeeds();
    for (format, ending) in [("ESRI Shapefile", "shp"), ("GeoJSON", "geojson"), ("FlatGeobuf", "fgb")] {
        let (plain, (_, stem)) = (format!("plain.{ending}"), RECIPIENTS[0]);
        host.run("ogr2ogr", &["-f", format, &plain, "gpkg_a.shp"]).succeeds();
        let said = distribute(&host, ending, "gpkg_a.shp", &["-f", format], "2").succeeds().stderr;
        assert!(!said.contains("GeoPackage") && !said.contains("gpkg"), "{said}");
        let features = |name: &str| in_any_order(contents::read(&host.path(name)).remove(0).features);
        let (before, after) = (features(&plain), features(&format!("{ending}/{stem}.{ending}")));
        assert!(
            before.len() > 100
                && before.iter().map(|f| &f.attributes).eq(after.iter().map(|f| &f.attributes))
        );
        assert!(before[0].attributes.contains("fid") && before != after, "{}", before[0].attributes);
    }
}

#[test]
fn the_extent_a_geojson_file_speaks_of_is_not_copied() {
    let host = host();
    let options = ["-f", "GeoJSON", "-lco", "RFC7946=YES", "-lco", "WRITE_BBOX=YES"];
    host.run("ogr2ogr", &[&options[..], &["map.geojson", "map.gpkg", "buildings"]].concat()).succeeds();
    distribute(&host, "out", "map.geojson", &["-f", "GPKG"], "2").succeeds();
    for (_, stem) in RECIPIENTS {
        let copy = fs::read(host.path(&format!("out/{stem}.gpkg"))).unwrap();
        let text = String::from_utf8_lossy(&copy).replace("&quot;", "\"");
        assert!(text.contains("\"bbox\":null") && text.matches("bbox").count() == 1, "{stem}");
    }
}

#[test]
fn a_damaged_copy_is_not_taken_for_a_finished_one() {
    let host = host();
    let run = || distribute(&host, "out", "map.gpkg", &[], "2");
    run().succeeds();
    let (_, stem) = RECIPIENTS[0];
    let copy = host.path(&format!("out/{stem}.gpkg"));
    let whole = fs::read(&copy).unwrap();
    for damaged in [&whole[..20_000], &[]] {
        fs::write(&copy, damaged).unwrap();
        let again = run();
        assert!(
            again.code == Some(2) && again.stderr.contains("is damaged or was changed"),
            "{}",
            again.stderr
        );
        assert!(again.stderr.contains(stem) && fs::read(&copy).unwrap() == damaged);
    }
    fs::write(&copy, whole).unwrap();
    run().succeeds();
}

#[test]
fn foreign_members_that_hold_places_are_warned_of_on_all_three_ways() {
    let host = host();
    host.run("ogr2ogr", &["-f", "GeoJSON", "plain.geojson", "map.gpkg", "buildings"]).succeeds();
    let mut map: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(host.path("plain.geojson")).unwrap()).unwrap();
    for feature in map["features"].as_array_mut().unwrap() {
        // A member "place" would make JSON-FG of it, whose CRS is in another place.
        feature["origin"] = feature["geometry"].clone();
    }
    fs::write(host.path("map.geojson"), map.to_string()).unwrap();
    let warned = "in foreign members of its features, which stay as they are";
    for (source, times) in [("map.geojson", 1), ("plain.geojson", 0)] {
        let said = [
            host.mark("GeoJSON", &format!("read_{source}"), source, &[]).succeeds().stderr,
            host.create(&format!("written_{source}"), source, &[]).succeeds().stderr,
            distribute(&host, source.trim_end_matches(".geojson"), source, &["-f", "GeoJSON"], "2")
                .succeeds()
                .stderr,
        ];
        for said in said {
            assert_eq!(said.matches(warned).count(), times, "{source}: {said}");
        }
        for name in ["ref.gpkg", "record.json"] {
            fs::remove_file(host.path(name)).unwrap();
        }
    }
}

#[test]
fn what_ogr2ogr_warns_of_is_said_once() {
    let host = host();
    let sql = "ALTER TABLE buildings ADD COLUMN longer_than_ten TEXT";
    host.run("ogrinfo", &["-q", "map.gpkg", "-sql", sql]).succeeds();
    host.run("ogr2ogr", &["-f", "GPKG", "one.gpkg", "map.gpkg", "buildings"]).succeeds();
    let said = distribute(&host, "out", "one.gpkg", &["-f", "ESRI Shapefile"], "2").succeeds().stderr;
    let cut = "meshmark: ogr2ogr: Normalized/laundered field name: 'longer_than_ten' to 'longer_tha'";
    assert_eq!(said.lines().filter(|line| *line == cut).count(), 1, "{said}");
    assert!(!said.contains(".meshmark-write-"), "{said}");
}

#[test]
fn one_thread_and_two_make_the_same_copies() {
    let host = host();
    for threads in ["1", "2"] {
        distribute(&host, threads, "map.gpkg", &["--shape", "rigid"], threads).succeeds();
    }
    for (_, stem) in RECIPIENTS {
        let [one, two] = ["1", "2"].map(|threads| ["json", "gpkg"].map(|e| format!("{threads}/{stem}.{e}")));
        assert_eq!(without_digests(&host, &one[0], &one[1]), without_digests(&host, &two[0], &two[1]));
        assert!(contents::read(&host.path(&one[1])) == contents::read(&host.path(&two[1])));
    }
}

#[test]
fn finished_copies_stay_and_what_is_none_is_refused() {
    let host = host();
    distribute(&host, "out", "map.gpkg", &[], "2").succeeds();
    let [(_, acme), (_, oester)] = RECIPIENTS;
    let (kept, gone) = (host.path(&format!("out/{acme}.gpkg")), host.path(&format!("out/{oester}.gpkg")));
    let time = fs::metadata(&kept).unwrap().modified().unwrap();
    fs::remove_file(&gone).unwrap();
    let again = distribute(&host, "out", "map.gpkg", &[], "2").succeeds();
    assert_eq!(again.stdout, "1 copy written to out, 1 copy there already\n");
    assert!(gone.exists() && fs::metadata(&kept).unwrap().modified().unwrap() == time);

    let refused = |more: &[&str], map: &str| {
        let run = distribute(&host, "out", map, more, "2");
        assert_eq!(run.code, Some(2), "{}", run.stderr);
        assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
        run.stderr
    };
    host.copy("helsinki.gpkg", "other.gpkg");
    for (more, map) in [(&["--amplitude", "0.2"][..], "map.gpkg"), (&[], "other.gpkg")] {
        let error = refused(more, map);
        assert!(error.contains(&format!("{acme}.json is not the record of this map, key")), "{error}");
    }
    fs::remove_file(host.path(&format!("out/{acme}.json"))).unwrap();
    let error = refused(&[], "map.gpkg");
    assert!(error.contains(&format!("{acme}.gpkg is there and is no finished copy")), "{error}");
    assert_eq!(fs::metadata(&kept).unwrap().modified().unwrap(), time);
    assert!(refused(&[], "MESHMARK:map.gpkg").contains("is a marked view already"));
}

#[test]
fn a_distribution_that_is_killed_or_has_no_disk_is_finished_by_the_next_run() {
    for format in ["GPKG", "ESRI Shapefile"] {
        let distribution = Distribution::new(format);
        let calls = distribution.count_calls();
        let mut seen = Vec::new();
        for at in (0..5).map(|place| 1 + place * (calls - 1) / 4) {
            for fault in [Fault::Kill(at), Fault::FullDisk(at)] {
                distribution.reset();
                seen.push(distribution.survives(fault));
            }
        }
        assert!(seen.contains(&0) && seen.iter().any(|&copies| copies > 0), "{seen:?}");
        for bytes in [4096, 81920] {
            distribution.reset();
            // The copy by ogr2ogr is larger.
            assert_eq!(distribution.survives(Fault::FileSize(bytes)), 0);
        }
        for seconds in [0.05, 0.2, 0.5] {
            distribution.reset();
            distribution.survives(Fault::KillAfter(seconds));
        }
    }
}
