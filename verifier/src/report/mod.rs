//! The report: data and words. What it says was computed when the suspect was examined.

mod candidates;
mod evidence;
mod evidence_map;
pub(crate) mod explain;
mod report_file;
pub mod sketch;
pub(crate) mod text;

pub use candidates::{Candidates, Entry};
pub use evidence::{Evidence, Provenance, command_line, versions};
pub use evidence_map::{EvidenceMap, EvidenceMapFile};
pub use explain::explain;
pub use report_file::{Format, ReportFile};

use crate::ExitCode;
use meshmark_core::{
    code::{Code, Decoder},
    options::{Laplacian, Rigidity},
};
use meshmark_detection::{
    decision::{Decoys, Null, Verdict},
    registration::Registration,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// The result of one verification. docs/report.schema.json describes its JSON.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Version of this format.
    pub meshmark_report: u32,
    /// The answer.
    pub verdict: Verdict,
    /// One sentence why.
    pub reason: String,
    /// The message as decoded, hexadecimal, in the terms of the expected one; null when nothing was decoded.
    pub message: Option<String>,
    /// The decoded bits themselves, hexadecimal.
    pub carried_message: Option<String>,
    /// The message that the key whitens to these bits, hexadecimal: that of a copy marked with MESSAGE.
    pub unwhitened_message: Option<String>,
    /// Log-likelihood ratios of these bits after decoding, natural logarithm, positive = 1.
    pub bits: Vec<f64>,
    /// How many of these bits differ from those of the expected message.
    pub bit_errors: Option<usize>,
    /// How the message was decoded.
    pub code: CodeEntry,
    /// The larger of the next two, times the number of candidates.
    pub p_value_log10: Option<f64>,
    /// log₁₀ p of this much evidence under a random key.
    pub p_mark_log10: Option<f64>,
    /// log₁₀ p of this much agreement under `null_hypothesis`.
    pub p_recipient_log10: Option<f64>,
    /// What the copy of somebody else carries; null when no message was expected.
    pub null_hypothesis: Option<Null>,
    /// log₁₀ p of this much evidence for any message at all under a random key.
    pub p_any_message_log10: Option<f64>,
    /// The records that were tried; null when one mark was asked for.
    pub candidates: Option<Candidates>,
    /// How decoy keys score; null when nothing was decoded or nothing moved.
    pub decoys: Option<Decoys>,
    /// How the suspect was brought onto the reference.
    pub registration: Registration,
    /// Vertices of the two maps.
    pub vertices: VertexCounts,
    /// What was assumed of the mark and how it was tested.
    pub parameters: ReportParameters,
    /// Seconds by stage; null in a report file, which is the same for the same input.
    pub seconds: Option<BTreeMap<&'static str, f64>>,
    /// What was compared and how to do it again; null but in a report file.
    pub provenance: Option<Provenance>,
    /// Where on the map the evidence is; null but in a report file.
    pub evidence: Option<Evidence>,
    /// How many messages were tried.
    #[serde(skip)]
    pub tried: usize,
    /// The expected message as the code carries it, hexadecimal.
    #[serde(skip)]
    pub expected_carried: Option<String>,
    /// Digest of the vertices of the reference.
    #[serde(skip)]
    pub reference_digest: String,
    /// CRS of the suspect's layers.
    #[serde(skip)]
    pub suspect_crs: Vec<String>,
    /// Where the vertices were found, and what each patch says.
    #[serde(skip)]
    pub evidence_map: Option<EvidenceMap>,
}

/// How the message was decoded.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CodeEntry {
    /// The code.
    pub name: Code,
    /// How many channel bits differ from those of the expected message, before decoding.
    pub channel_bit_errors: Option<usize>,
    /// Whether belief propagation came to a word that passes all parity checks; null without a code that has any.
    pub parity_holds: Option<bool>,
    /// What found the message; null when nothing was decoded.
    pub decoder: Option<Decoder>,
}

/// Distinct vertices.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct VertexCounts {
    /// Of the reference.
    pub reference: usize,
    /// Of the suspect.
    pub suspect: usize,
    /// Of the reference that have a counterpart within the radius.
    pub matched: usize,
}

/// What was assumed of the mark and how it was tested.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the names are those of the options
pub struct ReportParameters {
    pub key_id: String,
    pub recipient: Option<String>,
    pub expected_message: Option<String>,
    pub amplitude_m: f64,
    pub code: Code,
    pub chip_rate: usize,
    pub shape: Rigidity,
    pub basis: Laplacian,
    pub patch_size: usize,
    pub tolerance_m: f64,
    pub precision_crs_units: Option<f64>,
    pub layers: Option<Vec<String>>,
    pub crs: Option<String>,
    pub demodulator: &'static str,
    pub radius_m: f64,
    pub significance: f64,
    pub noise_m: Option<f64>,
    pub software: String,
}

impl Report {
    /// One JSON object, with a line feed at its end.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and strings are JSON") + "\n"
    }

    /// The exit code of this verdict.
    pub fn exit_code(&self) -> ExitCode {
        match self.verdict {
            Verdict::Match => ExitCode::Match,
            Verdict::NoMatch => ExitCode::NoMatch,
            Verdict::Inconclusive => ExitCode::Inconclusive,
        }
    }
}
