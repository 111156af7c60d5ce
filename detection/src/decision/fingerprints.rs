//! The verdict on the fingerprint of a recipient: match, no match, or inconclusive.

use super::{
    absence::{LEAST_FULLNESS, LEAST_MISSED_LOG10, MOST_MISSED_LOG10, SUSPICIOUS_LOG10, TRIAL_DEVIATION},
    recipients::{Standing, needed_score, p_log10},
    survival,
    verdict::Verdict,
};
use crate::power::Power;
use meshmark_core::agreement::Evidence;

/// The subject of a verdict; a change to any of these makes another mark.
const COPY: &str = "a copy of this recipient, made with this key, options and reference,";

/// The amplitude of pilots may be larger than that of the mark by this many standard deviations.
const AMPLITUDE_DEVIATIONS: f64 = 2.0;

/// What a verdict on fingerprints rests on besides the standing of a recipient. All recipients
/// share it.
pub struct Grounds {
    significance: f64,
    /// Whether a mark of the key shows and is weaker than that of one copy.
    is_mixed: bool,
    /// Whether the pilots show more of the key than chance usually does.
    may_have_key: bool,
    /// log₁₀ of the probability that the copy of one recipient has a score below the one needed, or
    /// the least that is stated.
    missed_log10: f64,
}

/// The answer about a recipient, and its grounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The answer.
    pub verdict: Verdict,
    /// The reason, one sentence.
    pub reason: String,
    /// log₁₀ of the probability that the test misses a mark which the suspect carries; `None` for a
    /// match.
    pub p_missed_log10: Option<f64>,
}

impl Grounds {
    /// Collects what a present mark would show. The amplitude of the key's pilots is 1 for a mark of
    /// full amplitude, and as uncertain as their score allows; `tried` recipients share the
    /// `significance`.
    pub fn new(
        evidence: &Evidence,
        (pilot_amplitude, pilot_score): (f64, f64),
        power: Power,
        (tried, significance): (usize, f64),
    ) -> Self {
        let least_amplitude = pilot_amplitude * (1.0 - AMPLITUDE_DEVIATIONS / pilot_score).max(0.0);
        let is_mixed = power == Power::KeyShows && evidence.fullness(least_amplitude) < LEAST_FULLNESS;
        let expected = match power {
            Power::Unmoved => f64::INFINITY,
            Power::KeyShows => evidence.expected_score(pilot_amplitude),
            Power::Trial(score) => score,
        };
        let lack = (expected - needed_score(tried, significance)) / TRIAL_DEVIATION;
        let missed_log10 = match lack.is_finite() {
            true => survival::normal_log10(lack).max(LEAST_MISSED_LOG10),
            false => LEAST_MISSED_LOG10,
        };
        let may_have_key = p_log10(pilot_score) < SUSPICIOUS_LOG10;
        Grounds { significance, is_mixed, may_have_key, missed_log10 }
    }

    /// Returns whether copies of several recipients may be mixed, so that a look for the shares of
    /// those who are not named may show more: the signs are weak, or nobody is named.
    pub fn ask_for_shares(&self, standings: &[Standing]) -> bool {
        self.is_mixed || self.may_have_key && standings.iter().all(|standing| !standing.is_named)
    }

    /// Decides on a recipient.
    pub fn decide(&self, standing: &Standing) -> Answer {
        if standing.is_named {
            let what = match standing.is_of_share {
                true => "agree so well with a share of the coordinates",
                false => "agree so well",
            };
            let reason = format!(
                "the probability that the secret signs of a recipient {what} by chance is below the significance of {:e}",
                self.significance
            );
            return Answer { verdict: Verdict::Match, reason, p_missed_log10: None };
        }
        let (verdict, reason) = match self.doubt(standing) {
            Some(doubt) => (Verdict::Inconclusive, doubt),
            None => (Verdict::NoMatch, format!("{COPY} would have shown, and it does not")),
        };
        Answer { verdict, reason, p_missed_log10: Some(self.missed_log10) }
    }

