//! The answers about many records, and the one about all of them.

use super::{candidate::Candidate, disclosed, evidence::Found, examination::Examination, request::Request};
use crate::report::{Candidates, Entry};
use meshmark_core::message::Message;
use meshmark_detection::decision::{Decision, Expected, Verdict};

/// Number of the best records in the list, which also holds every match.
const MOST_LISTED: usize = 20;

/// The outcome of one candidate.
pub struct Outcome {
    /// The numbers of its group, and of the candidate in the group.
    pub place: [usize; 2],
    /// The record.
    pub candidate: Candidate,
    /// The answer about it.
    pub answer: Answered,
    bit_errors: Option<usize>,
}

/// The answer about a candidate.
pub struct Answered {
    verdict: Verdict,
    reason: String,
    p_value_log10: Option<f64>,
    p_missed_log10: Option<f64>,
    /// The decision on a message.
    pub decision: Option<Decision>,
}

/// Returns the answer about every candidate; the best one comes first.
pub fn decide_all(
    of_group: Vec<Vec<Candidate>>,
    examined: &[(Request, Examination)],
    tried: usize,
    significance: f64,
) -> Vec<Outcome> {
    let message = |group: usize| examined[group].1.message().map(|found| found.demodulation.message());
    let messages: Vec<_> = (0..examined.len()).map(message).collect();
    let decide = |(place, candidate): ([usize; 2], Candidate)| {
        let (group, number) = (place[0], place[1]);
        let (request, seen) = &examined[group];
        let expected = |_: &Message| {
            let subject = candidate.options.subject.as_ref().expect("a record has one");
            Expected::new(subject, &request.settings.key)
        };
        let expected = candidate.message.as_ref().map(expected);
        let answer = match &expected {
            Some(expected) => Answered::of_message(seen.decide(expected, tried, significance)),
            None => Answered::of_fingerprint(seen, number),
        };
        let bit_errors =
            messages[group].as_ref().zip(expected).map(|(m, expected)| m.errors(&expected.carried));
        Outcome { place, candidate, answer, bit_errors }
    };
    let numbered = |(group, candidates): (usize, Vec<Candidate>)| {
        candidates.into_iter().enumerate().map(move |(number, candidate)| ([group, number], candidate))
    };
    let all = of_group.into_iter().enumerate().flat_map(numbered);
    let mut outcomes: Vec<Outcome> = all.map(decide).collect();
    let rank = |outcome: &Outcome| {
        let p = outcome.answer.p_value_log10.unwrap_or(f64::INFINITY);
        (outcome.answer.verdict != Verdict::Match, p)
    };
    outcomes.sort_by(|a, b| {
        let ((a_other, a_p), (b_other, b_p)) = (rank(a), rank(b));
        let by_errors = a.bit_errors.cmp(&b.bit_errors);
        a_other
            .cmp(&b_other)
            .then(a_p.total_cmp(&b_p))
            .then(by_errors)
            .then(a.candidate.name.cmp(&b.candidate.name))
    });
    outcomes
}

impl Answered {
    fn of_message(decision: Decision) -> Self {
        Answered {
            verdict: decision.verdict,
            reason: decision.reason.clone(),
            p_value_log10: decision.p_value_log10(),
            p_missed_log10: decision.p_missed_log10,
            decision: Some(decision),
        }
    }

    /// Returns the answer about the fingerprint of this number in an examination.
    fn of_fingerprint(seen: &Examination, number: usize) -> Self {
        match &seen.found {
            Ok(Found::Fingerprint(found)) => {
                let (standing, answer) = &found.recipients[number];
                Answered {
                    verdict: answer.verdict,
                    reason: answer.reason.clone(),
                    p_value_log10: Some(standing.p_value_log10),
                    p_missed_log10: answer.p_missed_log10,
                    decision: None,
                }
            }
            Ok(Found::Message(_)) => unreachable!("a fingerprint is sought"),
            Err(reason) => {
                let (verdict, reason) = (Verdict::Inconclusive, reason.clone());
                Answered { verdict, reason, p_value_log10: None, p_missed_log10: None, decision: None }
            }
        }
    }
}

/// The answer about all candidates.
pub struct Overall {
    pub verdict: Verdict,
    pub reason: String,
    pub p_missed_log10: Option<f64>,
}

/// Returns the answer about all candidates, with the grounds of the best one.
pub fn overall(outcomes: &[Outcome]) -> Overall {
    let matches = count_matches(outcomes);
    let Answered { verdict, reason, p_missed_log10, .. } = &outcomes[0].answer;
    let best = Overall { verdict: *verdict, reason: reason.clone(), p_missed_log10: *p_missed_log10 };
    let missed = || outcomes.iter().filter_map(|o| o.answer.p_missed_log10).reduce(f64::max);
    let unclear = outcomes.iter().find(|o| o.answer.verdict == Verdict::Inconclusive);
    match (matches, unclear) {
        (0, Some(unclear)) => Overall {
            verdict: Verdict::Inconclusive,
            reason: unclear.answer.reason.clone(),
            p_missed_log10: missed(),
        },
        (0, None) => Overall {
            reason: "a mark with this key, this reference and the message and options of any of these records would \
                     have shown, and none does"
                .into(),
            p_missed_log10: missed(),
            ..best
        },
        (1, _) => best,
        _ => Overall {
            reason: format!(
                "for {matches} of the records the probability of so good a fit by chance is below the significance"
            ),
            ..best
        },
    }
}

fn count_matches(outcomes: &[Outcome]) -> usize {
    outcomes.iter().filter(|o| o.answer.verdict == Verdict::Match).count()
}

/// Returns the list of the best records, given how many others were skipped.
pub fn listed(outcomes: &[Outcome], skipped: usize) -> Candidates {
    let matches = count_matches(outcomes);
    let entry = |outcome: &Outcome| {
        let is_match = outcome.answer.verdict == Verdict::Match;
        Entry {
            record: outcome.candidate.name.clone(),
            sha256: outcome.candidate.read.sha256.clone(),
            recipient: outcome.candidate.recipient(),
            p_value_log10: disclosed::p_log10(outcome.answer.p_value_log10, is_match),
            bit_errors: outcome.bit_errors.filter(|_| is_match),
        }
    };
    let mut entries = outcomes.iter().map(entry);
    let list = entries.by_ref().take(MOST_LISTED.max(matches)).collect();
    let next_p_value_log10 = entries.next().and_then(|next| next.p_value_log10);
    Candidates { tried: outcomes.len(), skipped, list, next_p_value_log10, matches }
}
