//! Bundles of a case: made by one, made again by another with the same inputs, and found out where
//! something was changed.

mod common;

use common::{
    authority::{Authority, Certificate},
    deposits::Vendor,
    ended, fixture,
};
use serde_json::Value;
use std::{
    fs::{self, File},
    io::Read,
    path::Path,
    process::Command,
};
use tempfile::TempDir;
use zip::ZipArchive;

type Change<'a> = &'a dyn Fn(&Auditor);

/// What the one who makes a bundle hands to the one who makes it again.
const INPUTS: [&str; 4] = ["key.json", "map.gpkg", "records/acme.json", "suspect.gpkg"];
const PUBLIC: [&str; 5] = ["authorities.pem", "case.toml", "key.public.pem", "series.deposit", "series.tsr"];

const VERIFY: [&str; 17] = [
    "verify",
    "--key",
    "key.json",
    "--reference",
    "map.gpkg",
    "--case",
    "case.toml",
    "--deposit",
    "series.deposit",
    "--public-key",
    "key.public.pem",
    "--time-stamp",
    "series.tsr",
    "--authorities",
    "authorities.pem",
    "--bundle",
    "case.zip",
];

/// A vendor whose deposit is stamped, and a leak.
fn case() -> Vendor {
    let (vendor, authority) = (Vendor::new(), Authority::new(Certificate::Right));
    authority.answer(&vendor.path("series.tsq"), &vendor.path("series.tsr"));
    fs::copy(authority.root(), vendor.path("authorities.pem")).unwrap();
    fs::copy(fixture("vectors/fingerprint/marked.gpkg"), vendor.path("suspect.gpkg")).unwrap();
    fs::write(vendor.path("case.toml"), "number = \"7/26\"\n").unwrap();
    vendor
}

fn bundle(vendor: &Vendor, more: &[&str]) -> (Option<i32>, String) {
    vendor.run(&[&VERIFY[..], more, &["suspect.gpkg"]].concat())
}

fn files(path: &Path) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(File::open(path).unwrap()).unwrap();
    let file = |number: usize, archive: &mut ZipArchive<File>| {
        let mut file = archive.by_index(number).unwrap();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).unwrap();
        (file.name().unwrap().into_owned(), bytes)
    };
    (0..archive.len()).map(|number| file(number, &mut archive)).collect()
}

/// An auditor on another machine, who has unzipped the bundle and received the inputs.
struct Auditor(TempDir);

impl Auditor {
    fn new(vendor: &Vendor) -> Self {
        let auditor = Auditor(tempfile::tempdir().unwrap());
        fs::create_dir(auditor.0.path().join("records")).unwrap();
        for name in INPUTS {
            fs::copy(vendor.path(name), auditor.0.path().join(name)).unwrap();
        }
        fs::copy(vendor.path("case.zip"), auditor.0.path().join("case.zip")).unwrap();
        for (name, bytes) in files(&vendor.path("case.zip")) {
            fs::write(auditor.0.path().join(name), bytes).unwrap();
        }
        auditor
    }

    fn repeat(&self) -> (Option<i32>, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
        command.env("GDAL_DRIVER_PATH", "none").current_dir(self.0.path()).args(["repeat", "case.zip"]);
        ended(command.output().unwrap())
    }

    fn change(&self, name: &str, from: &str, to: &str) {
        let path = self.0.path().join(name);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from));
        fs::write(path, text.replacen(from, to, 1)).unwrap();
    }
}

#[test]
fn an_auditor_on_a_clean_machine_makes_the_bundle_again_and_finds_every_change() {
    let vendor = case();
    let (code, text) = bundle(&vendor, &["--record", "records/acme.json"]);
    assert_eq!(code, Some(0), "{text}");
    let made = files(&vendor.path("case.zip"));
    let names: Vec<&str> = made.iter().map(|(name, _)| name.as_str()).collect();
    let mut expected = [&PUBLIC[..], &["manifest.json", "report.html", "report.json"]].concat();
    expected.sort_unstable();
    assert_eq!(names, expected);
    let secret = fs::read_to_string(vendor.path("key.json")).unwrap();
    let secret = serde_json::from_str::<Value>(&secret).unwrap()["secret"].as_str().unwrap().to_string();
    assert!(made.iter().all(|(_, bytes)| !String::from_utf8_lossy(bytes).contains(&secret)));

    let auditor = Auditor::new(&vendor);
    let (code, text) = auditor.repeat();
    assert!(code == Some(0) && text.contains("8 files, byte by byte"), "{text}");

    let changes: [(&str, Change); 7] = [
        ("key.json is another one", &|auditor| auditor.change("key.json", "{", "{ ")),
        ("records/acme.json is another one", &|auditor| auditor.change("records/acme.json", "{", "{ ")),
        ("map.gpkg is another one", &|auditor| {
            fs::copy(fixture("helsinki.gpkg"), auditor.0.path().join("map.gpkg")).unwrap();
        }),
        ("suspect.gpkg is missing", &|auditor| {
            fs::remove_file(auditor.0.path().join("suspect.gpkg")).unwrap();
        }),
        ("series.tsr is missing, which the bundle holds", &|auditor| {
            fs::remove_file(auditor.0.path().join("series.tsr")).unwrap();
        }),
        ("case.toml is another one", &|auditor| auditor.change("case.toml", "7/26", "8/26")),
        ("series.deposit is another one", &|auditor| auditor.change("series.deposit", "{", "{ ")),
    ];
    for (words, change) in changes {
        let auditor = Auditor::new(&vendor);
        change(&auditor);
        let (code, text) = auditor.repeat();
        assert!(code == Some(4) && text.contains(words), "{words}: {code:?} {text}");
    }
}

