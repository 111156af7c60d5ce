//! Time stamps: what an authority did not sign is refused, and what it signed has one time.
#![no_main]

mod file;

use libfuzzer_sys::fuzz_target;
use meshmark_verifier::time_stamp::{Authorities, TimeStamp, verify};
use std::sync::OnceLock;

/// What the seeds stamp, the certificate of their authority, and the time and the name in them.
const STAMPED: &[u8] = include_bytes!("../time_stamp/stamped");
const AUTHORITY: &[u8] = include_bytes!("../time_stamp/root.pem");
const TIME_STAMP: [&str; 2] = ["2026-11-28 12:22:17 UTC", "CN=Authority"];

fuzz_target!(|bytes: &[u8]| {
    static TRUSTED: OnceLock<Authorities> = OnceLock::new();
    let trusted = TRUSTED.get_or_init(|| {
        file::with("root.pem", AUTHORITY, Authorities::read).expect("the certificate of the authority")
    });
    match file::with("series.tsr", bytes, |path| verify(path, STAMPED, None, trusted)) {
        Ok(TimeStamp { time, authority }) => assert_eq!([&time[..], &authority], TIME_STAMP),
        Err(error) => assert!(error.to_string().contains("series.tsr"), "{error:?}"),
    }
});
