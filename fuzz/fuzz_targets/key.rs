//! Key files: a text that is a key is the text of no other one, and errors never quote the file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use meshmark_core::key::{SecretKey, read_text};

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = read_text(bytes) else { return };
    match SecretKey::from_json(&text) {
        Ok(key) => {
            let again = SecretKey::from_json(&key.to_json()).expect("a key reads its own text");
            assert_eq!((key.id(), key.commitment()), (again.id(), again.commitment()));
        }
        Err(error) => {
            let message = error.to_string();
            let digits = text.split(|c: char| !c.is_ascii_hexdigit()).filter(|digits| digits.len() >= 32);
            digits.for_each(|secret| assert!(!message.contains(secret), "{message}"));
        }
    }
});
