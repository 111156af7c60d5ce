//! Marking as the last step: the results of writing to MESHMARK with `ogr2ogr`.

use meshmark_core::fingerprint_record::FingerprintRecord;
use meshmark_host_tests::{
    contents::{self, LayerContents, lengths, moves},
    faults::points,
    plugin::{Host, Run, fixture},
};
use std::{fs, os::unix::fs::MetadataExt};

fn source(name: &str) -> String {
    fixture(name).display().to_string()
}

fn record(host: &Host) -> FingerprintRecord {
    FingerprintRecord::from_json(&fs::read_to_string(host.path("record.json")).unwrap()).unwrap()
}

#[test]
fn a_marked_map_its_reference_and_its_record_are_written_and_nothing_else() {
    let host = Host::new();
    let run = host.create("out.gpkg", &source("kotka.gpkg"), &[]).succeeds();
    assert!(run.warnings().is_empty(), "{}", run.stderr);
    assert_eq!(host.names(), ["key.json", "out.gpkg", "record.json", "ref.gpkg"]);
    let before = contents::read(&fixture("kotka.gpkg"));
    let moved = moves(&before, &contents::read(&host.path("out.gpkg")));
    let (rms, max) = lengths(&moved);
    assert_eq!(moved.len(), record(&host).reference.vertices, "all layers are marked together");
    assert!((0.05..0.15).contains(&rms) && max <= 0.75, "rms {rms} m, max {max} m");
    let (_, none) = lengths(&moves(&before, &contents::read(&host.path("ref.gpkg"))));
    assert_eq!(none, 0.0, "the reference is the map as it arrived");
    host.matches("ref.gpkg", &["--record", "record.json", "out.gpkg"]);
    host.matches(&source("kotka.gpkg"), &["--record", "record.json", "out.gpkg"]);
}

#[test]
fn marking_while_writing_and_marking_while_reading_make_the_same_map() {
    let host = Host::new();
    host.create("written.gpkg", &source("helsinki.gpkg"), &[]).succeeds();
    host.mark("GPKG", "read.gpkg", &source("helsinki.gpkg"), &[]).succeeds();
    assert!(contents::read(&host.path("written.gpkg")) == contents::read(&host.path("read.gpkg")));
}

#[test]
fn what_a_geojson_file_said_of_its_unmarked_extent_is_in_no_copy() {
    let host = Host::new();
    let layer = [source("kotka.gpkg"), "buildings".into()];
    let bounds = ["-f", "GeoJSON", "map.geojson", "-lco", "WRITE_BBOX=YES", &layer[0], &layer[1]];
    host.run("ogr2ogr", &bounds).succeeds();
    host.run("ogr2ogr", &["map.gpkg", "map.geojson"]).succeeds();
    fs::write(host.path("list.csv"), "recipient\nACME GmbH\n").unwrap();
    let says_it = |map: &str| {
        let said = host.run("ogrinfo", &["-so", "-mdd", "all", map, "buildings"]).succeeds().stdout;
        said.contains("NATIVE_DATA") && !said.contains("\"bbox\":null")
    };
    assert!(says_it("map.gpkg"), "ogr2ogr keeps it");

    host.mark("GPKG", "read.gpkg", "map.gpkg", &[]).succeeds();
    host.create("written.gpkg", "map.geojson", &[]).succeeds();
    let list =
        ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "out", "map.gpkg"];
    host.run(host.meshmark().to_str().unwrap(), &list).succeeds();
    let copies = fs::read_dir(host.path("out")).unwrap().map(|entry| entry.unwrap().path());
    let distributed = copies.filter(|path| path.extension().is_some_and(|kind| kind == "gpkg"));
    let mut marked: Vec<_> = distributed.map(|path| path.to_str().unwrap().to_string()).collect();
    assert_eq!(marked.len(), 1);
    marked.extend(["read.gpkg".into(), "written.gpkg".into()]);
    for map in marked {
        assert!(!says_it(&map), "{map}");
    }
}

