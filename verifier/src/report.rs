//! The report: one JSON object, or a short answer for a person.

use crate::{
    decision::{Decision, Verdict},
    error::ExitCode,
    registration::Registration,
    verify::{Demodulator, Request},
};
use meshmark_core::demodulation::Demodulation;
use meshmark_dataset::Survey;
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
    /// The message as decoded, hexadecimal; null when nothing was decoded.
    pub message: Option<String>,
    /// Log-likelihood ratios of its bits, natural logarithm, positive = 1.
    pub bits: Vec<f64>,
    /// How many bits differ from the expected message.
    pub bit_errors: Option<usize>,
    /// The larger of the next two.
    pub p_value_log10: Option<f64>,
    /// log₁₀ p of this much evidence under a random key.
    pub p_mark_log10: Option<f64>,
    /// log₁₀ p of this much agreement with a random recipient.
    pub p_recipient_log10: Option<f64>,
    /// How the suspect was brought onto the reference.
    pub registration: Registration,
    /// Vertices of the two maps.
    pub vertices: VertexCounts,
    /// What was assumed of the mark and how it was tested.
    pub parameters: ReportParameters,
    /// Seconds by stage.
    pub seconds: BTreeMap<&'static str, f64>,
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
    pub chip_rate: usize,
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
    /// Puts the pieces together.
    pub fn new(
        request: &Request,
        reference: &Survey,
        registration: Registration,
        vertices: VertexCounts,
        found: Option<&Demodulation>,
        decision: Decision,
        seconds: &BTreeMap<&'static str, f64>,
    ) -> Self {
        let message = found.map(Demodulation::message);
        let errors = message.as_ref().zip(request.expected.as_ref()).map(|(m, expected)| m.errors(expected));
        Report {
            meshmark_report: 1,
            verdict: decision.verdict,
            p_value_log10: decision.p_value_log10(),
            p_mark_log10: decision.p_mark_log10,
            p_recipient_log10: decision.p_recipient_log10,
            reason: decision.reason,
            message: message.map(|m| m.to_hex()),
            bits: found.map(Demodulation::log_likelihood_ratios).unwrap_or_default(),
            bit_errors: errors,
            registration,
            vertices,
            parameters: ReportParameters::new(request, reference, found),
            seconds: seconds.clone(),
        }
    }

    /// One JSON object, with a line feed at its end.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and strings are JSON") + "\n"
    }

    /// A short answer for a person.
    pub fn to_text(&self) -> String {
        let mut lines = vec![format!("verdict:      {}: {}", self.verdict_name(), self.reason)];
        if let Some(message) = &self.message {
            let errors = self.bit_errors.map_or(String::new(), |errors| {
                format!(" ({errors} of {} bits differ from the expected message)", self.bits.len())
            });
            lines.push(format!("message:      {message}{errors}"));
            lines.push(format!("weakest bit:  right with odds {}", odds(&self.bits)));
        }
        if let (Some(p), Some(mark), Some(recipient)) =
            (self.p_value_log10, self.p_mark_log10, self.p_recipient_log10)
        {
            lines.push(format!(
                "p-value:      {} (key {}, recipient {})",
                power_of_ten(p),
                power_of_ten(mark),
                power_of_ten(recipient)
            ));
        }
        let v = &self.vertices;
        lines.push(format!(
            "vertices:     {} of {} reference vertices found among {} of the suspect",
            v.matched, v.reference, v.suspect
        ));
        let landmarks = match self.registration.landmarks {
            0 => String::new(),
            count => format!(", {count} landmarks"),
        };
        let rms = self.registration.rms_m.map_or(String::new(), |rms| format!(", residual {rms:.3} m RMS"));
        lines.push(format!("registration: {}{landmarks}{rms}", self.registration.method));
        lines.join("\n") + "\n"
    }

    fn verdict_name(&self) -> &'static str {
        match self.verdict {
            Verdict::Match => "MATCH",
            Verdict::NoMatch => "NO MATCH",
            Verdict::Inconclusive => "INCONCLUSIVE",
        }
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

impl ReportParameters {
    fn new(request: &Request, reference: &Survey, found: Option<&Demodulation>) -> Self {
        let p = &request.parameters;
        ReportParameters {
            key_id: request.key.id(),
            recipient: request.record.as_ref().and_then(|record| record.recipient.clone()),
            expected_message: request.expected.as_ref().map(|m| m.to_hex()),
            amplitude_m: p.amplitude_m,
            chip_rate: p.chip_rate,
            patch_size: p.patch_size,
            tolerance_m: p.tolerance_m,
            precision_crs_units: p.precision,
            layers: request.layers.clone(),
            crs: reference.crs.as_ref().map(|crs| crs.label()),
            demodulator: match request.demodulator {
                Demodulator::Paper => "paper",
                Demodulator::Joint => "joint",
            },
            radius_m: request.radius_m,
            significance: request.significance,
            noise_m: found.map(|found| found.noise_m),
            software: format!("meshmark {}", env!("CARGO_PKG_VERSION")),
        }
    }
}

fn power_of_ten(log10: f64) -> String {
    if log10 > -3.0 { format!("{:.3}", 10f64.powf(log10)) } else { format!("10^{log10:.1}") }
}

/// "1000 : 1" for the least certain bit.
fn odds(bits: &[f64]) -> String {
    let least = bits.iter().map(|llr| llr.abs()).fold(f64::INFINITY, f64::min);
    if least > 13.8 { "over a million to 1".into() } else { format!("{:.1} to 1", least.exp()) }
}
