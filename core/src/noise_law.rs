//! The shape of the noise and the transformation of residuals that suits it. Least squares is
//! optimal under Gaussian noise only. Rounding to a grid and an attack that adds up to ±50 cm leave
//! noise with short tails, under which large residuals carry more information about the mark than
//! small ones.
//!
//! For noise of density f, the best test of a weak signal uses −f′/f of the residual in place of
//! the residual (the locally optimum detector: Kassam, *Signal Detection in Non-Gaussian Noise*,
//! 1988, chapter 2). Here f is a generalised Gaussian, exp(−|r|^κ), so −f′/f is sign(r) |r|^(κ−1);
//! κ = 2 leaves residuals unchanged. κ is chosen from the residuals, without key or chips.

/// The exponents κ that are tried.
const EXPONENTS: [f64; 6] = [2.0, 3.0, 4.0, 6.0, 8.0, 12.0];
/// κ > 2 must bring the variance below this share of that of least squares.
const WORTH_IT: f64 = 0.9;
/// Fewer residuals do not determine a shape.
const LEAST_RESIDUALS: usize = 500;

/// −f′/f of the noise, scaled so that a small shift of the residual shifts it as much.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseLaw {
    /// κ of the generalised Gaussian.
    pub exponent: f64,
    /// E[(κ−1) |r|^(κ−2)].
    slope: f64,
    /// Variance of a transformed residual, square metres.
    pub variance_m2: f64,
}

impl NoiseLaw {
    /// Fits the law under which `residuals_m` (any number, metres, each of one axis) carry most
    /// information about a shift.
    pub fn fit(residuals_m: &[f64]) -> Self {
        let plain = Self::with_exponent(2.0, residuals_m);
        if residuals_m.len() < LEAST_RESIDUALS {
            return plain;
        }
        let laws = EXPONENTS.map(|exponent| Self::with_exponent(exponent, residuals_m));
        let best = laws.into_iter().min_by(|a, b| a.variance_m2.total_cmp(&b.variance_m2)).expect("laws");
        if best.variance_m2 < WORTH_IT * plain.variance_m2 { best } else { plain }
    }

    fn with_exponent(exponent: f64, residuals_m: &[f64]) -> Self {
        let count = residuals_m.len().max(1) as f64;
        let mean = |power: f64| residuals_m.iter().map(|r| r.abs().powf(power)).sum::<f64>() / count;
        let slope = (exponent - 1.0) * mean(exponent - 2.0);
        let variance_m2 = if slope > 0.0 { mean(2.0 * exponent - 2.0) / slope.powi(2) } else { 0.0 };
        NoiseLaw { exponent, slope, variance_m2 }
    }

    /// Transforms a residual, metres.
    pub fn apply(&self, residual_m: f64) -> f64 {
        if self.exponent == 2.0 {
            return residual_m;
        }
        residual_m.signum() * residual_m.abs().powf(self.exponent - 1.0) / self.slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::{
        ChaCha8Rng,
        rand_core::{Rng, SeedableRng},
    };

    /// 20 000 numbers: `of` makes them from uniform ones in [0, 1).
    fn noise(of: impl Fn(&mut dyn FnMut() -> f64) -> f64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut uniform = || (random.next_u64() >> 11) as f64 / 2f64.powi(53);
        (0..20_000).map(|_| of(&mut uniform)).collect()
    }

    fn gaussian(uniform: &mut dyn FnMut() -> f64) -> f64 {
        let (a, b) = (uniform(), uniform());
        (-2.0 * (1.0 - a).ln()).sqrt() * (2.0 * std::f64::consts::PI * b).cos()
    }

    #[test]
    fn gaussian_and_heavy_tailed_noise_stay_with_least_squares() {
        let normal = NoiseLaw::fit(&noise(|u| 0.3 * gaussian(u)));
        assert_eq!(normal.exponent, 2.0);
        assert!((normal.variance_m2 - 0.09).abs() < 0.004, "{normal:?}");
        assert_eq!(normal.apply(0.7), 0.7);
        let laplace = NoiseLaw::fit(&noise(|u| -(1.0 - u()).ln() * if u() < 0.5 { 1.0 } else { -1.0 }));
        assert_eq!(laplace.exponent, 2.0);
    }

    #[test]
    fn under_uniform_noise_a_small_shift_is_seen_with_a_fraction_of_the_variance() {
        // Uniform ±0.5 m with a Gaussian mark of 7 cm under it, all shifted by a centimetre.
        let mark = noise(|u| 0.07 * gaussian(u));
        let plain: Vec<f64> = noise(|u| u() - 0.5).iter().rev().zip(mark).map(|(n, m)| n + m).collect();
        let law = NoiseLaw::fit(&plain);
        assert!(law.exponent > 2.0 && law.variance_m2 < 0.6 * (1.0 / 12.0 + 0.07 * 0.07), "{law:?}");
        let mean = |shift: f64| plain.iter().map(|r| law.apply(r + shift)).sum::<f64>() / 2e4;
        assert!((mean(0.01) - mean(-0.01) - 0.02).abs() < 0.002, "{}", mean(0.01) - mean(-0.01));
    }

    #[test]
    fn no_residuals_and_no_noise_are_no_trouble() {
        assert_eq!(NoiseLaw::fit(&[]).apply(0.2), 0.2);
        assert_eq!(NoiseLaw::fit(&[0.0; 1000]).apply(0.2), 0.2);
    }
}
