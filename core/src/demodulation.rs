//! Demodulation: from observed displacements back to the message (paper, section 3.5, and ours).
//!
//! Both demodulators reduce a suspect to the same evidence: a correlation a_i with every chip. Under a
//! wrong key the chips are independent random signs, so Σ p_i b′_i a_i has mean 0 and variance Σ a_i²
//! *given the suspect*, whatever was done to it: [`Demodulation::mark_score`] needs no model of the attack.

use crate::{
    Result,
    carrier::{Carrier, bit_of_coefficient},
    message::Message,
    options::Parameters,
    patches::{Patch, Patches},
    spectrum::Basis,
};
use faer::{
    Mat, Side,
    linalg::solvers::{Llt, Solve},
};
use rayon::prelude::*;

/// Displacements are never trusted to better than this.
const LEAST_NOISE_M: f64 = 1e-3;

/// What a demodulator found.
#[derive(Debug, Clone)]
pub struct Demodulation {
    /// b̂_j, m estimates of ±1; 0 is no idea.
    pub estimate: Vec<f64>,
    /// v_j, the variance of each.
    pub variance: Vec<f64>,
    /// q_j = Σ p_i a_i over the chips of bit j.
    pub scores: Vec<f64>,
    /// a_i, the correlation with every chip before its sign: patches × 2 axes × m·c.
    pub chip_correlations: Vec<f64>,
    /// What Σ p_i b′_i a_i is expected to be when the mark is there at its full amplitude.
    pub expected_sum: f64,
    /// Standard deviation of what is neither mark nor explained, metres per axis.
    pub noise_m: f64,
}

impl Demodulation {
    /// Log-likelihood ratios of the bits, 2 b̂_j / v_j, natural logarithm, positive = 1.
    pub fn log_likelihood_ratios(&self) -> Vec<f64> {
        self.estimate.iter().zip(&self.variance).map(|(b, v)| 2.0 * b / v).collect()
    }

    /// The most likely message.
    pub fn message(&self) -> Message {
        Message::from_signs(&self.estimate)
    }

    /// How many standard deviations the evidence for this message under this key is above that of a
    /// random key on the same suspect.
    pub fn mark_score(&self, message: &Message) -> f64 {
        ratio(dot(&message.signs(), &self.scores), self.null_deviation())
    }

    /// The [`Self::mark_score`] a mark of full amplitude would be expected to show.
    pub fn expected_mark_score(&self) -> f64 {
        ratio(self.expected_sum, self.null_deviation())
    }

    /// How many standard deviations the estimate agrees better with this message than with a random
    /// message under the same key: bᵀb̂ / |b̂|, at most √m.
    pub fn recipient_score(&self, message: &Message) -> f64 {
        ratio(dot(&message.signs(), &self.estimate), dot(&self.estimate, &self.estimate).sqrt())
    }

