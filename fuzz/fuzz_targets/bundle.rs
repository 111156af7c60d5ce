//! Bundles of cases: what is read can be packed, and reads back as the same bundle, which is no larger.
#![no_main]

mod file;

use libfuzzer_sys::fuzz_target;
use meshmark_verifier::bundle::Bundle;

fuzz_target!(|bytes: &[u8]| {
    let read = |bytes: &[u8]| file::with("case.zip", bytes, Bundle::read);
    match read(bytes) {
        Ok(bundle) => {
            let Ok(packed) = bundle.to_bytes() else { return };
            let again = read(&packed).expect("a bundle reads its own archive");
            assert_eq!(bundle, again);
            assert!(bundle.differing(&again).is_empty());
            assert!(file::with("case.zip", &packed, |path| again.is_all_of(path)).expect("the archive"));
        }
        Err(error) => assert!(error.to_string().contains("case.zip"), "{error:?}"),
    }
});
