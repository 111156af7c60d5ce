//! The carrier: keyed chips that spread the message over the coefficients (paper, section 3.4).

use crate::{
    key::SecretKey,
    signs::{Sequence, Signs},
};

/// Chips p_i = ±1. Every patch and axis has a sequence of its own: equal carriers could be averaged
/// out of a map.
pub struct Carrier {
    signs: Sequence,
}

impl Carrier {
    /// Creates the carrier of a key.
    pub fn new(key: &SecretKey) -> Self {
        Carrier { signs: Sequence::new(key.chip_seed()) }
    }

    /// Returns `count` chips of a patch and axis (0 = x, 1 = y).
    pub fn chips(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        self.signs.signs(patch, axis, count)
    }
}

/// Returns the channel bit that coefficient `i` (1 … m·c) carries. Coefficient 0 is the mean and
/// carries none.
pub fn bit_of_coefficient(i: usize, chip_rate: usize) -> usize {
    (i - 1) / chip_rate
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chips_are_reproducible_balanced_and_different_for_every_patch_and_axis() {
        let carrier = Carrier::new(&SecretKey::from_bytes([3; 32]));
        let chips = carrier.chips(5, 1, 10_000);
        assert_eq!(chips[..100], carrier.chips(5, 1, 100));
        assert!(chips.iter().sum::<f64>().abs() < 500.0); // 5 standard deviations
        for other in [carrier.chips(5, 0, 10_000), carrier.chips(6, 1, 10_000)] {
            let product: f64 = chips.iter().zip(&other).map(|(a, b)| a * b).sum();
            assert!(product.abs() < 500.0);
        }
    }
}
