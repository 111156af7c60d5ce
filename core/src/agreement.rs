//! The agreement of secret signs with the estimates of a suspect.
//!
//! For a recipient who has nothing to do with the copy, the signs s_i are random and independent of
//! the suspect. T = Σ s_i ŝ_i / √(Σ ŝ_i²) then has mean 0 and variance 1 *given the suspect*, as a
//! weighted sum of independent random signs, whatever happened to it.

use crate::{
    estimation::Estimates,
    signs::{Sequence, Signs, decoy_sums, is_pilot, signed},
};
use rayon::prelude::*;

/// Rounds in which the shares of several recipients are fitted together. Their signs are nearly
/// orthogonal, so each round leaves a small part of the error of the one before.
const ROUNDS: usize = 4;
/// The same for amplitudes that are not negative.
const ROUNDS_OF_AMPLITUDES: usize = 8;
/// Numbers that the patterns of all suspected candidates have together, at most.
const MOST_NUMBERS: usize = 1 << 25;

/// How far secret signs agree with the estimates of a suspect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// T, in standard deviations of the agreement of random signs; 0 where nothing was observed.
    pub score: f64,
    /// Number of signs that the suspect shows.
    pub signs: usize,
    /// Number of them that agree.
    pub agreeing: usize,
}

impl Agreement {
    /// Returns how many signs would agree by chance, and the standard deviation of that number.
    pub fn by_chance(&self) -> [f64; 2] {
        [self.signs as f64 / 2.0, (self.signs as f64).sqrt() / 2.0]
    }
}

/// The estimates of the signs in question, with all that does not depend on whose signs they are.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// ŝ_i: patches × 2 axes × coefficients; 0 for signs that are not in question.
    values: Vec<f64>,
    /// 1 − v_i, the share of the sign that a mark of full amplitude shows.
    shares: Vec<f64>,
    coefficients: usize,
}

impl Evidence {
    /// Selects the estimates of signs that belong to a recipient.
    pub fn of_recipients(estimates: &Estimates) -> Self {
        Self::selected(estimates, |i| !is_pilot(i))
    }

    /// Selects the estimates of pilots, whose signs belong to the key, whoever the recipient is.
    pub fn of_pilots(estimates: &Estimates) -> Self {
        Self::selected(estimates, is_pilot)
    }

    /// Selects coefficients by their number in patch and axis, counted from 1.
    fn selected(estimates: &Estimates, is_in_question: impl Fn(usize) -> bool) -> Self {
        let Estimates { values, variances, coefficients } = estimates;
        let keep = |(i, value): (usize, f64)| if is_in_question(i % coefficients + 1) { value } else { 0.0 };
        Evidence {
            values: values.iter().copied().enumerate().map(keep).collect(),
            shares: variances.iter().map(|v| 1.0 - v).enumerate().map(keep).collect(),
            coefficients: *coefficients,
        }
    }

    /// Returns the agreement with secret signs.
    pub fn agreement(&self, signs: &Sequence) -> Agreement {
        self.agreement_on(signs, 0..self.patches())
    }

    /// Returns the agreement with secret signs in each patch alone.
    pub fn patch_agreements(&self, signs: &Sequence) -> Vec<Agreement> {
        (0..self.patches()).map(|patch| self.agreement_on(signs, patch..patch + 1)).collect()
    }

    /// Returns the scores of `count` decoys on the same suspect: recipients or keys that nobody made,
    /// with random signs. Decoy k takes them from ChaCha20 stream k.
    pub fn decoy_scores(&self, count: usize, seed: [u8; 32]) -> Vec<f64> {
        let deviation = self.energy().sqrt();
        decoy_sums(&self.values, count, seed).into_iter().map(|sum| ratio(sum, deviation)).collect()
    }

    /// Returns the amplitude of secret signs that fits best, 1 for a mark of full amplitude.
    pub fn amplitude(&self, signs: &Sequence) -> f64 {
        ratio(dot(&self.pattern(signs), &self.values), dot(&self.shares, &self.shares))
    }

    /// Returns Σ ŝ_i².
    pub fn energy(&self) -> f64 {
        dot(&self.values, &self.values)
    }

    /// Returns the expected score of the only recipient of a copy of this amplitude.
    pub fn expected_score(&self, amplitude: f64) -> f64 {
        amplitude * ratio(self.shares.iter().sum(), self.energy().sqrt())
    }

    /// Returns the energy of the estimates as a share of that of a copy of this amplitude. Of an
    /// average of copies it is one part in as many.
    pub fn fullness(&self, amplitude: f64) -> f64 {
        // The estimates of a copy have mean β (1 − v) s and variance v (1 − v).
        let of_copy = |share: &f64| (amplitude * share).powi(2) + share * (1.0 - share);
        ratio(self.energy(), self.shares.iter().map(of_copy).sum())
    }

