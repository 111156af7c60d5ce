//! The disturbance of the suspect besides the mark, estimated without the key: a smooth deformation
//! (rubber sheeting, digitising, a wrong projection), shifts of polygon groups, and noise. The
//! method is kriging of the displacements.
//!
//! The displacement of a vertex is deformation + shift of its group + mark + noise. The deformation
//! is a Gaussian process with a Matérn 5/2 covariance (Rasmussen and Williams, *Gaussian Processes
//! for Machine Learning*, 2006, eq. 4.17) and a free shift of every patch. The estimate does not
//! depend on the chips: it is the same for the tested key and for every decoy.

pub use crate::covariance::Deformation;

use crate::{
    Result,
    covariance::{Covariance, Found, SHIFT_M, factor},
    derived::{Observables, Site},
    noise_law::NoiseLaw,
    options::Parameters,
    patches::{Patch, Patches},
    response::Response,
    spectrum::Basis,
};
use faer::{Mat, linalg::solvers::Solve};
use rayon::prelude::*;

/// Displacement of every observable point in order, metres, or `None` where it was not found: of the
/// reference vertices in canonical order, or of points derived from them.
pub type Observed = [Option<[f64; 2]>];

/// Lower bound of the estimated noise, metres.
pub const LEAST_NOISE_M: f64 = 0.01;
/// Numbers of patches, and of vertices in each, from which the hyper-parameters are estimated.
const SAMPLE_PATCHES: usize = 6;
const SAMPLE_VERTICES: usize = 200;
/// Fewer found points carry no information about a patch.
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
const GROUP_SHIFTS_M: [f64; 7] = [0.0, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2];
const RANGES_M: [f64; 6] = [5.0, 10.0, 20.0, 40.0, 80.0, 160.0];
const NOISES_M: [f64; 11] = [0.01, 0.03, 0.06, 0.1, 0.16, 0.25, 0.35, 0.5, 0.8, 1.1, 1.6];

/// A predicted deformation.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Its hyper-parameters.
    pub deformation: Deformation,
    /// The deformation at every observable point in order, found or not, metres.
    pub displacement_m: Vec<[f64; 2]>,
    /// The weight of every such point: 1, or less where its displacement disagrees with the others.
    pub weights: Vec<f64>,
}

