//! A vendor who has deposited key, reference and records.

use super::{ended, fixture, key};
use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use serde_json::Value;
use std::{fs, path::PathBuf, process::Command};
use tempfile::TempDir;

/// A vendor's folder: the key of the test vectors with a signing key, the reference, two records, and
/// the deposit of all of them.
pub struct Vendor(pub TempDir);

impl Vendor {
    pub fn new() -> Self {
        let vendor = Vendor(tempfile::tempdir().unwrap());
        fs::copy(key(), vendor.path("key.json")).unwrap();
        fs::copy(fixture("kotka.gpkg"), vendor.path("map.gpkg")).unwrap();
        fs::create_dir(vendor.path("records")).unwrap();
        fs::copy(fixture("vectors/record.json"), vendor.path("records/message.json")).unwrap();
        fs::copy(fixture("vectors/fingerprint/record.json"), vendor.path("records/acme.json")).unwrap();
        assert_eq!(vendor.run(&["keygen", "--signing-key-only", "key.json"]).0, Some(0));
        let (code, text) = vendor.deposit_and("series.deposit", &["--time-stamp-request", "series.tsq"]);
        assert!(code == Some(0) && text.starts_with(&deposited("series.deposit")), "{text}");
        vendor
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn run(&self, arguments: &[&str]) -> (Option<i32>, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
        command.env("GDAL_DRIVER_PATH", "none").current_dir(self.0.path()).args(arguments);
        ended(command.output().unwrap())
    }

    pub fn deposit(&self, output: &str) -> (Option<i32>, String) {
        self.deposit_and(output, &[])
    }

    pub fn deposit_and(&self, output: &str, more: &[&str]) -> (Option<i32>, String) {
        let arguments =
            ["deposit", "--key", "key.json", "--reference", "map.gpkg", "--records", "records", "-o", output];
        self.run(&[&arguments[..], more].concat())
    }

    pub fn openssl(&self, arguments: &str) -> String {
        let mut command = Command::new("openssl");
        command.current_dir(self.0.path()).args(arguments.split(' '));
        let (code, text) = ended(command.output().unwrap());
        assert_eq!(code, Some(0), "{text}");
        text
    }

    /// `deposit --verify` with everything that was deposited.
    pub fn verify(&self) -> (Option<i32>, String) {
        self.run(&[
            "deposit",
            "--verify",
            "series.deposit",
            "--public-key",
            "key.public.pem",
            "--key",
            "key.json",
            "--reference",
            "map.gpkg",
            "--records",
            "records",
        ])
    }

    pub fn statement(&self) -> Value {
        let envelope: Value =
            serde_json::from_slice(&fs::read(self.path("series.deposit")).unwrap()).unwrap();
        let payload = BASE64.decode(envelope["payload"].as_str().unwrap()).unwrap();
        serde_json::from_slice(&payload).unwrap()
    }

    pub fn replace_map(&self, other: &str) {
        fs::copy(fixture(other), self.path("map.gpkg")).unwrap();
    }

    /// Changes the text of a file.
    pub fn change(&self, name: &str, from: &str, to: &str) {
        let text = fs::read_to_string(self.path(name)).unwrap();
        assert!(text.contains(from), "{from} is not in {name}");
        fs::write(self.path(name), text.replacen(from, to, 1)).unwrap();
    }

    /// Changes the statement and leaves the signature as it was.
    pub fn change_statement(&self, from: &str, to: &str) {
        let mut envelope: Value =
            serde_json::from_slice(&fs::read(self.path("series.deposit")).unwrap()).unwrap();
        let payload = BASE64.decode(envelope["payload"].as_str().unwrap()).unwrap();
        let text = String::from_utf8(payload).unwrap();
        assert!(text.contains(from), "{from} is not in {text}");
        envelope["payload"] = BASE64.encode(text.replacen(from, to, 1)).into();
        fs::write(self.path("series.deposit"), envelope.to_string()).unwrap();
    }
}

/// What is printed of a deposit.
pub fn deposited(output: &str) -> String {
    format!("deposit of a key, 1 reference, 2 records and 1 recipient written to {output}\n")
}
