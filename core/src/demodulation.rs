//! Demodulation: observed displacements become the message again (paper, section 3.5, and our
//! extension).
//!
//! Both demodulators reduce a suspect to the same evidence: a correlation a_i with every chip.
//! Under a wrong key the chips are independent random signs, so Σ p_i b′_i a_i has mean 0 and
//! variance Σ a_i² *given the suspect*, whatever the attack: [`Demodulation::mark_score`] needs no
//! model of it.

use crate::{
    Result,
    carrier::{Carrier, bit_of_coefficient},
    code::{Code, Decoded},
    covariance::{Covariance, Found, factor},
    deformation::{Observed, Prediction},
    derived::Observables,
    message::Message,
    options::Parameters,
    patches::{Patch, Patches},
    response::{Kernel, Response},
    signs::decoy_sums,
    spectrum::Basis,
};
use faer::{
    Col, Mat, Par,
    linalg::{solvers::Solve, triangular_inverse::invert_lower_triangular},
};
use rayon::prelude::*;

/// Correlations with chips spread by this at least, metres.
const LEAST_SPREAD_M: f64 = 1e-3;

/// The result of a demodulator: estimates of the channel bits, which the code makes of the message.
#[derive(Debug, Clone)]
pub struct Demodulation {
    /// How the message became the channel bits.
    pub code: Code,
    /// b̂_j, an estimate of ±1 for every channel bit; 0 means no information.
    pub estimate: Vec<f64>,
    /// v_j, the variance of each.
    pub variance: Vec<f64>,
    /// q_j = Σ p_i a_i over the chips of bit j.
    pub scores: Vec<f64>,
    /// a_i, the correlation with every chip before its sign: patches × 2 axes × carriers.
    pub chip_correlations: Vec<f64>,
    /// The expected value of Σ p_i b′_i a_i for a mark of full amplitude.
    pub expected_sum: f64,
    /// Standard deviation of the unexplained displacement, metres per axis.
    pub noise_m: f64,
}

impl Demodulation {
    /// Returns the log-likelihood ratios of the channel bits, 2 b̂_j / v_j, natural logarithm,
    /// positive = 1.
    pub fn log_likelihood_ratios(&self) -> Vec<f64> {
        self.estimate.iter().zip(&self.variance).map(|(b, v)| 2.0 * b / v).collect()
    }

    /// Decodes the message and its reliability.
    pub fn decode(&self) -> Decoded {
        self.code.decode(&self.log_likelihood_ratios())
    }

    /// Returns the most likely message.
    pub fn message(&self) -> Message {
        self.decode().message
    }

    /// Counts the channel bits that differ from those of this message.
    pub fn channel_bit_errors(&self, message: &Message) -> usize {
        let signs = self.code.encode(message);
        signs.iter().zip(&self.estimate).filter(|(sign, b)| (**sign > 0.0) != (**b > 0.0)).count()
    }

    /// Returns by how many standard deviations the evidence for this message under this key exceeds
    /// that of a random key on the same suspect.
    pub fn mark_score(&self, message: &Message) -> f64 {
        ratio(dot(&self.code.encode(message), &self.scores), self.null_deviation())
    }

    /// Returns the expected [`Self::mark_score`] of a mark of full amplitude.
    pub fn expected_mark_score(&self) -> f64 {
        ratio(self.expected_sum, self.null_deviation())
    }

    /// Returns by how many standard deviations the estimate agrees better with this message than
    /// with a random message under the same key: Σ w_j b′_j b̂_j / |w b̂| over channel bits, at
    /// most the square root of their number. Its mean is 0 and its variance 1 with either code: the
    /// bits of a random LDPC code word are not all independent, but any four of them are (a test in
    /// `code.rs` shows that the dual distance is more than 4). On a clean copy all |b̂_j| are
    /// equal: without the weights w_j the score would have few values, at which the tail of the
    /// normal law is up to 1.5 times too small.
    pub fn recipient_score(&self, message: &Message) -> f64 {
        let weighted: Vec<f64> = self.estimate.iter().enumerate().map(|(j, b)| spread(j) * b).collect();
        ratio(dot(&self.code.encode(message), &weighted), dot(&weighted, &weighted).sqrt())
    }

