//! Rivals: other messages that may explain a suspect as well as the expected one.
//!
//! The bits of a recipient and of a whitened message are practically random, and no other recipient
//! has nearly the same bits. A message without whitening may be a serial number, whose neighbours
//! differ in one bit. For it the null hypothesis is *any other message*: the copy carries a message
//! that differs in at least one bit. On the differing bits the evidence then has the usual strength
//! and the opposite sign.

use super::survival;
use meshmark_core::{demodulation::Demodulation, message::Message};

/// Normal standard deviation per median absolute deviation.
const NORMAL_OF_MEDIAN: f64 = 1.4826;
/// Bits this many standard deviations below the rest do not belong to the same copy.
const MIXED_DEVIATIONS: f64 = 6.0;

/// The expected message compared with all others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// log₁₀ of the probability that a copy with the most similar other message gives this much
    /// evidence for the expected one.
    pub p_log10: f64,
    /// Whether some bits are much weaker than the rest, as in an average of copies with other
    /// messages.
    pub is_mixed: bool,
}

/// Compares the expected message with those that differ from it in one bit, and with the decoded
/// message.
pub fn standing(found: &Demodulation, expected: &Message) -> Standing {
    let signs = found.code.encode(expected);
    let agreement: Vec<f64> = signs.iter().zip(&found.estimate).map(|(sign, b)| sign * b).collect();
    let typical = median(agreement.clone());
    let spread = NORMAL_OF_MEDIAN * median(agreement.iter().map(|a| (a - typical).abs()).collect());
    let deviation = spread.max(median(found.variance.clone()).sqrt());
    let mut standing = Standing { p_log10: f64::NEG_INFINITY, is_mixed: false };
    for rival in (0..expected.len()).map(|bit| expected.with_flipped(bit)).chain([found.message()]) {
        let rival_signs = found.code.encode(&rival);
        let differing = signs.iter().zip(&rival_signs).zip(&agreement).filter(|((a, b), _)| a != b);
        let (count, sum) = differing.fold((0.0, 0.0), |(count, sum), (_, a)| (count + 1.0, sum + a));
        if count == 0.0 {
            continue; // the decoded message is the expected one
        }
        let score = |above: f64| above * f64::sqrt(count) / deviation;
        let mean = sum / count;
        standing.p_log10 = standing.p_log10.max(survival::normal_log10(score(mean + typical)));
        standing.is_mixed |= mean < typical / 2.0 && score(typical - mean) > MIXED_DEVIATIONS;
    }
    standing
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshmark_core::code::Code;

    fn serial(number: u32) -> Message {
        Message::from_hex(&format!("{number:032x}")).unwrap()
    }

    /// Returns the demodulation of the mean of copies with these messages, with a little
    /// deterministic noise.
    fn copies(code: Code, numbers: &[u32], noise: f64) -> Demodulation {
        let words: Vec<Vec<f64>> = numbers.iter().map(|n| code.encode(&serial(*n))).collect();
        let mean = |j: usize| words.iter().map(|word| word[j]).sum::<f64>() / words.len() as f64;
        let estimate: Vec<f64> =
            (0..words[0].len()).map(|j| mean(j) + noise * (j as f64 * 2.399).sin()).collect();
        Demodulation {
            code,
            variance: vec![noise * noise; estimate.len()],
            scores: estimate.iter().map(|b| 100.0 * b).collect(),
            estimate,
            chip_correlations: vec![1.0; 10_000],
            expected_sum: 5000.0,
            noise_m: 0.1,
        }
    }

    #[test]
    fn a_copy_speaks_for_its_own_number_and_for_no_neighbour() {
        for code in [Code::Repetition, Code::Ldpc] {
            let found = copies(code, &[1], 0.1);
            assert!(standing(&found, &serial(1)).p_log10 < -20.0);
            for other in [0, 2, 3, 5, 1 << 20] {
                assert!(standing(&found, &serial(other)).p_log10 > -1.0, "{code:?} {other}");
            }
        }
    }

    #[test]
    fn an_average_of_copies_does_not_speak_for_a_number_between_them() {
        for code in [Code::Repetition, Code::Ldpc] {
            for (numbers, innocent) in [(&[1, 2][..], 3), (&[1, 2], 0), (&[1, 2, 7], 3)] {
                let found = standing(&copies(code, numbers, 0.02), &serial(innocent));
                assert!(found.is_mixed || found.p_log10 > -1.0, "{code:?} {numbers:?} {innocent} {found:?}");
            }
        }
    }
}
