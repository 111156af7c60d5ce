//! Lists of recipients, through the function that reads them: it ends with the list's fault, or with
//! the map, which is missing.
#![no_main]

mod file;

use libfuzzer_sys::fuzz_target;
use meshmark_core::{key::SecretKey, options::Options};
use meshmark_verifier::{
    Error,
    distribute::{DistributeRequest, distribute},
    progress::Progress,
};

fuzz_target!(|bytes: &[u8]| {
    let mut warnings = 0;
    let result = file::with("list.csv", bytes, |list| {
        let request = DistributeRequest {
            key: SecretKey::from_bytes([7; 32]),
            options: Options::parse_for_recipients([]).expect("the defaults are legal"),
            map: file::folder().join("missing.gpkg"),
            recipients: list.into(),
            folder: file::folder().into(),
            format: "GPKG".into(),
        };
        distribute(&request, &Progress::default(), &mut |warning| {
            let is_known = [" is there again in line ", "means another recipient"];
            assert!(is_known.iter().any(|words| warning.contains(words)), "{warning}");
            warnings += 1;
        })
    });
    let error = result.err().expect("there is no map");
    let lines = bytes.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count();
    assert!(warnings <= lines + 1, "one warning for a line at most, and the last one may not end");
    match &error {
        Error::Recipients { reason, .. } => assert!(!reason.contains(char::is_control), "{reason:?}"),
        other => assert!(other.to_string().contains("missing.gpkg"), "{other}"),
    }
});
