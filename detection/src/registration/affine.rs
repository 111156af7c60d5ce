//! Affine maps of the plane and their fit to pairs of points.

use nalgebra::{Matrix3, Matrix3x2};

/// x′ = a x + b y + c, y′ = d x + e y + f.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    /// a, b, c, d, e, f.
    pub coefficients: [f64; 6],
}

impl Affine {
    /// The map that leaves every point in its place.
    pub const IDENTITY: Affine = Affine { coefficients: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0] };

    /// Returns the image of `p`.
    pub fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d, e, f] = self.coefficients;
        [a * x + b * y + c, d * x + e * y + f]
    }

    /// Returns the affine map that gives the points zero mean and unit covariance; the identity
    /// when they lie on a line.
    pub(crate) fn whitening(points: &[[f64; 2]]) -> Self {
        let Some(c) = weighted_mean(points, &vec![1.0; points.len()]) else { return Self::IDENTITY };
        let mean = |f: &dyn Fn(f64, f64) -> f64| {
            points.iter().map(|p| f(p[0] - c[0], p[1] - c[1])).sum::<f64>() / points.len() as f64
        };
        let (xx, xy, yy) = (mean(&|x, _| x * x), mean(&|x, y| x * y), mean(&|_, y| y * y));
        let (x_scale, slope) = (xx.sqrt(), xy / xx);
        let y_scale = (yy - slope * xy).sqrt();
        if !(x_scale > 0.0 && y_scale > 1e-6 * (yy.sqrt())) {
            return Self::IDENTITY;
        }
        let [a, d, e] = [1.0 / x_scale, -slope / y_scale, 1.0 / y_scale];
        Affine { coefficients: [a, 0.0, -a * c[0], d, e, -d * c[0] - e * c[1]] }
    }

    /// Returns the affine map from `from` to `to` with the least weighted sum of squares; `None`
    /// when the points do not span a plane. `weights` has one entry for every pair.
    pub fn fit(from: &[[f64; 2]], to: &[[f64; 2]], weights: &[f64]) -> Option<Self> {
        let centre = weighted_mean(from, weights)?;
        let spread = from.iter().flat_map(|p| [(p[0] - centre[0]).abs(), (p[1] - centre[1]).abs()]);
        let scale = spread.fold(0.0, f64::max);
        if scale == 0.0 || !scale.is_finite() {
            return None;
        }
        // Coordinates are centred and scaled to ±1, as those of 10⁷ give a normal matrix of
        // excessive condition number.
        let (mut normal, mut right) = (Matrix3::<f64>::zeros(), Matrix3x2::<f64>::zeros());
        for ((p, q), &w) in from.iter().zip(to).zip(weights) {
            let row = [(p[0] - centre[0]) / scale, (p[1] - centre[1]) / scale, 1.0];
            for i in 0..3 {
                for j in 0..3 {
                    normal[(i, j)] += w * row[i] * row[j];
                }
                right[(i, 0)] += w * row[i] * q[0];
                right[(i, 1)] += w * row[i] * q[1];
            }
        }
        let condition = normal.symmetric_eigenvalues();
        if condition.min() <= 1e-12 * condition.max() {
            return None;
        }
        let s = normal.cholesky()?.solve(&right);
        let row = |axis: usize| {
            let (a, b) = (s[(0, axis)] / scale, s[(1, axis)] / scale);
            [a, b, s[(2, axis)] - a * centre[0] - b * centre[1]]
        };
        let ([a, b, c], [d, e, f]) = (row(0), row(1));
        Some(Affine { coefficients: [a, b, c, d, e, f] })
    }

    /// Returns the affine map with the least sum of distances instead of squares, on which a few
    /// wrong pairs have little influence (paper, section 3.5). The method is iteratively reweighted
    /// least squares (Weiszfeld 1937); distances below `least_distance` have equal weight.
    /// Distances are in the units of `to`.
    pub(crate) fn fit_robustly(from: &[[f64; 2]], to: &[[f64; 2]], least_distance: f64) -> Option<Self> {
        let fit = |weights: &[f64]| Self::fit(from, to, weights);
        least_distances(from, to, least_distance, fit, |affine, p| affine.apply(p))
    }
}

/// Minimises the sum of distances by iteratively reweighted least squares: `fit` solves with given
/// weights, `apply` maps a point by a solution.
pub(crate) fn least_distances<T>(
    from: &[[f64; 2]],
    to: &[[f64; 2]],
    least_distance: f64,
    fit: impl Fn(&[f64]) -> Option<T>,
    apply: impl Fn(&T, [f64; 2]) -> [f64; 2],
) -> Option<T> {
    let mut weights = vec![1.0; from.len()];
    let mut best = fit(&weights)?;
    for _ in 0..50 {
        for ((w, p), q) in weights.iter_mut().zip(from).zip(to) {
            let r = apply(&best, *p);
            *w = 1.0 / (r[0] - q[0]).hypot(r[1] - q[1]).max(least_distance);
        }
        let next = fit(&weights)?;
        let change = from.iter().map(|p| {
            let (a, b) = (apply(&best, *p), apply(&next, *p));
            (a[0] - b[0]).hypot(a[1] - b[1])
        });
        let settled = change.fold(0.0, f64::max) < 1e-3 * least_distance;
        best = next;
        if settled {
            break;
        }
    }
    Some(best)
}

fn weighted_mean(points: &[[f64; 2]], weights: &[f64]) -> Option<[f64; 2]> {
    let total: f64 = weights.iter().sum();
    let sum = |axis: usize| points.iter().zip(weights).map(|(p, w)| p[axis] * w).sum::<f64>();
    (total > 0.0).then(|| [sum(0) / total, sum(1) / total])
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHEAR: Affine = Affine { coefficients: [0.8, -0.3, 5e5, 0.1, 1.2, 6.7e6] };

    fn grid() -> Vec<[f64; 2]> {
        (0..100).map(|i| [3.8e5 + (i % 10) as f64 * 70.0, 6.6e6 + (i / 10) as f64 * 50.0]).collect()
    }

    fn worst(fit: Affine, from: &[[f64; 2]]) -> f64 {
        let miss = |p: &[f64; 2]| {
            let (a, b) = (fit.apply(*p), SHEAR.apply(*p));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        from.iter().map(miss).fold(0.0, f64::max)
    }

    #[test]
    fn an_affine_map_is_recovered_at_large_coordinates() {
        let from = grid();
        let to: Vec<_> = from.iter().map(|p| SHEAR.apply(*p)).collect();
        let fit = Affine::fit(&from, &to, &[1.0; 100]).unwrap();
        assert!(worst(fit, &from) < 1e-6, "{}", worst(fit, &from));
    }

    #[test]
    fn a_quarter_of_wrong_pairs_does_not_pull_the_robust_fit() {
        let from = grid();
        let mut to: Vec<_> = from.iter().map(|p| SHEAR.apply(*p)).collect();
        (0..100).step_by(4).for_each(|i| to[i] = [to[i][0] + 300.0, to[i][1] - 40.0 * i as f64]);
        assert!(worst(Affine::fit(&from, &to, &[1.0; 100]).unwrap(), &from) > 50.0);
        assert!(worst(Affine::fit_robustly(&from, &to, 1e-3).unwrap(), &from) < 0.01);
    }

    #[test]
    fn points_on_a_line_have_no_affine_fit() {
        let line: Vec<_> = (0..10).map(|i| [i as f64, 2.0 * i as f64]).collect();
        assert_eq!(Affine::fit(&line, &line, &[1.0; 10]), None);
    }
}
