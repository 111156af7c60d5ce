//! Keys that a passphrase protects.

mod common;

use common::{deposits::Vendor, fixture};
use std::{
    fs,
    io::{Read, Write},
    os::unix::fs::PermissionsExt,
    process::{Command, Stdio},
    thread,
    time::Duration,
};

/// A vendor whose keys the passphrase in the file `passphrase` protects; no unprotected key is left.
fn vendor() -> Vendor {
    let vendor = Vendor::new();
    for (name, text) in
        [("passphrase", "correct horse\nsecond line\n"), ("wrong", "battery staple\n"), ("empty", "\n")]
    {
        fs::write(vendor.path(name), text).unwrap();
        fs::set_permissions(vendor.path(name), fs::Permissions::from_mode(0o600)).unwrap();
    }
    let (code, text) =
        vendor.run(&["keygen", "--passphrase", "--passphrase-file", "passphrase", "protected.json"]);
    assert!(code == Some(0), "{text}");
    vendor
}

#[test]
fn a_protected_key_is_opened_by_its_passphrase_alone() {
    let vendor = vendor();
    for name in ["protected.json", "protected.signing.pem"] {
        let text = fs::read_to_string(vendor.path(name)).unwrap();
        assert!(text.starts_with("-----BEGIN AGE ENCRYPTED FILE-----\n"), "{text}");
        assert_eq!(fs::metadata(vendor.path(name)).unwrap().permissions().mode() & 0o777, 0o600);
    }
    let distribute = |passphrase: &[&str]| {
        fs::write(vendor.path("list.csv"), "recipient\nACME GmbH\n").unwrap();
        let arguments = [
            "distribute",
            "--key",
            "protected.json",
            "--recipients",
            "list.csv",
            "--output-dir",
            "copies",
            "map.gpkg",
        ];
        vendor.run(&[&arguments[..], passphrase].concat())
    };
    for (file, words) in
        [("wrong", "the passphrase does not open protected.json"), ("empty", "is empty"), ("none", "none")]
    {
        let (code, text) = distribute(&["--passphrase-file", file]);
        assert!(code == Some(2) && text.contains(words), "{code:?} {text}");
    }
    let (code, text) = distribute(&["--passphrase-file", "passphrase"]);
    assert!(code == Some(0), "{text}");
    let deposit = [
        "deposit",
        "--key",
        "protected.json",
        "--reference",
        "map.gpkg",
        "--records",
        "copies",
        "-o",
        "own.deposit",
        "--passphrase-file",
        "passphrase",
    ];
    assert_eq!(vendor.run(&deposit).0, Some(0));
    let mut files = fs::read_dir(vendor.path("copies")).unwrap().map(|entry| entry.unwrap().path());
    let copy = files.find(|path| path.extension().is_some_and(|e| e == "gpkg")).unwrap();
    let verify = [
        "verify",
        "--key",
        "protected.json",
        "--reference",
        "map.gpkg",
        "--records",
        "copies",
        "--deposit",
        "own.deposit",
        "--passphrase-file",
        "passphrase",
        copy.to_str().unwrap(),
    ];
    let (code, text) = vendor.run(&verify);
    assert!(code == Some(0) && text.contains("fixed:        key"), "{text}");
}

/// Whether the terminal shows what is typed.
fn shows_typing(terminal: &str) -> bool {
    let settings = Command::new("stty").args(["-a", "-F", terminal]).output().unwrap();
    assert!(settings.status.success(), "{terminal}: {}", String::from_utf8_lossy(&settings.stderr));
    String::from_utf8(settings.stdout).unwrap().split_whitespace().any(|setting| setting == "echo")
}

/// `script` gives a command a terminal.
#[test]
fn the_terminal_asks_for_a_passphrase_that_the_child_needs() {
    let vendor = vendor();
    let suspect = fixture("vectors/fingerprint/marked.gpkg");
    let command = format!(
        "tty; exec {} verify --key protected.json --reference map.gpkg --recipient ACME {}",
        env!("CARGO_BIN_EXE_meshmark"),
        suspect.display()
    );
    let verify = |input: &str| {
        let mut script = Command::new("script");
        script.args(["-qec", &command, "/dev/null"]).current_dir(vendor.0.path());
        script.env("GDAL_DRIVER_PATH", "none").stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut started = script.spawn().unwrap();
        let (mut asked, mut output) = (Vec::new(), started.stdout.take().unwrap());
        while !asked.ends_with(b"Passphrase of protected.json: ") {
            let mut byte = [0];
            output.read_exact(&mut byte).unwrap();
            asked.extend(byte);
        }
        // The question comes before the terminal stops to show what is typed.
        let terminal = String::from_utf8(asked).unwrap().lines().next().unwrap().to_owned();
        while shows_typing(&terminal) {
            thread::sleep(Duration::from_millis(10));
        }
        started.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
        let mut answer = String::new();
        output.read_to_string(&mut answer).unwrap();
        (started.wait().unwrap().code(), answer)
    };
    let (code, text) = verify("correct horse\n");
    assert!(code == Some(1) && text.contains("NO MATCH"), "{code:?} {text}");
    assert!(!text.contains("horse"), "it is not shown: {text}");
    let (code, text) = verify("battery staple\n");
    assert!(code == Some(2) && text.contains("does not open protected.json"), "{code:?} {text}");
}

#[test]
fn a_passphrase_that_is_given_protects_every_new_secret() {
    const PROTECTED: &str = "-----BEGIN AGE ENCRYPTED FILE-----\n";
    let vendor = vendor();
    let is_protected = |name: &str| fs::read_to_string(vendor.path(name)).unwrap().starts_with(PROTECTED);
    assert_eq!(vendor.run(&["keygen", "--passphrase-file", "passphrase", "other.json"]).0, Some(0));
    assert!(is_protected("other.json") && is_protected("other.signing.pem"));
    for file in ["other.signing.pem", "other.public.pem"] {
        fs::remove_file(vendor.path(file)).unwrap();
    }
    let again = ["keygen", "--signing-key-only", "--passphrase-file", "passphrase", "other.json"];
    let (code, text) = vendor.run(&again);
    assert!(code == Some(0) && is_protected("other.signing.pem"), "{text}");
}