    /// Returns the [`Self::mark_score`] of each of `patches` patches alone; `None` where no
    /// displacement was observed.
    pub fn patch_scores(&self, carrier: &Carrier, message: &Message, patches: usize) -> Vec<Option<f64>> {
        let signs = self.code.encode(message);
        let carriers = self.chip_correlations.len() / patches / 2;
        let chip_rate = carriers / signs.len();
        let score = |(patch, of_patch): (usize, &[f64])| {
            let on_axis = |axis: usize| {
                let seen = of_patch[axis * carriers..].iter().take(carriers);
                let chips = carrier.chips(patch, axis, carriers);
                let signed = |(i, (chip, a)): (usize, (f64, &f64))| {
                    chip * signs[bit_of_coefficient(i + 1, chip_rate)] * a
                };
                chips.into_iter().zip(seen).enumerate().map(signed).sum::<f64>()
            };
            let deviation = dot(of_patch, of_patch).sqrt();
            (deviation > 0.0).then(|| (on_axis(0) + on_axis(1)) / deviation)
        };
        self.chip_correlations.par_chunks(2 * carriers).enumerate().map(score).collect()
    }

    /// Returns the [`Self::mark_score`] of `count` decoy keys on the same suspect. Random signs
    /// replace the chips; decoy k takes them from ChaCha20 stream k.
    pub fn decoy_scores(&self, count: usize, seed: [u8; 32]) -> Vec<f64> {
        let deviation = self.null_deviation();
        let sums = decoy_sums(&self.chip_correlations, count, seed);
        sums.into_iter().map(|sum| ratio(sum, deviation)).collect()
    }

    /// Returns Σ_j q_j² / n_j, where n_j = Σ a_i² over the chips of channel bit j, and the number
    /// of bits in the sum. For a key that was not used the sum is chi-squared with that many
    /// degrees of freedom; any message raises it.
    pub fn key_score(&self, chip_rate: usize) -> (f64, usize) {
        let bits = self.scores.len();
        let mut energy = vec![0.0; bits];
        for axis in self.chip_correlations.chunks(bits * chip_rate) {
            for (i, a) in axis.iter().enumerate() {
                energy[bit_of_coefficient(i + 1, chip_rate)] += a * a;
            }
        }
        let seen = energy.iter().zip(&self.scores).filter(|(n, _)| **n > 0.0);
        seen.fold((0.0, 0), |(sum, count), (n, q)| (sum + q * q / n, count + 1))
    }

    fn null_deviation(&self) -> f64 {
        dot(&self.chip_correlations, &self.chip_correlations).sqrt()
    }
}

/// Returns a weight between 3/4 and 5/4; multiples of the golden ratio keep the weights as
/// different as possible. Their deviation of 0.14 blurs the steps of 1/4 between scores of LDPC
/// code words and costs 1 % of the score.
fn spread(j: usize) -> f64 {
    0.75 + 0.5 * ((j as f64 * 0.618_033_988_749_895).fract())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}

