//! Records of both versions: what is read can be written, reads back as the same record, and has
//! legal options.
#![no_main]

use libfuzzer_sys::fuzz_target;
use meshmark_core::{
    key::{SecretKey, read_text},
    recorded::Recorded,
};

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = read_text(bytes) else { return };
    match Recorded::from_json(&text) {
        Ok(record) => {
            let again = Recorded::from_json(&record.to_json()).expect("a record reads its own text");
            assert_eq!(record, again);
            let options = record.options().expect("what was read is legal");
            options.subject.expect("a record has a subject").carried(&SecretKey::from_bytes([7; 32]));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
