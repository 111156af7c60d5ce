//! The report: data and words. [`verify`](mod@crate::verify) computes the data.

mod candidates;
mod case;
mod deposit;
pub(crate) mod error_rates;
mod evidence;
mod evidence_map;
pub(crate) mod explain;
mod extent;
mod fingerprint;
mod likelihood;
pub mod sketch;
mod text;

pub use candidates::{Candidates, Entry};
pub use case::Case;
pub use deposit::{DepositEntry, Standing};
pub use evidence::{Digested, Evidence, Inputs, Member, Provenance};
pub use evidence_map::{EvidenceMap, ExactDisplacement, FoundVertex, PatchEvidence};
pub use explain::explain;
pub use extent::Extent;
pub use fingerprint::{FingerprintEntry, PatchAgreement, SignAgreement};
pub use likelihood::LikelihoodEntry;

use crate::words::printable;
use meshmark_core::{
    code::{Code, Decoder},
    fingerprint_record::FingerprintShape,
    options::Parameters,
};
use meshmark_detection::{
    Observations,
    decision::{Decoys, Null, Verdict},
    matching::RadiusReason,
    registration::Registration,
};
use meshmark_marking::LeftOut;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// The result of one verification. docs/report.schema.json describes its JSON.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Version of this format.
    pub meshmark_report: u32,
    /// The answer.
    pub verdict: Verdict,
    /// The reason, one sentence.
    pub reason: String,
    /// The decoded message, hexadecimal, in the form of the expected one; null when nothing was
    /// decoded.
    pub message: Option<String>,
    /// The decoded bits themselves, hexadecimal.
    pub carried_message: Option<String>,
    /// The message that the key whitens to these bits, hexadecimal: that of a copy marked with
    /// MESSAGE.
    pub unwhitened_message: Option<String>,
    /// Log-likelihood ratios of these bits after decoding, natural logarithm, positive = 1.
    pub bits: Vec<f64>,
    /// Number of these bits that differ from those of the expected message.
    pub bit_errors: Option<usize>,
    /// The decoding of the message; null where the mark is a fingerprint.
    pub code: Option<CodeEntry>,
    /// The agreement of secret signs; null where the mark is a message, and where nothing was
    /// observed.
    pub fingerprint: Option<FingerprintEntry>,
    /// log₁₀ of the larger of the next two p-values, times the number of candidates.
    pub p_value_log10: Option<f64>,
    /// log₁₀ of the p-value of this much evidence under a random key.
    pub p_mark_log10: Option<f64>,
    /// log₁₀ of the p-value of this much agreement under `null_hypothesis`.
    pub p_recipient_log10: Option<f64>,
    /// log₁₀ of the probability that this test misses a mark which the suspect carries, at least
    /// −6; null for a match and where nothing was decided.
    pub p_missed_log10: Option<f64>,
    /// The content of a copy with another message; null when no message was expected.
    pub null_hypothesis: Option<Null>,
    /// log₁₀ of the p-value of this much evidence for any message under a random key.
    pub p_any_message_log10: Option<f64>,
    /// The likelihood ratios of the recipient; null where the mark is a message, and where nothing was
    /// observed or no recipient is named.
    pub likelihood: Option<LikelihoodEntry>,
    /// The records that were tried; null when the request names one mark.
    pub candidates: Option<Candidates>,
    /// The case, from a case file; null without one.
    pub case: Option<Case>,
    /// The deposit of key, reference and record; null without one.
    pub deposit: Option<DepositEntry>,
    /// Scores of decoy keys; null when nothing was decoded or no vertex moved.
    pub decoys: Option<Decoys>,
    /// The registration of the suspect.
    pub registration: Registration,
    /// Numbers of vertices of the two maps.
    pub vertices: VertexCounts,
    /// What the suspect has that was left out.
    pub left_out: Faults,
    /// The assumed parameters of the mark, and those of the test.
    pub parameters: ReportParameters,
    /// Seconds by stage; null in a report file, which is the same for the same input.
    pub seconds: Option<BTreeMap<&'static str, f64>>,
    /// The compared data and the means to repeat the verification; null except in a report file.
    pub provenance: Option<Provenance>,
    /// The places of the evidence on the map; null except in a report file.
    pub evidence: Option<Evidence>,
    /// Number of messages that were tried.
    #[serde(skip)]
    pub tried: usize,
    /// The certainty of `bits`; `None` when nothing was decoded.
    #[serde(skip)]
    pub certainty: Option<Certainty>,
    /// The expected message as the code carries it, hexadecimal.
    #[serde(skip)]
    pub expected_carried: Option<String>,
    /// The number of the reference, the one of the best record.
    #[serde(skip)]
    pub reference: usize,
    /// Digest of the vertices of the reference.
    #[serde(skip)]
    pub reference_digest: String,
    /// CRS of the layers of the suspect.
    #[serde(skip)]
    pub suspect_crs: Vec<String>,
    /// The places of matched vertices, and the evidence of each patch.
    #[serde(skip)]
    pub evidence_map: Option<EvidenceMap>,
}

