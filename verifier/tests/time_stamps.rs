//! Time stamps of deposits: openssl is the authority.

mod common;

use common::{
    authority::{Authority, Certificate},
    deposits::Vendor,
};
use std::fs;

/// Has the deposit stamped; returns the authority.
fn stamped(vendor: &Vendor, certificate: Certificate) -> Authority {
    let authority = Authority::new(certificate);
    authority.answer(&vendor.path("series.tsq"), &vendor.path("series.tsr"));
    authority
}

fn verify(vendor: &Vendor, authority: &Authority) -> (Option<i32>, String) {
    let root = authority.root().display().to_string();
    vendor.run(&[
        "deposit",
        "--verify",
        "series.deposit",
        "--time-stamp",
        "series.tsr",
        "--authorities",
        &root,
        "--time-stamp-request",
        "series.tsq",
    ])
}

fn assert_refused((code, text): (Option<i32>, String), expected: i32, words: &str) {
    assert!(code == Some(expected) && text.contains(words), "{code:?} {text}");
}

#[test]
fn a_right_time_stamp_says_since_when_the_deposit_exists() {
    let vendor = Vendor::new();
    for certificate in [Certificate::Right, Certificate::OldRsa] {
        let authority = stamped(&vendor, certificate);
        let (code, text) = verify(&vendor, &authority);
        assert_eq!(code, Some(0), "{text}");
        let since = text.lines().find_map(|line| line.strip_prefix("since:")).unwrap();
        assert!(since.trim_start().starts_with("20") && since.ends_with(" UTC, by CN=Authority"), "{since}");
        fs::remove_file(vendor.path("series.tsr")).unwrap();
    }
}

#[test]
fn the_request_is_one_that_openssl_reads_and_the_command_that_sends_it_is_printed() {
    let vendor = Vendor::new();
    let shown = vendor.openssl("ts -query -in series.tsq -text");
    for part in ["Hash Algorithm: sha256", "Nonce: 0x", "Certificate required: yes"] {
        assert!(shown.contains(part), "{shown}");
    }
    let (code, text) = vendor.deposit_and("again.deposit", &["--time-stamp-request", "of it.tsq"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("--data-binary '@of it.tsq' -o 'of it.tsr' ADDRESS\n"), "{text}");
    let both = ["series.tsq", "of it.tsq"].map(|name| fs::read(vendor.path(name)).unwrap());
    assert_ne!(both[0], both[1], "the nonce of every request is another one");
}

#[test]
fn the_request_of_another_program_and_a_longer_digest_will_do() {
    let vendor = Vendor::new();
    let authority = Authority::new(Certificate::Right);
    for options in ["-sha256", "-sha384", "-sha512 -no_nonce"] {
        fs::remove_file(vendor.path("series.tsq")).unwrap();
        authority.request(&vendor.path("series.deposit"), options, &vendor.path("series.tsq"));
        authority.answer(&vendor.path("series.tsq"), &vendor.path("series.tsr"));
        assert_refused(verify(&vendor, &authority), 0, "UTC, by CN=Authority");
        fs::remove_file(vendor.path("series.tsr")).unwrap();
    }
}

#[test]
fn a_time_stamp_that_is_wrong_is_refused_by_its_fault() {
    for (certificate, words) in [
        (Certificate::Expired, "a certificate that was not valid at 20"),
        (Certificate::OfServer, "is not for time stamps (its purpose is another one)"),
        (Certificate::NotCritical, "is not for time stamps (its purpose is not marked as critical)"),
    ] {
        let vendor = Vendor::new();
        let authority = stamped(&vendor, certificate);
        assert_refused(verify(&vendor, &authority), 4, words);
    }
}

#[test]
fn a_time_stamp_of_another_file_or_for_another_request_is_refused() {
    let vendor = Vendor::new();
    let authority = stamped(&vendor, Certificate::Right);
    fs::rename(vendor.path("series.tsq"), vendor.path("first.tsq")).unwrap();
    authority.request(&vendor.path("series.deposit"), "-sha256", &vendor.path("series.tsq"));
    assert_refused(verify(&vendor, &authority), 4, "answers another request, as its nonce is another");
    fs::remove_file(vendor.path("series.tsq")).unwrap();
    authority.request(&vendor.path("map.gpkg"), "-sha256", &vendor.path("series.tsq"));
    fs::remove_file(vendor.path("series.tsr")).unwrap();
    authority.answer(&vendor.path("series.tsq"), &vendor.path("series.tsr"));
    assert_refused(verify(&vendor, &authority), 4, "stamps another file");
    fs::remove_file(vendor.path("series.tsq")).unwrap();
    fs::remove_file(vendor.path("series.tsr")).unwrap();
    authority.request(&vendor.path("series.deposit"), "-sha1", &vendor.path("series.tsq"));
    authority.answer(&vendor.path("series.tsq"), &vendor.path("series.tsr"));
    assert_refused(verify(&vendor, &authority), 4, "is a refusal of the authority (status 2");
}

#[test]
fn the_stamp_of_an_authority_that_nobody_vouches_for_is_refused() {
    let vendor = Vendor::new();
    let own = stamped(&vendor, Certificate::Right);
    let other = Authority::new(Certificate::Right);
    // Both roots have the same name, and another key.
    assert_refused(
        verify(&vendor, &other),
        4,
        "signed by CN=Authority, which no certificate of --authorities",
    );
    assert_refused(verify(&vendor, &own), 0, "UTC");
    fs::write(vendor.path("bundle.pem"), "# no certificate\n").unwrap();
    let verified = vendor.run(&[
        "deposit",
        "--verify",
        "series.deposit",
        "--time-stamp",
        "series.tsr",
        "--authorities",
        "bundle.pem",
    ]);
    assert_refused(verified, 2, "holds no certificate");
    let bundle = [other.root(), own.root()].map(|path| fs::read_to_string(path).unwrap());
    fs::write(own.root(), format!("# two of one name\n{}\n{}", bundle[0], bundle[1])).unwrap();
    assert_refused(verify(&vendor, &own), 0, "UTC");
}

#[test]
fn no_changed_byte_of_a_time_stamp_passes_and_none_panics() {
    let vendor = Vendor::new();
    let authority = stamped(&vendor, Certificate::Right);
    let right = fs::read(vendor.path("series.tsr")).unwrap();
    let (_, accepted) = verify(&vendor, &authority);
    for place in (0..right.len()).step_by(right.len() / 60) {
        let mut changed = right.clone();
        changed[place] ^= 4;
        fs::write(vendor.path("series.tsr"), &changed).unwrap();
        let (code, text) = verify(&vendor, &authority);
        // What is not signed may change, such as a status or a certificate that is not needed.
        let is_same = code == Some(0) && text == accepted;
        assert!(is_same || matches!(code, Some(2 | 4)), "byte {place}: {code:?} {text}");
    }
    for text in ["", "<html>not found</html>"] {
        fs::write(vendor.path("series.tsr"), text).unwrap();
        assert_refused(verify(&vendor, &authority), 2, "is no response of a time-stamping authority");
    }
}