#[test]
fn a_bundle_whose_report_was_changed_is_not_made_again() {
    let vendor = case();
    bundle(&vendor, &["--record", "records/acme.json"]);
    let auditor = Auditor::new(&vendor);
    let path = auditor.0.path().join("case.zip");
    // Bytes before and after an archive, where another program may find other files.
    let bytes = fs::read(&path).unwrap();
    for around in [[&b"PK"[..], &bytes], [&bytes, b"PK"]] {
        fs::write(&path, around.concat()).unwrap();
        let (code, text) = auditor.repeat();
        assert!(code == Some(4) && text.contains("holds more than its files"), "{code:?} {text}");
    }
    fs::write(&path, bytes).unwrap();
    let changed = files(&path).into_iter().map(|(name, bytes)| match name.as_str() {
        "report.html" => {
            (name, String::from_utf8(bytes).unwrap().replace("ACME GmbH", "Innocent Ltd").into_bytes())
        }
        _ => (name, bytes),
    });
    let mut archive = zip::ZipWriter::new(File::create(&path).unwrap());
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in changed.collect::<Vec<_>>() {
        archive.start_file(name, stored).unwrap();
        std::io::Write::write_all(&mut archive, &bytes).unwrap();
    }
    archive.finish().unwrap();
    let (code, text) = auditor.repeat();
    assert!(code == Some(4) && text.contains("report.html is another one"), "{text}");
    fs::write(&path, "no archive").unwrap();
    let (code, text) = auditor.repeat();
    assert!(code == Some(5) && text.contains("is no bundle of a case"), "{text}");
}

#[test]
fn equal_inputs_make_equal_bundles_and_many_records_disclose_no_other_recipient() {
    let vendor = case();
    let records = ["--records", "records"];
    assert_eq!(bundle(&vendor, &records).0, Some(0));
    fs::rename(vendor.path("case.zip"), vendor.path("first.zip")).unwrap();
    assert_eq!(bundle(&vendor, &records).0, Some(0));
    assert!(fs::read(vendor.path("first.zip")).unwrap() == fs::read(vendor.path("case.zip")).unwrap());
    for (name, bytes) in files(&vendor.path("case.zip")) {
        assert!(!String::from_utf8_lossy(&bytes).contains("message.json"), "{name} names another record");
    }
}

#[test]
fn a_bundle_that_nobody_could_make_again_is_refused_and_nothing_is_written() {
    let vendor = case();
    let outside = fixture("vectors/fingerprint/record.json").display().to_string();
    for (more, code, words) in [
        (["--record", outside.as_str()], 2, "does not lie in the current folder"),
        (["--record", "records/none.json"], 2, "is no local file"),
    ] {
        let (found, text) = bundle(&vendor, &more);
        assert!(found == Some(code) && text.contains(words), "{found:?} {text}");
    }
    fs::rename(vendor.path("case.toml"), vendor.path("manifest.json")).unwrap();
    let (code, text) = vendor.run(&[
        "verify",
        "--key",
        "key.json",
        "--reference",
        "map.gpkg",
        "--case",
        "manifest.json",
        "--bundle",
        "case.zip",
        "suspect.gpkg",
    ]);
    assert!(code == Some(2) && text.contains("has a file of this name itself"), "{text}");
    assert!(!vendor.path("case.zip").exists());
    // An examination that fails leaves none either.
    vendor.change_statement("\"vertices\":3833", "\"vertices\":3834");
    fs::rename(vendor.path("manifest.json"), vendor.path("case.toml")).unwrap();
    assert_eq!(bundle(&vendor, &["--record", "records/acme.json"]).0, Some(4));
    assert!(!vendor.path("case.zip").exists());
}
