//! The report: one JSON object, or a short answer for a person.

use crate::{
    candidates::Candidates,
    decision::{Decision, Null, Verdict, p_any_message_log10},
    decoys::Decoys,
    error::ExitCode,
    evidence::{Evidence, Provenance},
    evidence_map::EvidenceMap,
    registration::Registration,
    verify::{Demodulator, Examination, Request},
};
use meshmark_core::{
    code::{Code, Decoder},
    demodulation::Demodulation,
    message::Message,
    options::{Laplacian, Rigidity},
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
    /// Puts the pieces together.
    pub fn new(
        request: &Request,
        seen: &Examination,
        decision: Decision,
        seconds: &BTreeMap<&'static str, f64>,
    ) -> Self {
        let (found, hypothesis) = (seen.found.as_ref().ok(), request.expected());
        let expected = hypothesis.as_ref().map(|hypothesis| &hypothesis.carried);
        let decoded = found.map(Demodulation::decode);
        let carried = decoded.as_ref().map(|decoded| &decoded.message);
        let read = |carried: &Message| match &request.subject {
            Some(subject) => subject.message_of(carried, &request.key),
            None => carried.clone(),
        };
        let tested = found.zip(expected).map(|(found, expected)| found.mark_score(expected));
        let code = CodeEntry {
            name: request.parameters.code,
            channel_bit_errors: found.zip(expected).map(|(found, m)| found.channel_bit_errors(m)),
            parity_holds: decoded.as_ref().and_then(|decoded| decoded.parity_holds),
            decoder: decoded.as_ref().map(|decoded| decoded.decoder),
        };
        Report {
            meshmark_report: 1,
            verdict: decision.verdict,
            p_value_log10: decision.p_value_log10(),
            p_mark_log10: decision.p_mark_log10,
            p_recipient_log10: decision.p_recipient_log10,
            p_any_message_log10: found.and_then(|f| p_any_message_log10(f, request.parameters.chip_rate)),
            candidates: None,
            decoys: seen.decoys.clone().map(|decoys| Decoys { tested, ..decoys }),
            reason: decision.reason,
            message: carried.map(|carried| read(carried).to_hex()),
            carried_message: carried.map(Message::to_hex),
            unwhitened_message: carried.map(|carried| request.key.unwhitened(carried).to_hex()),
            expected_carried: expected.map(Message::to_hex),
            null_hypothesis: hypothesis.as_ref().map(|hypothesis| hypothesis.null),
            tried: decision.tried,
            bit_errors: decoded.as_ref().zip(expected).map(|(decoded, m)| decoded.message.errors(m)),
            bits: decoded.map(|decoded| decoded.message_llrs).unwrap_or_default(),
            code,
            registration: seen.registration.clone(),
            vertices: seen.vertices,
            parameters: ReportParameters::new(request, seen),
            seconds: Some(seconds.clone()),
            provenance: None,
            evidence: Evidence::new(request, seen),
            reference_digest: seen.reference_digest.clone(),
            suspect_crs: seen.suspect_crs.clone(),
            evidence_map: seen.evidence_map.as_ref().map(|map| map.scored(request, found)),
        }
    }

    /// One JSON object, with a line feed at its end.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and strings are JSON") + "\n"
    }

    /// A short answer for a person.
    pub fn to_text(&self) -> String {
        let mut lines = vec![format!("verdict:      {}: {}", self.verdict_name(), self.reason)];
        if let Some(candidates) = &self.candidates {
            lines.extend(candidates.to_lines());
        }
        if let Some(message) = &self.message {
            let errors = self.bit_errors.map_or(String::new(), |errors| {
                format!(" ({errors} of {} bits differ from the expected message)", self.bits.len())
            });
            lines.push(format!("message:      {message}{}{errors}", self.other_reading()));
            // Of noise, too, a code word and bits are made; their odds suppose a mark.
            lines.extend(self.decoding().map(|how| format!("code:         {how}")));
            lines.push(match self.shows_mark() {
                true => format!("bits:         {}", certainty(&self.bits)),
                false => "bits:         no better than guessed, for no mark of this key shows".into(),
            });
        }
        lines.extend(self.p_value_lines());
        let v = &self.vertices;
        lines.push(format!(
            "vertices:     {} of {} reference vertices found among {} of the suspect",
            v.matched, v.reference, v.suspect
        ));
        lines.push(format!("registration: {}", self.registration.to_text()));
        lines.join("\n") + "\n"
    }

    fn p_value_lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let (Some(p), Some(mark), Some(recipient)) =
            (self.p_value_log10, self.p_mark_log10, self.p_recipient_log10)
        {
            let tried = if self.tried > 1 { format!(", times {} tried", self.tried) } else { String::new() };
            lines.push(format!(
                "p-value:      {} (key {}, recipient {}{tried})",
                power_of_ten(p),
                power_of_ten(mark),
                power_of_ten(recipient)
            ));
        }
        if let Some(p) = self.p_any_message_log10.filter(|_| self.verdict != Verdict::Match) {
            let says = match self.shows_key() {
                true => "a mark of this key is present, whatever its message or code",
                false => "no mark of this key shows, whatever its message",
            };
            lines.push(format!("key:          {says} (p-value {})", power_of_ten(p)));
        }
        lines
    }

    /// What the message is where nothing says whether the key whitened it.
    pub(crate) fn other_reading(&self) -> String {
        let other = self.unwhitened_message.as_ref().filter(|_| self.parameters.expected_message.is_none());
        other.map_or(String::new(), |other| format!(", or {other} if the copy was marked with MESSAGE"))
    }

    /// What LDPC did with the mark that shows, for a person.
    pub(crate) fn decoding(&self) -> Option<String> {
        let how = match self.code.decoder.filter(|_| self.shows_mark())? {
            Decoder::Sign => return None,
            Decoder::BeliefPropagation => "belief propagation, all parity checks hold",
            Decoder::OrderedStatistics => "ordered statistics, the most likely code word of those near",
        };
        let of = self.code.name.channel_bits(self.bits.len()).expect("they were decoded");
        let wrong =
            self.code.channel_bit_errors.map(|wrong| format!("{wrong} of {of} code bits were wrong; "));
        Some(format!("{}read by {how}", wrong.unwrap_or_default()))
    }

    /// Whether what was decoded is a mark rather than noise.
    pub(crate) fn shows_mark(&self) -> bool {
        self.verdict == Verdict::Match || self.shows_key()
    }

    /// Whether some mark of the key is there, whatever its message.
    pub(crate) fn shows_key(&self) -> bool {
        self.p_any_message_log10.is_some_and(|p| p < self.parameters.significance.log10())
    }

    pub(crate) fn verdict_name(&self) -> &'static str {
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
    fn new(request: &Request, seen: &Examination) -> Self {
        let p = &request.parameters;
        ReportParameters {
            key_id: request.key.id(),
            recipient: request.recipient().map(String::from),
            expected_message: request.subject.as_ref().map(|s| s.message(&request.key).to_hex()),
            amplitude_m: p.amplitude_m,
            code: p.code,
            chip_rate: p.chip_rate,
            shape: p.shape,
            basis: p.laplacian,
            patch_size: p.patch_size,
            tolerance_m: p.tolerance_m,
            precision_crs_units: p.precision,
            layers: request.layers.clone(),
            crs: seen.crs.clone(),
            demodulator: match request.demodulator {
                Demodulator::Paper => "paper",
                Demodulator::Joint => "joint",
            },
            radius_m: request.radius_m,
            significance: request.significance,
            noise_m: seen.found.as_ref().ok().map(|found| found.noise_m),
            software: format!("meshmark {}", env!("CARGO_PKG_VERSION")),
        }
    }
}

