//! The likelihood ratio: how much more probable the evidence is if the suspect was made from the copy
//! of this recipient than if it was made from that of another one, or from no copy of the key.
//!
//! *The law without the copy.* The score of a recipient who had no part in the suspect is standard
//! normal, and under another key so is that of the pilots. The tail of a sum of signs is at most
//! 3.18 times the normal one, see [`survival::signs_log10`], by which a ratio above 1 is divided.
//!
//! *The law with it.* What a mark of full amplitude scores on this suspect is predicted as for the
//! power of the verdict. The amplitude that is left is unknown: any up to twice the full one is as
//! probable, and the pilots, which all copies share, say which it is. The recipient's own signs then
//! have this amplitude, or, where copies were mixed or replaced in part, any share of it. Each such
//! reservation spreads the law and makes the ratio smaller.
//!
//! *Where others were taken out first*, or the evidence is a bet, no law with the copy is predicted.
//! The ratio is then 1 / (2 √p), which exceeds k with a probability of at most 1 / k without the copy
//! (V. Vovk, R. Wang, *E-values: calibration, combination and applications*, Annals of Statistics 49,
//! 2021).
//!
//! The study `calibration` compares these ratios with scores of copies and of the innocent; no ratio
//! outside the range that it supports is stated.

use super::{
    recipients::{Standing, rounds_log10},
    survival,
};
use serde::Serialize;
use std::f64::consts::{LN_10, PI};

/// log₁₀ of the largest ratio that is stated: the study tests about so many of the innocent, none of
/// whom comes near it.
pub const MOST_LOG10: f64 = 6.0;
/// log₁₀ of the smallest ratio that is stated: the study has no more than some hundred copies.
pub const LEAST_LOG10: f64 = -2.0;

/// The largest amplitude that is considered, 1 for a mark as recorded.
const MOST_AMPLITUDE: f64 = 2.0;
/// The share of copies whose own signs are weaker than their pilots, though none is mixed.
const WEAKER: f64 = 0.1;
/// The least share of a mixture that is considered.
const LEAST_SHARE: f64 = 0.01;
/// Standard deviation of the score of a clear mark where noise differs from place to place.
const CLEAR_DEVIATION: f64 = 1.3;
/// Marks with this score are half as clear.
const HALF_CLEAR: f64 = 4.0;
/// Steps of the amplitude and of the share of a mixture.
const AMPLITUDES: usize = 2000;
const SHARES: usize = 100;
/// Width of the classes of expected scores.
const CLASS: f64 = 0.25;
/// Classes with a smaller probability do not count.
const NEGLIGIBLE: f64 = 1e-15;

/// The laws of the scores on one suspect.
#[derive(Debug, Clone)]
pub struct Laws {
    /// Scores `[of the recipient, of the pilots]` that are expected of a mark of full amplitude, and
    /// whether copies are mixed.
    expected: ([f64; 2], bool),
    /// Expected scores of the recipient whose copy it is, each with its probability given the
    /// pilots.
    with_copy: Vec<(f64, f64)>,
    /// Natural logarithm of the ratio of the pilots' score, for a mark of the key against none.
    key_ln: f64,
}

/// The likelihood ratios of a recipient, log₁₀, within what is stated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ratios {
    /// For this recipient's copy against that of another recipient.
    pub another_recipient_log10: f64,
    /// For this recipient's copy against no copy of the key.
    pub no_copy_log10: f64,
}