#[test]
fn every_format_gets_what_its_own_driver_writes_but_for_the_coordinates() {
    for (format, target, native) in [
        ("GPKG", "out.gpkg", "native.gpkg"),
        ("ESRI Shapefile", "out.shp", "native.shp"),
        ("ESRI Shapefile", "out.shz", "native.shz"),
        ("FlatGeobuf", "out.fgb", "native.fgb"),
        ("GeoJSON", "out.geojson", "native.geojson"),
    ] {
        let host = Host::new();
        host.run("ogr2ogr", &["-f", format, native, &source("kotka.gpkg"), "buildings"]).succeeds();
        let run = host.create(target, &source("kotka.gpkg"), &["buildings"]).succeeds();
        let ours: Vec<_> = run.warnings().into_iter().filter(|w| w.contains("MESHMARK")).collect();
        assert!(ours.is_empty(), "{format}: {ours:?}");
        let (before, after) = (comparable(&host, native), comparable(&host, target));
        let moved = moves(&before, &after);
        let (rms, max) = lengths(&moved);
        assert!(moved.len() > 2000 && (0.05..0.15).contains(&rms) && max <= 0.75, "{format}: {rms}, {max}");
        host.matches("ref.gpkg", &["--record", "record.json", target]);
    }
}

/// Returns a map without the names that follow from that of the file; FlatGeobuf orders features by
/// place.
fn comparable(host: &Host, name: &str) -> Vec<LayerContents> {
    let mut layers = contents::read(&host.path(name));
    for layer in &mut layers {
        layer.name.clear();
        if name.ends_with(".fgb") {
            layer.features.iter_mut().for_each(|feature| feature.fid = None);
            layer.features.sort_by(|a, b| a.attributes.cmp(&b.attributes));
        }
    }
    layers
}

#[test]
fn every_geometry_type_field_type_and_null_value_arrives() {
    let host = Host::new();
    let run = host.create("out.gpkg", &source("shapes.gpkg"), &[]);
    let run = run.succeeds();
    let before = contents::read(&fixture("shapes.gpkg"));
    let (rms, _) = lengths(&moves(&before, &contents::read(&host.path("out.gpkg"))));
    assert!(rms > 0.05, "{}", run.stderr);
    host.matches("ref.gpkg", &["--record", "record.json", "out.gpkg"]);
    let domain = |file: &str| {
        let run = host.run("ogrinfo", &["-fielddomain", "rakennuslaji", file]).succeeds();
        run.stdout.lines().skip(2).map(String::from).collect::<Vec<_>>()
    };
    assert_eq!(domain("out.gpkg"), domain(&source("shapes.gpkg")));
}

#[test]
fn a_layer_may_bear_a_name_that_geopackage_reserves() {
    let host = Host::new();
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", "gpkg_a.shp", &source("kotka.gpkg"), "buildings"])
        .succeeds();
    host.create("out.fgb", "gpkg_a.shp", &["-dsco", "LAYERS=gpkg_a"]).succeeds();
    assert_eq!(contents::read(&host.path("out.fgb"))[0].name, "gpkg_a");
    host.matches("ref.gpkg", &["--record", "record.json", "out.fgb"]);
}

/// Options for a small map.
const SMALL: [&str; 4] = ["-dsco", "PATCH_SIZE=130", "-dsco", "MESSAGE=0123456789abcdef"];

#[test]
fn values_that_geopackage_cannot_hold_reach_a_format_that_can() {
    let host = Host::new();
    let properties = r#""n":#,"list":[1,#],"texts":["a,b","(c)"],"reals":[0.5,#.25],"time":"2020-02-03T04:05:06",
        "zoned":"2020-02-03T04:05:06+02:00","big":9007199254740993,"yes":true,"none":null,"fid":#,"geom":"square""#;
    fs::write(host.path("in.geojson"), points(400, properties)).unwrap();
    host.run("ogr2ogr", &["-f", "GeoJSON", "native.geojson", "in.geojson"]).succeeds();
    host.create("out.geojson", "in.geojson", &SMALL).succeeds();
    let (before, after) = (comparable(&host, "native.geojson"), comparable(&host, "out.geojson"));
    assert_eq!(moves(&before, &after).len(), 400);
}

