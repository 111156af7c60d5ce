//! Deposits: what they fix, and how a change afterwards is found out.

mod common;

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use common::{
    deposits::{Vendor, deposited},
    fixture, key,
};
use meshmark_core::key::SecretKey;
use serde_json::Value;
use std::{fs, os::unix::fs::PermissionsExt, process::Command};

#[test]
fn a_deposit_holds_digests_and_neither_the_secret_nor_a_name() {
    let vendor = Vendor::new();
    let (code, text) = vendor.verify();
    assert_eq!(code, Some(0), "{text}");
    for fixed in ["key", "vertices of the reference map.gpkg", "file of the reference map.gpkg", "2 records"]
    {
        assert!(text.contains(&format!("fixed:        {fixed}\n")), "{text}");
    }
    let statement = vendor.statement();
    let key = SecretKey::from_json(&fs::read_to_string(vendor.path("key.json")).unwrap()).unwrap();
    assert_eq!(statement["predicate"]["key_commitment"], key.commitment());
    assert_eq!(statement["predicate"]["recipients"]["digests"][0], key.blinded("ACME GmbH"));
    let record: Value = serde_json::from_slice(&fs::read(vendor.path("records/acme.json")).unwrap()).unwrap();
    assert_eq!(
        statement["predicate"]["references"][0]["vertices_sha256"],
        record["reference"]["vertices_sha256"]
    );
    let text = statement.to_string();
    assert!(!text.contains("ACME") && !text.contains("000102"), "{text}");
}

#[test]
fn the_same_inputs_make_the_same_deposit() {
    let vendor = Vendor::new();
    fs::rename(vendor.path("records/acme.json"), vendor.path("records/zacme.json")).unwrap();
    assert_eq!(vendor.deposit("again.deposit"), (Some(0), deposited("again.deposit")));
    let [first, second] =
        ["series.deposit", "again.deposit"].map(|name| fs::read(vendor.path(name)).unwrap());
    assert!(first == second);
}

#[test]
fn other_programs_verify_the_signature() {
    let vendor = Vendor::new();
    let envelope: Value = serde_json::from_slice(&fs::read(vendor.path("series.deposit")).unwrap()).unwrap();
    let decoded = |value: &Value| BASE64.decode(value.as_str().unwrap()).unwrap();
    let (kind, payload) = (envelope["payloadType"].as_str().unwrap(), decoded(&envelope["payload"]));
    let head = format!("DSSEv1 {} {kind} {} ", kind.len(), payload.len());
    fs::write(vendor.path("signed"), [head.as_bytes(), &payload].concat()).unwrap();
    fs::write(vendor.path("signature"), decoded(&envelope["signatures"][0]["sig"])).unwrap();
    let verified =
        vendor.openssl("pkeyutl -verify -pubin -inkey key.public.pem -rawin -in signed -sigfile signature");
    assert_eq!(verified, "Signature Verified Successfully\n");
    vendor.openssl("pkey -in key.signing.pem -noout");
}

#[test]
fn secrets_are_for_their_owner_alone_and_others_are_warned_of() {
    let vendor = Vendor::new();
    let mode = |name: &str| fs::metadata(vendor.path(name)).unwrap().permissions().mode() & 0o777;
    assert_eq!(vendor.run(&["keygen", "new.json"]).0, Some(0));
    for secret in ["new.json", "new.signing.pem", "key.signing.pem"] {
        assert_eq!(mode(secret), 0o600, "{secret}");
    }
    assert_eq!(vendor.run(&["keygen", "new.json"]).0, Some(2));
    fs::remove_file(vendor.path("new.json")).unwrap();
    let (code, text) = vendor.run(&["keygen", "new.json"]);
    assert!(code == Some(2) && text.contains("new.signing.pem exists"), "{text}");
    assert!(!vendor.path("new.json").exists(), "a key without its signing key");
    fs::set_permissions(vendor.path("key.signing.pem"), fs::Permissions::from_mode(0o644)).unwrap();
    let (code, text) = vendor.deposit("again.deposit");
    assert!(code == Some(0) && text.contains("key.signing.pem has the rights 0644"), "{text}");
}

