//! Cubic polynomials: the remainder of a smooth distortion (an unknown projection, a stretched
//! scan) after the best affine map.

use super::affine::{Affine, least_distances};
use nalgebra::{SMatrix, SVector};
use serde::Serialize;

/// Terms of one axis: 1, u, v, u², uv, v², u³, u²v, uv², v³.
pub(super) const TERMS: usize = 10;

/// With u = (x − centre x) / scale and v alike: x′ = x + Σ x_i t_i(u, v), y′ = y + Σ y_i t_i(u, v).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cubic {
    /// Centre of the reference, CRS units.
    pub centre: [f64; 2],
    /// Half of its longer side, CRS units.
    pub scale: f64,
    /// Coefficients of x, CRS units.
    pub x: [f64; TERMS],
    /// Coefficients of y, CRS units.
    pub y: [f64; TERMS],
}

/// An affine map, followed by an optional cubic polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Transform {
    /// The linear part.
    pub affine: Affine,
    /// The nonlinear remainder.
    pub cubic: Option<Cubic>,
}

impl From<Affine> for Transform {
    fn from(affine: Affine) -> Self {
        Transform { affine, cubic: None }
    }
}

impl Transform {
    /// Returns the image of `p`.
    pub fn apply(&self, p: [f64; 2]) -> [f64; 2] {
        let p = self.affine.apply(p);
        self.cubic.map_or(p, |cubic| cubic.apply(p))
    }
}

impl Cubic {
    /// Returns the polynomial that leaves every point in its place. Its frame encloses the map: the
    /// centre and half of the longer side.
    pub(crate) fn zero(centre: [f64; 2], scale: f64) -> Self {
        Cubic { centre, scale, x: [0.0; TERMS], y: [0.0; TERMS] }
    }

    /// Returns the image of `p`.
    pub(crate) fn apply(&self, p: [f64; 2]) -> [f64; 2] {
        let terms = self.terms(p);
        let shift = |c: &[f64; TERMS]| c.iter().zip(terms).map(|(c, t)| c * t).sum::<f64>();
        [p[0] + shift(&self.x), p[1] + shift(&self.y)]
    }

    fn terms(&self, p: [f64; 2]) -> [f64; TERMS] {
        let [u, v] = [0, 1].map(|axis| (p[axis] - self.centre[axis]) / self.scale);
        [1.0, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v]
    }

    /// Returns the polynomial in the frame of `self` that maps `from` to `to` with the least sum of
    /// distances; `None` when the points do not determine it. `least_distance` has the meaning it
    /// has in [`Affine::fit_robustly`].
    pub(crate) fn fit_robustly(
        &self,
        from: &[[f64; 2]],
        to: &[[f64; 2]],
        least_distance: f64,
    ) -> Option<Self> {
        let fit = |weights: &[f64]| self.fit(from, to, weights);
        least_distances(from, to, least_distance, fit, |cubic, p| cubic.apply(p))
    }

    fn fit(&self, from: &[[f64; 2]], to: &[[f64; 2]], weights: &[f64]) -> Option<Self> {
        let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
        let mut right = SMatrix::<f64, TERMS, 2>::zeros();
        for ((p, q), &w) in from.iter().zip(to).zip(weights) {
            let terms = SVector::from(self.terms(*p));
            normal.syger(w, &terms, &terms, 1.0);
            for axis in 0..2 {
                right.column_mut(axis).axpy(w * (q[axis] - p[axis]), &terms, 1.0);
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        let condition = normal.symmetric_eigenvalues();
        if condition.min() <= 1e-9 * condition.max() {
            return None;
        }
        let solution = normal.cholesky()?.solve(&right);
        let column = |axis: usize| std::array::from_fn(|i| solution[(i, axis)]);
        Some(Cubic { x: column(0), y: column(1), ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns 20 × 20 points, 50 m apart, and their images under a cubic polynomial of up to tens
    /// of metres.
    fn bent() -> (Cubic, Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let truth = Cubic {
            x: [3.0, -1.0, 2.0, 12.0, -5.0, 4.0, 8.0, 0.5, -3.0, 1.0],
            y: [-7.0, 0.5, 1.0, 2.0, 9.0, -15.0, 0.0, 6.0, -2.0, 11.0],
            ..Cubic::zero([3.8e5 + 475.0, 6.6e6 + 475.0], 475.0)
        };
        let at = |i: usize| [3.8e5 + 50.0 * (i % 20) as f64, 6.6e6 + 50.0 * (i / 20) as f64];
        let from: Vec<[f64; 2]> = (0..400).map(at).collect();
        let to = from.iter().map(|p| truth.apply(*p)).collect();
        (truth, from, to)
    }

    fn largest_difference(a: &Cubic, b: &Cubic) -> f64 {
        let pairs = a.x.iter().chain(&a.y).zip(b.x.iter().chain(&b.y));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_cubic_polynomial_is_recovered_with_a_fifth_of_wrong_pairs() {
        let (truth, from, mut to) = bent();
        (0..400).step_by(5).for_each(|i| to[i] = [to[i][0] + 40.0, to[i][1] - 0.3 * i as f64]);
        let fit = Cubic::zero(truth.centre, truth.scale).fit_robustly(&from, &to, 1e-4).unwrap();
        assert!(largest_difference(&fit, &truth) < 1e-3, "{fit:?}");
    }

    #[test]
    fn points_on_three_lines_determine_no_cubic() {
        let (truth, from, to) = bent();
        let zero = Cubic::zero(truth.centre, truth.scale);
        assert_eq!(zero.fit_robustly(&from[..60], &to[..60], 1e-4), None);
    }
}
