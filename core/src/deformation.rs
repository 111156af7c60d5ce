//! The disturbance of the suspect besides the mark, estimated without the key: a smooth deformation
//! (rubber sheeting, digitising, a wrong projection) and noise. The method is kriging of the
//! displacements.
//!
//! The displacement of a vertex is deformation + mark + noise. The deformation is a Gaussian
//! process with a Matérn 5/2 covariance (Rasmussen and Williams, *Gaussian Processes for Machine
//! Learning*, 2006, eq. 4.17) and a free shift of every patch. The estimate does not depend on the
//! chips: it is the same for the tested key and for every decoy.

use crate::{
    Result,
    noise_law::NoiseLaw,
    options::Parameters,
    patches::{Patch, Patches},
    response::Response,
    spectrum::Basis,
};
use faer::{
    Mat, Par, Side,
    linalg::{
        solvers::{Llt, Solve},
        triangular_solve::solve_lower_triangular_in_place,
    },
};
use rayon::prelude::*;

/// Displacement of every reference vertex in canonical order, metres, or `None` where it was not
/// found.
pub type Observed = [Option<[f64; 2]>];

/// Standard deviation of the shift of a whole patch, metres; the shift is practically free.
const SHIFT_M: f64 = 1.0;
/// No displacement is trusted to better than this, metres.
pub(crate) const LEAST_NOISE_M: f64 = 0.01;
/// Numbers of patches, and of vertices in each, from which the hyper-parameters are estimated.
const SAMPLE_PATCHES: usize = 6;
const SAMPLE_VERTICES: usize = 200;
/// Fewer found vertices carry no information about a patch.
const LEAST_FOUND: usize = 30;
/// A residual of more standard deviations than this weighs less (Huber 1964).
const HUBER: f64 = 2.0;
/// A residual of more standard deviations than this is no displacement of the vertex at all.
const OUTLIER: f64 = 4.0;
/// The law of the noise is estimated from residuals, which show it only where the noise is this
/// many times the mark.
const WEAK_MARK: f64 = 1.5;
/// A deformation is accepted when it raises the log-likelihood by this much.
const WORTH_IT: f64 = 10.0;

const DEVIATIONS_M: [f64; 6] = [0.06, 0.12, 0.25, 0.5, 1.0, 2.0];
const RANGES_M: [f64; 6] = [5.0, 10.0, 20.0, 40.0, 80.0, 160.0];
const NOISES_M: [f64; 9] = [0.01, 0.03, 0.06, 0.1, 0.16, 0.25, 0.35, 0.5, 0.8];

/// Hyper-parameters of the displacement, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    /// σ_f, standard deviation of the deformation; 0 where there is none.
    pub deviation_m: f64,
    /// ℓ, the distance over which it changes.
    pub range_m: f64,
    /// σ, standard deviation of the noise.
    pub noise_m: f64,
}

/// A predicted deformation.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Its hyper-parameters.
    pub deformation: Deformation,
    /// The deformation at every reference vertex in canonical order, found or not, metres.
    pub displacement_m: Vec<[f64; 2]>,
    /// The weight of every reference vertex: 1, or less where its displacement disagrees with the
    /// others.
    pub weights: Vec<f64>,
}

impl Prediction {
    /// Removes from `observed` the displacements that are neither deformation nor mark nor noise:
    /// those of vertices that a cut or an edit made where no reference vertex went. The scale is
    /// the median residual, which a few such vertices do not change, and at least that of the mark.
    pub fn without_outliers(&self, observed: &Observed, mark_m: f64) -> Vec<Option<[f64; 2]>> {
        let rest =
            |(o, f): (&Option<[f64; 2]>, &[f64; 2])| o.map(|o| [(o[0] - f[0]).abs(), (o[1] - f[1]).abs()]);
        let rests: Vec<Option<[f64; 2]>> = observed.iter().zip(&self.displacement_m).map(rest).collect();
        let mut sizes: Vec<f64> = rests.iter().flatten().flatten().copied().collect();
        if sizes.is_empty() {
            return observed.to_vec();
        }
        let middle = sizes.len() / 2;
        let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        let most = OUTLIER * (median / 0.6745).max(mark_m); // the median of |N(0, 1)|
        let fits = |r: &Option<[f64; 2]>| r.is_none_or(|r| r[0].max(r[1]) <= most);
        observed.iter().zip(&rests).map(|(o, r)| o.filter(|_| fits(r))).collect()
    }

