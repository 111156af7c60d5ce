//! The current code reproduces the test vectors of fixtures/vectors.

use meshmark_core::{fingerprint_record::FingerprintRecord, key::SecretKey, record::Record};
use meshmark_host_tests::{
    fingerprint_vectors,
    vectors::{self, ReferenceMarking, differences},
};
use serde_json::{Value, json};
use std::{fs, sync::LazyLock};

/// The tolerance for numbers in metres and without a unit: processors round differently, and
/// nothing else may differ.
const TOLERANCE: f64 = 1e-9;

static MARKING: LazyLock<ReferenceMarking> = LazyLock::new(ReferenceMarking::new);

fn text(file: &str) -> String {
    fs::read_to_string(vectors::folder().join(file)).unwrap()
}

#[test]
fn every_intermediate_value_is_as_written() {
    let written: Value = serde_json::from_str(&text("steps.json")).unwrap();
    let found = differences(&MARKING.steps(), &written, TOLERANCE);
    assert!(found.is_empty(), "{} differences: {:#?}", found.len(), &found[..found.len().min(20)]);
}

#[test]
fn every_value_of_a_fingerprint_and_of_its_record_is_as_written() {
    let (steps, record) = fingerprint_vectors::steps_and_record();
    let written: Value = serde_json::from_str(&text("fingerprint/steps.json")).unwrap();
    let found = differences(&steps, &written, TOLERANCE);
    assert!(found.is_empty(), "{} differences: {found:#?}", found.len());
    let agreement = &written["5_agreement"];
    let [agreeing, signs] =
        ["agreeing", "signs"].map(|field| agreement["recipient"][field].as_f64().unwrap());
    assert!(agreeing > 0.85 * signs, "{agreeing} of {signs}");
    assert!(agreement["other_recipient"]["score"].as_f64().unwrap().abs() < 5.0);
    let read = FingerprintRecord::from_json(&text("fingerprint/record.json")).unwrap();
    assert!(read.is_of(&vectors::key()));
    let [now, written] = [&record, &read].map(|record| serde_json::to_value(record).unwrap());
    let found = differences(&now, &written, TOLERANCE);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn the_key_file_holds_the_key() {
    assert_eq!(SecretKey::from_json(&text("key.json")).unwrap().id(), vectors::key().id());
}

#[test]
fn the_record_tells_of_this_marking() {
    let record = Record::from_json(&text("record.json")).unwrap();
    assert_eq!(record.key_id, vectors::key().id());
    assert_eq!(record.recipient.as_deref(), Some(vectors::RECIPIENT));
    assert_eq!(record.message().unwrap(), MARKING.message);
    assert_eq!(record.parameters, MARKING.parameters);
    assert_eq!(record.reference.vertices, MARKING.reference.len());
    assert_eq!(record.reference.patches, MARKING.marked.patches);
    assert_eq!(record.reference.vertices_sha256, MARKING.reference.digest());
    assert_eq!(record.reference.crs.as_deref(), Some("EPSG:3067"));
    let (written, now) = (&record.displacement, MARKING.marked.displacement);
    for (a, b) in [(written.rms_m, now.rms_m), (written.p99_m, now.p99_m), (written.max_m, now.max_m)] {
        assert!((a - b).abs() <= TOLERANCE, "{a} {b}");
    }
}

#[test]
fn every_vertex_of_the_marked_map_is_where_it_belongs() {
    let before = vectors::coordinates(&vectors::reference_path());
    let after = vectors::coordinates(&vectors::marked_path());
    assert_eq!(before.len(), after.len());
    let vertices = &MARKING.reference;
    for (from, to) in before.iter().zip(&after) {
        let expected = MARKING.marked.coords[vertices.index_of(*from).unwrap()];
        let [dx, dy] = MARKING.ground.metres_between(expected, *to);
        assert!(dx.hypot(dy) <= TOLERANCE, "{from:?} is at {to:?} instead of {expected:?}");
    }
}

#[test]
fn a_changed_value_is_a_difference() {
    let a = json!({ "x": [1.0, 2.0], "name": "a", "none": null });
    assert!(differences(&a, &json!({ "x": [1.0, 2.0 + 9e-10], "name": "a", "none": null }), 1e-9).is_empty());
    for b in [
        json!({ "x": [1.0, 2.0 + 2e-9], "name": "a", "none": null }),
        json!({ "x": [1.0], "name": "a", "none": null }),
        json!({ "x": [1.0, 2.0], "name": "b", "none": null }),
        json!({ "x": [1.0, 2.0], "name": "a", "none": 0.0 }),
        json!({ "x": [1.0, 2.0], "name": "a" }),
    ] {
        assert_eq!(differences(&a, &b, 1e-9).len(), 1, "{b}");
    }
}