    /// Returns the number of patches.
    pub fn patches(&self) -> usize {
        self.values.len() / self.coefficients / 2
    }

    fn agreement_on(&self, signs: &Sequence, patches: std::ops::Range<usize>) -> Agreement {
        let (mut sum, mut energy) = (0.0, 0.0);
        let (mut count, mut agreeing) = (0, 0);
        let axes = patches.flat_map(|patch| [(patch, 0), (patch, 1)]);
        for (patch, axis) in axes {
            let values = self.axis(&self.values, patch, axis);
            if values.iter().all(|value| *value == 0.0) {
                continue;
            }
            for (values, word) in values.chunks(64).zip(signs.words(patch, axis)) {
                for (i, &value) in values.iter().enumerate() {
                    let agreement = signed(value, word, i);
                    sum += agreement;
                    energy += value * value;
                    count += usize::from(value != 0.0);
                    agreeing += usize::from(agreement > 0.0);
                }
            }
        }
        Agreement { score: ratio(sum, f64::sqrt(energy)), signs: count, agreeing }
    }

    /// Returns what remains when the shares of some recipients are taken out: Σ_k β_k (1 − v) s_k,
    /// with the β_k that leave the least squares. Signs of other recipients are independent of
    /// it, too.
    pub fn without(&self, recipients: &[Sequence]) -> Self {
        let mut rest = self.clone();
        let energy = dot(&self.shares, &self.shares);
        for signs in std::iter::repeat_n(recipients, ROUNDS).flatten() {
            let pattern = self.pattern(signs);
            let amplitude = ratio(dot(&pattern, &rest.values), energy);
            rest.values.iter_mut().zip(&pattern).for_each(|(value, p)| *value -= amplitude * p);
        }
        rest
    }

    /// Returns the scores of all candidates beside the others: of the estimates, Σ_j β_j (1 − v) s_j is
    /// taken out, where j are the *other* candidates that are suspected and the β_j ≥ 0 leave the
    /// least squares. A candidate is suspected whose score in all estimates is `least_score` or more.
    /// What remains for a candidate depends on the suspect and on the signs of others alone, so that
    /// signs that have nothing to do with the suspect are independent of it.
    pub fn scores_beside_others(&self, candidates: &[Sequence], least_score: f64) -> Vec<f64> {
        let alone: Vec<f64> = candidates.par_iter().map(|signs| self.agreement(signs).score).collect();
        let suspected: Vec<usize> = (0..alone.len()).filter(|&k| alone[k] >= least_score).collect();
        if suspected.len() * self.values.len() > MOST_NUMBERS {
            return alone;
        }
        let patterns: Vec<Vec<f64>> = suspected.par_iter().map(|&k| self.pattern(&candidates[k])).collect();
        let fit = Fit::new(&patterns, &self.values);
        let beside = |own: Option<usize>| {
            let mut rest = self.clone();
            for (amplitude, pattern) in fit.amplitudes(own).iter().zip(&patterns) {
                rest.values.iter_mut().zip(pattern).for_each(|(value, p)| *value -= amplitude * p);
            }
            rest
        };
        let beside_all = beside(None);
        let score = |(k, signs): (usize, &Sequence)| match suspected.binary_search(&k) {
            Ok(own) => beside(Some(own)).agreement(signs).score,
            Err(_) => beside_all.agreement(signs).score,
        };
        candidates.par_iter().enumerate().map(score).collect()
    }

    /// Returns the expected estimates of a copy with these signs.
    fn pattern(&self, signs: &Sequence) -> Vec<f64> {
        let axes = (0..self.patches()).flat_map(|patch| [(patch, 0), (patch, 1)]);
        let of_axis = |(patch, axis)| {
            let shares = self.axis(&self.shares, patch, axis).iter();
            let signs = signs.signs(patch, axis, self.coefficients);
            shares.zip(signs).map(|(share, sign)| share * sign).collect::<Vec<_>>()
        };
        axes.flat_map(of_axis).collect()
    }

    fn axis<'a>(&self, of_all: &'a [f64], patch: usize, axis: usize) -> &'a [f64] {
        &of_all[(2 * patch + axis) * self.coefficients..][..self.coefficients]
    }
}

/// The least squares of amplitudes that are not negative.
struct Fit {
    /// The products of patterns with each other and with the estimates.
    gram: Vec<Vec<f64>>,
    with_values: Vec<f64>,
}

