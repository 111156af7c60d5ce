//! SVG drawings as suspects: a drawing is read, or refused by its name.
#![no_main]

mod file;

use libfuzzer_sys::fuzz_target;
use meshmark_verifier::inputs::{private_copy::PrivateCopy, suspects::suspect};

fuzz_target!(|bytes: &[u8]| {
    let read =
        file::with("leak.svg", bytes, |path| suspect(&PrivateCopy::make("suspect", path).expect("a copy")));
    if let Err(error) = read {
        assert!(error.to_string().contains("leak.svg"), "{error}");
    }
});
