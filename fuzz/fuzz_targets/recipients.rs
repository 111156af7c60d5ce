//! Lists of recipients, through the function that reads them: it ends with the list's fault, or with
//! the map, which is missing.
#![no_main]

use libfuzzer_sys::fuzz_target;
use meshmark_core::{key::SecretKey, options::Options};
use meshmark_verifier::{
    Error,
    distribute::{DistributeRequest, distribute},
    progress::Progress,
};
use std::{fs, sync::OnceLock};
use tempfile::TempDir;

fuzz_target!(|bytes: &[u8]| {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder for temporary files"));
    let list = folder.path().join("list.csv");
    fs::write(&list, bytes).expect("a temporary file");
    let request = DistributeRequest {
        key: SecretKey::from_bytes([7; 32]),
        options: Options::parse_for_recipients([]).expect("the defaults are legal"),
        map: folder.path().join("missing.gpkg"),
        recipients: list,
        folder: folder.path().to_path_buf(),
        format: "GPKG".into(),
    };
    let mut warnings = 0;
    let result = distribute(&request, &mut Progress::default(), &mut |warning| {
        assert!(warning.contains(" is there again in line "), "{warning}");
        warnings += 1;
    });
    let error = result.err().expect("there is no map");
    let lines = bytes.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count();
    assert!(warnings <= lines, "one warning for a line at most");
    match &error {
        Error::Recipients { reason, .. } => assert!(!reason.contains(char::is_control), "{reason:?}"),
        other => assert!(other.to_string().contains("missing.gpkg"), "{other}"),
    }
});
