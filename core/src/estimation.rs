//! Estimation: observed displacements become estimates of the sign of every coefficient.
//!
//! No key is involved. The estimates are a linear function of the displacements alone, so that under
//! a key or a recipient that has nothing to do with the suspect, its signs are independent of them.

use crate::{
    Result,
    covariance::{Covariance, Found},
    deformation::{Observed, Prediction},
    demodulation::posterior,
    derived::Observables,
    options::Parameters,
    patches::Patch,
    response::{Kernel, Response},
    spectrum::Basis,
};
use faer::Mat;
use rayon::prelude::*;

/// Estimates of the signs of all coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimates {
    /// ŝ_i, the expected sign given the displacements, between −1 and 1 on a whole copy: patches ×
    /// 2 axes × coefficients. It is 0 where nothing was observed.
    pub values: Vec<f64>,
    /// v_i, the variance of each; a mark of full amplitude has ŝ_i = (1 − v_i) s_i on average.
    pub variances: Vec<f64>,
    /// Number of coefficients of a patch and axis.
    pub coefficients: usize,
}

impl Estimates {
    /// Estimates the signs of `coefficients` coefficients of every patch and axis. In each patch
    /// y = S s + f + ε with signatures S = α E, the smooth deformation f and the noise ε of
    /// `disturbance`. With Σ = cov(f + ε): ŝ = (SᵀΣ⁻¹S + I)⁻¹ SᵀΣ⁻¹ y. Vertices that were not found
    /// are erasures.
    ///
    /// `observed` holds the displacement of every point in order, metres, or `None`; `progress` is called once for every patch.
    ///
    /// # Errors
    /// Fails when a patch cannot be solved.
    pub fn new<'a>(
        of: impl Into<Observables<'a>>,
        observed: &Observed,
        coefficients: usize,
        parameters: &Parameters,
        disturbance: &Prediction,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        Self::with_bases((of.into(), &[]), observed, coefficients, parameters, disturbance, progress)
    }

    /// Does the same as [`Self::new`], with the bases of the first patches in `solved`.
    pub(crate) fn with_bases(
        (of, solved): (Observables, &[Basis]),
        observed: &Observed,
        coefficients: usize,
        parameters: &Parameters,
        disturbance: &Prediction,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        assert_eq!(observed.len(), of.count(), "one observation for every point");
        let of_patch = |(number, patch): (usize, &Patch)| {
            let found = Found::new(of, number, observed);
            if found.rows.is_empty() {
                progress(1);
                return Ok((vec![0.0; 2 * coefficients], vec![1.0; 2 * coefficients]));
            }
            let basis = Basis::known_or_solved(solved, number, patch, coefficients + 1)?;
            let weights: Vec<f64> = found
                .rows
                .iter()
                .map(|&row| disturbance.weights[of.in_patch(number)[row] as usize])
                .collect();
            let covariance = Covariance::new(&disturbance.deformation, &found.at, &weights);
            let response = Response::carriers(patch, &basis, parameters);
            let seen = of.seen(number, &response, &found.rows);
            let seen = seen.map(|block| covariance.whiten(block));
            let correlations = seen.correlations(&covariance.whiten(found.moved));
            let estimates = estimate(&seen.kernel(), &correlations, parameters.amplitude_m);
            progress(1);
            Ok(estimates)
        };
        let all = of.patches().as_slice().par_iter().enumerate();
        let (values, variances): (Vec<_>, Vec<_>) =
            all.map(of_patch).collect::<Result<Vec<(Vec<f64>, Vec<f64>)>>>()?.into_iter().unzip();
        Ok(Estimates { values: values.concat(), variances: variances.concat(), coefficients })
    }
}

/// Returns estimates and variances of the signs of both axes of a patch.
fn estimate(kernel: &Kernel, correlations: &[Vec<f64>; 2], amplitude_m: f64) -> (Vec<f64>, Vec<f64>) {
    let product = |axis: usize| correlations[axis].iter().map(|a| amplitude_m * a).collect::<Vec<f64>>();
    let gram = |lower: &Mat<f64>| lower * faer::Scale(amplitude_m.powi(2));
    match (&kernel.own[..], &kernel.cross) {
        ([(_, lower)], None) => {
            let [x, y] = [0, 1].map(|axis| posterior(gram(lower), &product(axis)));
            ([x.0, y.0].concat(), [x.1, y.1].concat())
        }
        ([(_, x), (_, y)], Some(cross)) => {
            let count = x.ncols();
            let mut coupled = Mat::zeros(2 * count, 2 * count);
            coupled.submatrix_mut(0, 0, count, count).copy_from(x);
            coupled.submatrix_mut(count, count, count, count).copy_from(y);
            coupled.submatrix_mut(count, 0, count, count).copy_from(cross.transpose());
            posterior(gram(&coupled), &[product(0), product(1)].concat())
        }
        _ => unreachable!("a kernel is that of both axes, or of either with their products"),
    }
}