impl Laws {
    /// Creates the laws for scores `[of the recipient, of the pilots]` that are `expected` of a mark
    /// of full amplitude, where the pilots have this score. `is_mixed` where the evidence as a whole
    /// shows that the recipient's signs are weaker than the pilots.
    pub fn new(expected: [f64; 2], pilot_score: f64, is_mixed: bool) -> Self {
        let [of_recipient, of_pilots] = expected;
        let amplitude = |i: usize| MOST_AMPLITUDE * (i as f64 + 0.5) / AMPLITUDES as f64;
        let ratio_ln =
            |i: usize| present_ln(pilot_score, amplitude(i) * of_pilots) - standard_ln(pilot_score);
        let ratios_ln: Vec<f64> = (0..AMPLITUDES).map(ratio_ln).collect();
        let total_ln = sum_ln(&ratios_ln);
        let classes = (MOST_AMPLITUDE * of_recipient / CLASS) as usize + 2;
        let mut probability = vec![0.0; classes];
        let weaker = if is_mixed { 1.0 } else { WEAKER };
        for (i, ratio_ln) in ratios_ln.iter().enumerate() {
            let of_amplitude = (ratio_ln - total_ln).exp();
            if of_amplitude < NEGLIGIBLE {
                continue;
            }
            let expected = amplitude(i) * of_recipient;
            let mut add = |expected: f64, p: f64| probability[(expected / CLASS).round() as usize] += p;
            add(expected, (1.0 - weaker) * of_amplitude);
            for k in 0..SHARES {
                let share = LEAST_SHARE.powf((k as f64 + 0.5) / SHARES as f64);
                add(share * expected, weaker * of_amplitude / SHARES as f64);
            }
        }
        let with_copy = probability.into_iter().enumerate().filter(|(_, p)| *p >= NEGLIGIBLE);
        let with_copy = with_copy.map(|(class, p)| (class as f64 * CLASS, p)).collect();
        let key_ln = total_ln - (AMPLITUDES as f64).ln();
        Laws { expected: (expected, is_mixed), with_copy, key_ln }
    }

    /// Returns the laws for another key on the same suspect, whose pilots have this score.
    pub fn for_pilots(&self, pilot_score: f64) -> Self {
        let (expected, is_mixed) = self.expected;
        Self::new(expected, pilot_score, is_mixed)
    }

    /// Creates the laws for a suspect in which nothing moved: no mark does that, whoever its
    /// recipient is.
    pub fn of_unmoved() -> Self {
        Laws { expected: ([0.0; 2], false), with_copy: vec![(0.0, 1.0)], key_ln: f64::NEG_INFINITY }
    }

    /// Returns the ratios of a recipient.
    pub fn ratios(&self, standing: &Standing) -> Ratios {
        let is_first =
            standing.round == 1 && !standing.is_of_share && standing.score == standing.agreement.score;
        if is_first {
            return self.ratios_of_score(standing.score);
        }
        let p_log10 = (standing.p_alone_log10 + rounds_log10(standing.round, usize::MAX)).min(0.0);
        let ln = -p_log10 * LN_10 / 2.0 - 2f64.ln();
        Ratios::stated(ln, ln + cautious(self.key_ln))
    }

    /// Returns the ratios of a recipient with this score on the evidence as a whole.
    pub fn ratios_of_score(&self, score: f64) -> Ratios {
        let terms: Vec<f64> =
            self.with_copy.iter().map(|(expected, p)| p.ln() + present_ln(score, *expected)).collect();
        let ln = cautious(sum_ln(&terms) - standard_ln(score));
        Ratios::stated(ln, ln + cautious(self.key_ln))
    }
}

impl Ratios {
    /// Returns ratios, natural logarithms, as they are stated: rounded down to one decimal of log₁₀.
    fn stated(another_recipient_ln: f64, no_copy_ln: f64) -> Self {
        let stated = |ln: f64| (ln / LN_10).clamp(LEAST_LOG10, MOST_LOG10);
        // A ratio of 1 stays one whatever its last digit.
        let rounded = |log10: f64| (log10 * 10.0 + 1e-6).floor() / 10.0 + 0.0;
        let [another_recipient_log10, no_copy_log10] =
            [another_recipient_ln, no_copy_ln].map(|ln| rounded(stated(ln)));
        Ratios { another_recipient_log10, no_copy_log10 }
    }
}

/// Returns the natural logarithm of a ratio divided by the factor of the tail, if it stays above 1.
fn cautious(ratio_ln: f64) -> f64 {
    let least = ratio_ln.min(0.0);
    (ratio_ln - survival::signs_factor_log10() * LN_10).max(least)
}

/// Returns the logarithm of the density of a score whose expectation is this one.
fn present_ln(score: f64, expected: f64) -> f64 {
    let clear = expected * expected / (expected * expected + HALF_CLEAR * HALF_CLEAR);
    let deviation = (1.0 + (CLEAR_DEVIATION * CLEAR_DEVIATION - 1.0) * clear).sqrt();
    standard_ln((score - expected) / deviation) - deviation.ln()
}

/// Returns the logarithm of the density of the standard normal distribution.
fn standard_ln(score: f64) -> f64 {
    -score * score / 2.0 - (2.0 * PI).sqrt().ln()
}