    fn null_deviation(&self) -> f64 {
        dot(&self.chip_correlations, &self.chip_correlations).sqrt()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}

/// The paper's detector: a vertex that is not found counts as not moved, the dual basis gives the
/// coefficients, and the chips of a bit are summed over axes and patches.
///
/// `observed` holds the displacement of every reference vertex in canonical order, metres, or `None`;
/// `progress` is called once for every patch.
///
/// # Errors
/// [`crate::Error::TooManyCoefficients`] when the message does not fit.
pub fn paper(
    patches: &Patches,
    carrier: &Carrier,
    observed: &[Option<[f64; 2]>],
    bits: usize,
    parameters: &Parameters,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Demodulation> {
    let job = Job::new(patches, carrier, observed, bits, parameters, progress)?;
    let sums = job.sum_over_patches(|basis, rows, displacement, chips| {
        let carriers = job.carriers;
        let filled = |axis: usize| {
            let mut values = vec![0.0; basis.degrees.len()];
            rows.iter().zip(displacement).for_each(|(&v, d)| values[v] = d[axis]);
            values
        };
        let correlations = [0, 1].map(|axis| basis.analyse(&filled(axis))[1..].to_vec());
        // The share of coefficient i that the found vertices pass on: (E⁻¹)_io E_oi.
        let share = |i: usize| {
            let seen = rows.iter().map(|&v| basis.degrees[v] * basis.vectors[(v, i)].powi(2));
            basis.norms_squared[i] * seen.sum::<f64>()
        };
        let shares: Vec<f64> = (1..=carriers).map(share).collect();
        let mut gram = Mat::zeros(job.bits, 1);
        for (i, share) in shares.iter().enumerate() {
            gram[(job.bit(i), 0)] += 2.0 * share;
        }
        Sums::new(&job, gram, correlations, chips, 2.0 * shares.iter().sum::<f64>(), 0.0)
    })?;
    Ok(paper_estimate(&job, sums))
}

/// b̂_j is q_j over what a whole mark would give, with the spread of the a_i around their mean size.
fn paper_estimate(job: &Job, sums: Sums) -> Demodulation {
    let gain = |j: usize| job.parameters.amplitude_m * sums.gram[(j, 0)];
    let estimate: Vec<f64> = (0..job.bits).map(|j| ratio(sums.scores[j], gain(j))).collect();
    let count = sums.correlations.len().max(1) as f64;
    let explained: f64 = estimate.iter().zip(&sums.scores).map(|(b, q)| b * q).sum();
    let explained = explained * job.parameters.amplitude_m * ratio(sums.trace, count);
    let spread2 =
        ((dot(&sums.correlations, &sums.correlations) - explained) / count).max(LEAST_NOISE_M.powi(2));
    let chips_of_bit = count / job.bits as f64;
    let variance = |j: usize| if gain(j) > 0.0 { spread2 * chips_of_bit / gain(j).powi(2) } else { 1.0 };
    Demodulation {
        variance: (0..job.bits).map(variance).collect(),
        estimate,
        scores: sums.scores,
        chip_correlations: sums.correlations,
        expected_sum: job.parameters.amplitude_m * sums.trace,
        noise_m: spread2.sqrt(),
    }
}

/// The joint detector: least squares over the vertices that were found, all bits at once,
/// y_o = S_o b + ε with signatures S = α E diag(p) C; vertices that were not found are erasures.
/// With G = Σ SᵀS / σ² and h = Σ Sᵀy / σ²: b̂ = (G + I)⁻¹ h, v = diag (G + I)⁻¹.
///
/// Arguments and errors are those of [`paper`].
pub fn joint(
    patches: &Patches,
    carrier: &Carrier,
    observed: &[Option<[f64; 2]>],
    bits: usize,
    parameters: &Parameters,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Demodulation> {
    let job = Job::new(patches, carrier, observed, bits, parameters, progress)?;
    let sums = job.sum_over_patches(|basis, rows, displacement, chips| {
        let seen = Mat::from_fn(rows.len(), job.carriers, |o, i| basis.vectors[(rows[o], i + 1)]);
        let moved = Mat::from_fn(rows.len(), 2, |o, axis| displacement[o][axis]);
        let kernel = seen.transpose() * &seen;
        let product = seen.transpose() * &moved;
        let correlations =
            [0, 1].map(|axis| (0..job.carriers).map(|i| product[(i, axis)]).collect::<Vec<f64>>());
        let trace = 2.0 * (0..job.carriers).map(|i| kernel[(i, i)]).sum::<f64>();
        let energy = displacement.iter().flatten().map(|d| d * d).sum();
        Sums::new(&job, job.fold(&kernel, chips), correlations, chips, trace, energy)
    })?;
    Ok(joint_estimate(&job, sums))
}

/// Alternates between the message given the noise and the noise given the message.
fn joint_estimate(job: &Job, sums: Sums) -> Demodulation {
    let (m, amplitude_m) = (job.bits, job.parameters.amplitude_m);
    let gram = Mat::from_fn(m, m, |j, l| amplitude_m * amplitude_m * sums.gram[(j, l)]);
    let product = Mat::from_fn(m, 1, |j, _| amplitude_m * sums.scores[j]);
    let count = 2.0 * job.observed.iter().flatten().count() as f64;
    let mut noise2 = (sums.energy / count.max(1.0)).max(LEAST_NOISE_M.powi(2));
    let mut solution = posterior(&gram, &product, noise2);
    for _ in 0..8 {
        let (estimate, _) = &solution;
        let explained = 2.0 * dot(estimate, product.col_as_slice(0));
        let fitted = Mat::from_fn(m, 1, |j, _| estimate[j]);
        let energy = (fitted.transpose() * &gram * &fitted)[(0, 0)];
        let free = (count - m as f64).max(1.0);
        noise2 = ((sums.energy - explained + energy) / free).max(LEAST_NOISE_M.powi(2));
        solution = posterior(&gram, &product, noise2);
    }
    let (estimate, variance) = solution;
    Demodulation {
        estimate,
        variance,
        scores: sums.scores,
        chip_correlations: sums.correlations,
        expected_sum: amplitude_m * sums.trace,
        noise_m: noise2.sqrt(),
    }
}

/// (G/σ² + I)⁻¹ h/σ² and the diagonal of (G/σ² + I)⁻¹.
fn posterior(gram: &Mat<f64>, product: &Mat<f64>, noise2: f64) -> (Vec<f64>, Vec<f64>) {
    let m = gram.nrows();
    let matrix = Mat::from_fn(m, m, |j, l| gram[(j, l)] / noise2 + f64::from(u8::from(j == l)));
    let factor = Llt::new(matrix.as_ref(), Side::Lower).expect("a Gram matrix plus I is positive definite");
    let inverse = factor.solve(Mat::<f64>::identity(m, m));
    let estimate = &inverse * product;
    ((0..m).map(|j| estimate[(j, 0)] / noise2).collect(), (0..m).map(|j| inverse[(j, j)]).collect())
}

struct Job<'a> {
    patches: &'a Patches,
    carrier: &'a Carrier,
    observed: &'a [Option<[f64; 2]>],
    bits: usize,
    /// m·c.
    carriers: usize,
    parameters: &'a Parameters,
    progress: &'a (dyn Fn(usize) + Sync),
}

/// What the patches add up to.
struct Sums {
    /// m × m for `joint`, m × 1 for `paper`.
    gram: Mat<f64>,
    scores: Vec<f64>,
    correlations: Vec<f64>,
    trace: f64,
    /// Σ |y|².
    energy: f64,
}

impl Sums {
    fn new(
        job: &Job,
        gram: Mat<f64>,
        correlations: [Vec<f64>; 2],
        chips: &[Vec<f64>; 2],
        trace: f64,
        energy: f64,
    ) -> Self {
        let mut scores = vec![0.0; job.bits];
        for (chips, correlations) in chips.iter().zip(&correlations) {
            for (i, (chip, correlation)) in chips.iter().zip(correlations).enumerate() {
                scores[job.bit(i)] += chip * correlation;
            }
        }
        Sums { gram, scores, correlations: correlations.concat(), trace, energy }
    }

    fn add(&mut self, other: Sums) {
        self.gram += other.gram;
        self.scores.iter_mut().zip(other.scores).for_each(|(a, b)| *a += b);
        self.correlations.extend(other.correlations);
        self.trace += other.trace;
        self.energy += other.energy;
    }
}

impl<'a> Job<'a> {
    fn new(
        patches: &'a Patches,
        carrier: &'a Carrier,
        observed: &'a [Option<[f64; 2]>],
        bits: usize,
        parameters: &'a Parameters,
        progress: &'a (dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        assert_eq!(observed.len(), patches.vertex_count(), "one observation for every reference vertex");
        patches.check_capacity(bits, parameters.chip_rate)?;
        let carriers = bits * parameters.chip_rate;
        Ok(Job { patches, carrier, observed, bits, carriers, parameters, progress })
    }

    /// The bit of the i-th chip, counted from 0.
    fn bit(&self, i: usize) -> usize {
        bit_of_coefficient(i + 1, self.parameters.chip_rate)
    }

    /// Cᵀ diag(p) K diag(p) C over both axes: m × m from K, m·c × m·c.
    fn fold(&self, kernel: &Mat<f64>, chips: &[Vec<f64>; 2]) -> Mat<f64> {
        let mut gram = Mat::zeros(self.bits, self.bits);
        for k in 0..self.carriers {
            for i in 0..self.carriers {
                let sign = chips[0][i] * chips[0][k] + chips[1][i] * chips[1][k];
                gram[(self.bit(i), self.bit(k))] += sign * kernel[(i, k)];
            }
        }
        gram
    }

    /// Sums `f(basis, found rows, their displacements, chips)` over the patches. They are added up in blocks
    /// whose size depends on the number of patches alone: the same sum for any number of threads,
    /// without holding a matrix for every patch.
    fn sum_over_patches(
        &self,
        f: impl Fn(&Basis, &[usize], &[[f64; 2]], &[Vec<f64>; 2]) -> Sums + Sync,
    ) -> Result<Sums> {
        let all = self.patches.as_slice();
        let block = all.len().div_ceil(64);
        let sum_block = |(index, patches): (usize, &[Patch])| -> Result<Sums> {
            let mut total: Option<Sums> = None;
            for (offset, patch) in patches.iter().enumerate() {
                let basis = Basis::low_frequencies(patch, self.carriers + 1)?;
                let chips = [0, 1].map(|a| self.carrier.chips(index * block + offset, a, self.carriers));
                let found = patch.vertices.iter().enumerate();
                let (rows, displacement): (Vec<usize>, Vec<[f64; 2]>) =
                    found.filter_map(|(row, &v)| Some((row, self.observed[v as usize]?))).unzip();
                let sums = f(&basis, &rows, &displacement, &chips);
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