    /// Returns why the verdict cannot be "no match", and what would help; `None` where it can.
    fn doubt(&self, standing: &Standing) -> Option<String> {
        let alone = p_log10(standing.score);
        if standing.p_value_log10 < SUSPICIOUS_LOG10 || alone < self.significance.log10() {
            return Some(
                "the evidence for this recipient is weak, but stronger than chance usually gives: a larger piece of \
                 the suspect, or the edition of the reference that was marked, would show more"
                    .into(),
            );
        }
        if self.is_mixed {
            return Some(
                "a mark of this key is there, and its signs are weaker than those of one copy: copies of several \
                 recipients may be mixed, or features replaced, so that nobody can be ruled out; a part of the suspect \
                 may show more than all of it"
                    .into(),
            );
        }
        (self.missed_log10 >= MOST_MISSED_LOG10).then(|| {
            format!(
                "too few vertices match, or too roughly, for {COPY} to show: a larger piece of the suspect, or the \
                 edition of the reference that was marked, would show more"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{super::recipients::name_recipients, *};
    use meshmark_core::{
        estimation::Estimates,
        fingerprint::{Fingerprint, pilots, recipient_signs},
        key::SecretKey,
        part::Parts,
        signs::{Sequence, Signs},
        vertices::VertexTable,
    };

    const COEFFICIENTS: usize = 256;
    const SIGNIFICANCE: f64 = 1e-6;

    fn key() -> SecretKey {
        SecretKey::from_bytes([3; 32])
    }

    fn part() -> Parts {
        Parts::whole(&VertexTable::new(vec![[0.0, 1.0]]).unwrap())
    }

    fn signs(name: &str) -> Sequence {
        recipient_signs(&key(), &part(), name)
    }

    /// Estimates of this share of all signs of the mean of copies, on so many patches.
    fn mean_of(names: &[&str], share: f64, patches: usize) -> Estimates {
        let copies: Vec<Fingerprint> =
            names.iter().map(|name| Fingerprint::new(&key(), &part(), name)).collect();
        let of_axis = |(patch, axis): (usize, usize)| {
            let all: Vec<_> = copies.iter().map(|copy| copy.signs(patch, axis, COEFFICIENTS)).collect();
            let mean = |i: usize| all.iter().map(|signs| signs[i]).sum::<f64>() / all.len() as f64;
            (0..COEFFICIENTS).map(|i| share * mean(i)).collect::<Vec<_>>()
        };
        let values: Vec<f64> = (0..2 * patches).map(|i| (i / 2, i % 2)).flat_map(of_axis).collect();
        Estimates { variances: vec![1.0 - share; values.len()], values, coefficients: COEFFICIENTS }
    }

    /// Returns the answer about the last of `tried` recipients.
    fn answer(estimates: &Estimates, power: Power, tried: &[&str]) -> Answer {
        let evidence = Evidence::of_recipients(estimates);
        let (of_pilots, pilots) = (Evidence::of_pilots(estimates), pilots(&key(), &part()));
        let seen = (of_pilots.amplitude(&pilots), of_pilots.agreement(&pilots).score);
        let candidates: Vec<Sequence> = tried.iter().map(|name| signs(name)).collect();
        let standings = name_recipients(&evidence, &candidates, SIGNIFICANCE);
        let grounds = Grounds::new(&evidence, seen, power, (tried.len(), SIGNIFICANCE));
        grounds.decide(standings.last().unwrap())
    }

    #[test]
    fn the_copy_of_one_recipient_matches_its_own_and_rules_out_others() {
        let copy = mean_of(&["A"], 0.95, 4);
        let own = answer(&copy, Power::KeyShows, &["A"]);
        assert_eq!((own.verdict, own.p_missed_log10), (Verdict::Match, None));
        assert_eq!(answer(&copy, Power::KeyShows, &["B", "A"]).verdict, Verdict::Match);
        let other = answer(&copy, Power::KeyShows, &["B"]);
        assert_eq!(other.verdict, Verdict::NoMatch, "{other:?}");
        assert_eq!(other.p_missed_log10, Some(LEAST_MISSED_LOG10));
    }

    #[test]
    fn a_mixture_of_copies_rules_nobody_out() {
        for members in [&["A", "B"][..], &["A", "B", "C", "D"]] {
            let mixed = mean_of(members, 0.95, 4);
            assert_eq!(answer(&mixed, Power::KeyShows, &["A"]).verdict, Verdict::Match);
            let other = answer(&mixed, Power::KeyShows, &["E"]);
            assert!(other.verdict == Verdict::Inconclusive && other.reason.contains("mixed"), "{other:?}");
        }
    }

    #[test]
    fn without_the_key_a_trial_mark_that_shows_rules_out_a_recipient_and_a_weak_one_does_not() {
        let nothing = Estimates { values: vec![0.0; 2048], ..mean_of(&["A"], 0.5, 4) };
        assert_eq!(answer(&nothing, Power::Unmoved, &["A"]).verdict, Verdict::NoMatch);
        let noise: Vec<f64> = (0..2048).map(|i| (i * 7919 % 101) as f64 / 50.0 - 1.0).collect();
        let noise = Estimates { values: noise, ..nothing };
        assert_eq!(answer(&noise, Power::Trial(14.0), &["A"]).verdict, Verdict::NoMatch);
        let weak = answer(&noise, Power::Trial(9.0), &["A"]);
        assert_eq!(weak.verdict, Verdict::Inconclusive);
        assert!(weak.reason.contains("too few vertices match") && weak.p_missed_log10.unwrap() > -3.0);
        // The same trial mark is too weak among many.
        let names: Vec<String> = (0..100_000).map(|k| format!("recipient {k}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        assert_eq!(answer(&noise, Power::Trial(11.0), &names[..1]).verdict, Verdict::NoMatch);
        assert_eq!(answer(&noise, Power::Trial(11.0), &names).verdict, Verdict::Inconclusive);
    }

    #[test]
    fn weak_evidence_is_never_no_match() {
        let evidence = Evidence::of_recipients(&mean_of(&["A"], 0.95, 4));
        let grounds = |tried, significance| {
            Grounds::new(&evidence, (1.0, 20.0), Power::Trial(50.0), (tried, significance))
        };
        let standing = |score: f64, p_value_log10: f64| {
            let agreement = evidence.agreement(&signs("B"));
            Standing {
                agreement,
                score,
                round: 1,
                p_alone_log10: p_log10(score),
                p_value_log10,
                is_of_share: false,
                is_named: false,
            }
        };
        let verdict = |grounds: Grounds, standing| grounds.decide(&standing).verdict;
        assert_eq!(verdict(grounds(1, 1e-6), standing(3.0, -2.4)), Verdict::Inconclusive);
        assert_eq!(verdict(grounds(1, 1e-6), standing(2.0, -1.1)), Verdict::NoMatch);
        // Alone it would be named, among many it is chance.
        assert_eq!(verdict(grounds(1 << 20, 1e-6), standing(5.1, 0.0)), Verdict::Inconclusive);
    }
}