/// Demodulates as the paper does: a vertex that is not found counts as unmoved, the dual basis
/// gives the coefficients, and the chips of a bit are summed over axes and patches.
///
/// `observed` holds the displacement of every reference vertex in canonical order, metres, or
/// `None`; `bits` is the length of the message; `progress` is called once for every patch.
///
/// # Errors
/// Returns the errors of [`Patches::carriers`] when the message does not fit.
pub fn paper(
    patches: &Patches,
    carrier: &Carrier,
    observed: &Observed,
    bits: usize,
    parameters: &Parameters,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Demodulation> {
    let job = Job::new(patches.into(), carrier, observed, bits, parameters, progress)?;
    let sums = job.sum_over_patches(|_, basis, found, chips| {
        let carriers = job.carriers;
        let filled = |axis: usize| {
            let mut values = vec![0.0; basis.degrees.len()];
            found.rows.iter().enumerate().for_each(|(o, &v)| values[v] = found.moved[(o, axis)]);
            values
        };
        let correlations = [0, 1].map(|axis| basis.analyse(&filled(axis))[1..].to_vec());
        // The share of coefficient i that the found vertices transmit: (E⁻¹)_io E_oi.
        let share = |i: usize| {
            let seen = found.rows.iter().map(|&v| basis.degrees[v] * basis.vectors[(v, i)].powi(2));
            basis.norms_squared[i] * seen.sum::<f64>()
        };
        let shares: Vec<f64> = (1..=carriers).map(share).collect();
        let mut gram = Mat::zeros(job.bits, 1);
        for (i, share) in shares.iter().enumerate() {
            gram[(job.bit(i), 0)] += 2.0 * share;
        }
        Sums::new(&job, gram, correlations, chips, 2.0 * shares.iter().sum::<f64>())
    })?;
    Ok(paper_estimate(&job, sums))
}

/// Estimates b̂_j as q_j over its value for a complete mark, and its variance from the spread of
/// the a_i around their mean size.
fn paper_estimate(job: &Job, sums: Sums) -> Demodulation {
    let gain = |j: usize| job.parameters.amplitude_m * sums.gram[(j, 0)];
    let estimate: Vec<f64> = (0..job.bits).map(|j| ratio(sums.scores[j], gain(j))).collect();
    let count = sums.correlations.len().max(1) as f64;
    let explained: f64 = estimate.iter().zip(&sums.scores).map(|(b, q)| b * q).sum();
    let explained = explained * job.parameters.amplitude_m * ratio(sums.trace, count);
    let spread2 =
        ((dot(&sums.correlations, &sums.correlations) - explained) / count).max(LEAST_SPREAD_M.powi(2));
    let chips_of_bit = count / job.bits as f64;
    let variance = |j: usize| if gain(j) > 0.0 { spread2 * chips_of_bit / gain(j).powi(2) } else { 1.0 };
    Demodulation {
        code: job.parameters.code,
        variance: (0..job.bits).map(variance).collect(),
        estimate,
        scores: sums.scores,
        chip_correlations: sums.correlations,
        expected_sum: job.parameters.amplitude_m * sums.trace,
        noise_m: spread2.sqrt(),
    }
}

/// Demodulates all bits at once over the found points: y_o = S_o b + f_o + ε with signatures
/// S = α E diag(p) C, and with the smooth deformation f and noise ε of `disturbance`. Points that
/// were not found are erasures, and those derived from vertices have signatures derived alike. With Σ = cov(f + ε), G = Σ SᵀΣ⁻¹S and h = Σ SᵀΣ⁻¹y summed over
/// patches and axes: b̂ = (G + I)⁻¹ h, v = diag (G + I)⁻¹.
///
/// The other arguments and the errors are those of [`paper`].
pub fn joint<'a>(
    of: impl Into<Observables<'a>>,
    carrier: &Carrier,
    observed: &Observed,
    bits: usize,
    parameters: &Parameters,
    disturbance: &Prediction,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Demodulation> {
    let job = Job::new(of.into(), carrier, observed, bits, parameters, progress)?;
    joint_of(&job, disturbance)
}

/// Demodulates like [`joint`], with the bases of the first patches in `solved`.
pub(crate) fn joint_solved(
    (patches, solved): (&Patches, &[Basis]),
    carrier: &Carrier,
    observed: &Observed,
    bits: usize,
    parameters: &Parameters,
    disturbance: &Prediction,
) -> Result<Demodulation> {
    let job = Job::new(patches.into(), carrier, observed, bits, parameters, &|_| ())?;
    joint_of(&Job { solved, ..job }, disturbance)
}

fn joint_of(job: &Job, disturbance: &Prediction) -> Result<Demodulation> {
    let parameters = job.parameters;
    let sums = job.sum_over_patches(|patch, basis, found, chips| {
        if found.rows.is_empty() {
            return Sums::nothing(job);
        }
        let points = job.of.in_patch(patch);
        let weights: Vec<f64> =
            found.rows.iter().map(|&row| disturbance.weights[points[row] as usize]).collect();
        let covariance = Covariance::new(&disturbance.deformation, &found.at, &weights);
        let response = Response::carriers(&job.patches()[patch], basis, parameters);
        let seen = job.of.seen(patch, &response, &found.rows);
        let seen = seen.map(|block| covariance.whiten(block));
        let kernel = seen.kernel();
        let correlations = seen.correlations(&covariance.whiten(found.moved.clone()));
        let trace = kernel.trace();
        Sums::new(job, job.fold(&kernel, chips), correlations, chips, trace)
    })?;
    let amplitude_m = parameters.amplitude_m;
    let gram = Mat::from_fn(job.bits, job.bits, |j, l| amplitude_m * amplitude_m * sums.gram[(j, l)]);
    let product: Vec<f64> = sums.scores.iter().map(|q| amplitude_m * q).collect();
    let (estimate, variance) = posterior(gram, &product);
    Ok(Demodulation {
        code: parameters.code,
        estimate,
        variance,
        scores: sums.scores,
        chip_correlations: sums.correlations,
        expected_sum: amplitude_m * sums.trace,
        noise_m: disturbance.deformation.noise_m,
    })
}

/// Returns (G + I)⁻¹ h and the diagonal of (G + I)⁻¹, given the lower triangle of G.
pub(crate) fn posterior(mut gram: Mat<f64>, product: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let m = gram.nrows();
    (0..m).for_each(|j| gram[(j, j)] += 1.0);
    let factor = factor(&gram);
    let mut estimate = Col::from_fn(m, |j| product[j]);
    factor.solve_in_place(&mut estimate);
    // G + I = L Lᵀ, so that the diagonal of the inverse is that of L⁻ᵀ L⁻¹.
    let mut root = Mat::zeros(m, m);
    invert_lower_triangular(root.as_mut(), factor.L(), Par::Seq);
    let variance = root.col_iter().map(|column| column.squared_norm_l2());
    (estimate.iter().copied().collect(), variance.collect())
}

struct Job<'a> {
    of: Observables<'a>,
    /// The bases of the first patches, as far as they are known.
    solved: &'a [Basis],
    carrier: &'a Carrier,
    observed: &'a Observed,
    /// Channel bits.
    bits: usize,
    carriers: usize,
    parameters: &'a Parameters,
    progress: &'a (dyn Fn(usize) + Sync),
}

