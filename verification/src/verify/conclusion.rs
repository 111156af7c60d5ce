//! The conclusion: a report on examination and decision, including all that needs the secret key.

use super::{
    disclosed,
    evidence::{FingerprintEvidence, Found, MessageEvidence},
    examination::Examination,
    members::Members,
    request::{Request, Sought},
};
use crate::report::{
    Certainty, CodeEntry, Evidence, FingerprintEntry, LikelihoodEntry, MarkParameters, Member,
    PatchAgreement, Report, ReportParameters, SignAgreement,
};
use meshmark_core::{carrier::Carrier, fingerprint_record::FingerprintShape, message::Message};
use meshmark_detection::{
    Demodulator,
    decision::{Decision, Decoys, Verdict, fingerprints, p_any_message_log10},
};
use meshmark_marking::CrsSource;
use std::collections::BTreeMap;

/// Creates the report on an examination for a message and the decision.
pub fn conclude(
    request: &Request,
    seen: &Examination,
    decision: Decision,
    seconds: &BTreeMap<&'static str, f64>,
) -> Report {
    let (evidence, hypothesis) = (seen.message(), request.expected());
    let found = evidence.map(|evidence| &evidence.demodulation);
    let expected = hypothesis.as_ref().map(|hypothesis| &hypothesis.carried);
    let decoded = found.map(|found| found.decode());
    let carried = decoded.as_ref().map(|decoded| &decoded.message);
    let read = |carried: &Message| match &request.subject {
        Some(subject) => subject.message_of(carried, &request.settings.key),
        None => carried.clone(),
    };
    let tested = found.zip(expected).map(|(found, expected)| disclosed::score(found.mark_score(expected)));
    let is_match = decision.verdict == Verdict::Match;
    let p = |exact: Option<f64>| disclosed::p_log10(exact, is_match);
    let exact = decoded.as_ref().map_or(&[][..], |decoded| &decoded.message_llrs);
    let bits = disclosed::scores(exact);
    let code = CodeEntry {
        name: request.parameters.code,
        channel_bit_errors: found.zip(expected).map(|(found, m)| found.channel_bit_errors(m)),
        parity_holds: decoded.as_ref().and_then(|decoded| decoded.parity_holds),
        decoder: decoded.as_ref().map(|decoded| decoded.decoder),
    };
    let patch_scores = |patches: usize| -> Vec<Option<f64>> {
        let tested = found.zip(expected);
        let carrier = Carrier::new(&request.settings.key);
        tested.map(|(found, expected)| found.patch_scores(&carrier, expected, patches)).unwrap_or_default()
    };
    let decoys = evidence.and_then(|MessageEvidence { decoys, .. }| decoys.clone());
    Report {
        p_value_log10: p(decision.p_value_log10()),
        p_mark_log10: p(decision.p_mark_log10),
        p_recipient_log10: p(decision.p_recipient_log10),
        p_missed_log10: decision.p_missed_log10,
        p_any_message_log10: p(found.and_then(|f| p_any_message_log10(f, request.parameters.chip_rate))),
        decoys: decoys.map(|decoys| Decoys { tested, ..decoys }),
        message: carried.map(|carried| read(carried).to_hex()),
        carried_message: carried.map(Message::to_hex),
        unwhitened_message: carried.map(|carried| request.settings.key.unwhitened(carried).to_hex()),
        expected_carried: expected.filter(|_| is_match).map(Message::to_hex),
        null_hypothesis: hypothesis.as_ref().map(|hypothesis| hypothesis.null),
        tried: decision.tried,
        bit_errors: decoded.as_ref().zip(expected).map(|(decoded, m)| decoded.message.errors(m)),
        certainty: certainty(&bits),
        bits,
        code: Some(code),
        ..report(
            request,
            seen,
            (decision.verdict, decision.reason),
            seconds,
            (&patch_scores, Members::default()),
        )
    }
}