/// A probability from its logarithm.
pub fn power_of_ten(log10: f64) -> String {
    if log10 > -3.0 { format!("{:.3}", 10f64.powf(log10)) } else { format!("10^{log10:.1}") }
}

/// Text of a file on one line, without what would steer a terminal or turn the order of what is read.
pub fn printable(text: &str) -> String {
    let turns = |c: char| matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    text.chars().map(|c| if c.is_control() || turns(c) { '\u{fffd}' } else { c }).collect()
}

/// A longer name fills pages.
const LONGEST_NAME: usize = 200;

/// The same of a name, cut short when it fills pages; the JSON has all of it.
pub(crate) fn clipped(name: &str) -> String {
    let printable = printable(name);
    match printable.char_indices().nth(LONGEST_NAME) {
        None => printable,
        Some((end, _)) => format!("{}… ({} characters)", &printable[..end], name.chars().count()),
    }
}

/// How sure the bits are, from their log-likelihood ratios.
pub(crate) fn certainty(bits: &[f64]) -> String {
    let mut sure: Vec<f64> = bits.iter().map(|llr| llr.abs()).collect();
    sure.sort_by(f64::total_cmp);
    let beyond = sure.iter().filter(|llr| **llr > 1000f64.ln()).count();
    let (weakest, median) = (odds(sure[0]), odds(sure[sure.len() / 2]));
    format!("weakest right with odds {weakest}, median {median}; {beyond} of {} over 1000 to 1", bits.len())
}

/// "1000 to 1", from a log-likelihood ratio.
fn odds(llr: f64) -> String {
    if llr > 13.8 { "over a million to 1".into() } else { format!("{:.1} to 1", llr.exp()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_certainty_of_the_bits_is_in_odds() {
        let text = certainty(&[-20.0, 2f64.ln(), 7.0, -7.5, 0.0]);
        assert_eq!(text, "weakest right with odds 1.0 to 1, median 1096.6 to 1; 3 of 5 over 1000 to 1");
    }

    #[test]
    fn names_do_not_steer_the_terminal() {
        assert_eq!(printable("A\u{1b}[31m\nB é"), "A\u{fffd}[31m\u{fffd}B é");
        assert_eq!(printable("HbmG \u{202e}EMCA"), "HbmG \u{fffd}EMCA");
    }
}