/// The sums over the patches.
struct Sums {
    /// The lower triangle of m × m for [`joint`], m × 1 for [`paper`], of m channel bits.
    gram: Mat<f64>,
    scores: Vec<f64>,
    correlations: Vec<f64>,
    trace: f64,
}

impl Sums {
    fn new(
        job: &Job,
        gram: Mat<f64>,
        correlations: [Vec<f64>; 2],
        chips: &[Vec<f64>; 2],
        trace: f64,
    ) -> Self {
        let mut scores = vec![0.0; job.bits];
        for (chips, correlations) in chips.iter().zip(&correlations) {
            for (i, (chip, correlation)) in chips.iter().zip(correlations).enumerate() {
                scores[job.bit(i)] += chip * correlation;
            }
        }
        Sums { gram, scores, correlations: correlations.concat(), trace }
    }

    /// Returns what a patch without found vertices adds to the sums of [`joint`].
    fn nothing(job: &Job) -> Self {
        Sums {
            gram: Mat::zeros(job.bits, job.bits),
            scores: vec![0.0; job.bits],
            correlations: vec![0.0; 2 * job.carriers],
            trace: 0.0,
        }
    }

    fn add(&mut self, other: Sums) {
        self.gram += other.gram;
        self.scores.iter_mut().zip(other.scores).for_each(|(a, b)| *a += b);
        self.correlations.extend(other.correlations);
        self.trace += other.trace;
    }
}

impl<'a> Job<'a> {
    fn new(
        of: Observables<'a>,
        carrier: &'a Carrier,
        observed: &'a Observed,
        message_bits: usize,
        parameters: &'a Parameters,
        progress: &'a (dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        assert_eq!(observed.len(), of.count(), "one observation for every observable point");
        let carriers = of.patches().carriers(message_bits, parameters)?;
        let bits = carriers / parameters.chip_rate;
        Ok(Job { of, solved: &[], carrier, observed, bits, carriers, parameters, progress })
    }

