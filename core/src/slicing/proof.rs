//! The proof that eigenvalues are the lowest ones and that their vectors are accurate.
//!
//! Within the residual of a vector of length one around its Rayleigh quotient there is an
//! eigenvalue (B. N. Parlett, *The Symmetric Eigenvalue Problem*, SIAM, 1998, theorem 4.5.1). When
//! these k intervals are disjoint they hold k eigenvalues, and when the inertia at a shift above
//! them is k, up to the error of its factor, there are no others. The angle between a vector and
//! the eigenvector is at most its residual over the distance to the other eigenvalues (theorem
//! 11.7.1).

use super::solution::Solution;

/// A residual is computed with this error, relative to the norm of the matrix.
const ROUNDING: f64 = 2e-15;
/// A vector is refused when its residual is not smaller than this.
const LARGE_RESIDUAL: f64 = 1e-13;
/// A vector is refused when its error may be larger than this.
const LARGE_ERROR: f64 = 1e-9;

/// Checks residuals and distances, and returns the upper end of the interval of the highest
/// eigenvalue.
pub fn disjoint(solution: &Solution, least_gap: f64, norm: f64) -> Option<f64> {
    let Solution { values, residuals, .. } = solution;
    let radius = |i: usize| residuals[i] + ROUNDING * norm;
    let is_small = residuals.iter().all(|residual| *residual < LARGE_RESIDUAL * norm);
    let is_apart = (1..values.len()).all(|i| {
        let gap = values[i] - values[i - 1] - radius(i) - radius(i - 1);
        gap > least_gap && residuals[i].max(residuals[i - 1]) < LARGE_ERROR * gap
    });
    let last = values.len() - 1;
    (is_small && is_apart).then(|| values[last] + radius(last))
}
