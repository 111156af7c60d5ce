//! Survival functions as logarithms: the probability of a larger score, finite even where it
//! underflows.

use statrs::function::{
    erf::erfc,
    gamma::{gamma_lr, ln_gamma},
};
use std::f64::consts::{LN_10, PI, SQRT_2};

/// Returns log₁₀ of the probability that a standard normal variable exceeds `score`; it is finite
/// for every finite score.
pub fn normal_log10(score: f64) -> f64 {
    if score < 30.0 {
        return (erfc(score / SQRT_2) / 2.0).log10();
    }
    // Two terms of Abramowitz and Stegun 26.2.12; erfc underflows from 38 on.
    let z2 = score * score;
    let ln = -z2 / 2.0 - (score * (2.0 * PI).sqrt()).ln() + (-1.0 / z2 + 3.0 / (z2 * z2)).ln_1p();
    ln / LN_10
}

/// Returns log₁₀ of a bound of the probability that a weighted sum of independent random signs of
/// variance 1 exceeds `score`, whatever the weights are: c Φ(−score) with c = 1 / (4 Φ(−√2)), the
/// smallest factor for which that is true (V. Bentkus, D. Dzindzalieta, *A tight Gaussian bound for
/// weighted sums of Rademacher random variables*, Bernoulli 21, 2015).
pub fn signs_log10(score: f64) -> f64 {
    (signs_factor_log10() + normal_log10(score)).min(0.0)
}

/// Returns log₁₀ of the factor of [`signs_log10`], 3.18.
pub fn signs_factor_log10() -> f64 {
    -4f64.log10() - normal_log10(SQRT_2)
}

/// Returns the score from which [`signs_log10`] is at most log₁₀ of `p`, for p from 10⁻³⁰⁰ to 1.
pub fn signs_quantile(p: f64) -> f64 {
    normal_quantile(4.0 * p * 10f64.powf(normal_log10(SQRT_2)))
}

/// Returns the score that a standard normal variable exceeds with probability `p`, for p from
/// 10⁻³⁰⁰ to ½.
pub fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if normal_log10(middle) > p.log10() { low = middle } else { high = middle }
    }
    high
}

/// Returns log₁₀ of the probability that a chi-squared variable with `degrees` degrees of freedom
/// exceeds `score`.
pub fn chi_squared_log10(score: f64, degrees: usize) -> f64 {
    let (a, x) = (degrees as f64 / 2.0, score / 2.0);
    if x <= 0.0 {
        return 0.0;
    }
    if x < a + 1.0 {
        return (-gamma_lr(a, x)).ln_1p() / LN_10;
    }
    (a * x.ln() - x - ln_gamma(a) + gamma_fraction(a, x).ln()) / LN_10
}

/// Returns Γ(a, x) eˣ x⁻ᵃ for x > a + 1 from its continued fraction (Abramowitz and Stegun 6.5.31),
/// evaluated by the method of Lentz 1976.
fn gamma_fraction(a: f64, x: f64) -> f64 {
    let mut b = x + 1.0 - a;
    let mut c = f64::INFINITY;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for i in 1..10_000 {
        let numerator = -f64::from(i) * (f64::from(i) - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_one_has_its_tabled_values_and_no_infinities() {
        for (score, p) in [(0.0, 0.5), (1.0, 0.158_655_25), (5.0, 2.866_516e-7), (-2.0, 0.977_249_87)] {
            assert!((normal_log10(score) - f64::log10(p)).abs() < 1e-6, "{score}");
        }
        for score in [0.5, 4.75, 12.0] {
            assert!((normal_quantile(10f64.powf(normal_log10(score))) - score).abs() < 1e-6, "{score}");
        }
        // The function is continuous where the formula changes, and finite in the far tail.
        assert!((normal_log10(29.999_999_9) - normal_log10(30.0)).abs() < 1e-4);
        assert!((normal_log10(100.0) + 2173.87).abs() < 0.01, "{}", normal_log10(100.0));
    }

    #[test]
    fn sums_of_signs_stay_below_their_bound_and_reach_it_once() {
        // All 2¹² sums of equal and of unequal weights.
        let equal = vec![1.0; 12];
        let unequal: Vec<f64> = (0..12).map(|i| f64::powi(0.7, i)).collect();
        let two = [vec![1.0; 2], vec![0.0; 10]].concat();
        for weights in [&equal, &unequal, &two] {
            let norm = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
            let sum = |signs: u32| {
                let each = weights.iter().enumerate();
                each.map(|(i, w)| if signs >> i & 1 == 1 { *w } else { -w }).sum::<f64>() / norm
            };
            let sums: Vec<f64> = (0..1 << 12).map(sum).collect();
            for score in [0.0, 0.5, 1.0, SQRT_2, 2.0, 2.5, 3.0, 3.4] {
                let beyond = sums.iter().filter(|sum| **sum >= score - 1e-12).count() as f64 / 4096.0;
                assert!(beyond.log10() <= signs_log10(score) + 1e-9, "{weights:?} {score} {beyond}");
            }
        }
        // Two equal signs agree with probability ¼, at √2 deviations.
        assert!((signs_log10(SQRT_2) - 0.25f64.log10()).abs() < 1e-12);
        assert_eq!(signs_log10(-3.0), 0.0);
        for score in [1.0, 4.75, 12.0] {
            assert!((signs_quantile(10f64.powf(signs_log10(score))) - score).abs() < 1e-6, "{score}");
        }
    }

    #[test]
    fn the_chi_squared_one_has_its_tabled_values() {
        for (score, degrees, p) in
            [(3.841_459, 1, 0.05), (18.307_038, 10, 0.05), (29.588_298, 10, 0.001), (124.342_113, 100, 0.05)]
        {
            assert!((chi_squared_log10(score, degrees) - f64::log10(p)).abs() < 1e-6, "{score}");
        }
        assert_eq!(chi_squared_log10(0.0, 128), 0.0);
    }

    #[test]
    fn the_chi_squared_one_is_the_closed_form_for_an_even_number_of_degrees() {
        // This is e⁻ˣ Σ_{i<k} xⁱ / i!, summed as logarithms.
        let closed = |score: f64, degrees: usize| {
            let x = score / 2.0;
            let term = |i: usize| i as f64 * x.ln() - ln_gamma(i as f64 + 1.0);
            let largest = (0..degrees / 2).map(term).fold(f64::NEG_INFINITY, f64::max);
            let sum: f64 = (0..degrees / 2).map(|i| (term(i) - largest).exp()).sum();
            (largest + sum.ln() - x) / LN_10
        };
        for degrees in [2, 8, 128, 256, 1024] {
            for factor in [0.5, 0.9, 1.0, 1.01, 1.1, 2.0, 10.0, 1e3, 1e5] {
                let score = factor * degrees as f64;
                let (ours, theirs) = (chi_squared_log10(score, degrees), closed(score, degrees));
                assert!(
                    (ours - theirs).abs() < 1e-9 * theirs.abs().max(1.0),
                    "{degrees} {score}: {ours} {theirs}"
                );
            }
        }
    }
}