/// Creates the report on an examination for fingerprints, on the recipient of this number, who is the
/// subject of the request.
pub fn conclude_fingerprint(
    request: &Request,
    seen: &Examination,
    number: usize,
    seconds: &BTreeMap<&'static str, f64>,
) -> Report {
    let found = match &seen.found {
        Ok(Found::Fingerprint(found)) => found,
        Ok(Found::Message(_)) => unreachable!("a fingerprint is sought"),
        Err(reason) => {
            let answer = (Verdict::Inconclusive, reason.clone());
            return report(request, seen, answer, seconds, (&|_| Vec::new(), Members::default()));
        }
    };
    let FingerprintEvidence { recipients, pilots, .. } = found;
    let scored = |decoys: &Option<Decoys>, tested: Option<f64>| {
        decoys.clone().map(|decoys| Decoys { tested: tested.map(disclosed::score), ..decoys })
    };
    let of_key = FingerprintEntry {
        recipient: None,
        key: (*pilots).into(),
        patches: None,
        recipient_decoys: scored(&found.recipient_decoys, None),
        key_decoys: scored(&found.key_decoys, Some(pilots.score)),
    };
    let Some((standing, answer)) = recipients.get(number) else {
        let answer = (Verdict::Inconclusive, without_recipient(of_key.shows_key()));
        return Report {
            fingerprint: Some(of_key),
            ..report(request, seen, answer, seconds, (&|_| Vec::new(), Members::default()))
        };
    };
    let recipient = request.recipient().expect("a fingerprint is that of a recipient");
    let scores = found.patch_scores(&request.settings.key, recipient);
    let is_match = answer.verdict == Verdict::Match;
    let p = |exact: f64| disclosed::p_log10(Some(exact), is_match);
    let of_recipient = SignAgreement::from(standing.agreement);
    let of_recipient = match is_match {
        true => of_recipient,
        false => SignAgreement {
            score: disclosed::score(of_recipient.score),
            p_log10: p(of_recipient.p_log10).unwrap_or(0.0),
            ..of_recipient
        },
    };
    let fingerprint = FingerprintEntry {
        recipient: Some(of_recipient),
        patches: Some(PatchAgreement::new(&scores)),
        recipient_decoys: scored(&found.recipient_decoys, Some(standing.agreement.score)),
        ..of_key
    };
    let members = Members::new(request, found);
    Report {
        p_value_log10: p(standing.p_value_log10),
        p_recipient_log10: p(standing.p_alone_log10),
        p_missed_log10: answer.p_missed_log10,
        fingerprint: Some(fingerprint),
        likelihood: Some(LikelihoodEntry::new(answer.likelihood)),
        ..report(
            request,
            seen,
            (answer.verdict, reason(request, answer)),
            seconds,
            (&|_| scores.clone(), members),
        )
    }
}

/// Returns the reason of an answer. Without a record nothing says whether a map rests on
/// earlier editions or is cut into parts of another size.
fn reason(request: &Request, answer: &fingerprints::Answer) -> String {
    let reservation = match answer.verdict == Verdict::NoMatch && request.record.is_none() {
        true => {
            ": an edition that rests on earlier ones, or a large map in parts of another size, shows with its record alone"
        }
        false => "",
    };
    answer.reason.clone() + reservation
}

fn without_recipient(shows_key: bool) -> String {
    let remedy = "name a recipient, or give the folder with the records of all copies";
    match shows_key {
        true => format!("a mark of this key is there, and no recipient is named: {remedy}"),
        false => format!("no mark of this key shows by itself, and no recipient is named: {remedy}"),
    }
}

