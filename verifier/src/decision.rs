//! The decision: two questions, two null hypotheses.
//!
//! *Was this key used?* Under another key the chips are independent random signs. Given the suspect,
//! the sum Σ p_i b′_i a_i then has mean 0 and variance Σ a_i², whatever happened to the map, so the score is
//! standard normal (a sum of thousands of independent signs; its tail is at most 3.18 times the normal
//! one, Bentkus and Dzindzalieta 2015). *Is it this recipient?* Under the right key, an unrelated
//! recipient has a random message: bᵀb̂ has mean 0 and variance |b̂|². The larger p counts.

use meshmark_core::{demodulation::Demodulation, message::Message};
use serde::Serialize;
use statrs::function::erf::erfc;

/// A message of fewer bits is shared by too many recipients.
pub const LEAST_BITS: usize = 20;
/// A suspect may be called unmarked when a mark would show this many standard deviations above what
/// significance needs.
const POWER_MARGIN: f64 = 3.0;

/// The answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// This mark is in the suspect.
    Match,
    /// It is not, and it would have shown.
    NoMatch,
    /// The suspect cannot tell.
    Inconclusive,
}

/// The answer and its grounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// The answer.
    pub verdict: Verdict,
    /// One sentence why.
    pub reason: String,
    /// log₁₀ of the probability of this much evidence under a random key.
    pub p_mark_log10: Option<f64>,
    /// log₁₀ of the probability of this much agreement with a random recipient.
    pub p_recipient_log10: Option<f64>,
}

impl Decision {
    /// The larger of the two.
    pub fn p_value_log10(&self) -> Option<f64> {
        Some(self.p_mark_log10?.max(self.p_recipient_log10?))
    }

    /// No answer, for a reason found before demodulation.
    pub fn inconclusive(reason: String) -> Self {
        Decision { verdict: Verdict::Inconclusive, reason, p_mark_log10: None, p_recipient_log10: None }
    }
}

/// Weighs a demodulation against the expected message.
pub fn decide(found: &Demodulation, expected: Option<&Message>, significance: f64) -> Decision {
    let Some(message) = expected else {
        return Decision::inconclusive(
            "no expected message was given, so there is nothing to compare the decoded one with".into(),
        );
    };
    let bits = message.len();
    let p_mark = log10_survival(found.mark_score(message));
    // A message of m bits cannot be hit less often than once in 2^m.
    let p_recipient = log10_survival(found.recipient_score(message)).max(-(bits as f64) * 2f64.log10());
    let (verdict, reason) = if bits < LEAST_BITS {
        let reason =
            format!("a message of {bits} bits cannot identify anyone: mark with {LEAST_BITS} or more");
        (Verdict::Inconclusive, reason)
    } else if p_mark.max(p_recipient) < significance.log10() {
        (Verdict::Match, "the evidence for this key and this message is below the significance".into())
    } else if would_show(found, bits, significance) {
        (Verdict::NoMatch, "a mark with this key and message would have shown, and it does not".into())
    } else {
        (Verdict::Inconclusive, "too little of the map was matched for a mark to show".into())
    };
    Decision { verdict, reason, p_mark_log10: Some(p_mark), p_recipient_log10: Some(p_recipient) }
}

/// Whether a full mark would be expected to pass both tests with a margin.
fn would_show(found: &Demodulation, bits: usize, significance: f64) -> bool {
    let needed = (-2.0 * significance.ln()).sqrt(); // above the normal quantile
    // Were the mark there, b̂ would be near ±1 on the bits that are known at all.
    let known = found.variance.iter().map(|v| (1.0 - v).max(0.0)).sum::<f64>().min(bits as f64);
    // In the untouched reference nothing moved, so there is no noise either to measure a mark against.
    let nothing_moved = found.expected_sum > 0.0 && found.chip_correlations.iter().all(|a| *a == 0.0);
    let visible = nothing_moved || found.expected_mark_score() > needed + POWER_MARGIN;
    visible && known.sqrt() > needed
}

/// log₁₀ of the standard normal survival function; finite for every finite score.
pub fn log10_survival(score: f64) -> f64 {
    if score < 30.0 {
        return (erfc(score / std::f64::consts::SQRT_2) / 2.0).log10();
    }
    // Abramowitz and Stegun 26.2.12, two terms; erfc underflows from 38 on.
    let z2 = score * score;
    let ln = -z2 / 2.0 - (score * (2.0 * std::f64::consts::PI).sqrt()).ln()
        + (-1.0 / z2 + 3.0 / (z2 * z2)).ln_1p();
    ln / std::f64::consts::LN_10
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_survival_function_has_its_tabled_values_and_no_infinities() {
        for (score, p) in [(0.0, 0.5), (1.0, 0.158_655_25), (5.0, 2.866_516e-7), (-2.0, 0.977_249_87)] {
            assert!((log10_survival(score) - f64::log10(p)).abs() < 1e-6, "{score}");
        }
        // Continuous where the formula changes, and finite far out.
        assert!((log10_survival(29.999_999_9) - log10_survival(30.0)).abs() < 1e-4);
        assert!((log10_survival(100.0) + 2173.87).abs() < 0.01, "{}", log10_survival(100.0));
    }

    fn evidence(estimate: Vec<f64>, scores: Vec<f64>) -> Demodulation {
        Demodulation {
            variance: vec![0.1; estimate.len()],
            estimate,
            scores,
            chip_correlations: vec![1.0; 10_000], // null deviation 100
            expected_sum: 5000.0,
            noise_m: 0.1,
        }
    }

    #[test]
    fn the_right_key_alone_is_no_match_for_another_recipient() {
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let other = Message::from_hex("5a5a5a5a0f0f0f0f3c3c3c3c12345678").unwrap();
        let scores: Vec<f64> = message.signs().iter().map(|b| 40.0 * b).collect();
        let found = evidence(message.signs(), scores);
        let right = decide(&found, Some(&message), 1e-6);
        assert_eq!(right.verdict, Verdict::Match);
        assert!(right.p_recipient_log10.unwrap() >= -38.6, "not below 2^-128");
        assert_eq!(decide(&found, Some(&other), 1e-6).verdict, Verdict::NoMatch);
    }

    #[test]
    fn a_short_message_or_none_is_inconclusive() {
        let message = Message::from_hex("a5").unwrap();
        let found = evidence(message.signs(), message.signs().iter().map(|b| 1e4 * b).collect());
        assert_eq!(decide(&found, Some(&message), 0.1).verdict, Verdict::Inconclusive);
        assert_eq!(decide(&found, None, 1e-6).verdict, Verdict::Inconclusive);
    }

    #[test]
    fn the_untouched_reference_is_no_match() {
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let untouched =
            Demodulation { chip_correlations: vec![0.0; 512], ..evidence(vec![0.0; 128], vec![0.0; 128]) };
        assert_eq!(decide(&untouched, Some(&message), 1e-6).verdict, Verdict::NoMatch);
    }

    #[test]
    fn a_suspect_in_which_a_mark_could_not_show_is_inconclusive() {
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let weak = Demodulation { expected_sum: 200.0, ..evidence(vec![0.01; 128], vec![0.1; 128]) };
        assert_eq!(decide(&weak, Some(&message), 1e-6).verdict, Verdict::Inconclusive);
    }
}