#[test]
fn several_references_are_deposited_each_with_its_own_vertices() {
    let vendor = Vendor::new();
    let arguments =
        ["deposit", "--key", "key.json", "--reference", "map.gpkg", "--records", "records", "--reference"];
    let helsinki = fixture("helsinki.gpkg").display().to_string();
    let (code, text) = vendor.run(&[&arguments[..], &[&helsinki, "-o", "both.deposit"]].concat());
    assert!(code == Some(0) && text.contains("2 references"), "{text}");
    for (map, code) in [("map.gpkg", 0), (&helsinki, 0), (&fixture("shapes.gpkg").display().to_string(), 4)] {
        let verified = vendor.run(&["deposit", "--verify", "both.deposit", "--reference", map]);
        assert_eq!(verified.0, Some(code), "{map}: {}", verified.1);
    }
}

#[test]
fn what_does_not_belong_is_not_deposited() {
    let vendor = Vendor::new();
    let refused = |code: i32, words: &str| {
        let (found, text) = vendor.deposit("new.deposit");
        assert!(found == Some(code) && text.contains(words), "{found:?} {text}");
        assert!(!vendor.path("new.deposit").exists());
    };
    let record = fs::read(vendor.path("records/message.json")).unwrap();
    vendor.change("records/message.json", "434471506306423b", "0000000000000000");
    refused(4, "message.json: the record was made with key");
    fs::write(vendor.path("records/message.json"), &record).unwrap();
    vendor.change("records/message.json", "ce0eba", "ce0ebb");
    refused(4, "message.json: the record was made from none of the 1 references");
    fs::write(vendor.path("records/message.json"), &record[..100]).unwrap();
    refused(2, "message.json: malformed record");
    fs::write(vendor.path("records/message.json"), "{}").unwrap();
    let (code, text) = vendor.deposit("new.deposit");
    assert!(code == Some(0) && text.contains("message.json is no record"), "{text}");
    fs::remove_file(vendor.path("new.deposit")).unwrap();
    fs::remove_file(vendor.path("records/acme.json")).unwrap();
    refused(2, "no file of records is a record");
    let (code, text) = vendor.run(&[
        "deposit",
        "--key",
        "key.json",
        "--reference",
        "map.gpkg",
        "--records",
        "records",
        "-o",
        "series.deposit",
    ]);
    assert!(code == Some(2) && text.contains("a deposit is never overwritten"), "{text}");
}

/// The owner of another key pair signs the same statement.
fn signed_by_another(vendor: &Vendor) {
    fs::remove_file(vendor.path("series.deposit")).unwrap();
    fs::rename(vendor.path("key.public.pem"), vendor.path("published.pem")).unwrap();
    fs::remove_file(vendor.path("key.signing.pem")).unwrap();
    assert_eq!(vendor.run(&["keygen", "--signing-key-only", "key.json"]).0, Some(0));
    assert_eq!(vendor.deposit("series.deposit").0, Some(0));
    fs::rename(vendor.path("published.pem"), vendor.path("key.public.pem")).unwrap();
}

/// What a vendor changes, how, and what is said of it.
type Forgery = (&'static str, fn(&Vendor), &'static str);

/// docs/deposit.md lists these forgeries.
#[test]
fn forgeries_of_what_was_deposited_are_found_out() {
    let forgeries: [Forgery; 9] = [
        (
            "another key",
            |vendor| {
                fs::write(vendor.path("key.json"), SecretKey::from_bytes([1; 32]).to_json().as_bytes())
                    .unwrap()
            },
            "is not in the deposit",
        ),
        (
            "another reference",
            |vendor| vendor.replace_map("helsinki.gpkg"),
            "reference map.gpkg is not in the deposit",
        ),
        (
            "a reference whose vertices were moved",
            |vendor| vendor.replace_map("vectors/marked.gpkg"),
            "reference map.gpkg is not in the deposit",
        ),
        (
            "a record with another figure",
            |vendor| vendor.change("records/acme.json", "\"amplitude_m\": 0.1", "\"amplitude_m\": 0.2"),
            "record acme.json is not in the deposit",
        ),
        (
            "a record of a new recipient",
            |vendor| {
                fs::copy(vendor.path("records/acme.json"), vendor.path("records/new.json")).unwrap();
                vendor.change("records/new.json", "ACME GmbH", "Innocent Ltd");
            },
            "record new.json is not in the deposit",
        ),
        (
            "a statement about another key",
            |vendor| {
                let new = SecretKey::from_bytes([1; 32]).commitment();
                let own = vendor.statement()["predicate"]["key_commitment"].as_str().unwrap().to_string();
                vendor.change_statement(&own, &new);
            },
            "was changed after it was signed",
        ),
        (
            "a statement with one more record",
            |vendor| {
                let digests = vendor.statement()["predicate"]["records"]["digests"].to_string();
                let more = digests.replace(']', &format!(",\"{}\"]", "f".repeat(64)));
                vendor.change_statement(&digests, &more);
            },
            "the Merkle root of its records is not that of their digests",
        ),
        (
            "a statement with another recipient",
            |vendor| {
                let digest = vendor.statement()["predicate"]["recipients"]["digests"][0].clone();
                vendor.change_statement(digest.as_str().unwrap(), &"f".repeat(64));
            },
            "the Merkle root of its recipients is not that of their digests",
        ),
        ("a deposit signed anew", signed_by_another, "was signed with key"),
    ];
    for (name, forge, words) in forgeries {
        let vendor = Vendor::new();
        forge(&vendor);
        let (code, text) = vendor.verify();
        assert!(code == Some(4) && text.contains(words), "{name}: {code:?} {text}");
    }
}