    fn patches(&self) -> &'a [Patch] {
        self.of.patches().as_slice()
    }

    /// Returns the bit of the i-th chip, counted from 0.
    fn bit(&self, i: usize) -> usize {
        bit_of_coefficient(i + 1, self.parameters.chip_rate)
    }

    /// Returns the lower triangle of Cᵀ diag(p) K diag(p) C, m × m, from the kernel K of both axes,
    /// 2·m·c × 2·m·c.
    fn fold(&self, kernel: &Kernel, chips: &[Vec<f64>; 2]) -> Mat<f64> {
        let mut gram = Mat::zeros(self.bits, self.bits);
        // Two chips of one bit meet on the diagonal, once from either side of the diagonal of K.
        let times = |i: usize, k: usize| if self.bit(i) == self.bit(k) { 2.0 } else { 1.0 };
        for (axes, lower) in &kernel.own {
            for k in 0..self.carriers {
                for (i, value) in (k..self.carriers).zip(&lower.col_as_slice(k)[k..]) {
                    let sign: f64 = axes.iter().map(|&axis| chips[axis][i] * chips[axis][k]).sum();
                    let times = if i == k { 1.0 } else { times(i, k) };
                    gram[(self.bit(i), self.bit(k))] += times * sign * value;
                }
            }
        }
        if let Some(cross) = &kernel.cross {
            for k in 0..self.carriers {
                for (i, value) in cross.col_as_slice(k).iter().enumerate() {
                    let (row, column) = (self.bit(i.max(k)), self.bit(i.min(k)));
                    gram[(row, column)] += times(i, k) * chips[0][i] * chips[1][k] * value;
                }
            }
        }
        gram
    }

    /// Sums `f(patch, basis, found points, chips)` over the patches. The size of the blocks in
    /// which they are added depends on the number of patches alone, so the sum is the same for any
    /// number of threads, and no matrix is held for every patch.
    fn sum_over_patches(
        &self,
        f: impl Fn(usize, &Basis, &Found, &[Vec<f64>; 2]) -> Sums + Sync,
    ) -> Result<Sums> {
        let all = self.patches();
        let block = all.len().div_ceil(64);
        let sum_block = |(index, patches): (usize, &[Patch])| -> Result<Sums> {
            let mut total: Option<Sums> = None;
            for (offset, patch) in patches.iter().enumerate() {
                let number = index * block + offset;
                let basis = Basis::known_or_solved(self.solved, number, patch, self.carriers + 1)?;
                let chips = [0, 1].map(|axis| self.carrier.chips(number, axis, self.carriers));
                let found = Found::new(self.of, number, self.observed);
                let sums = f(number, &basis, &found, &chips);
                match &mut total {
                    None => total = Some(sums),
                    Some(total) => total.add(sums),
                }
                (self.progress)(1);
            }
            Ok(total.expect("a block has patches"))
        };
        let blocks: Vec<Sums> = all.par_chunks(block).enumerate().map(sum_block).collect::<Result<_>>()?;
        Ok(blocks
            .into_iter()
            .reduce(|mut a, b| {
                a.add(b);
                a
            })
            .expect("a map has patches"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::{
        ChaCha20Rng,
        rand_core::{Rng, SeedableRng},
    };

    /// 3 bits of 2 chips, 50 patches; a third of the correlations is 0.
    fn found() -> Demodulation {
        let correlation = |i: usize| (i % 3) as f64 * (1.0 + (i % 7) as f64);
        Demodulation {
            code: Code::Repetition,
            estimate: vec![0.0; 3],
            variance: vec![1.0; 3],
            scores: vec![30.0, -40.0, 0.0],
            chip_correlations: (0..600).map(correlation).collect(),
            expected_sum: 1.0,
            noise_m: 0.1,
        }
    }

    #[test]
    fn every_patch_has_a_score_of_its_own() {
        let message = Message::from_hex("a5").unwrap();
        let carrier = Carrier::new(&crate::key::SecretKey::from_bytes([3; 32]));
        let signs = message.signs();
        // 8 bits of 2 chips: the first patch carries the mark, the second its opposite, and no
        // vertex of the third was found.
        let patch = |(patch, size): (usize, f64)| {
            let chips = [0, 1].map(|axis| carrier.chips(patch, axis, 16)).concat();
            chips.into_iter().enumerate().map(|(i, chip)| size * chip * signs[i % 16 / 2]).collect::<Vec<_>>()
        };
        let chip_correlations = [2.0, -1.0, 0.0].into_iter().enumerate().flat_map(patch).collect();
        let found = Demodulation { chip_correlations, scores: vec![0.0; 8], ..found() };
        let scores = found.patch_scores(&carrier, &message, 3);
        assert_eq!(scores[2], None);
        for (score, expected) in scores.iter().zip([32f64.sqrt(), -(32f64.sqrt())]) {
            assert!((score.unwrap() - expected).abs() < 1e-12, "{scores:?}");
        }
    }

    #[test]
    fn decoys_are_standard_normal_and_the_same_for_the_same_seed() {
        let scores = found().decoy_scores(10_000, [5; 32]);
        assert_eq!(scores[..10], found().decoy_scores(10, [5; 32]));
        assert_ne!(scores[..10], found().decoy_scores(10, [6; 32]));
        let mean = scores.iter().sum::<f64>() / 1e4;
        let variance = scores.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / 1e4;
        // The limits are 5 deviations.
        assert!(mean.abs() < 0.05 && (variance - 1.0).abs() < 0.07, "{mean} {variance}");
        let beyond = scores.iter().filter(|s| **s > 1.644_854).count();
        assert!((390..610).contains(&beyond), "{beyond} instead of 500");
    }

    #[test]
    fn random_recipients_of_a_clean_copy_have_the_tail_of_the_normal_law() {
        let mut random = ChaCha20Rng::seed_from_u64(11);
        for (code, channel_bits) in [(Code::Ldpc, 256), (Code::Repetition, 128)] {
            let mut message = || {
                let bits: Vec<f64> = (0..128).map(|_| f64::from(random.next_u32() & 1) - 0.5).collect();
                Message::from_signs(&bits)
            };
            let estimate = code.encode(&message());
            assert_eq!(estimate.len(), channel_bits);
            let found = Demodulation { code, estimate, ..found() };
            let beyond = (0..400_000).filter(|_| found.recipient_score(&message()) >= 3.0).count();
            // 540 of a normal distribution, give or take 23.
            assert!((430..650).contains(&beyond), "{code:?}: {beyond} instead of 540");
        }
    }

    #[test]
    fn the_scores_of_patches_add_up_to_that_of_the_map() {
        let carrier = Carrier::new(&crate::key::SecretKey::from_bytes([3; 32]));
        let message = Code::Repetition.decode(&[1.0, -1.0, 1.0]).message;
        let mut found = found();
        found.chip_correlations[24..36].fill(0.0); // patch 2
        found.scores = vec![0.0; 3];
        for (axis, a) in found.chip_correlations.chunks(6).enumerate() {
            let chips = carrier.chips(axis / 2, axis % 2, 6);
            (0..6).for_each(|i| found.scores[i / 2] += chips[i] * a[i]);
        }
        let scores = found.patch_scores(&carrier, &message, 50);
        assert_eq!(scores.iter().position(Option::is_none), Some(2));
        let deviations = found.chip_correlations.chunks(12).map(|a| dot(a, a).sqrt());
        let sum: f64 = scores.iter().zip(deviations).map(|(score, d)| score.unwrap_or(0.0) * d).sum();
        assert!((ratio(sum, found.null_deviation()) - found.mark_score(&message)).abs() < 1e-9);
    }

    #[test]
    fn the_key_score_weighs_every_bit_by_its_own_chips_and_leaves_out_what_was_not_seen() {
        let mut found = found();
        let energy = |bits: std::ops::Range<usize>, found: &Demodulation| -> f64 {
            let all = found.chip_correlations.iter().enumerate();
            all.filter(|(i, _)| bits.contains(&(i % 6))).map(|(_, a)| a * a).sum()
        };
        let expected = 900.0 / energy(0..2, &found) + 1600.0 / energy(2..4, &found);
        assert!((found.key_score(2).0 - expected).abs() < 1e-12);
        assert_eq!(found.key_score(2).1, 3);
        found.chip_correlations.iter_mut().skip(4).step_by(6).for_each(|a| *a = 0.0);
        found.chip_correlations.iter_mut().skip(5).step_by(6).for_each(|a| *a = 0.0);
        assert_eq!(found.key_score(2).1, 2);
    }
}