impl Prediction {
    /// Returns the disturbance of `vertices` vertices by nothing but noise of this standard
    /// deviation.
    pub fn of_noise(noise_m: f64, vertices: usize) -> Self {
        Prediction {
            deformation: Deformation::none(noise_m),
            displacement_m: vec![[0.0; 2]; vertices],
            weights: vec![1.0; vertices],
        }
    }

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
    /// Returns the hyper-parameters of greatest marginal likelihood on a few patches. The mark
    /// enters with its covariance over all chips and messages, α² E Eᵀ. `carriers` is the result of
    /// [`Patches::carriers`].
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`].
    pub fn estimate<'a>(
        of: impl Into<Observables<'a>>,
        observed: &Observed,
        carriers: usize,
        parameters: &Parameters,
    ) -> Result<Self> {
        let of = of.into();
        let found = |p: &usize| of.in_patch(*p).iter().filter(|&&v| observed[v as usize].is_some()).count();
        let patches = 0..of.patches().as_slice().len();
        let known: Vec<usize> = patches.filter(|patch| found(patch) >= LEAST_FOUND).collect();
        let step = known.len().div_ceil(SAMPLE_PATCHES).max(1);
        let chosen: Vec<usize> = known.into_iter().step_by(step).collect();
        let sample = |patch: &usize| Sample::new(of, *patch, observed, carriers, parameters);
        let samples: Vec<Sample> = chosen.par_iter().map(sample).collect::<Result<_>>()?;
        Ok(most_likely(|candidate| {
            let each: Vec<f64> = samples.par_iter().map(|s| s.log_likelihood(candidate)).collect();
            each.iter().sum()
        }))
    }

    /// Predicts the deformation from the observed displacements. The mark counts as noise here, so
    /// no spectrum is needed.
    pub fn predict<'a>(
        &self,
        of: impl Into<Observables<'a>>,
        observed: &Observed,
        carriers: usize,
        amplitude_m: f64,
    ) -> Prediction {
        let of = of.into();
        let predict = |(number, patch): (usize, &Patch)| {
            let mark2 = amplitude_m.powi(2) * carriers as f64 / patch.vertices.len() as f64;
            let with_mark = Deformation { noise_m: (self.noise_m.powi(2) + mark2).sqrt(), ..*self };
            Kriging::new(with_mark, Found::new(of, number, observed)).predict(of, of.in_patch(number))
        };
        let patches = of.patches().as_slice().par_iter().enumerate();
        let predicted: Vec<PatchPrediction> = patches.map(predict).collect();
        let mut all = Prediction {
            deformation: *self,
            displacement_m: vec![[0.0; 2]; observed.len()],
            weights: vec![1.0; observed.len()],
        };
        for (patch, part) in predicted.into_iter().enumerate() {
            let points = of.in_patch(patch);
            for (&point, displacement) in points.iter().zip(part.displacement_m) {
                all.displacement_m[point as usize] = displacement;
            }
            for (row, weight) in part.rows.into_iter().zip(part.weights) {
                all.weights[points[row] as usize] = weight;
            }
        }
        all
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

    fn predict(self, of: Observables, points: &[u32]) -> PatchPrediction {
        let total = |axis: usize| (0..self.found.rows.len()).map(|o| self.solved[(o, axis)]).sum::<f64>();
        let shift = [0, 1].map(|axis| SHIFT_M.powi(2) * total(axis));
        let anywhere = |point: u32| {
            let here = of.place(point);
            self.found.at.iter().enumerate().fold(shift, |sum, (o, there)| {
                let k = self.deformation.covariance(here.at_m, there.at_m)
                    + self.deformation.of_groups(here.group, there.group);
                [sum[0] + k * self.solved[(o, 0)], sum[1] + k * self.solved[(o, 1)]]
            })
        };
        let mut displacement_m = vec![None; points.len()];
        if self.deformation.is_still() {
            displacement_m.fill(Some(shift));
        }
        for (o, &row) in self.found.rows.iter().enumerate() {
            let fitted = [0, 1].map(|axis| self.found.moved[(o, axis)] - self.residuals_m[o][axis]);
            displacement_m[row].get_or_insert(fitted);
        }
        let each = displacement_m.into_iter().zip(points);
        let displacement_m = each.map(|(known, &point)| known.unwrap_or_else(|| anywhere(point))).collect();
        PatchPrediction { displacement_m, rows: self.found.rows, weights: self.weights }
    }
}

/// The data of one patch for the likelihood.
struct Sample {
    at: Vec<Site>,
    /// o × 2.
    moved: Mat<f64>,
    /// α² E_o E_oᵀ, o × o.
    mark: Mat<f64>,
}

impl Sample {
    fn new(
        of: Observables,
        number: usize,
        observed: &Observed,
        carriers: usize,
        parameters: &Parameters,
    ) -> Result<Self> {
        let patch = &of.patches().as_slice()[number];
        let mut found = Found::new(of, number, observed);
        // Neighbours in x remain, as short distances determine ℓ.
        found.rows.truncate(SAMPLE_VERTICES);
        found.at.truncate(SAMPLE_VERTICES);
        let basis = Basis::low_frequencies(patch, carriers + 1)?;
        let count = found.rows.len();
        let seen = of.seen(number, &Response::carriers(patch, &basis, parameters), &found.rows);
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

/// Finds the maximum by coordinate ascent over the grid of values: with a deformation and without
/// one, then with shifts of polygon groups.
fn most_likely(log_likelihood: impl Fn(&Deformation) -> f64) -> Deformation {
    let best_of = |candidates: &mut dyn Iterator<Item = Deformation>| {
        let scored = candidates.map(|candidate| (log_likelihood(&candidate), candidate));
        scored.reduce(|best, next| if next.0 > best.0 { next } else { best }).expect("candidates")
    };
    let still = best_of(&mut NOISES_M.iter().map(|&noise_m| Deformation::none(noise_m)));
    let start = Deformation { deviation_m: 0.25, range_m: 20.0, ..still.1 };
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
    let smooth = if best.0 > still.0 + WORTH_IT { best } else { still };
    let mut best = smooth;
    for _ in 0..2 {
        let now = best.1;
        let shifts = GROUP_SHIFTS_M.iter().map(|&group_shift_m| Deformation { group_shift_m, ..now });
        let mut with_noises = shifts
            .flat_map(|shifted| NOISES_M.iter().map(move |&noise_m| Deformation { noise_m, ..shifted }));
        best = best_of(&mut with_noises);
        if best.1.group_shift_m == 0.0 || smooth.1.deviation_m == 0.0 {
            break;
        }
        // Shifts of groups may be what a smooth deformation was taken for.
        let now = best.1;
        best = best_of(
            &mut [0.0].iter().chain(&DEVIATIONS_M).map(|&deviation_m| Deformation { deviation_m, ..now }),
        );
    }
    if best.0 > smooth.0 + WORTH_IT { best.1 } else { smooth.1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        ground::Ground,
        map::Map,
        map_data::{ChainKind, MapData},
        vertices::VertexTable,
    };

    /// 600 scattered vertices on 300 m × 300 m in two patches.
    fn patches() -> Patches {
        let hash = |i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29) % 300_000;
        let coords = (0..600).map(|i| [hash(i) as f64 / 1e3, hash(i + 7777) as f64 / 1e3]).collect();
        let table = VertexTable::new(coords).unwrap();
        let parameters = Parameters { patch_size: 300, ..Parameters::default() };
        Patches::new(&Map::of_points(&table, &Ground::METRES), &parameters).unwrap()
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
        let found = Found::new((&patches).into(), 0, &observed(&patches));
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
        let smooth = Deformation { deviation_m: 0.5, range_m: 40.0, group_shift_m: 0.0, noise_m: 1e-4 };
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
        let deformation = Deformation { deviation_m: 0.5, range_m: 40.0, group_shift_m: 0.0, noise_m: 0.02 };
        let prediction = deformation.predict(&patches, &observed, 64, 0.001);
        let kept = prediction.without_outliers(&observed, 0.01);
        assert!([100, 301, 400].iter().all(|&wrong| kept[wrong].is_none()));
        let (before, after) = (observed.iter().flatten().count(), kept.iter().flatten().count());
        assert!(before - after <= 3 + before / 50, "{before} {after}");
        assert_eq!(prediction.without_outliers(&[None; 600], 0.01), [None; 600]);
    }

    #[test]
    fn shifts_of_polygon_groups_are_told_from_noise_and_predicted_for_all_their_vertices() {
        let corner = |i: usize| [[0.0, 0.0], [9.0, 0.0], [9.0, 7.0], [0.0, 7.0], [0.0, 0.0]][i % 5];
        let house = |i: usize| [(i / 5 % 15 * 20 + i / 5 % 7) as f64, (i / 75 * 20 + i / 5 % 3) as f64];
        let coords = (0..750).map(|i| [0, 1].map(|axis| corner(i)[axis] + house(i)[axis])).collect();
        let starts: Vec<u32> = (0..750).step_by(5).collect();
        let (town, _) = MapData::from_chains(coords, &starts, vec![ChainKind::Shell; 150]).unwrap();
        let patches = Patches::new(
            &town.on(&Ground::METRES, &Ground::METRES),
            &Parameters { patch_size: 300, ..Parameters::default() },
        )
        .unwrap();
        let random = |i: u64| (i.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / 2f64.powi(53) - 0.5;
        let shift = |root: u32| [0, 1].map(|axis| 3.0 * random(2 * u64::from(root) + axis + 1));
        let noise = |i: usize| 0.02 * random(7919 + i as u64);
        let observed: Vec<_> = (town.polygon_roots.iter().enumerate())
            .map(|(i, &root)| (i % 4 > 0).then(|| shift(root).map(|value| value + noise(i))))
            .collect();
        let parameters = Parameters { amplitude_m: 0.001, ..Parameters::default() };
        let found = Deformation::estimate(&patches, &observed, 64, &parameters).unwrap();
        assert!(found.group_shift_m >= 0.8 && found.noise_m <= 0.03, "{found:?}");
        let prediction = found.predict(&patches, &observed, 64, parameters.amplitude_m);
        let missed = (town.polygon_roots.iter().zip(&prediction.displacement_m))
            .filter(|(root, d)| (d[0] - shift(**root)[0]).hypot(d[1] - shift(**root)[1]) > 0.05);
        assert_eq!(missed.count(), 0);
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
        let deformation = Deformation { deviation_m: 0.5, range_m: 40.0, group_shift_m: 0.0, noise_m: 0.02 };
        let prediction = deformation.predict(&patches, &observed, 64, 0.001);
        assert!(prediction.weights[301] < 0.2, "{}", prediction.weights[301]);
        assert!(prediction.weights.iter().filter(|w| **w == 1.0).count() > 500);
    }
}