    /// Returns what to demodulate in place of `observed`: the residual of every displacement is
    /// transformed by the fitted [`NoiseLaw`], and the noise is that of the transformed residuals.
    pub fn shape_noise(
        mut self,
        patches: &Patches,
        observed: &Observed,
        carriers: usize,
        amplitude_m: f64,
    ) -> (Vec<Option<[f64; 2]>>, Self) {
        let residual = |(o, f): (&Option<[f64; 2]>, &[f64; 2])| o.map(|o| [o[0] - f[0], o[1] - f[1]]);
        let residuals: Vec<[f64; 2]> =
            observed.iter().zip(&self.displacement_m).filter_map(residual).collect();
        let law = NoiseLaw::fit(residuals.as_flattened());
        let mark_m = mark_deviation_m(patches, carriers, amplitude_m);
        if law.exponent == 2.0 || self.deformation.noise_m < WEAK_MARK * mark_m {
            return (observed.to_vec(), self);
        }
        let noise2 = law.variance_m2 - mark_m.powi(2);
        self.deformation.noise_m = noise2.max(LEAST_NOISE_M.powi(2)).sqrt();
        let shaped = observed.iter().zip(&self.displacement_m).map(|(o, f)| {
            let axis = |o: &[f64; 2], a: usize| f[a] + law.apply(o[a] - f[a]);
            o.as_ref().map(|o| [axis(o, 0), axis(o, 1)])
        });
        (shaped.collect(), self)
    }
}

/// Returns the standard deviation of the mark's displacement on one axis, metres: unit columns of E
/// spread over n rows.
pub fn mark_deviation_m(patches: &Patches, carriers: usize, amplitude_m: f64) -> f64 {
    let per_vertex = (carriers * patches.as_slice().len()) as f64 / patches.vertex_count() as f64;
    amplitude_m * per_vertex.sqrt()
}

impl Deformation {
    /// Returns a disturbance of noise alone.
    pub fn none(noise_m: f64) -> Self {
        Deformation { deviation_m: 0.0, range_m: 1.0, noise_m }
    }