/// Returns the logarithm of a sum of numbers that are given by theirs.
fn sum_ln(terms: &[f64]) -> f64 {
    let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    largest + terms.iter().map(|term| (term - largest).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decision::recipients::p_log10;
    use meshmark_core::agreement::Agreement;

    fn ratio(laws: &Laws, score: f64) -> f64 {
        laws.ratios_of_score(score).another_recipient_log10
    }

    #[test]
    fn the_copy_of_a_recipient_has_the_largest_ratio_and_an_innocent_one_of_the_same_copy_the_least() {
        let clear = Laws::new([60.0, 30.0], 30.0, false);
        assert_eq!(clear.ratios_of_score(60.0), Ratios { another_recipient_log10: 6.0, no_copy_log10: 6.0 });
        assert!(ratio(&clear, 0.0) < -1.5, "{}", ratio(&clear, 0.0));
        // Others of this key are ruled out by nothing else than their signs.
        assert_eq!(clear.ratios_of_score(0.0).no_copy_log10, MOST_LOG10);
    }

    #[test]
    fn a_mixture_of_copies_weakens_a_ratio_and_excludes_nobody() {
        let [one, mixed] = [false, true].map(|is_mixed| Laws::new([60.0, 30.0], 30.0, is_mixed));
        assert_eq!(ratio(&mixed, 20.0), MOST_LOG10);
        assert!(ratio(&mixed, 1.0) > -0.7 && ratio(&mixed, 1.0) > ratio(&one, 1.0), "{}", ratio(&mixed, 1.0));
    }

    #[test]
    fn a_suspect_that_shows_nothing_of_a_key_says_nothing_about_whose_copy_it_is() {
        let nothing = Laws::new([60.0, 30.0], 0.3, false);
        for score in [-1.0, 0.0, 1.0] {
            assert!(ratio(&nothing, score).abs() < 1.0, "{}", ratio(&nothing, score));
        }
        assert!(nothing.ratios_of_score(0.0).no_copy_log10 < -1.0, "but that it is no copy of the key");
        // Where no mark could show, there is no evidence either way.
        let blind = Laws::new([0.0, 0.0], 1.7, false);
        let even = Ratios { another_recipient_log10: 0.0, no_copy_log10: 0.0 };
        assert_eq!(blind.ratios_of_score(0.0), even);
        assert_eq!(blind.ratios_of_score(3.0), even);
        let unmoved = Laws::of_unmoved().ratios_of_score(0.0);
        assert_eq!((unmoved.another_recipient_log10, unmoved.no_copy_log10), (0.0, LEAST_LOG10));
    }

    #[test]
    fn the_innocent_have_a_mean_ratio_of_at_most_one() {
        // An integral over the standard normal scores of the innocent, in steps of 0.01.
        for laws in [
            Laws::new([60.0, 30.0], 30.0, false),
            Laws::new([20.0, 9.0], 6.0, true),
            Laws::new([3.0, 1.5], 1.0, false),
        ] {
            let scores = (-600..600).map(|i| f64::from(i) / 100.0);
            let weighted = scores.map(|s| 0.01 * standard_ln(s).exp() * 10f64.powf(ratio(&laws, s)));
            let mean: f64 = weighted.sum();
            assert!(mean < 1.0, "{mean}");
        }
    }

    #[test]
    fn evidence_that_needs_others_taken_out_is_weighed_by_its_p_value() {
        let laws = Laws::new([60.0, 30.0], 30.0, true);
        let agreement = Agreement { score: 2.0, signs: 1000, agreeing: 530 };
        let standing = |round: usize, score: f64| Standing {
            agreement,
            score,
            round,
            p_alone_log10: p_log10(score).min(0.0),
            p_value_log10: 0.0,
            is_of_share: false,
            is_named: false,
        };
        assert_eq!(laws.ratios(&standing(1, 2.0)), laws.ratios_of_score(2.0));
        let later = laws.ratios(&standing(2, 6.0)).another_recipient_log10;
        let from_p = (-(p_log10(6.0) + 6f64.log10()) / 2.0 - 2f64.log10()) * 10.0;
        assert_eq!(later, (from_p + 1e-6).floor() / 10.0);
        let of_share = Standing { is_of_share: true, p_alone_log10: -20.0, ..standing(1, 2.0) };
        assert_eq!(laws.ratios(&of_share).another_recipient_log10, MOST_LOG10);
    }
}