/// The decoding of the message.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CodeEntry {
    /// The code.
    pub name: Code,
    /// Number of channel bits that differ from those of the expected message, before decoding.
    pub channel_bit_errors: Option<usize>,
    /// Whether belief propagation reached a word that passes all parity checks; null for a code
    /// without checks.
    pub parity_holds: Option<bool>,
    /// The decoder that found the message; null when nothing was decoded.
    pub decoder: Option<Decoder>,
}

/// The certainty of decoded bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certainty {
    /// The smallest absolute log-likelihood ratio of a bit, natural logarithm.
    pub weakest_llr: f64,
    /// The median of the absolute ratios.
    pub median_llr: f64,
    /// Number of bits whose odds exceed 1000 to 1.
    pub over_1000_to_1: usize,
}

/// Numbers of distinct vertices.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct VertexCounts {
    /// Vertices of the reference.
    pub reference: usize,
    /// Vertices of the suspect.
    pub suspect: usize,
    /// Vertices of the reference with a match within the radius.
    pub matched: usize,
}

/// The numbers that shape a mark, those of its version.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum MarkParameters {
    /// Of a mark that carries a message.
    Message(Parameters),
    /// Of a fingerprint.
    Fingerprint(FingerprintShape),
}

/// What the suspect has that cannot be read or placed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Faults {
    /// Number of coordinate pairs outside all that a CRS can mean.
    pub coordinates: usize,
    /// Number of features that cannot be read, or not to their end.
    pub features: usize,
    /// The first of these faults.
    pub named: Vec<String>,
}

/// The assumed parameters of the mark, and those of the test.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the names are those of the options
pub struct ReportParameters {
    pub key_id: String,
    pub recipient: Option<String>,
    pub expected_message: Option<String>,
    #[serde(flatten)]
    pub mark: MarkParameters,
    pub layers: Option<Vec<String>>,
    pub crs: Option<String>,
    pub crs_source: Option<&'static str>,
    pub crs_of_reference: Option<String>,
    pub demodulator: &'static str,
    pub radius_m: f64,
    pub radius_reason: RadiusReason,
    pub observations: Option<Observations>,
    pub significance: f64,
    pub noise_m: Option<f64>,
    pub software: String,
}

impl From<LeftOut> for Faults {
    fn from(LeftOut { coordinates, features, named }: LeftOut) -> Self {
        Faults { coordinates, features, named: named.iter().map(|fault| printable(fault)).collect() }
    }
}

impl Report {
    /// Returns one JSON object, followed by a line feed.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and strings are JSON") + "\n"
    }

    /// Returns the report as a file holds it, which is the same for the same input.
    pub fn into_file(self) -> Self {
        Report { seconds: None, ..self }
    }

    /// Returns what a reader must know where the CRS of the reference is not its own.
    pub fn other_crs(&self) -> Option<String> {
        let ReportParameters { crs, crs_source, crs_of_reference, .. } = &self.parameters;
        let Some(crs) = crs.as_deref().map(printable) else {
            return Some("the reference states none, and its units are taken as metres".into());
        };
        if *crs_source != Some("record") {
            return None;
        }
        Some(match crs_of_reference {
            Some(own) => format!(
                "the reference states {}, and its record {crs}, in which it was marked: its coordinates are read as \
                 {crs}; give the file with its CRS, or correct that",
                printable(own)
            ),
            None => format!(
                "the reference states none, and its coordinates are read as {crs}, as its record states"
            ),
        })
    }

    /// Returns the warning about a reference in another CRS than its record states.
    pub fn warning(&self) -> Option<String> {
        self.other_crs().filter(|_| self.parameters.crs_of_reference.is_some())
    }

    /// Returns the recipients whose copies were looked for, or of many records those that match, each once.
    pub fn recipients(&self) -> Vec<&str> {
        let Some(candidates) = &self.candidates else {
            return self.parameters.recipient.as_deref().into_iter().collect();
        };
        let of_matches = candidates.list.iter().take(candidates.matches);
        let mut names: Vec<&str> = of_matches.filter_map(|entry| entry.recipient.as_deref()).collect();
        let mut seen = BTreeSet::new();
        names.retain(|name| seen.insert(*name));
        names
    }

    /// Hides the names of recipients whose records were tried and do not match.
    pub fn hide_others(&mut self) {
        let Some(candidates) = &mut self.candidates else { return };
        candidates.hide_others();
        if candidates.matches == 0 {
            self.parameters.recipient = None;
        }
    }
}
