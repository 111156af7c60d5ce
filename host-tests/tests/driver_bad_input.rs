//! Impossible requests: the user gets one clear sentence, and nothing is written or lost.

use meshmark_host_tests::plugin::{Host, fixture};
use std::{
    fs::{self, File},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

const KEY: [&str; 2] = ["-oo", "KEY=key.json"];
const RECIPIENT: [&str; 2] = ["-oo", "RECIPIENT=ACME GmbH"];

fn map() -> String {
    fixture("helsinki.gpkg").display().to_string()
}

/// Runs ogr2ogr, which must report exactly one failure that holds all of `words`, and write
/// nothing.
#[track_caller]
fn refuses(host: &Host, source: &str, options: &[&str], words: &[&str]) {
    let before = host.files();
    let source = format!("MESHMARK:{source}");
    let run = host.run("ogr2ogr", &[&["-f", "GPKG", "out.gpkg", &source], options].concat());
    assert!(run.code.is_some_and(|code| code != 0), "{:?}: {}", run.code, run.stderr);
    let [error] = run.errors()[..] else { panic!("one failure, not {:?}", run.stderr) };
    for word in words {
        assert!(error.contains(word), "{word:?} is not in: {error}");
    }
    assert!(error.contains(&source), "the input is named: {error}");
    assert!(!run.stderr.contains(&host.secret()));
    assert!(host.files() == before, "nothing is written, changed or left");
}

/// Runs ogr2ogr like [`refuses`], with the key and a recipient.
#[track_caller]
fn refuses_map(host: &Host, source: &str, more: &[&str], words: &[&str]) {
    refuses(host, source, &[&KEY[..], &RECIPIENT, more].concat(), words);
}

#[test]
fn a_missing_key_option_is_explained() {
    refuses(&Host::new(), &map(), &RECIPIENT, &["no KEY", "MESHMARK_KEY", "meshmark keygen"]);
}

#[test]
fn an_unreadable_key_file_is_named() {
    let host = Host::new();
    let options = [&RECIPIENT[..], &["-oo", "KEY=nowhere.json"]].concat();
    refuses(&host, &map(), &options, &["nowhere.json", "No such file", "meshmark keygen"]);
    let options = [&RECIPIENT[..], &["-oo", "KEY=/"]].concat();
    refuses(&host, &map(), &options, &["key file / cannot be read"]);
}

#[test]
fn a_malformed_key_file_is_named_and_never_quoted() {
    let host = Host::new();
    let good = fs::read_to_string(host.path("key.json")).unwrap();
    for bad in
        [good.replace("c5c5c5", "c5c5c6"), good.replace("secret", "password"), "{}".into(), String::new()]
    {
        fs::write(host.path("bad.json"), bad).unwrap();
        let options = [&RECIPIENT[..], &["-oo", "KEY=bad.json"]].concat();
        refuses(&host, &map(), &options, &["bad.json", "malformed key", "meshmark keygen"]);
    }
    let options = [&RECIPIENT[..], &["-oo", "KEY=/dev/zero"]].concat();
    refuses(
        &host,
        &map(),
        &options,
        &[
            "key file /dev/zero cannot be read (it is longer than the 67108864 bytes of any key, record or plan)",
        ],
    );
}

#[test]
fn exactly_one_of_recipient_and_message_must_be_given() {
    let host = Host::new();
    refuses(&host, &map(), &KEY, &["neither RECIPIENT nor MESSAGE", "give exactly one"]);
    refuses_map(&host, &map(), &["-oo", "MESSAGE=00"], &["both RECIPIENT and MESSAGE", "give exactly one"]);
    refuses(&host, &map(), &[&KEY[..], &["-oo", "RECIPIENT= "]].concat(), &["RECIPIENT is empty"]);
}

#[test]
fn a_recipient_with_a_line_break_or_blanks_around_it_is_refused_and_a_decomposed_name_warned_of() {
    let host = Host::new();
    for (recipient, words) in [
        ("ACME\nGmbH", "RECIPIENT=ACME\\u{a}GmbH has a line break or another control character: remove it"),
        (" ACME", "RECIPIENT= ACME begins or ends with a blank: remove it"),
    ] {
        let option = format!("RECIPIENT={recipient}");
        refuses(&host, &map(), &[&KEY[..], &["-oo", &option]].concat(), &[words]);
        let written = host.create("written.gpkg", &map(), &["-dsco", &option]);
        assert!(written.code != Some(0) && written.stderr.contains(words), "{}", written.stderr);
        assert!(!host.path("written.gpkg").exists());
    }
    for (recipient, warning) in [
        ("Cafe\u{301}", "decomposed form of Unicode"),
        ("AC\u{200b}ME", "\"AC\\u{200b}ME\" has characters that nobody sees"),
        ("Caf\u{e9}", ""),
    ] {
        let (copy, source) = (format!("{}.gpkg", warning.len()), format!("MESHMARK:{}", map()));
        let option = format!("RECIPIENT={recipient}");
        let arguments = [&["-f", "GPKG", &copy, &source][..], &KEY, &["-oo", &option]].concat();
        let run = host.run("ogr2ogr", &arguments);
        let stderr = &run.succeeds().stderr;
        assert!(
            stderr.contains(warning) && stderr.contains("another recipient") != warning.is_empty(),
            "{stderr}"
        );
    }
}

#[test]
fn bad_hexadecimal_digits_are_shown() {
    let options = [&KEY[..], &["-oo", "MESSAGE=c0ffeg"]].concat();
    refuses(&Host::new(), &map(), &options, &["\"c0ffeg\"", "2 to 256 hexadecimal digits"]);
}

#[test]
fn a_code_that_does_not_fit_the_message_says_what_does() {
    let options = [&KEY[..], &["-oo", "CODE=LDPC", "-oo", "MESSAGE=0123456789abcdef"]].concat();
    refuses(&Host::new(), &map(), &options, &["exactly 128 bits, not 64", "32 hexadecimal digits"]);
    refuses_map(&Host::new(), &map(), &["-oo", "CODE=MORSE"], &["CODE=MORSE", "REPETITION or LDPC"]);
    let words = [
        "CODE=LDPC and CHIP_RATE=3 needs 768",
        "CHIP_RATE=2 or less, CODE=REPETITION and CHIP_RATE=4 or less, or",
    ];
    refuses_map(&Host::new(), &map(), &["-oo", "CHIP_RATE=3"], &words);
}

#[test]
fn numbers_that_are_none_or_out_of_range_are_named_with_what_is_legal() {
    let host = Host::new();
    for (option, words) in [
        ("AMPLITUDE=wide", ["AMPLITUDE=wide", "greater than 0"]),
        ("AMPLITUDE=-1", ["AMPLITUDE=-1", "greater than 0"]),
        ("AMPLITUDE=nan", ["AMPLITUDE=nan", "greater than 0"]),
        ("TOLERANCE=inf", ["TOLERANCE=inf", "at most 1000000"]),
        ("CHIP_RATE=2.5", ["CHIP_RATE=2.5", "whole number from 1 to 2048"]),
        ("PATCH_SIZE=3", ["PATCH_SIZE=3", "whole number from 16 to 4096"]),
        ("PRECISION=0", ["PRECISION=0", "greater than 0"]),
        ("PRECISION=5", ["PRECISION=5", "TOLERANCE=0.75"]),
    ] {
        refuses_map(&host, &map(), &["-oo", option], &words);
    }
}

#[test]
fn an_unknown_option_is_an_error_that_lists_the_known_ones() {
    let words = ["unknown option COLOUR", "KEY", "RECORD"];
    refuses_map(&Host::new(), &map(), &["-oo", "COLOUR=red"], &words);
}

#[test]
fn an_unknown_layer_is_named_with_those_there_are() {
    let words = ["\"streets\"", "buildings, landuse, roads"];
    refuses_map(&Host::new(), &map(), &["-oo", "LAYERS=roads,streets"], &words);
}

#[test]
fn a_map_that_is_too_small_is_told_which_patch_size_fits() {
    let words = ["338 distinct vertices", "PATCH_SIZE=480", "use PATCH_SIZE=338"];
    refuses_map(&Host::new(), &map(), &["-oo", "LAYERS=amenities"], &words);
}

#[test]
fn a_failure_right_after_the_threads_began_is_one_message_however_they_end() {
    let host = Host::new();
    write_points(&host, "few.geojson", (0..100).map(|i| format!("{i}, {}", i * i % 101)));
    let source = [
        "-ro",
        "-q",
        "MESHMARK:few.geojson",
        "-oo",
        "KEY=key.json",
        "-oo",
        "RECIPIENT=ACME",
        "-oo",
        "SRS=EPSG:3067",
    ];
    for _ in 0..40 {
        let run = host.run("ogrinfo", &source);
        assert!(run.errors().len() == 1 && run.errors()[0].contains("PATCH_SIZE"), "{}", run.stderr);
        assert!(!run.stderr.contains("TLS") && !run.stderr.contains("ErrorHandler"), "{}", run.stderr);
    }
}

#[test]
fn a_message_that_is_too_long_for_the_patches_is_told_what_fits() {
    let host = Host::new();
    let words =
        ["128 bits with CHIP_RATE=8", "use CHIP_RATE=4 or less, a shorter message, or a larger PATCH_SIZE"];
    refuses_map(&host, &map(), &["-oo", "CODE=REPETITION", "-oo", "CHIP_RATE=8"], &words);
    // The advice for small patches works.
    let words = [
        "CODE=LDPC and CHIP_RATE=1 needs 256",
        "use CODE=REPETITION and CHIP_RATE=1, or a larger PATCH_SIZE",
    ];
    refuses_map(&host, &map(), &["-oo", "CODE=LDPC", "-oo", "PATCH_SIZE=200"], &words);
    host.copy("kotka.gpkg", "map.gpkg");
    let advised = ["-oo", "PATCH_SIZE=200", "-oo", "CODE=REPETITION", "-oo", "CHIP_RATE=1"];
    host.mark("GPKG", "marked.gpkg", "map.gpkg", &advised).succeeds();
    let words = ["CODE=LDPC and CHIP_RATE=1 needs 256", "use a shorter message, or a larger PATCH_SIZE"];
    refuses_map(&Host::new(), &map(), &["-oo", "CODE=LDPC", "-oo", "PATCH_SIZE=100"], &words);
    let few = (0..200).map(|i| format!("{},{}", i % 20 * 31, i / 20 * 17 + i % 7));
    write_points(&host, "few.geojson", few);
    let options = ["-oo", "CODE=LDPC", "-oo", "PATCH_SIZE=100", "-oo", "SRS=EPSG:3067"];
    let words = ["use a shorter message, or mark more layers together"];
    refuses_map(&host, &host.path("few.geojson").display().to_string(), &options, &words);
}

/// Writes a GeoJSON map of points, in metres.
fn write_points(host: &Host, name: &str, points: impl Iterator<Item = String>) {
    let feature = |p: String| {
        format!(r#"{{"type":"Feature","properties":{{}},"geometry":{{"type":"Point","coordinates":[{p}]}}}}"#)
    };
    let features: Vec<String> = points.map(feature).collect();
    let crs = r#""crs":{"type":"name","properties":{"name":"urn:ogc:def:crs:EPSG::3067"}}"#;
    let text = format!(r#"{{"type":"FeatureCollection",{crs},"features":[{}]}}"#, features.join(","));
    fs::write(host.path(name), text).unwrap();
}

#[test]
fn vertices_on_one_line_or_in_one_place_have_no_mesh() {
    let host = Host::new();
    write_points(&host, "line.json", (0..600).map(|i| format!("{}, {}", 300000 + 3 * i, 6700000 + 2 * i)));
    refuses_map(&host, "line.json", &[], &["600 distinct vertices", "one straight line"]);
    write_points(&host, "place.json", (0..600).map(|_| "300000, 6700000".into()));
    refuses_map(&host, "place.json", &[], &["1 distinct vertex,", "at least 16"]);
}

#[test]
fn a_coordinate_that_is_no_number_is_found_by_layer_and_feature() {
    let host = Host::new();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        host.run("ogr2ogr", &["-f", "ESRI Shapefile", "roads.shp", &map(), "roads"]).succeeds();
        // This is the offset of the second point in the first line: after the headers of file and
        // record, the box, the counts and one part.
        let y = 100 + 8 + 4 + 32 + 8 + 4 + 16 + 8;
        let mut bytes = fs::read(host.path("roads.shp")).unwrap();
        bytes[y..y + 8].copy_from_slice(&bad.to_le_bytes());
        fs::write(host.path("roads.shp"), bytes).unwrap();
        let words = ["layer \"roads\"", "feature 0", "are not finite numbers"];
        refuses_map(&host, "roads.shp", &[], &words);
    }
}

#[test]
fn a_source_that_is_not_there_is_said_to_be_so() {
    let host = Host::new();
    refuses_map(&host, "nowhere.gpkg", &[], &["cannot be opened", "No such file"]);
    refuses_map(&host, "", &[], &["the source is missing"]);
}

#[test]
fn a_source_that_no_driver_knows_is_said_to_be_so() {
    let host = Host::new();
    fs::write(host.path("letter.txt"), "Dear Sir or Madam").unwrap();
    refuses_map(&host, "letter.txt", &[], &["cannot be opened", "not recognized"]);
}

#[test]
fn a_truncated_source_is_refused_in_every_format() {
    let host = Host::new();
    for (format, name, words) in [
        ("GPKG", "map.gpkg", "cannot be opened"),
        ("ESRI Shapefile", "map.shp", "layer \"map\" cannot be read to its end"),
        ("FlatGeobuf", "map.fgb", "layer \"buildings\" cannot be read to its end"),
        ("GeoJSON", "map.geojson", "cannot be opened"),
        ("GML", "map.gml", "layer \"buildings\" cannot be read to its end"),
    ] {
        host.run("ogr2ogr", &["-f", format, name, &map(), "buildings"]);
        let whole = fs::read(host.path(name)).unwrap();
        for percent in [30, 60, 95] {
            fs::write(host.path(name), &whole[..whole.len() * percent / 100]).unwrap();
            refuses_map(&host, name, &["-oo", "PATCH_SIZE=300"], &[words]);
        }
    }
}

#[test]
fn a_raster_is_no_source() {
    let host = Host::new();
    let make = ["-of", "GTiff", "-outsize", "20", "20", "-burn", "1", "image.tif"];
    host.run("gdal_create", &make).succeeds();
    refuses_map(&host, "image.tif", &[], &["raster", "vector dataset"]);
}

#[test]
fn a_table_without_geometry_has_too_few_vertices() {
    let host = Host::new();
    fs::write(host.path("table.csv"), "a,b\n1,2\n").unwrap();
    refuses_map(&host, "table.csv", &[], &["has no vertices"]);
}

#[test]
fn a_marked_view_is_not_marked_again() {
    refuses_map(&Host::new(), &format!("MESHMARK:{}", map()), &[], &["marked view already"]);
}

#[test]
fn layers_of_two_crs_are_refused_by_name() {
    let host = Host::new();
    host.copy("helsinki.gpkg", "map.gpkg");
    let add = ["-update", "map.gpkg", "map.gpkg", "roads", "-nln", "strade", "-t_srs", "EPSG:3857"];
    host.run("ogr2ogr", &add).succeeds();
    let words = ["\"buildings\" (EPSG:3067)", "\"strade\" (EPSG:3857)", "LAYERS"];
    refuses_map(&host, "map.gpkg", &[], &words);
}

#[test]
fn degrees_without_a_crs_and_contradicting_srs_are_refused() {
    let host = Host::new();
    let degrees = fixture("europe_deg.gpkg").display().to_string();
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", "bare.shp", &degrees]).succeeds();
    fs::remove_file(host.path("bare.prj")).unwrap();
    refuses_map(&host, "bare.shp", &[], &["no CRS", "SRS=EPSG:4326"]);
    refuses_map(&host, "bare.shp", &["-oo", "SRS=EPSG:nowhere"], &["SRS=EPSG:nowhere", "PROJ"]);
    refuses_map(&host, &map(), &["-oo", "SRS=EPSG:4326"], &["EPSG:3067", "leave SRS out"]);
}

#[test]
fn the_view_cannot_be_opened_for_update() {
    let host = Host::new();
    let before = host.files();
    let view = format!("MESHMARK:{}", map());
    let run = host.run("ogr2ogr", &["-update", &view, &map(), "-nln", "new"]);
    assert_ne!(run.code, Some(0));
    assert!(run.errors()[0].contains("cannot be opened for update"), "{}", run.stderr);
    assert!(host.files() == before);
}

// --- records -------------------------------------------------------------------------------------

#[test]
fn another_record_is_never_overwritten() {
    let host = Host::new();
    fs::write(host.path("acme.json"), "something else").unwrap();
    refuses_map(&host, &map(), &["-oo", "RECORD=acme.json"], &["RECORD=acme.json", "move it away"]);
    host.mark("GPKG", "a.gpkg", &map(), &["-oo", "RECORD=a.json"]).succeeds();
    let words = ["RECORD=a.json", "has other content"];
    refuses_map(&host, &map(), &["-oo", "RECORD=a.json", "-oo", "AMPLITUDE=0.2"], &words);
}

#[test]
fn a_record_is_neither_the_key_nor_the_source_by_any_name() {
    let host = Host::new();
    host.copy("helsinki.gpkg", "map.gpkg");
    std::os::unix::fs::symlink("key.json", host.path("alias.json")).unwrap();
    refuses_map(&host, "map.gpkg", &["-oo", "RECORD=./key.json"], &["RECORD=./key.json", "as the key"]);
    refuses_map(&host, "map.gpkg", &["-oo", "RECORD=alias.json"], &["RECORD=alias.json", "as the key"]);
    refuses_map(&host, "map.gpkg", &["-oo", "RECORD=map.gpkg"], &["RECORD=map.gpkg", "as the source"]);
}

#[test]
fn a_record_is_not_the_output_by_any_name() {
    let host = Host::new();
    for name in ["out.gpkg", "./out.gpkg"] {
        let option = format!("RECORD={name}");
        refuses_map(&host, &map(), &["-oo", &option], &[&option, "same file as the output"]);
    }
}

#[test]
fn a_record_needs_a_folder_that_can_be_written() {
    let host = Host::new();
    refuses_map(
        &host,
        &map(),
        &["-oo", "RECORD=no/where.json"],
        &["RECORD=no/where.json", "no is no folder"],
    );
    refuses_map(&host, &map(), &["-oo", "RECORD=/"], &["RECORD=/", "folder"]);
    refuses_map(
        &host,
        &map(),
        &["-oo", "RECORD=/proc/acme.json"],
        &["RECORD=/proc/acme.json", "cannot be written"],
    );
}

#[test]
fn a_record_is_not_lost_in_a_link_to_nowhere() {
    let host = Host::new();
    std::os::unix::fs::symlink("nowhere.json", host.path("link.json")).unwrap();
    refuses_map(&host, &map(), &["-oo", "RECORD=link.json"], &["RECORD=link.json", "does not exist"]);
}

#[test]
fn a_folder_of_shapefiles_is_not_written_into_itself() {
    let host = Host::new();
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", "shp", fixture("kotka.gpkg").to_str().unwrap()]).succeeds();
    let files = || {
        let entries = fs::read_dir(host.path("shp")).unwrap().map(|entry| entry.unwrap().path());
        let mut files: Vec<_> = entries.map(|path| (path.clone(), fs::read(path).unwrap())).collect();
        files.sort();
        files
    };
    let before = files();
    for source in ["shp", "shp/buildings.shp"] {
        let run = host.mark("ESRI Shapefile", "shp", source, &[]);
        assert_eq!(run.code, Some(1), "{}", run.stderr);
        assert!(run.stderr.contains("the output shp is the source itself"), "{}", run.stderr);
        assert!(files() == before, "{source}");
    }
}

#[test]
fn a_failed_marking_writes_no_record() {
    let options = ["-oo", "LAYERS=amenities", "-oo", "RECORD=acme.json"];
    refuses_map(&Host::new(), &map(), &options, &["338 distinct vertices"]);
}

#[test]
fn a_record_can_be_read_by_whom_the_umask_lets() {
    let host = Host::new();
    host.mark("GPKG", "marked.gpkg", &map(), &["-oo", "RECORD=acme.json"]).succeeds();
    File::create(host.path("plain.txt")).unwrap();
    let mode = |name: &str| host.path(name).metadata().unwrap().permissions().mode();
    assert_eq!(mode("acme.json"), mode("plain.txt"));
}

// --- writing onto the source ---------------------------------------------------------------------

/// Writes a map in a format, lets ogr2ogr write the marked map onto it, and returns the message.
fn write_onto_source(host: &Host, format: &str, name: &str, mode: &[&str], target: &str) -> String {
    host.run("ogr2ogr", &["-f", format, name, &map(), "buildings"]).succeeds();
    let run = host.mark(format, target, name, mode);
    assert!(run.code.is_some_and(|code| code != 0), "{format} {mode:?}: {}", run.stderr);
    run.stderr
}

#[test]
fn the_source_survives_being_named_as_the_output() {
    for (format, name) in [
        ("GPKG", "map.gpkg"),
        ("ESRI Shapefile", "map.shp"),
        ("GeoJSON", "map.geojson"),
        ("FlatGeobuf", "map.fgb"),
        ("SQLite", "map.sqlite"),
    ] {
        for mode in [&[][..], &["-overwrite"], &["-append"], &["-update"]] {
            let (host, expected) = (Host::new(), Host::new());
            let said = write_onto_source(&host, format, name, mode, name);
            assert!(said.contains("is the source itself"), "{format} {mode:?}: {said}");
            expected.run("ogr2ogr", &["-f", format, name, &map(), "buildings"]).succeeds();
            assert_same_files(&host, &expected, format);
        }
    }
}

/// Asserts that the files are the same. GeoPackages hold the time of their writing, so the length
/// of files is compared instead of their bytes.
fn assert_same_files(a: &Host, b: &Host, what: &str) {
    let names =
        |host: &Host| host.files().into_iter().map(|(name, bytes)| (name, bytes.len())).collect::<Vec<_>>();
    assert_eq!(names(a), names(b), "{what}");
}

#[test]
fn another_name_of_the_source_does_not_help() {
    let host = Host::new();
    fs::create_dir(host.path("sub")).unwrap();
    std::os::unix::fs::symlink("map.gpkg", host.path("link.gpkg")).unwrap();
    for target in ["./map.gpkg", "sub/../map.gpkg", "link.gpkg"] {
        for mode in [&[][..], &["-overwrite"]] {
            if !host.path("map.gpkg").exists() {
                host.copy("helsinki.gpkg", "map.gpkg");
            }
            let before = host.files();
            let run = host.mark("GPKG", target, "map.gpkg", mode);
            assert_ne!(run.code, Some(0));
            assert!(host.files() == before, "{target} {mode:?}");
        }
    }
}

#[test]
fn the_folder_of_a_shapefile_cannot_be_updated_while_it_is_read() {
    let host = Host::new();
    fs::create_dir(host.path("folder")).unwrap();
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", "folder/map.shp", &map(), "buildings"]).succeeds();
    let shapefile = fs::read(host.path("folder/map.shp")).unwrap();
    for mode in ["-overwrite", "-append", "-update"] {
        let run = host.mark("ESRI Shapefile", "folder", "folder/map.shp", &[mode]);
        assert_ne!(run.code, Some(0), "{mode}");
        assert!(fs::read(host.path("folder/map.shp")).unwrap() == shapefile, "{mode}");
    }
}

fn in_path(program: &str) -> PathBuf {
    let folders = std::env::var_os("PATH").unwrap();
    std::env::split_paths(&folders).map(|folder| folder.join(program)).find(|path| path.exists()).unwrap()
}

#[test]
fn a_writer_that_truncates_the_source_all_the_same_leaves_a_saved_copy() {
    for (format, name) in [("KML", "map.kml"), ("GML", "map.gml"), ("MapInfo File", "map.tab")] {
        let host = Host::new();
        host.run("ogr2ogr", &["-f", format, name, &map(), "buildings"]);
        let original = fs::read(host.path(name)).unwrap();
        // The driver reads the command line of ogr2ogr alone; this is another program that
        // writes.
        fs::copy(in_path("ogr2ogr"), host.path("export")).unwrap();
        let source = format!("MESHMARK:{name}");
        let options = ["-oo", "KEY=key.json", "-oo", "RECIPIENT=B"];
        let arguments = [&["-f", format, name, &source][..], &options].concat();
        let run = host.run(host.path("export").to_str().unwrap(), &arguments);
        assert_ne!(run.code, Some(0), "{format}");
        assert!(run.stderr.contains(&format!("{name}.saved")), "{format}: {}", run.stderr);
        assert!(fs::read(host.path(&format!("{name}.saved"))).unwrap() == original, "{format}");
    }
}

#[test]
fn other_outputs_may_still_be_overwritten() {
    let host = Host::new();
    host.copy("kotka.gpkg", "out.gpkg");
    host.mark("GPKG", "out.gpkg", &map(), &["-overwrite"]).succeeds();
    host.mark("GPKG", "out.gpkg", &map(), &[]).succeeds();
    assert!(!Path::new(&host.path("out.gpkg.saved")).exists());
}
