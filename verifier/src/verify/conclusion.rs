//! The conclusion: a report on examination and decision, including all that needs the secret key.

use super::{examination::Examination, request::Request};
use crate::report::{Certainty, CodeEntry, Evidence, Report, ReportParameters};
use meshmark_core::{carrier::Carrier, demodulation::Demodulation, message::Message};
use meshmark_detection::{
    Demodulator,
    decision::{Decision, Decoys, p_any_message_log10},
};
use std::collections::BTreeMap;

/// Creates the report on an examination and the decision.
pub fn conclude(
    request: &Request,
    seen: &Examination,
    decision: Decision,
    seconds: &BTreeMap<&'static str, f64>,
) -> Report {
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
    let patch_scores = |patches: usize| -> Vec<Option<f64>> {
        let tested = found.zip(expected);
        let carrier = Carrier::new(&request.key);
        tested.map(|(found, expected)| found.patch_scores(&carrier, expected, patches)).unwrap_or_default()
    };
    let sketch = seen.sketch.clone();
    let evidence_map = seen.evidence_map.clone();
    Report {
        meshmark_report: 1,
        verdict: decision.verdict,
        p_value_log10: decision.p_value_log10(),
        p_mark_log10: decision.p_mark_log10,
        p_recipient_log10: decision.p_recipient_log10,
        p_missed_log10: decision.p_missed_log10,
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
        certainty: decoded.as_ref().and_then(|decoded| certainty(&decoded.message_llrs)),
        bits: decoded.map(|decoded| decoded.message_llrs).unwrap_or_default(),
        code,
        registration: seen.registration.clone(),
        vertices: seen.vertices,
        left_out: seen.left_out.clone().into(),
        parameters: report_parameters(request, seen),
        seconds: Some(seconds.clone()),
        provenance: None,
        evidence: sketch.map(|sketch| Evidence { patch_scores: patch_scores(sketch.patches.len()), sketch }),
        reference: request.reference.clone(),
        reference_digest: seen.reference_digest.clone(),
        suspect_crs: seen.suspect_crs.clone(),
        evidence_map: evidence_map.map(|map| {
            let scores = patch_scores(map.patches.len());
            map.scored(scores)
        }),
    }
}

/// Returns the certainty of bits, given their log-likelihood ratios; `None` without bits.
fn certainty(llrs: &[f64]) -> Option<Certainty> {
    let mut sure: Vec<f64> = llrs.iter().map(|llr| llr.abs()).collect();
    sure.sort_by(f64::total_cmp);
    Some(Certainty {
        weakest_llr: *sure.first()?,
        median_llr: sure[sure.len() / 2],
        over_1000_to_1: sure.iter().filter(|llr| **llr > 1000f64.ln()).count(),
    })
}

fn report_parameters(request: &Request, seen: &Examination) -> ReportParameters {
    ReportParameters {
        key_id: request.key.id(),
        recipient: request.recipient().map(String::from),
        expected_message: request.subject.as_ref().map(|s| s.message(&request.key).to_hex()),
        mark: request.parameters.clone(),
        layers: request.layers.clone(),
        crs: seen.crs.clone(),
        demodulator: match request.demodulator {
            Demodulator::Paper => "paper",
            Demodulator::Joint => "joint",
        },
        radius_m: seen.radius.metres,
        radius_reason: seen.radius.reason,
        observations: seen.observations,
        significance: request.significance,
        noise_m: seen.found.as_ref().ok().map(|found| found.noise_m),
        software: format!("meshmark {}", env!("CARGO_PKG_VERSION")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_certainty_of_bits_does_not_depend_on_their_signs() {
        let expected = Certainty { weakest_llr: 0.0, median_llr: 7.0, over_1000_to_1: 3 };
        assert_eq!(certainty(&[-20.0, 2f64.ln(), 7.0, -7.5, 0.0]), Some(expected));
        assert_eq!(certainty(&[]), None);
    }
}
