//! What a report discloses of numbers that the secret key has a part in.
//!
//! Whoever has a suspect and the unmarked map can compute all of a score but the secret signs. A
//! score with all its digits is then an equation for these, and a few such equations are enough for
//! a search. Of copies that are not in the suspect, reports therefore state what a reader can use,
//! and no more digits.

/// Decimals of log₁₀ of a probability.
const P_DECIMALS: f64 = 1000.0;
/// Decimals of a score and of the log-likelihood ratio of a bit.
const SCORE_DECIMALS: f64 = 10.0;

/// Returns log₁₀ of a probability as reported. That of a copy which is not in the suspect is rounded
/// up, so that it stays above the significance.
pub fn p_log10(exact: Option<f64>, is_match: bool) -> Option<f64> {
    exact.map(|p| if is_match { p } else { ((p * P_DECIMALS).ceil() / P_DECIMALS).min(0.0) + 0.0 })
}

/// Returns a score as reported.
pub fn score(exact: f64) -> f64 {
    (exact * SCORE_DECIMALS).round() / SCORE_DECIMALS + 0.0 // no negative zero
}

/// Returns log-likelihood ratios of bits as reported. What is derived from them, such as odds, is derived
/// from these: the exact odds of one bit are an equation like an exact score.
pub fn scores(exact: &[f64]) -> Vec<f64> {
    exact.iter().map(|exact| score(*exact)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_that_is_not_in_the_suspect_stays_above_the_significance() {
        for (exact, rounded) in [(-5.9999, -5.999), (-6.0, -6.0), (-0.00001, 0.0), (0.0, 0.0)] {
            assert_eq!(p_log10(Some(exact), false), Some(rounded));
            assert_eq!(p_log10(Some(exact), true), Some(exact));
        }
        assert_eq!(p_log10(None, false), None);
    }

    #[test]
    fn a_score_has_one_decimal_and_zero_no_sign() {
        assert_eq!([58.449, -0.26].map(score), [58.4, -0.3]);
        assert!(score(-0.01).is_sign_positive());
    }
}
