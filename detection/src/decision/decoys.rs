//! Decoys: the scores of nonexistent keys and recipients on the same suspect. The p-values rest on
//! the analytic null distribution; the decoys show that it holds for this suspect.

use crate::histogram::Histogram;
use meshmark_core::{agreement::Evidence, demodulation::Demodulation, hex, vertices::VertexTable};
use serde::Serialize;
use sha2::{Digest, Sha256};

const COUNT: usize = 1000;
const BINS: usize = 20;

/// Scores of decoy keys, in standard deviations of the null hypothesis.
#[derive(Debug, Clone, Serialize)]
pub struct Decoys {
    /// Number of decoys.
    pub count: usize,
    /// SHA-256 of "meshmark decoys" and the digests of the vertices of the suspect and the
    /// reference. Equal maps have equal decoys, and nobody can choose them.
    pub seed: String,
    /// Mean of the scores.
    pub mean: f64,
    /// Standard deviation of the scores.
    pub standard_deviation: f64,
    /// The largest score.
    pub largest: f64,
    /// Frequency of the scores.
    pub histogram: Histogram,
    /// The score of what is in question: key and message, recipient, or key. Null where none is.
    pub tested: Option<f64>,
}

impl Decoys {
    /// Scores decoy keys on a suspect. Returns `None` where no displacement was observed.
    pub fn new(found: &Demodulation, suspect: &VertexTable, reference: &VertexTable) -> Option<Self> {
        if found.chip_correlations.iter().all(|a| *a == 0.0) {
            return None;
        }
        Self::scored(suspect, reference, |seed| found.decoy_scores(COUNT, seed))
    }

    /// Scores decoys on estimates of signs: recipients on those of recipients, keys on pilots.
    /// Returns `None` where no displacement was observed.
    pub fn of_signs(evidence: &Evidence, suspect: &VertexTable, reference: &VertexTable) -> Option<Self> {
        if evidence.energy() == 0.0 {
            return None;
        }
        Self::scored(suspect, reference, |seed| evidence.decoy_scores(COUNT, seed))
    }

    fn scored(
        suspect: &VertexTable,
        reference: &VertexTable,
        scores: impl FnOnce([u8; 32]) -> Vec<f64>,
    ) -> Option<Self> {
        let text = format!("meshmark decoys {} {}", suspect.digest(), reference.digest());
        let seed: [u8; 32] = Sha256::digest(text).into();
        let scores = scores(seed);
        let mean = scores.iter().sum::<f64>() / COUNT as f64;
        let variance = scores.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (COUNT - 1) as f64;
        Some(Decoys {
            count: COUNT,
            seed: hex::encode(&seed),
            mean,
            standard_deviation: variance.sqrt(),
            largest: scores.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            histogram: Histogram::of_values(&scores, BINS)?,
            tested: None,
        })
    }
}
