//! Counts of values in bins of equal, round width.

use serde::Serialize;

/// Counts of values in bins of equal width.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Histogram {
    /// Lower end of the first bin.
    pub from: f64,
    /// Width of every bin.
    pub width: f64,
    /// Number of values in every bin, its lower end included.
    pub counts: Vec<usize>,
}

impl Histogram {
    /// Counts finite values in about `bins` bins at most; returns `None` without values.
    pub fn of_values(values: &[f64], bins: usize) -> Option<Self> {
        let least = values.iter().copied().reduce(f64::min)?;
        let most = values.iter().copied().reduce(f64::max)?;
        let width = round_up((most - least) / bins as f64);
        let first = (least / width).floor();
        let mut counts = vec![0; ((most / width).floor() - first) as usize + 1];
        for value in values {
            let bin = ((value / width).floor() - first) as usize;
            counts[bin] += 1;
        }
        Some(Histogram { from: first * width, width, counts })
    }
}

/// Returns the smallest of 1, 2 and 5 times a power of ten that is at least `value`; 10⁻³ unless
/// the value is positive and finite.
pub fn round_up(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return 1e-3;
    }
    let power = 10f64.powi(value.log10().floor() as i32);
    [1.0, 2.0, 5.0].iter().map(|step| step * power).find(|step| *step >= value).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_in_a_bin_of_round_width() {
        let found = Histogram::of_values(&[-0.31, 0.0, 0.05, 0.29], 8).unwrap();
        assert_eq!((found.width, found.counts.iter().sum::<usize>()), (0.1, 4));
        assert!((found.from + 0.4).abs() < 1e-12 && found.counts == [1, 0, 0, 0, 2, 0, 1], "{found:?}");
        assert_eq!(Histogram::of_values(&[2.0, 2.0], 8).unwrap().counts, [2]);
        assert_eq!(Histogram::of_values(&[], 8), None);
    }

    #[test]
    fn round_numbers_are_one_two_and_five() {
        let round = [0.7, 1.0, 1.1, 20.1, 0.0003, 600.0].map(round_up);
        assert_eq!(
            round.map(|v| format!("{v:.4}")),
            ["1.0000", "1.0000", "2.0000", "50.0000", "0.0005", "1000.0000"]
        );
    }
}
