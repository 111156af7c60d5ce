//! The largest of several places that move: of two nearly as extreme ones the mark decides which
//! becomes the larger.

use statrs::function::erf::erfc;
use std::f64::consts::{PI, SQRT_2};

/// Places move by about this, metres on an axis: by the amplitude of a mark.
const MOVEMENT_M: f64 = 0.1;
/// Places farther behind the largest never become it, in movements.
const BEHIND: f64 = 6.0;
/// Numbers of places, of which the foremost are compared, and of steps of the integral.
const MOST_PLACES: usize = 16;
const STEPS: usize = 64;

/// The largest of several places after their movement.
#[derive(Debug, PartialEq)]
pub struct Largest {
    /// Its expected value.
    pub mean: f64,
    /// The derivative of the expected value by each place that may be the largest: the probability
    /// that it is (Stein's lemma), by its number.
    pub shares: Vec<(usize, f64)>,
    /// The variance that no linear function of the movements explains.
    pub variance: f64,
}

/// Returns the largest of `values` after independent normal movements of each.
pub fn largest(values: &[f64]) -> Largest {
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut near: Vec<(usize, f64)> =
        values.iter().map(|value| (value - most) / MOVEMENT_M).enumerate().collect();
    near.retain(|(_, behind)| *behind > -BEHIND);
    near.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    near.truncate(MOST_PLACES);
    let mut shares = vec![0.0; near.len()];
    let (mut mean, mut square) = (0.0, 0.0);
    let step = 2.0 * BEHIND / STEPS as f64;
    for at in (0..=STEPS).map(|i| i as f64 * step - BEHIND) {
        for (share, density) in shares.iter_mut().zip(densities(&near, at)) {
            *share += density * step;
            mean += density * step * at;
            square += density * step * at * at;
        }
    }
    let explained: f64 = shares.iter().map(|share| share * share).sum();
    Largest {
        mean: most + MOVEMENT_M * mean,
        shares: near.iter().map(|(number, _)| *number).zip(shares).collect(),
        variance: MOVEMENT_M.powi(2) * (square - mean * mean - explained).max(0.0),
    }
}

/// Returns the density of the event that each place is the largest and lies at `at`.
fn densities(near: &[(usize, f64)], at: f64) -> impl Iterator<Item = f64> {
    let density = |z: f64| (-z * z / 2.0).exp() / (2.0 * PI).sqrt();
    let below = |z: f64| erfc(-z / SQRT_2) / 2.0;
    near.iter().enumerate().map(move |(i, (_, value))| {
        let others = near.iter().enumerate().filter(|(k, _)| *k != i);
        density(at - value) * others.map(|(_, (_, other))| below(at - other)).product::<f64>()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_far_ahead_is_the_largest_and_of_equals_each_is_as_often() {
        let alone = largest(&[3.0, 10.0, 9.0]);
        assert!((alone.mean - 10.0).abs() < 1e-6 && alone.variance < 1e-6, "{alone:?}");
        assert!(alone.shares.len() == 1 && alone.shares[0].0 == 1 && (alone.shares[0].1 - 1.0).abs() < 1e-6);
        // The largest of two standard normal variables has mean 1/√π and variance 1 − 1/π.
        let two = largest(&[4.0, 1.0, 4.0]);
        let (mean, variance) = ((two.mean - 4.0) / MOVEMENT_M, two.variance / MOVEMENT_M.powi(2));
        assert!((mean - PI.powf(-0.5)).abs() < 1e-6 && (variance - (0.5 - 1.0 / PI)).abs() < 1e-6, "{two:?}");
        assert_eq!(two.shares.iter().map(|share| share.0).collect::<Vec<_>>(), [0, 2]);
        assert!(two.shares.iter().all(|share| (share.1 - 0.5).abs() < 1e-6), "{two:?}");
    }

    #[test]
    fn the_shares_are_the_derivatives_of_the_mean() {
        let values = [1.0, 0.93, 0.7, 1.02, 0.2];
        let found = largest(&values);
        for (number, share) in &found.shares {
            let shifted = |by: f64| {
                let mut values = values;
                values[*number] += by;
                largest(&values).mean
            };
            let derivative = (shifted(1e-4) - shifted(-1e-4)) / 2e-4;
            assert!((derivative - share).abs() < 1e-4, "{number}: {derivative} {share}");
        }
        assert!((found.shares.iter().map(|share| share.1).sum::<f64>() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_curve_of_many_places_costs_no_more_than_some() {
        let dense: Vec<f64> = (0..100_000).map(|i| -((i as f64 - 5e4) * 1e-6).powi(2)).collect();
        assert_eq!(largest(&dense).shares.len(), MOST_PLACES);
    }
}
