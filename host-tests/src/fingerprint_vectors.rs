//! The test vectors of version 2 of the mark, fixtures/vectors/fingerprint: a fingerprint from key
//! and vertices to its agreement, and its record.

use crate::vectors::{self, RECIPIENT, key, plus_minus, read, reference_path};
use meshmark_core::{
    agreement::{Agreement, Evidence},
    deformation::Prediction,
    embedding::Marked,
    estimation::Estimates,
    fingerprint::{COEFFICIENTS, pilots, recipient_signs},
    fingerprint_embedding::FingerprintEmbedding,
    fingerprint_record::FingerprintRecord,
    options::{Options, Parameters},
    patches::Patches,
    series::Series,
    signs::Signs,
};
use meshmark_dataset::{GeosOfGdal, Selection, Survey};
use meshmark_marking::{self as marking, Lineage, Unmarked};
use serde_json::{Value, json};
use std::path::PathBuf;

/// How many values of a long sequence are written.
const FIRST: usize = 8;
/// The noise that the estimates assume, metres.
const NOISE_M: f64 = 0.01;
/// Somebody who has nothing to do with the copy.
const OTHER: &str = "Other Ltd";

/// The folder of the test vectors.
pub fn folder() -> PathBuf {
    vectors::folder().join("fingerprint")
}

/// Returns every intermediate value that an implementer may want to compare, by the steps of the
/// algorithm, and the record of the marking.
///
/// # Panics
/// When the reference cannot be marked: the kit is then of no use.
pub fn steps_and_record() -> (Value, FingerprintRecord) {
    let options = Options::parse([("RECIPIENT", RECIPIENT)]).expect("they are legal");
    let (key, parameters) = (key(), &options.parameters);
    let map = read(&reference_path(), &Selection { geometries: true, ..Selection::default() });
    let on_ground = map.map(parameters).expect("a projected CRS");
    let series = Series::of_one(on_ground, parameters);
    let embedding = FingerprintEmbedding::new(&series, &key, COEFFICIENTS).expect("it fits");
    let fingerprint = embedding.fingerprint(RECIPIENT);
    let mut wanted = embedding.wanted(std::slice::from_ref(&fingerprint), &|_| ()).expect("it converges");
    let wanted = wanted.pop().expect("one for each fingerprint");
    let divided = embedding.divided(&wanted);
    let first_wanted = wanted.displacements()[..FIRST].to_vec();
    let marked = embedding.settle(&fingerprint, wanted).expect("it is read back");
    let geometries = map.geometries.as_ref().expect("they were requested");
    let distortion = Unmarked::new(geometries, &on_ground, &GeosOfGdal).distortion(&marked, parameters);
    let reference = marking::reference(&map.data.vertices, map.crs(), marked.patches);
    let lineage = Lineage { divided, ..Lineage::default() };
    let record = marking::fingerprint_record(
        &options,
        RECIPIENT,
        &key,
        COEFFICIENTS,
        (reference, lineage),
        distortion,
    );
    let part = embedding.parts();
    let signs = |signs: &dyn Signs| json!({ "x": plus_minus(&signs.signs(0, 0, COEFFICIENTS)), "y": plus_minus(&signs.signs(0, 1, COEFFICIENTS)) });
    let estimates = estimates(&map, &marked, parameters);
    let agreement = |recipient: &str| {
        let signs = recipient_signs(&key, part, recipient);
        describe(Evidence::of_recipients(&estimates).agreement(&signs))
    };
    let steps = json!({
        "0_key": { "commitment": key.commitment() },
        "1_part": { "vertices": map.data.vertices.len(), "sha256": part.as_slice()[0].digest },
        "2_signs": {
            "recipient": RECIPIENT,
            "patch_0_recipient": signs(&recipient_signs(&key, part, RECIPIENT)),
            "patch_0_pilots": signs(&pilots(&key, part)),
            "patch_0_fingerprint": signs(&fingerprint),
        },
        "3_marked": {
            "first_wanted": first_wanted,
            "first": marked.coords[..FIRST],
            "rms_m": marked.displacement.rms_m,
            "max_m": marked.displacement.max_m,
        },
        "4_estimates": {
            "noise_m": NOISE_M,
            "patch_0_x_values": estimates.values[..FIRST],
            "patch_0_x_variances": estimates.variances[..FIRST],
        },
        "5_agreement": {
            "recipient": agreement(RECIPIENT),
            "other_recipient": agreement(OTHER),
            "pilots": describe(Evidence::of_pilots(&estimates).agreement(&pilots(&key, part))),
        },
    });
    (steps, record)
}

fn estimates(map: &Survey, marked: &Marked, parameters: &Parameters) -> Estimates {
    let on_ground = map.map(parameters).expect("a projected CRS");
    let patches = Patches::new(&on_ground, parameters).expect("it fits");
    let pairs = map.data.vertices.coords().iter().zip(&marked.coords);
    let observed: Vec<_> =
        pairs.map(|(from, to)| Some(on_ground.ground.metres_between(*from, *to))).collect();
    let noise = Prediction::of_noise(NOISE_M, observed.len());
    Estimates::new(&patches, &observed, COEFFICIENTS, parameters, &noise, &|_| ()).expect("it converges")
}

fn describe(Agreement { score, signs, agreeing }: Agreement) -> Value {
    json!({ "score": score, "signs": signs, "agreeing": agreeing })
}