    /// Returns the hyper-parameters of greatest marginal likelihood on a few patches. The mark
    /// enters with its covariance over all chips and messages, α² E Eᵀ. `carriers` is the result of
    /// [`Patches::carriers`].
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`].
    pub fn estimate(
        patches: &Patches,
        observed: &Observed,
        carriers: usize,
        parameters: &Parameters,
    ) -> Result<Self> {
        let found = |p: &&Patch| p.vertices.iter().filter(|&&v| observed[v as usize].is_some()).count();
        let known: Vec<&Patch> = patches.as_slice().iter().filter(|p| found(p) >= LEAST_FOUND).collect();
        let step = known.len().div_ceil(SAMPLE_PATCHES).max(1);
        let chosen: Vec<&Patch> = known.into_iter().step_by(step).collect();
        let sample = |patch: &&Patch| Sample::new(patches, patch, observed, carriers, parameters);
        let samples: Vec<Sample> = chosen.par_iter().map(sample).collect::<Result<_>>()?;
        Ok(most_likely(|candidate| {
            let each: Vec<f64> = samples.par_iter().map(|s| s.log_likelihood(candidate)).collect();
            each.iter().sum()
        }))
    }

    /// Predicts the deformation from the observed displacements. The mark counts as noise here, so
    /// no spectrum is needed.
    pub fn predict(
        &self,
        patches: &Patches,
        observed: &Observed,
        carriers: usize,
        amplitude_m: f64,
    ) -> Prediction {
        let predict = |patch: &Patch| {
            let mark2 = amplitude_m.powi(2) * carriers as f64 / patch.vertices.len() as f64;
            let with_mark = Deformation { noise_m: (self.noise_m.powi(2) + mark2).sqrt(), ..*self };
            Kriging::new(with_mark, Found::new(patches, patch, observed)).predict(patches, patch)
        };
        let predicted: Vec<PatchPrediction> = patches.as_slice().par_iter().map(predict).collect();
        let mut all = Prediction {
            deformation: *self,
            displacement_m: vec![[0.0; 2]; observed.len()],
            weights: vec![1.0; observed.len()],
        };
        for (patch, part) in patches.as_slice().iter().zip(predicted) {
            for (&v, displacement) in patch.vertices.iter().zip(part.displacement_m) {
                all.displacement_m[v as usize] = displacement;
            }
            for (row, weight) in part.rows.into_iter().zip(part.weights) {
                all.weights[patch.vertices[row] as usize] = weight;
            }
        }
        all
    }

    /// Returns σ_f² k(d / ℓ), Matérn 5/2.
    fn covariance(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let d = (5.0 * ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2))).sqrt() / self.range_m;
        self.deviation_m.powi(2) * (1.0 + d + d * d / 3.0) * (-d).exp()
    }

    /// Returns the covariance of deformation, shift and noise over found vertices, o × o. Only its
    /// lower triangle is filled, as the factorisation reads no more; weights divide the noise.
    fn matrix(&self, at: &[[f64; 2]], weights: &[f64]) -> Mat<f64> {
        Mat::from_fn(at.len(), at.len(), |i, j| {
            let noise = if i == j { self.noise_m.powi(2) / weights[i] } else { 0.0 };
            let smooth = if self.deviation_m > 0.0 && i >= j { self.covariance(at[i], at[j]) } else { 0.0 };
            SHIFT_M.powi(2) + smooth + noise
        })
    }
}

/// The covariance Σ of deformation, shift and noise over o found vertices, factored.
pub(crate) enum Covariance {
    /// The Cholesky factor.
    Dense(Llt<f64>),
    /// Without a deformation Σ = P⁻¹ + s² 1 1ᵀ, where the diagonal P holds these precisions and
    /// needs no factorisation.
    Shift(Vec<f64>),
}

impl Covariance {
    pub fn new(deformation: &Deformation, at: &[[f64; 2]], weights: &[f64]) -> Self {
        if deformation.deviation_m > 0.0 {
            return Covariance::Dense(factor(&deformation.matrix(at, weights)));
        }
        Covariance::Shift(weights.iter().map(|w| w / deformation.noise_m.powi(2)).collect())
    }

    /// Multiplies a square root of Σ⁻¹ by the columns of a matrix with o rows.
    pub fn whiten(&self, mut columns: Mat<f64>) -> Mat<f64> {
        match self {
            Covariance::Dense(factor) => {
                solve_lower_triangular_in_place(factor.L(), columns.as_mut(), Par::Seq);
            }
            Covariance::Shift(precisions) => {
                // With q = P^½ 1: Σ⁻¹ = P^½ (1 + s² q qᵀ)⁻¹ P^½, and (1 + s² q qᵀ)^−½ = 1 − β q qᵀ.
                let total: f64 = precisions.iter().sum();
                let beta = (1.0 - 1.0 / (1.0 + SHIFT_M.powi(2) * total).sqrt()) / total;
                let roots: Vec<f64> = precisions.iter().map(|p| p.sqrt()).collect();
                for j in 0..columns.ncols() {
                    let column = columns.col_as_slice_mut(j);
                    let mean: f64 = column.iter().zip(precisions).map(|(x, p)| x * p).sum::<f64>() * beta;
                    column.iter_mut().zip(&roots).for_each(|(x, q)| *x = q * (*x - mean));
                }
            }
        }
        columns
    }

    /// Multiplies Σ⁻¹ by the columns of a matrix with o rows.
    fn solve(&self, columns: &Mat<f64>) -> Mat<f64> {
        match self {
            Covariance::Dense(factor) => factor.solve(columns),
            Covariance::Shift(precisions) => {
                let total: f64 = precisions.iter().sum();
                let share = SHIFT_M.powi(2) / (1.0 + SHIFT_M.powi(2) * total);
                let mean =
                    |j| share * (0..columns.nrows()).map(|i| columns[(i, j)] * precisions[i]).sum::<f64>();
                let means: Vec<f64> = (0..columns.ncols()).map(mean).collect();
                Mat::from_fn(columns.nrows(), columns.ncols(), |i, j| {
                    precisions[i] * (columns[(i, j)] - means[j])
                })
            }
        }
    }
}

/// Returns the Cholesky factor of a covariance with noise.
pub(crate) fn factor(covariance: &Mat<f64>) -> Llt<f64> {
    Llt::new(covariance.as_ref(), Side::Lower).expect("a covariance with noise is positive definite")
}

/// The vertices of a patch that were found.
pub(crate) struct Found {
    /// Their positions in the patch.
    pub rows: Vec<usize>,
    /// Their places, metres.
    pub at: Vec<[f64; 2]>,
    /// Their displacements, o × 2, metres.
    pub moved: Mat<f64>,
}

impl Found {
    pub fn new(patches: &Patches, patch: &Patch, observed: &Observed) -> Self {
        let all = patch.vertices.iter().enumerate();
        let (rows, displacement): (Vec<usize>, Vec<[f64; 2]>) = all
            .filter(|(row, _)| !patch.hangs_elsewhere(*row))
            .filter_map(|(row, &v)| Some((row, observed[v as usize]?)))
            .unzip();
        let at = rows.iter().map(|&row| patches.positions_m()[patch.vertices[row] as usize]).collect();
        Found { moved: Mat::from_fn(rows.len(), 2, |o, axis| displacement[o][axis]), rows, at }
    }
}

/// Kriging within one patch.
struct Kriging {
    deformation: Deformation,
    found: Found,
    weights: Vec<f64>,
    /// Σ⁻¹ y, o × 2.
    solved: Mat<f64>,
    /// y − f̂ at the found vertices, metres.
    residuals_m: Vec<[f64; 2]>,
}

struct PatchPrediction {
    displacement_m: Vec<[f64; 2]>,
    rows: Vec<usize>,
    weights: Vec<f64>,
}

impl Kriging {
    /// Alternates between estimating the deformation and reducing the weights of vertices that do
    /// not fit it.
    fn new(deformation: Deformation, found: Found) -> Self {
        let mut weights = vec![1.0; found.rows.len()];
        let mut solved = Mat::zeros(found.rows.len(), 2);
        let mut residuals_m = Vec::new();
        for _ in 0..if found.rows.is_empty() { 0 } else { 3 } {
            solved = Covariance::new(&deformation, &found.at, &weights).solve(&found.moved);
            // The residual is y − f̂ = (σ² / w) Σ⁻¹ y.
            let residual_m = |(o, w): (usize, &f64)| {
                [0, 1].map(|axis| solved[(o, axis)] * deformation.noise_m.powi(2) / w)
            };
            residuals_m = weights.iter().enumerate().map(residual_m).collect();
            for (weight, [x, y]) in weights.iter_mut().zip(&residuals_m) {
                *weight = (HUBER * deformation.noise_m / x.hypot(*y)).min(1.0);
            }
        }
        Kriging { deformation, found, weights, solved, residuals_m }
    }

    fn predict(self, patches: &Patches, patch: &Patch) -> PatchPrediction {
        let total = |axis: usize| (0..self.found.rows.len()).map(|o| self.solved[(o, axis)]).sum::<f64>();
        let shift = [0, 1].map(|axis| SHIFT_M.powi(2) * total(axis));
        let anywhere = |v: u32| {
            let here = patches.positions_m()[v as usize];
            self.found.at.iter().enumerate().fold(shift, |sum, (o, &there)| {
                let k = self.deformation.covariance(here, there);
                [sum[0] + k * self.solved[(o, 0)], sum[1] + k * self.solved[(o, 1)]]
            })
        };
        let mut displacement_m = vec![None; patch.vertices.len()];
        if self.deformation.deviation_m == 0.0 {
            displacement_m.fill(Some(shift));
        }
        for (o, &row) in self.found.rows.iter().enumerate() {
            let fitted = [0, 1].map(|axis| self.found.moved[(o, axis)] - self.residuals_m[o][axis]);
            displacement_m[row].get_or_insert(fitted);
        }
        let each = displacement_m.into_iter().zip(&patch.vertices);
        let displacement_m = each.map(|(known, &v)| known.unwrap_or_else(|| anywhere(v))).collect();
        PatchPrediction { displacement_m, rows: self.found.rows, weights: self.weights }
    }
}

/// The data of one patch for the likelihood.
struct Sample {
    at: Vec<[f64; 2]>,
    /// o × 2.
    moved: Mat<f64>,
    /// α² E_o E_oᵀ, o × o.
    mark: Mat<f64>,
}

impl Sample {
    fn new(
        patches: &Patches,
        patch: &Patch,
        observed: &Observed,
        carriers: usize,
        parameters: &Parameters,
    ) -> Result<Self> {
        let mut found = Found::new(patches, patch, observed);
        // Neighbours in x remain, as short distances determine ℓ.
        found.rows.truncate(SAMPLE_VERTICES);
        found.at.truncate(SAMPLE_VERTICES);
        let basis = Basis::low_frequencies(patch, carriers + 1)?;
        let count = found.rows.len();
        let seen = Response::carriers(patch, &basis, parameters.shape).rows(&found.rows);
        let moved = found.moved.subrows(0, count).to_owned();
        let mark = seen.covariance() * faer::Scale(parameters.amplitude_m.powi(2));
        Ok(Sample { at: found.at, moved, mark })
    }

    /// Returns log p(y) of both axes without its constant.
    fn log_likelihood(&self, candidate: &Deformation) -> f64 {
        let count = self.at.len();
        let factor = factor(&(candidate.matrix(&self.at, &vec![1.0; count]) + &self.mark));
        let half_log_determinant: f64 = (0..count).map(|i| factor.L()[(i, i)].ln()).sum();
        let solved = factor.solve(&self.moved);
        let axis = |a: usize| (0..count).map(|i| self.moved[(i, a)] * solved[(i, a)]).sum::<f64>();
        -2.0 * half_log_determinant - (axis(0) + axis(1)) / 2.0
    }
}

/// Finds the maximum by coordinate ascent over the grid of values, with a deformation and without
/// one.
fn most_likely(log_likelihood: impl Fn(&Deformation) -> f64) -> Deformation {
    let best_of = |candidates: &mut dyn Iterator<Item = Deformation>| {
        let scored = candidates.map(|candidate| (log_likelihood(&candidate), candidate));
        scored.reduce(|best, next| if next.0 > best.0 { next } else { best }).expect("candidates")
    };
    let still = best_of(&mut NOISES_M.iter().map(|&noise_m| Deformation::none(noise_m)));
    let start = Deformation { deviation_m: 0.25, range_m: 20.0, noise_m: still.1.noise_m };
    let mut best = (f64::NEG_INFINITY, start);
    loop {
        let before = best.0;
        let now = best.1;
        best = best_of(&mut RANGES_M.iter().map(|&range_m| Deformation { range_m, ..now }));
        let now = best.1;
        best = best_of(&mut DEVIATIONS_M.iter().map(|&deviation_m| Deformation { deviation_m, ..now }));
        let now = best.1;
        best = best_of(&mut NOISES_M.iter().map(|&noise_m| Deformation { noise_m, ..now }));
        if best.0 <= before {
            break;
        }
    }
    if best.0 > still.0 + WORTH_IT { best.1 } else { still.1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ground::Ground, map::Map, vertices::VertexTable};

    /// 600 scattered vertices on 300 m × 300 m in two patches.
    fn patches() -> Patches {
        let hash = |i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29) % 300_000;
        let coords = (0..600).map(|i| [hash(i) as f64 / 1e3, hash(i + 7777) as f64 / 1e3]).collect();
        let table = VertexTable::new(coords).unwrap();
        let parameters = Parameters { patch_size: 300, ..Parameters::default() };
        Patches::new(&Map::of_points(&table, Ground::Plane { metres_per_unit: 1.0 }), &parameters).unwrap()
    }

    fn wave([x, y]: [f64; 2]) -> [f64; 2] {
        [0.8 * (x / 40.0).sin(), 0.8 * (y / 40.0).cos()]
    }

    /// Returns the wave at two vertices of three, with a centimetre of noise.
    fn observed(patches: &Patches) -> Vec<Option<[f64; 2]>> {
        let noise = |i: usize| ((i * 7919) % 101) as f64 / 101.0 * 0.03 - 0.015;
        let each = patches.positions_m().iter().enumerate();
        each.map(|(i, p)| (i % 3 > 0).then(|| [wave(*p)[0] + noise(i), wave(*p)[1] - noise(i)])).collect()
    }

    #[test]
    fn a_smooth_deformation_is_found_and_predicted_where_nothing_was_observed() {
        let patches = patches();
        let observed = observed(&patches);
        let parameters = Parameters { amplitude_m: 0.001, ..Parameters::default() };
        let found = Deformation::estimate(&patches, &observed, 64, &parameters).unwrap();
        assert!(found.deviation_m >= 0.25 && found.range_m >= 20.0, "{found:?}");
        let prediction = found.predict(&patches, &observed, 64, parameters.amplitude_m);
        let miss = |i: usize| {
            let (a, b) = (prediction.displacement_m[i], wave(patches.positions_m()[i]));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        let mut misses: Vec<f64> = (0..600).step_by(3).map(miss).collect();
        misses.sort_by(f64::total_cmp);
        assert!(misses[100] < 0.03 && misses[190] < 0.2, "{} {}", misses[100], misses[190]);
    }

    #[test]
    fn without_a_deformation_the_covariance_needs_no_factoring_and_at_a_found_vertex_no_kernel() {
        let patches = patches();
        let found = Found::new(&patches, &patches.as_slice()[0], &observed(&patches));
        let weights: Vec<f64> = (0..found.rows.len()).map(|o| 0.1 + (o % 10) as f64 / 10.0).collect();
        let still = Deformation::none(0.03);
        let (quick, dense) = (
            Covariance::new(&still, &found.at, &weights),
            Covariance::Dense(factor(&still.matrix(&found.at, &weights))),
        );
        let difference = quick.solve(&found.moved) - dense.solve(&found.moved);
        assert!(difference.norm_max() < 1e-8 * dense.solve(&found.moved).norm_max());
        let gram = |covariance: &Covariance| {
            let white = covariance.whiten(found.moved.clone());
            white.transpose() * &white
        };
        assert!((gram(&quick) - gram(&dense)).norm_max() < 1e-9 * gram(&dense).norm_max());
        // A smooth deformation with negligible noise interpolates the observed displacements.
        let smooth = Deformation { deviation_m: 0.5, range_m: 40.0, noise_m: 1e-4 };
        let observed: Vec<_> = patches.positions_m().iter().map(|p| Some(wave(*p))).collect();
        let prediction = smooth.predict(&patches, &observed, 64, 0.0);
        for (predicted, observed) in prediction.displacement_m.iter().zip(observed.iter().flatten()) {
            assert!((predicted[0] - observed[0]).hypot(predicted[1] - observed[1]) < 1e-3);
        }
    }

    #[test]
    fn a_few_wrong_matches_are_dropped_and_honest_displacements_stay() {
        let patches = patches();
        let mut observed = observed(&patches);
        for wrong in [100, 301, 400] {
            observed[wrong] = observed[wrong].map(|[x, y]| [x + 0.7, y - 0.7]);
        }
        let deformation = Deformation { deviation_m: 0.5, range_m: 40.0, noise_m: 0.02 };
        let prediction = deformation.predict(&patches, &observed, 64, 0.001);
        let kept = prediction.without_outliers(&observed, 0.01);
        assert!([100, 301, 400].iter().all(|&wrong| kept[wrong].is_none()));
        let (before, after) = (observed.iter().flatten().count(), kept.iter().flatten().count());
        assert!(before - after <= 3 + before / 50, "{before} {after}");
        assert_eq!(prediction.without_outliers(&[None; 600], 0.01), [None; 600]);
    }

    #[test]
    fn noise_is_not_taken_for_a_deformation() {
        let patches = patches();
        let random = |i: u64| (i.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / 2f64.powi(53) - 0.5;
        let observed: Vec<_> = (0..600).map(|i| Some([random(2 * i + 1), random(2 * i + 2)])).collect();
        let found = Deformation::estimate(&patches, &observed, 64, &Parameters::default()).unwrap();
        assert_eq!(found.deviation_m, 0.0);
        assert!((0.16..0.5).contains(&found.noise_m), "{found:?}"); // uniform ±0.5 m: 0.29 m
    }

    #[test]
    fn a_vertex_that_does_not_fit_weighs_less() {
        let patches = patches();
        let mut observed = observed(&patches);
        observed[301] = observed[301].map(|[x, y]| [x + 0.7, y - 0.7]);
        let deformation = Deformation { deviation_m: 0.5, range_m: 40.0, noise_m: 0.02 };
        let prediction = deformation.predict(&patches, &observed, 64, 0.001);
        assert!(prediction.weights[301] < 0.2, "{}", prediction.weights[301]);
        assert!(prediction.weights.iter().filter(|w| **w == 1.0).count() > 500);
    }
}
