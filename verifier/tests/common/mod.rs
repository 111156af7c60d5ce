//! The command as the tests of suspects run it.
#![allow(dead_code)] // each test uses a part

pub mod authority;
pub mod deposits;

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Child, Command, Output},
    sync::OnceLock,
    thread::sleep,
    time::Duration,
};
use tempfile::TempDir;

pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures").join(name)
}

/// A copy of the key of the test vectors that its owner alone can read, as a check-out of the fixtures
/// gives others rights, which the command warns of.
pub fn key() -> PathBuf {
    static KEY: OnceLock<PathBuf> = OnceLock::new();
    let copy = || {
        let name = format!("key_{}.json", std::process::id());
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        fs::copy(fixture("vectors/key.json"), &path).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        path
    };
    KEY.get_or_init(copy).clone()
}

/// `meshmark verify` of a suspect against the test vectors.
pub fn command(suspect: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    command
        .env("GDAL_DRIVER_PATH", "none")
        .args(["verify", "--key"])
        .arg(key())
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

/// Waits until a command runs its child, and returns the number of that process.
pub fn child_of(parent: &Child) -> i32 {
    let children = format!("/proc/{0}/task/{0}/children", parent.id());
    loop {
        match fs::read_to_string(&children).expect("the command runs").trim().parse() {
            Ok(child) => return child,
            Err(_) => sleep(Duration::from_millis(5)),
        }
    }
}

pub fn write(folder: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    path
}