impl Fit {
    fn new(patterns: &[Vec<f64>], values: &[f64]) -> Self {
        let products = |a: &Vec<f64>| patterns.iter().map(|b| dot(a, b)).collect();
        Fit {
            gram: patterns.par_iter().map(products).collect(),
            with_values: patterns.iter().map(|pattern| dot(pattern, values)).collect(),
        }
    }

    /// Returns the amplitudes of all patterns; that of pattern `without` is 0.
    fn amplitudes(&self, without: Option<usize>) -> Vec<f64> {
        let mut amplitudes = vec![0.0; self.gram.len()];
        for _ in 0..ROUNDS_OF_AMPLITUDES {
            for (j, row) in self.gram.iter().enumerate().filter(|(j, _)| Some(*j) != without) {
                let rest = self.with_values[j] - dot(row, &amplitudes);
                amplitudes[j] = (amplitudes[j] + ratio(rest, row[j])).max(0.0);
            }
        }
        amplitudes
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COEFFICIENTS: usize = 100;

    fn sequence(number: u32) -> Sequence {
        let mut seed = [7; 32];
        seed[..4].copy_from_slice(&number.to_le_bytes());
        Sequence::new(seed)
    }

    /// Estimates of the mean of copies with these signs on 20 patches; the estimates differ in
    /// size, and nothing of patch 3 was observed.
    fn mean_of(copies: &[u32]) -> Estimates {
        let share = |patch: usize, i: usize| if patch == 3 { 0.0 } else { 0.5 + (i % 7) as f64 / 14.0 };
        let axes = (0..20).flat_map(|patch| [(patch, 0), (patch, 1)]);
        let (mut values, mut variances) = (Vec::new(), Vec::new());
        for (patch, axis) in axes {
            let signs = copies.iter().map(|&copy| sequence(copy).signs(patch, axis, COEFFICIENTS));
            let signs: Vec<_> = signs.collect();
            for i in 0..COEFFICIENTS {
                let mean = signs.iter().map(|signs| signs[i]).sum::<f64>() / copies.len() as f64;
                values.push(share(patch, i) * mean);
                variances.push(1.0 - share(patch, i));
            }
        }
        Estimates { values, variances, coefficients: COEFFICIENTS }
    }

    #[test]
    fn all_signs_of_the_own_copy_agree_and_those_of_others_as_by_chance() {
        let evidence = Evidence::of_recipients(&mean_of(&[1]));
        let own = evidence.agreement(&sequence(1));
        assert_eq!((own.signs, own.agreeing), (19 * 2 * 88, 19 * 2 * 88));
        // Of equal estimates it would be the root of their number.
        assert!(own.score > 0.95 * (own.signs as f64).sqrt() && own.score < (own.signs as f64).sqrt());
        let [mean, deviation] = own.by_chance();
        for other in 2..50 {
            let other = evidence.agreement(&sequence(other));
            assert!((other.agreeing as f64 - mean).abs() < 5.0 * deviation && other.score.abs() < 5.0);
        }
        let nothing = mean_of(&[1]);
        let nothing = Estimates { values: vec![0.0; nothing.values.len()], ..nothing };
        let agreement = Evidence::of_recipients(&nothing).agreement(&sequence(1));
        assert_eq!(agreement, Agreement { score: 0.0, signs: 0, agreeing: 0 });
    }

    #[test]
    fn scores_of_unrelated_recipients_are_standard_normal_whatever_the_estimates_are() {
        // A few large values among many small ones.
        let value = |i: usize| if i.is_multiple_of(50) { 3.0 } else { 0.1 * (i % 11) as f64 };
        let estimates = Estimates {
            values: (0..4000).map(value).collect(),
            variances: vec![0.5; 4000],
            coefficients: COEFFICIENTS,
        };
        let evidence = Evidence::of_recipients(&estimates);
        let scores: Vec<f64> = (0..10_000).map(|k| evidence.agreement(&sequence(k)).score).collect();
        let mean = scores.iter().sum::<f64>() / 1e4;
        let variance = scores.iter().map(|s| s * s).sum::<f64>() / 1e4;
        // The limits are 5 deviations.
        assert!(mean.abs() < 0.05 && (variance - 1.0).abs() < 0.07, "{mean} {variance}");
        let beyond = scores.iter().filter(|s| **s > 1.644_854).count();
        assert!((390..610).contains(&beyond), "{beyond} instead of 500");
    }

    #[test]
    fn scores_of_decoys_are_standard_normal_and_the_same_again() {
        let evidence = Evidence::of_recipients(&mean_of(&[1]));
        let scores = evidence.decoy_scores(10_000, [5; 32]);
        assert_eq!(scores[..100], evidence.decoy_scores(100, [5; 32]));
        let mean = scores.iter().sum::<f64>() / 1e4;
        let variance = scores.iter().map(|s| s * s).sum::<f64>() / 1e4;
        assert!(mean.abs() < 0.05 && (variance - 1.0).abs() < 0.07, "{mean} {variance}");
        assert_ne!(scores[..100], Evidence::of_pilots(&mean_of(&[1])).decoy_scores(100, [5; 32]));
    }

    #[test]
    fn pilots_and_signs_of_recipients_are_different_coefficients_and_together_all() {
        let estimates = mean_of(&[1]);
        let [own, pilots] = [Evidence::of_recipients(&estimates), Evidence::of_pilots(&estimates)];
        let sum = own.values.iter().zip(&pilots.values).map(|(a, b)| a + b);
        assert!(sum.eq(estimates.values.iter().copied()));
        assert_eq!(pilots.agreement(&sequence(1)).signs, 19 * 2 * 12);
    }

    #[test]
    fn patches_have_agreements_of_their_own_which_add_up() {
        let evidence = Evidence::of_recipients(&mean_of(&[1]));
        let (whole, each) = (evidence.agreement(&sequence(1)), evidence.patch_agreements(&sequence(1)));
        assert_eq!(each.len(), 20);
        assert_eq!(each[3], Agreement { score: 0.0, signs: 0, agreeing: 0 });
        assert_eq!(each.iter().map(|patch| patch.signs).sum::<usize>(), whole.signs);
        let mosaic = each.iter().filter(|patch| patch.signs > 0).all(|patch| patch.agreeing == patch.signs);
        assert!(mosaic);
    }

    #[test]
    fn the_amplitude_and_the_energy_of_a_copy_are_those_of_a_mark_and_of_an_average_less() {
        let (one, four) = (&mean_of(&[1]), &mean_of(&[1, 2, 3, 4]));
        let [one, four] = [one, four].map(Evidence::of_recipients);
        assert!((one.amplitude(&sequence(1)) - 1.0).abs() < 1e-12);
        assert!((four.amplitude(&sequence(1)) - 0.25).abs() < 0.05);
        assert!((one.amplitude(&sequence(9))).abs() < 0.1);
        assert!((one.expected_score(1.0) - one.agreement(&sequence(1)).score).abs() < 1e-9);
        assert!((four.fullness(1.0) / one.fullness(1.0) - 0.25).abs() < 0.02);
        let nothing = Estimates { values: vec![0.0; 4000], variances: vec![1.0; 4000], ..mean_of(&[1]) };
        let nothing = Evidence::of_recipients(&nothing);
        let all = [nothing.amplitude(&sequence(1)), nothing.expected_score(1.0), nothing.fullness(1.0)];
        assert_eq!(all, [0.0; 3]);
    }

    #[test]
    fn what_remains_without_one_of_three_names_the_others_better_and_the_one_no_more() {
        let evidence = Evidence::of_recipients(&mean_of(&[1, 2, 3]));
        let rest = evidence.without(&[sequence(1)]);
        let score = |evidence: &Evidence, k| evidence.agreement(&sequence(k)).score;
        for other in [2, 3] {
            assert!(score(&rest, other) > 1.15 * score(&evidence, other));
        }
        assert!(score(&rest, 1).abs() < 1.0);
        let nobody = rest.without(&[sequence(2), sequence(3)]);
        let [left, all] = [nobody.energy(), evidence.energy()];
        assert!(left < 1e-3 * all, "{left} {all}");
    }

    #[test]
    fn beside_each_other_the_members_of_a_large_coalition_stand_out_and_others_do_not() {
        const MEMBERS: u32 = 30;
        let evidence = Evidence::of_recipients(&mean_of(&(0..MEMBERS).collect::<Vec<_>>()));
        let candidates: Vec<Sequence> = (0..1000).map(sequence).collect();
        let scores = evidence.scores_beside_others(&candidates, 3.0);
        let alone: Vec<f64> = candidates.iter().map(|signs| evidence.agreement(signs).score).collect();
        let (members, others) = scores.split_at(MEMBERS as usize);
        assert!(members.iter().zip(&alone).all(|(beside, alone)| *beside > 2.0 * alone), "{members:?}");
        let variance = others.iter().map(|s| s * s).sum::<f64>() / others.len() as f64;
        let most = others.iter().copied().fold(f64::MIN, f64::max);
        assert!((variance - 1.0).abs() < 0.2 && most < 5.0, "{variance} {most}");
        // A candidate alone has nobody beside.
        assert_eq!(evidence.scores_beside_others(&candidates[..1], 0.0), alone[..1]);
    }
}