/// Creates a report without what depends on the version of the mark. `patch_scores` returns the
/// score of each of so many patches, or nothing.
fn report(
    request: &Request,
    seen: &Examination,
    (verdict, reason): (Verdict, String),
    seconds: &BTreeMap<&'static str, f64>,
    (patch_scores, members): (&dyn Fn(usize) -> Vec<Option<f64>>, Members),
) -> Report {
    let (sketch, evidence_map) = (seen.sketch.clone(), seen.evidence_map.clone());
    let disclosed =
        |scores: Vec<Option<f64>>| scores.into_iter().map(|score| score.map(disclosed::score)).collect();
    let patch_scores = |patches: usize| -> Vec<Option<f64>> { disclosed(patch_scores(patches)) };
    let recipients = members.recipients();
    let Members { members, of_patch } = members;
    let of_member = |member: Member| Member { patch_scores: disclosed(member.patch_scores), ..member };
    let members = members.into_iter().map(of_member).collect();
    Report {
        meshmark_report: 1,
        verdict,
        reason,
        message: None,
        carried_message: None,
        unwhitened_message: None,
        bits: Vec::new(),
        bit_errors: None,
        code: None,
        fingerprint: None,
        p_value_log10: None,
        p_mark_log10: None,
        p_recipient_log10: None,
        p_missed_log10: None,
        null_hypothesis: None,
        p_any_message_log10: None,
        likelihood: None,
        candidates: None,
        case: None,
        deposit: None,
        decoys: None,
        registration: seen.registration.clone(),
        vertices: seen.vertices,
        left_out: seen.left_out.clone().into(),
        parameters: report_parameters(request, seen, verdict),
        seconds: Some(seconds.clone()),
        provenance: None,
        evidence: sketch.map(|sketch| Evidence {
            patch_scores: patch_scores(sketch.patches.len()),
            members,
            patch_members: of_patch,
            sketch,
        }),
        tried: 1,
        certainty: None,
        expected_carried: None,
        reference: 0,
        reference_digest: seen.reference_digest.clone(),
        suspect_crs: seen.suspect_crs.clone(),
        evidence_map: evidence_map.map(|map| {
            let scores = patch_scores(map.patches.len());
            map.scored(scores, recipients)
        }),
    }
}

/// Returns the certainty of bits, given their log-likelihood ratios as disclosed; `None` without bits.
fn certainty(llrs: &[f64]) -> Option<Certainty> {
    let mut sure: Vec<f64> = llrs.iter().map(|llr| llr.abs()).collect();
    sure.sort_by(f64::total_cmp);
    Some(Certainty {
        weakest_llr: *sure.first()?,
        median_llr: sure[sure.len() / 2],
        over_1000_to_1: sure.iter().filter(|llr| **llr > 1000f64.ln()).count(),
    })
}

fn report_parameters(request: &Request, seen: &Examination, verdict: Verdict) -> ReportParameters {
    // The message of another copy, together with the leaked one, makes the mark of that copy.
    let is_disclosed = verdict == Verdict::Match || request.is_message_given();
    let subject = request.subject.as_ref().filter(|_| is_disclosed);
    let (mark, expected_message) = match &request.sought {
        Sought::Message { .. } => (
            MarkParameters::Message(request.parameters.clone()),
            subject.map(|subject| subject.message(&request.settings.key).to_hex()),
        ),
        Sought::Fingerprint { coefficients, .. } => {
            // Maps that rest on others or fit them are not cut, so that the reference has all vertices.
            let is_cut = (1..seen.vertices.reference).contains(&request.part_size);
            let part_size = is_cut.then_some(request.part_size);
            let shape = FingerprintShape::new(*coefficients, &request.parameters, part_size);
            (MarkParameters::Fingerprint(shape), None)
        }
    };
    let noise_m = match seen.found.as_ref().ok() {
        Some(Found::Message(evidence)) => Some(evidence.demodulation.noise_m),
        Some(Found::Fingerprint(evidence)) => Some(evidence.noise_m),
        None => None,
    };
    let (crs_source, crs_of_reference) = match &seen.crs_source {
        CrsSource::Map => (Some("reference"), None),
        CrsSource::Option => (Some("option"), None),
        CrsSource::Record { other } => (Some("record"), other.clone()),
    };
    ReportParameters {
        key_id: request.settings.key.id(),
        recipient: request.recipient().map(String::from),
        expected_message,
        mark,
        layers: request.layers.clone(),
        crs: seen.crs.clone(),
        crs_source: crs_source.filter(|_| seen.crs.is_some()),
        crs_of_reference,
        demodulator: match request.settings.demodulator {
            Demodulator::Paper => "paper",
            Demodulator::Joint => "joint",
        },
        radius_m: seen.radius.metres,
        radius_reason: seen.radius.reason,
        observations: seen.observations,
        significance: request.settings.significance,
        noise_m,
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

    #[test]
    fn the_odds_of_bits_disclose_no_more_digits_than_their_ratios() {
        let certain = |llrs: &[f64]| certainty(&disclosed::scores(llrs));
        assert_eq!(certain(&[2.0449, -7.0151, 9.0]), certain(&[1.9551, -6.9851, 9.0]));
        assert_ne!(certain(&[2.1]), certain(&[2.0]));
    }
}
