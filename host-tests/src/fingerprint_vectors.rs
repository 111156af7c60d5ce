//! The test vectors of version 2 of the mark, fixtures/vectors/fingerprint.json: a fingerprint from
//! key and vertices to its agreement.

use crate::vectors::{RECIPIENT, key, plus_minus, read, reference_path};
use meshmark_core::{
    agreement::{Agreement, Evidence},
    deformation::Prediction,
    embedding::Marked,
    estimation::Estimates,
    fingerprint::{COEFFICIENTS, FingerprintEmbedding, pilots, recipient_signs},
    options::Parameters,
    patches::Patches,
    signs::Signs,
};
use meshmark_dataset::Survey;
use serde_json::{Value, json};

/// How many values of a long sequence are written.
const FIRST: usize = 8;
/// The noise that the estimates assume, metres.
const NOISE_M: f64 = 0.01;
/// Somebody who has nothing to do with the copy.
const OTHER: &str = "Other Ltd";

/// Returns every intermediate value that an implementer may want to compare, by the steps of the
/// algorithm.
///
/// # Panics
/// When the reference cannot be marked: the kit is then of no use.
pub fn steps() -> Value {
    let (map, key, parameters) = (read(&reference_path()), key(), Parameters::default());
    let on_ground = map.map().expect("a projected CRS");
    let embedding = FingerprintEmbedding::new(&on_ground, &key, COEFFICIENTS, &parameters).expect("it fits");
    let fingerprint = embedding.fingerprint(RECIPIENT);
    let wanted = embedding.wanted(&[fingerprint], &|_| ()).expect("it converges");
    let marked = embedding.settle(&fingerprint, &wanted[0]).expect("it is read back");
    let part = embedding.part();
    let signs = |signs: &dyn Signs| json!({ "x": plus_minus(&signs.signs(0, 0, COEFFICIENTS)), "y": plus_minus(&signs.signs(0, 1, COEFFICIENTS)) });
    let estimates = estimates(&map, &marked, &parameters);
    let agreement = |recipient: &str| {
        let signs = recipient_signs(&key, &part, recipient);
        describe(Evidence::of_recipients(&estimates).agreement(&signs))
    };
    json!({
        "0_key": { "commitment": key.commitment() },
        "1_part": { "vertices": map.data.vertices.len(), "sha256": part },
        "2_signs": {
            "recipient": RECIPIENT,
            "patch_0_recipient": signs(&recipient_signs(&key, &part, RECIPIENT)),
            "patch_0_pilots": signs(&pilots(&key, &part)),
            "patch_0_fingerprint": signs(&fingerprint),
        },
        "3_marked": {
            "first_wanted": wanted[0][..FIRST],
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
            "pilots": describe(Evidence::of_pilots(&estimates).agreement(&pilots(&key, &part))),
        },
    })
}

fn estimates(map: &Survey, marked: &Marked, parameters: &Parameters) -> Estimates {
    let on_ground = map.map().expect("a projected CRS");
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