#[test]
fn the_map_is_marked_after_it_was_reprojected_and_clipped_and_on_the_grid_of_the_target() {
    let host = Host::new();
    let more = ["-t_srs", "EPSG:3857", "-simplify", "0.1", "-dsco", "PRECISION=0.01"];
    host.create("out.gpkg", &source("helsinki.gpkg"), &more).succeeds();
    let record = record(&host);
    assert_eq!(record.reference.crs.as_deref(), Some("EPSG:3857"));
    host.matches("ref.gpkg", &["--record", "record.json", "out.gpkg"]);
    let layers = contents::read(&host.path("out.gpkg"));
    let coords = layers.iter().flat_map(|layer| layer.coords()).flatten();
    let off_grid = coords.filter(|v| ((v * 100.0).round() / 100.0) != *v).count();
    assert_eq!(off_grid, 0, "nothing happens to the coordinates after they were put on the grid");
}

#[test]
fn layer_options_go_to_the_real_driver_and_are_checked_by_it() {
    let host = Host::new();
    let more = ["buildings", "-lco", "FID=number", "-lco", "GEOMETRY_NAME=line", "-lco", "COLOUR=red"];
    let run = host.create("out.gpkg", &source("kotka.gpkg"), &more).succeeds();
    assert!(matches!(run.warnings()[..], [only] if only.contains("COLOUR")), "{}", run.stderr);
    let info = host.run("ogrinfo", &["-so", "out.gpkg", "buildings"]).succeeds().stdout;
    assert!(info.contains("FID Column = number") && info.contains("Geometry Column = line"), "{info}");

    let host = Host::new();
    let more = ["buildings", "-lco", "COORDINATE_PRECISION=2"];
    host.create("out.geojson", &source("kotka.gpkg"), &more).succeeds();
    let coords = contents::read(&host.path("out.geojson"))[0].coords();
    assert!(coords.iter().flatten().all(|v| ((v * 100.0).round() / 100.0) == *v));
    host.matches("ref.gpkg", &["--record", "record.json", "out.geojson"]);
}

#[test]
fn only_the_layers_that_are_named_are_marked() {
    let host = Host::new();
    host.create("out.gpkg", &source("kotka.gpkg"), &["-dsco", "LAYERS=buildings"]).succeeds();
    let (before, after) = (contents::read(&fixture("kotka.gpkg")), contents::read(&host.path("out.gpkg")));
    for (before, after) in before.iter().zip(&after) {
        let (_, max) = lengths(&moves(std::slice::from_ref(before), std::slice::from_ref(after)));
        assert_eq!(max > 0.0, before.name == "buildings", "{}", before.name);
    }
    host.matches("ref.gpkg", &["--record", "record.json", "out.gpkg"]);
}

#[test]
fn a_map_without_numbers_of_its_own_gets_those_of_the_format() {
    let host = Host::new();
    host.create("out.shp", &source("kotka.gpkg"), &["buildings", "-unsetFid"]).succeeds();
    let first = contents::read(&host.path("out.shp"))[0].features[0].fid;
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", "native.shp", &source("kotka.gpkg"), "buildings"])
        .succeeds();
    assert_eq!(first, contents::read(&host.path("native.shp"))[0].features[0].fid);
}

#[test]
fn reference_and_record_may_go_to_folders_and_file_systems_of_their_own() {
    let host = Host::new();
    let elsewhere = tempfile::tempdir_in("/dev/shm").unwrap();
    let other = elsewhere.path().metadata().unwrap().dev() != host.folder().metadata().unwrap().dev();
    assert!(other, "/dev/shm is a file system of its own");
    let reference = elsewhere.path().join("ref.gpkg").display().to_string();
    fs::create_dir(host.path("records")).unwrap();
    let options = [format!("REFERENCE={reference}"), "RECORD=records/acme.json".into()];
    let more = ["-dsco", options[0].as_str(), "-dsco", &options[1]];
    host.create("out.gpkg", &source("kotka.gpkg"), &more).succeeds();
    host.matches(&reference, &["--record", "records/acme.json", "out.gpkg"]);
    assert_eq!(host.names(), ["key.json", "out.gpkg", "records"]);
    let count = |folder: &std::path::Path| fs::read_dir(folder).unwrap().count();
    assert_eq!((count(elsewhere.path()), count(&host.path("records"))), (1, 1));
}

