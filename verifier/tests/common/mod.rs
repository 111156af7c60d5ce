//! The command as the tests of suspects run it.
#![allow(dead_code)] // each test uses a part

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};
use tempfile::TempDir;

pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures").join(name)
}

/// `meshmark verify` of a suspect against the test vectors.
pub fn command(suspect: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    command
        .env("GDAL_DRIVER_PATH", "none")
        .args(["verify", "--key"])
        .arg(fixture("vectors/key.json"))
        .arg("--record")
        .arg(fixture("vectors/record.json"))
        .arg("--reference")
        .arg(fixture("kotka.gpkg"))
        .arg(suspect);
    command
}

/// The exit code of a command, and what it prints.
pub fn ended(output: Output) -> (Option<i32>, String) {
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (output.status.code(), text.concat())
}

/// What `meshmark verify` says of a suspect against the test vectors.
pub fn verify(suspect: &Path) -> (Option<i32>, String) {
    ended(command(suspect).output().unwrap())
}

/// Asserts an exit code and a part of the text.
pub fn assert_answer(suspect: &Path, code: i32, part: &str) {
    let (found, text) = verify(suspect);
    assert!(found == Some(code) && text.contains(part), "{}: {found:?}\n{text}", suspect.display());
}

pub fn write(folder: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    path
}
