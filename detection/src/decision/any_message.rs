//! The evidence for a mark of a key, whatever its message.

use super::survival;
use meshmark_core::demodulation::Demodulation;

/// A mark of a key is detected, whatever its message, where the p-value for any message is below 10
/// to this power.
const DETECTED_LOG10: f64 = -9.0;

/// Returns log₁₀ of the probability of this much evidence for any message under a random key;
/// `None` where no displacement was observed. Few chips may carry a bit, but the even moments of
/// sums of random signs are at most those of normal variables, so Chernoff's bound on chi-squared
/// holds for any number of chips.
pub fn p_any_message_log10(found: &Demodulation, chip_rate: usize) -> Option<f64> {
    let (score, degrees) = found.key_score(chip_rate);
    (degrees > 0).then(|| survival::chi_squared_log10(score, degrees))
}

/// Returns whether a mark of the key is detected, given log₁₀ of the p-value for any message, or of
/// the pilots of fingerprints.
pub fn shows_key(p_log10: Option<f64>) -> bool {
    p_log10.is_some_and(|p| p < DETECTED_LOG10)
}