#[test]
fn the_key_may_come_from_the_configuration_and_the_secret_is_seen_nowhere() {
    let host = Host::new();
    let source = source("kotka.gpkg");
    let arguments = ["-f", "MESHMARK", "MESHMARK:out.gpkg", &source, "-dsco", "RECIPIENT=ACME GmbH"];
    let arguments = [&arguments[..], &["-dsco", "REFERENCE=ref.gpkg"]].concat();
    let configuration = [("MESHMARK_KEY", "key.json"), ("CPL_DEBUG", "ON")];
    let run = host.run_with("ogr2ogr", &arguments, &configuration);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(!run.stderr.contains(&host.secret()));
    let secret = host.secret().into_bytes();
    for (name, bytes) in host.files().into_iter().filter(|(name, _)| name != "key.json") {
        assert!(!bytes.windows(secret.len()).any(|window| window == secret), "{name}");
    }
}

// --- targets that exist --------------------------------------------------------------------------

/// Runs ogr2ogr, which must fail with a sentence that holds all of `words` and leave everything
/// unchanged.
#[track_caller]
fn refuses(host: &Host, run: impl FnOnce() -> Run, words: &[&str]) {
    let before = host.files();
    let run = run();
    assert!(run.code.is_some_and(|code| code != 0), "{:?}: {}", run.code, run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "{word:?} is not in: {}", run.stderr);
    }
    assert!(host.files() == before, "nothing is written, changed or left: {:?}", host.names());
}

#[test]
fn a_file_that_is_there_is_replaced_only_when_that_is_said() {
    let host = Host::new();
    host.copy("astana.gpkg", "out.gpkg");
    let kotka = source("kotka.gpkg");
    refuses(&host, || host.create("out.gpkg", &kotka, &[]), &["out.gpkg exists", "OVERWRITE=YES"]);
    host.create("out.gpkg", &kotka, &["-dsco", "OVERWRITE=YES"]).succeeds();
    host.matches("ref.gpkg", &["--record", "record.json", "out.gpkg"]);

    let again = ["-dsco", "OVERWRITE=YES", "-dsco", "RECORD=again.json"];
    refuses(
        &host,
        || host.create("out.gpkg", &kotka, &again),
        &["ref.gpkg exists", "other copies may depend"],
    );
    let again = [&again[..], &["-dsco", "REFERENCE=again.gpkg", "-dsco", "RECIPIENT=B"]].concat();
    host.create("out.gpkg", &kotka, &again).succeeds();
    host.matches("again.gpkg", &["--record", "again.json", "out.gpkg"]);
}

#[test]
fn all_files_of_a_shapefile_are_replaced_together() {
    let host = Host::new();
    let astana = source("astana.gpkg");
    host.run(
        "ogr2ogr",
        &["-f", "ESRI Shapefile", "out.shp", &astana, "buildings", "-lco", "SPATIAL_INDEX=YES"],
    )
    .succeeds();
    assert!(host.path("out.qix").exists());
    fs::write(host.path("out.txt"), "a note that is no part of it").unwrap();
    host.create("out.shp", &source("kotka.gpkg"), &["buildings", "-dsco", "OVERWRITE=YES"]).succeeds();
    host.matches("ref.gpkg", &["--record", "record.json", "out.shp"]);
    assert!(!host.path("out.qix").exists(), "the index was that of the old one");
    assert!(host.path("out.txt").exists());
}

#[test]
fn a_marked_map_cannot_be_extended_and_the_target_stays_as_it_was() {
    let kotka = source("kotka.gpkg");
    for mode in ["-append", "-update", "-overwrite"] {
        let host = Host::new();
        host.create("out.gpkg", &kotka, &[]).succeeds();
        let more =
            ["-dsco", "REFERENCE=second.gpkg", "-dsco", "RECORD=second.json", "-dsco", "OVERWRITE=YES", mode];
        refuses(&host, || host.create("out.gpkg", &kotka, &more), &["cannot be extended", "leave -append"]);
        refuses(&host, || host.create("new.gpkg", &kotka, &more), &["cannot be extended"]);
    }
}

