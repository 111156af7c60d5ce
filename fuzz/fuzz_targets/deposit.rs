//! Deposits: nobody but the owner of the signing key makes one, and what is signed reads back.
#![no_main]

mod file;

use libfuzzer_sys::fuzz_target;
use meshmark_verifier::deposit::{Deposit, SigningKey, Statement};
use std::sync::OnceLock;

/// Returns the signing key of all inputs of a run.
fn signing_key() -> &'static SigningKey {
    static KEY: OnceLock<SigningKey> = OnceLock::new();
    KEY.get_or_init(|| SigningKey::random().expect("random bytes"))
}

fuzz_target!(|bytes: &[u8]| {
    if let Ok(deposit) = file::with("series.deposit", bytes, |path| Deposit::read(path, None)) {
        assert_eq!(deposit.bytes(), bytes);
        assert_eq!(deposit.statement().predicate.public_key, deposit.signer().to_hex());
        assert_eq!(
            Statement::from_bytes(&deposit.statement().to_bytes()).ok(),
            Some(deposit.statement().clone())
        );
    }
    let Ok(mut statement) = Statement::from_bytes(bytes) else { return };
    statement.predicate.public_key = signing_key().public().to_hex();
    let mut signed = Deposit::sign(&statement, signing_key());
    let read = |bytes: &[u8]| {
        file::with("signed.deposit", bytes, |path| Deposit::read(path, Some(&signing_key().public())))
    };
    assert_eq!(read(&signed).expect("what was signed").statement(), &statement);
    // A payload that differs by a character is not what was signed.
    let payload = signed.windows(10).position(|window| window == b"\"payload\":").expect("a payload") + 20;
    signed[payload] = if signed[payload] == b'A' { b'B' } else { b'A' };
    assert!(read(&signed).is_err());
});
