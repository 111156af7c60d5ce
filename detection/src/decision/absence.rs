//! Absence: decides whether an undetected mark is absent. "No match" is a statement like "match"
//! and has its own error rate: the probability that a mark which the suspect carries would be
//! missed.

use super::{
    rivals, survival,
    verdict::{MARK, Verdict},
};
use crate::power::Power;
use meshmark_core::demodulation::Demodulation;

/// The verdict is "no match" only where a present mark would be missed with a smaller probability.
pub(super) const MOST_MISSED_LOG10: f64 = -3.0;
/// A smaller p-value is never "no match".
pub(super) const SUSPICIOUS_LOG10: f64 = -2.0;
/// No smaller probability of missing a mark is stated: the studies support no more.
pub(super) const LEAST_MISSED_LOG10: f64 = -6.0;
/// Standard deviation of the score of a mark around that of one trial mark on the same suspect:
/// each varies by up to 1.3 where noise differs from place to place, so that the variance of their
/// difference is 2 · 1.3².
pub(super) const TRIAL_DEVIATION: f64 = 1.84;
/// The bits of a copy of one recipient have this share of the energy of a message, or more; those
/// of an average or a patchwork of copies have less.
pub(super) const LEAST_FULLNESS: f64 = 0.85;
/// Least standard deviation of the agreement of a recipient's bits.
const LEAST_DEVIATION: f64 = 0.1;

/// What an expected message shows without matching.
pub(super) struct Unmatched<'a> {
    pub found: &'a Demodulation,
    pub power: Power,
    /// Number of bits of the message.
    pub bits: usize,
    /// The significance for each of the tried messages.
    pub each: f64,
    /// The significance for all of them.
    pub significance: f64,
    /// log₁₀ of the p-value of the message alone, and of all that were tried.
    pub p_log10: [f64; 2],
}

/// The verdict on a message that does not match.
pub(super) struct Absence {
    pub verdict: Verdict,
    pub reason: String,
    /// log₁₀ of the probability of missing a present mark.
    pub p_missed_log10: f64,
}

impl Unmatched<'_> {
    /// Decides between "no match" and "inconclusive".
    pub fn decide(&self) -> Absence {
        let needed = survival::normal_quantile(self.each);
        let missed = self.missed_log10(needed);
        let (verdict, reason) = match self.doubt(needed, missed) {
            Some(doubt) => (Verdict::Inconclusive, doubt),
            None => (Verdict::NoMatch, format!("{MARK} would have shown, and it does not")),
        };
        Absence { verdict, reason, p_missed_log10: missed }
    }

    /// Decides for a suspect that carries a mark of the key while another message explains it as
    /// well or better. A copy of the expected message is missed with at most the p-value of the
    /// decoded one, whose null hypothesis is any other message.
    pub fn another_message(&self) -> Absence {
        let decoded = self.found.message();
        let standing = rivals::standing(self.found, &decoded);
        let p_missed_log10 = standing.p_log10.max(LEAST_MISSED_LOG10);
        let stands_alone = standing.p_log10 < self.each.log10() && !standing.is_mixed;
        let is_no_match = stands_alone && !self.is_suspicious() && p_missed_log10 < MOST_MISSED_LOG10;
        let (verdict, reason) = match is_no_match {
            true => (
                Verdict::NoMatch,
                format!("a mark of this key is there, and it carries another message, {}", decoded.to_hex()),
            ),
            false => (
                Verdict::Inconclusive,
                "a mark of this key is there, but a message that differs in few bits explains it as well, and a message \
                 that was not whitened names nobody then"
                    .into(),
            ),
        };
        Absence { verdict, reason, p_missed_log10 }
    }

    /// Returns whether chance rarely gives so much evidence.
    fn is_suspicious(&self) -> bool {
        let [alone, of_all] = self.p_log10;
        of_all < SUSPICIOUS_LOG10 || alone < self.significance.log10()
    }

    /// Returns why the verdict cannot be "no match", and what would help; `None` where it can.
    fn doubt(&self, needed: f64, missed: f64) -> Option<String> {
        let (bits, each) = (self.bits, self.each);
        let least_root = needed + survival::normal_quantile(10f64.powf(MOST_MISSED_LOG10)) * LEAST_DEVIATION;
        if (self.found.estimate.len() as f64).sqrt() <= least_root {
            return Some(format!(
                "a message of {bits} bits is too short for its absence to show at a significance of {each:.1e}: give a \
                 larger one, or mark with {} bits or more",
                (least_root.powi(2) as usize + 1).next_multiple_of(4)
            ));
        }
        if self.is_suspicious() {
            return Some(
                "the evidence for this mark is weak, but stronger than chance usually gives: a larger piece of the \
                 suspect, or the edition of the reference that was marked, would show more"
                    .into(),
            );
        }
        if self.power == Power::KeyShows && self.fullness() < LEAST_FULLNESS {
            return Some(
                "a mark of this key is there, and its bits are weaker than those of one copy: copies of several \
                 recipients may be mixed, features replaced, or the mark made with another code, so that nobody can be ruled \
                 out; a part of the suspect may show more than all of it"
                    .into(),
            );
        }
        (missed >= MOST_MISSED_LOG10).then(|| {
            format!(
                "too few vertices match, or too roughly, for {MARK} to show: a larger piece of the suspect, or the edition \
                 of the reference that was marked, would show more"
            )
        })
    }

    /// Returns log₁₀ of the probability that a present mark has a score below `needed`, or the
    /// least that is stated.
    fn missed_log10(&self, needed: f64) -> f64 {
        let of_recipient = {
            // With the mark present b̂_j has mean 1 − v_j and variance v_j (1 − v_j).
            let shares = self.found.variance.iter().map(|v| (1.0 - v).clamp(0.0, 1.0));
            let (known, spread) =
                shares.fold((0.0, 0.0), |(k, s), share| (k + share, s + share * (1.0 - share)));
            let deviation = if known > 0.0 { (spread / known).sqrt() } else { 0.0 };
            survival::normal_log10((f64::sqrt(known) - needed) / deviation.max(LEAST_DEVIATION))
        };
        let of_key = match self.power {
            Power::Unmoved => return LEAST_MISSED_LOG10,
            Power::KeyShows => LEAST_MISSED_LOG10,
            Power::Trial(score) => survival::normal_log10((score - needed) / TRIAL_DEVIATION),
        };
        of_recipient.max(of_key).max(LEAST_MISSED_LOG10)
    }

    /// Returns the energy of the estimated bits as a share of that of a message.
    fn fullness(&self) -> f64 {
        let found: f64 = self.found.estimate.iter().map(|b| b * b).sum();
        let full: f64 = self.found.variance.iter().map(|v| (1.0 - v).max(0.0)).sum();
        if full > 0.0 { found / full } else { 0.0 }
    }
}