#[test]
fn only_files_are_written() {
    let host = Host::new();
    let kotka = source("kotka.gpkg");
    fs::create_dir(host.path("folder")).unwrap();
    let refuse = |target: &str, more: &[&str], words: &[&str]| {
        refuses(&host, || host.create(target, &kotka, more), words);
    };
    refuse("folder", &["-dsco", "FORMAT=ESRI Shapefile"], &["folder is a folder"]);
    refuse("nowhere/out.gpkg", &[], &["nowhere/out.gpkg", "in no folder that exists"]);
    refuse("/vsimem/out.gpkg", &[], &["/vsimem/out.gpkg", "virtual file"]);
    refuse("PG:dbname=map", &[], &["a name without extension", "write a GPKG"]);
    refuse("PG:dbname=map", &["-dsco", "FORMAT=PostgreSQL"], &["FORMAT=PostgreSQL", "GPKG"]);
    refuse("out.xyz", &[], &["extension \"xyz\""]);
    refuse("out.shp", &[], &["ESRI Shapefile holds one layer"]);
    refuse("out.geojson", &[], &["GeoJSON holds one layer"]);
    refuse("", &[], &["MESHMARK:"]);
}

#[test]
fn what_is_missing_or_collides_is_named() {
    let host = Host::new();
    let kotka = source("kotka.gpkg");
    let plain = ["-f", "MESHMARK", "MESHMARK:out.gpkg", &kotka, "-dsco", "KEY=key.json"];
    let named = [&plain[..], &["-dsco", "RECIPIENT=A"]].concat();
    refuses(&host, || host.run("ogr2ogr", &named), &["there is no REFERENCE"]);
    let refuse =
        |more: &[&str], words: &[&str]| refuses(&host, || host.create("out.gpkg", &kotka, more), words);
    refuse(&["-dsco", "REFERENCE=ref.shp"], &["ref.shp", ".gpkg"]);
    refuse(&["-dsco", "REFERENCE=out.gpkg"], &["REFERENCE and the target"]);
    refuse(&["-dsco", "RECORD=out.gpkg"], &["RECORD and the target"]);
    refuse(&["-dsco", "RECORD=ref.gpkg"], &["RECORD and REFERENCE"]);
    refuse(&["-dsco", "OVERWRITE=perhaps"], &["OVERWRITE=perhaps"]);
    refuse(&["-dsco", "COLOUR=red"], &["unknown option COLOUR"]);
    refuse(&["-dsco", "KEY=nowhere.json"], &["nowhere.json", "meshmark keygen"]);
    refuse(&["-dsco", "PATCH_SIZE=3"], &["PATCH_SIZE=3"]);
    fs::write(host.path("record.json"), "of another copy").unwrap();
    refuse(&[], &["record.json", "exists"]);
}

#[test]
fn ogr2ogr_shows_the_progress_of_the_marking_where_it_is_asked_to() {
    let host = Host::new();
    // A bar is "0...10...20" to "100 - done.", or on a terminal of later versions a line that is redrawn.
    let bars = |run: Run| {
        let Run { stdout, stderr, .. } = run.succeeds();
        assert!(stderr.is_empty(), "{stderr}");
        stdout.matches("done").count()
    };
    let map = &source("helsinki.gpkg");
    assert_eq!(bars(host.mark("GPKG", "quiet.gpkg", map, &[])), 0);
    assert_eq!(bars(host.mark("GPKG", "read.gpkg", map, &["-progress"])), 2, "of patches, then of features");
    assert_eq!(bars(host.create("written.gpkg", map, &["-progress"])), 2, "of features, then of patches");
    let to_stdout = ["-progress", "buildings"];
    let written = host.mark("GeoJSON", "/vsistdout/", &source("kotka.gpkg"), &to_stdout).succeeds().stdout;
    assert!(written.starts_with('{'), "no bar is in a map: {:?}", written.get(..60));
    let quiet = contents::read(&host.path("quiet.gpkg"));
    assert!(["read.gpkg", "written.gpkg"].iter().all(|file| contents::read(&host.path(file)) == quiet));
}
