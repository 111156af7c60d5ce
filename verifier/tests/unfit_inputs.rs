//! Inputs that are not what they seem: pipes that nobody writes to, files that cannot be read, a
//! reference that is named twice or has lost a file.

mod common;

use common::{deposits::Vendor, ended, fixture};
use gdal::{
    Dataset, DriverManager,
    vector::{LayerAccess, LayerOptions, OGRwkbGeometryType},
};
use serde_json::Value;
use std::{fs, process::Command};

const SUSPECT: &str = "vectors/fingerprint/marked.gpkg";

fn vendor() -> Vendor {
    let vendor = Vendor::new();
    fs::copy(fixture(SUSPECT), vendor.path("suspect.gpkg")).unwrap();
    vendor
}

/// A verification in which one argument is another one.
fn verify_with(vendor: &Vendor, instead: &str, of: &str) -> (Option<i32>, String) {
    let arguments =
        ["verify", "--key", "key.json", "--reference", "map.gpkg", "--record", "records/acme.json"];
    let arguments =
        arguments.iter().chain(&["suspect.gpkg"]).map(|word| if *word == of { instead } else { word });
    vendor.run(&arguments.collect::<Vec<_>>())
}

#[test]
fn a_pipe_that_nobody_writes_to_is_refused_wherever_it_is_given() {
    let vendor = vendor();
    let (code, text) = ended(Command::new("mkfifo").arg(vendor.path("pipe")).output().unwrap());
    assert_eq!(code, Some(0), "{text}");
    for of in ["key.json", "map.gpkg", "records/acme.json", "suspect.gpkg"] {
        let (code, text) = verify_with(&vendor, "pipe", of);
        assert!(code == Some(5) && text.contains("pipe"), "{of}: {code:?} {text}");
    }
    let distribute = ["distribute", "--key", "key.json", "--recipients", "pipe", "--output-dir", "out"];
    let deposit =
        ["deposit", "--key", "key.json", "--reference", "pipe", "--records", "records", "-o", "new"];
    for arguments in [&[&distribute[..], &["map.gpkg"]].concat(), &deposit.to_vec()] {
        let (code, text) = vendor.run(arguments);
        assert!(code == Some(5) && text.contains("no plain file"), "{arguments:?}: {code:?} {text}");
    }
    let (code, text) = vendor.run(&["compare", "map.gpkg", "pipe"]);
    assert!(code == Some(5) && text.contains("no plain file"), "{code:?} {text}");
    let (code, text) = vendor.run(&["deposit", "--verify", "pipe"]);
    assert!(code == Some(5) && text.contains("no plain file"), "{code:?} {text}");
}

#[test]
fn a_link_to_nothing_and_a_pipe_among_records_are_named() {
    let vendor = vendor();
    let path = |name: &str| vendor.path(&format!("records/{name}"));
    std::os::unix::fs::symlink("nowhere.json", path("lost.json")).unwrap();
    let (code, text) = ended(Command::new("mkfifo").arg(path("pipe.json")).output().unwrap());
    assert_eq!(code, Some(0), "{text}");
    let verify = ["verify", "--key", "key.json", "--reference", "map.gpkg", "--records", "records"];
    let (code, text) = vendor.run(&[&verify[..], &["suspect.gpkg"]].concat());
    assert_eq!(code, Some(0), "{text}");
    for name in ["lost.json", "pipe.json"] {
        assert!(text.contains(&format!("{name} is skipped: it cannot be read")), "{text}");
    }
    let (code, text) = vendor.deposit_and("new.deposit", &[]);
    assert!(code == Some(5) && text.contains("lost.json cannot be read"), "{code:?} {text}");
    let (code, text) = vendor.run(&[&verify[..], &["--bundle", "case.zip", "suspect.gpkg"]].concat());
    assert!(
        code == Some(5) && text.contains(".json") && !vendor.path("case.zip").exists(),
        "{code:?} {text}"
    );
}

#[test]
fn a_key_or_a_record_that_is_not_there_is_an_unreadable_input() {
    let vendor = vendor();
    for of in ["key.json", "map.gpkg", "records/acme.json", "suspect.gpkg"] {
        let (code, text) = verify_with(&vendor, "missing", of);
        assert!(code == Some(5) && text.contains("missing"), "{of}: {code:?} {text}");
    }
}

#[test]
fn a_reference_that_is_named_twice_is_deposited_once() {
    let vendor = vendor();
    let (code, text) = vendor.deposit_and("twice.deposit", &["--reference", "./map.gpkg"]);
    assert!(code == Some(0) && text.contains("a key, 1 reference, "), "{text}");
    fs::rename(vendor.path("twice.deposit"), vendor.path("series.deposit")).unwrap();
    let statement: Value = vendor.statement();
    assert_eq!(statement["subject"].as_array().unwrap().len(), 1);
}

#[test]
fn the_command_that_sends_a_request_never_writes_over_it() {
    let vendor = vendor();
    let (code, text) = vendor.deposit_and("new.deposit", &["--time-stamp-request", "new.tsr"]);
    assert!(code == Some(0) && text.contains("--data-binary @new.tsr -o new.tsr.tsr ADDRESS"), "{text}");
}

#[test]
fn a_shapefile_that_has_lost_its_table_is_another_file() {
    let vendor = vendor();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let layer = source.layer(0).unwrap();
    let shapes = DriverManager::get_driver_by_name("ESRI Shapefile").unwrap();
    let srs = layer.spatial_ref();
    let mut copy = shapes.create_vector_only(vendor.path("map.shp")).unwrap();
    let options = LayerOptions {
        name: "map",
        srs: srs.as_ref(),
        ty: OGRwkbGeometryType::wkbMultiPolygon,
        options: None,
    };
    {
        let mut new = copy.create_layer(options).unwrap();
        let mut layer = source.layer(0).unwrap();
        for feature in layer.features() {
            new.create_feature(feature.geometry().unwrap().clone()).unwrap();
        }
    }
    copy.close().unwrap();
    let (code, text) = vendor.deposit_and("shapes.deposit", &["--reference", "map.shp"]);
    assert_eq!(code, Some(0), "{text}");
    let verify = || vendor.run(&["deposit", "--verify", "shapes.deposit", "--reference", "map.shp"]);
    let (code, text) = verify();
    assert!(code == Some(0) && text.contains("fixed:        file of the reference map.shp\n"), "{text}");
    fs::remove_file(vendor.path("map.dbf")).unwrap();
    let (code, text) = verify();
    assert!(code == Some(0) && text.contains("not fixed:    file of the reference map.shp"), "{text}");
}

#[test]
fn a_passphrase_is_never_cut() {
    let vendor = vendor();
    fs::write(vendor.path("long"), "x".repeat(4096) + "\n").unwrap();
    fs::write(vendor.path("longer"), "x".repeat(4097) + "\n").unwrap();
    let (code, text) = vendor.run(&["keygen", "--passphrase-file", "longer", "new.json"]);
    assert!(code == Some(2) && text.contains("more than 4096 bytes"), "{code:?} {text}");
    assert!(!vendor.path("new.json").exists());
    let (code, text) = vendor.run(&["keygen", "--passphrase-file", "long", "new.json"]);
    assert_eq!(code, Some(0), "{text}");
}