#[test]
fn what_is_no_deposit_is_refused_by_its_fault() {
    let vendor = Vendor::new();
    let text = fs::read_to_string(vendor.path("series.deposit")).unwrap();
    let envelope: Value = serde_json::from_str(&text).unwrap();
    let two = serde_json::json!([envelope["signatures"][0], envelope["signatures"][0]]);
    for (bad, words) in [
        (String::new(), "is no deposit (EOF"),
        ("[]".into(), "is no deposit"),
        (text[..text.len() / 2].into(), "is no deposit"),
        (text.replace("in-toto+json", "other+json"), "its payload is application/vnd.other+json"),
        (text.replace("\"payload\": \"", "\"payload\": \"AAAA"), "is no deposit"),
        (fs::read_to_string(key()).unwrap(), "is no deposit"),
        (
            {
                let mut envelope = envelope.clone();
                envelope["signatures"] = two;
                envelope.to_string()
            },
            "it has 2 signatures",
        ),
    ] {
        fs::write(vendor.path("series.deposit"), bad).unwrap();
        let (code, text) = vendor.verify();
        assert!(code == Some(2) && text.contains(words), "{code:?} {text}");
    }
    fs::remove_file(vendor.path("series.deposit")).unwrap();
    assert_eq!(vendor.verify().0, Some(2));
    fs::write(vendor.path("series.deposit"), &text).unwrap();
    fs::write(vendor.path("key.public.pem"), "none").unwrap();
    assert!(vendor.verify().1.contains("is no public key"));
}

#[test]
fn a_reference_saved_anew_keeps_its_vertices_and_is_said_to_be_another_file() {
    let vendor = Vendor::new();
    let copied =
        Command::new("ogr2ogr").args(["-q", "saved.gpkg", "map.gpkg"]).current_dir(vendor.0.path()).status();
    assert!(copied.unwrap().success());
    fs::rename(vendor.path("saved.gpkg"), vendor.path("map.gpkg")).unwrap();
    let (code, text) = vendor.verify();
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("not fixed:    file of the reference map.gpkg, whose vertices are those"),
        "{text}"
    );
}

#[test]
fn a_record_that_is_there_twice_does_not_stand_for_another_one() {
    let vendor = Vendor::new();
    fs::copy(vendor.path("records/acme.json"), vendor.path("records/message.json")).unwrap();
    let (code, text) = vendor.verify();
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("fixed:        1 record\n"), "{text}");
    assert!(text.contains("1 record of the deposit that the folder lacks"), "{text}");
}

#[test]
fn a_record_that_was_cut_is_refused_and_a_request_needs_its_answer() {
    let vendor = Vendor::new();
    let request = ["deposit", "--verify", "series.deposit", "--time-stamp-request", "series.tsq"];
    let (code, text) = vendor.run(&request);
    assert!(code == Some(2) && text.contains("give the response to it with --time-stamp"), "{text}");
    for cut in ["", "{\n  \"mesh"] {
        fs::write(vendor.path("records/acme.json"), cut).unwrap();
        let (code, text) = vendor.deposit("again.deposit");
        assert!(code == Some(2) && text.contains("acme.json"), "{text}");
        assert!(!vendor.path("again.deposit").exists());
    }
}
