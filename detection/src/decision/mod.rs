//! The decision: two questions, two null hypotheses.
//!
//! *Was this key used?* Under another key the chips are independent random signs. Given the
//! suspect, the sum Σ p_i b′_i a_i then has mean 0 and variance Σ a_i², whatever the attack, so the
//! score is standard normal (a sum of thousands of independent signs; its tail is at most 3.18
//! times the normal tail, Bentkus and Dzindzalieta 2015).
//!
//! *Is the recipient the expected one?* Under the right key, an unrelated recipient has a random
//! message: Σ w_j b′_j b̂_j over the channel bits has mean 0 and variance |w b̂|². With `CODE=LDPC`
//! b′ is a random code word and its bits are not independent. Any four of them are, and over random
//! messages the tail is that of the normal distribution (tests of `demodulation.rs` in
//! `meshmark-core` show both). A message that the key did not whiten is not random; for it the null
//! hypothesis covers every other message, see [`Null`]. The p-value of the decision is the largest
//! one.

mod absence;
mod any_message;
mod decoys;
pub mod fingerprints;
pub mod likelihood;
pub mod recipients;
mod rivals;
mod survival;
mod verdict;

pub use any_message::{p_any_message_log10, shows_key};
pub use decoys::Decoys;
pub use verdict::Verdict;

use crate::power::Power;
use absence::Unmatched;
use meshmark_core::{
    demodulation::Demodulation,
    key::SecretKey,
    message::{LEAST_IDENTIFYING_BITS, Message},
    options::Subject,
};
use serde::Serialize;

/// The content of a copy with another message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Null {
    /// A random message: messages of recipients are keyed hashes, and the key whitens the others.
    RandomMessage,
    /// Any other message, even one that differs in a single bit. This applies to messages without
    /// whitening.
    AnyOtherMessage,
}

/// The bits that the code is expected to carry, and the null hypothesis about them.
#[derive(Debug, Clone)]
pub struct Expected {
    /// The expected bits.
    pub carried: Message,
    /// The null hypothesis.
    pub null: Null,
}

impl Expected {
    /// Creates the expectation for a subject under a key.
    pub fn new(subject: &Subject, key: &SecretKey) -> Self {
        let null = match subject {
            Subject::Unwhitened(_) => Null::AnyOtherMessage,
            Subject::Recipient(_) | Subject::Message(_) => Null::RandomMessage,
        };
        Expected { carried: subject.carried(key), null }
    }
}

/// The share of the largest possible recipient score, √n for n channel bits, that remains with
/// unequal weights.
const MOST_OF_ROOT: f64 = 0.99;

/// The answer and its grounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// The answer.
    pub verdict: Verdict,
    /// The reason, one sentence.
    pub reason: String,
    /// log₁₀ of the probability of this much evidence under a random key.
    pub p_mark_log10: Option<f64>,
    /// log₁₀ of the probability of this much agreement under the null hypothesis about the message.
    pub p_recipient_log10: Option<f64>,
    /// log₁₀ of the probability that the test misses a mark which the suspect carries; `None` for a
    /// match, and where it is unknown.
    pub p_missed_log10: Option<f64>,
    /// Number of messages that were tried.
    pub tried: usize,
}

impl Decision {
    /// Returns log₁₀ of the larger p-value times the number of tried messages (Bonferroni).
    pub fn p_value_log10(&self) -> Option<f64> {
        let larger = self.p_mark_log10?.max(self.p_recipient_log10?);
        Some((larger + (self.tried as f64).log10()).min(0.0))
    }

    /// Returns an inconclusive decision for the case that no message is expected.
    pub fn without_message() -> Self {
        Self::inconclusive(
            "no expected message was given, so there is nothing to compare the decoded one with".into(),
        )
    }

    /// Returns an inconclusive decision for a reason found before demodulation.
    pub fn inconclusive(reason: String) -> Self {
        let (p_mark_log10, p_recipient_log10) = (None, None);
        let p_missed_log10 = None;
        Decision {
            verdict: Verdict::Inconclusive,
            reason,
            p_mark_log10,
            p_recipient_log10,
            p_missed_log10,
            tried: 1,
        }
    }
}

/// Decides whether a demodulation matches the expected message, one of the `tried` messages;
/// `power` is what a present mark would show on the suspect.
pub fn decide_among(
    found: &Demodulation,
    power: Power,
    expected: &Expected,
    tried: usize,
    significance: f64,
) -> Decision {
    let message = &expected.carried;
    let each = significance / tried as f64; // Bonferroni
    let bits = message.len();
    let p_mark = survival::normal_log10(found.mark_score(message));
    // A random message of m bits equals the expected one with probability 2⁻ᵐ, so no p-value is
    // smaller.
    let least = -(bits as f64) * 2f64.log10();
    let p_random = survival::normal_log10(found.recipient_score(message)).max(least);
    // This is the score of a message with equally reliable bits, apart from the weights.
    let channel_bits = found.estimate.len() as f64;
    let best = survival::normal_log10(MOST_OF_ROOT * channel_bits.sqrt()).max(least);
    let among_rivals = match expected.null {
        Null::RandomMessage => None,
        Null::AnyOtherMessage => Some(rivals::standing(found, message)),
    };
    let p_recipient = among_rivals.map_or(p_random, |standing| p_random.max(standing.p_log10));
    let is_mixed = among_rivals.is_some_and(|standing| standing.is_mixed);
    let fits = |p_message: f64| p_mark.max(p_message) < each.log10();
    let mut p_missed_log10 = None;
    let (verdict, reason) = if bits < LEAST_IDENTIFYING_BITS {
        let reason = format!(
            "a message of {bits} bits cannot identify anyone: mark with {LEAST_IDENTIFYING_BITS} or more"
        );
        (Verdict::Inconclusive, reason)
    } else if best >= each.log10() {
        let among = if tried > 1 { format!(" for each of {tried} that were tried") } else { String::new() };
        let reason = format!(
            "no message of {bits} bits has a p-value below 10^{best:.1}, even if every bit is right, and a significance \
             of {each:.1e}{among} asks for less: give a larger one, or mark with more bits"
        );
        (Verdict::Inconclusive, reason)
    } else if fits(p_recipient) && is_mixed {
        let reason = "some bits of the message are much weaker than the rest, as if copies with other messages were \
                      mixed: a message that was not whitened then names nobody";
        (Verdict::Inconclusive, reason.into())
    } else if fits(p_recipient) {
        let reason = format!(
            "the probability that this key and message fit so well by chance is below the significance of \
             {significance:e}"
        );
        (Verdict::Match, reason)
    } else {
        let alone = p_mark.max(p_recipient);
        let p_log10 = [alone, alone + (tried as f64).log10()];
        let unmatched = Unmatched { found, power, bits, each, significance, p_log10 };
        let absence = if fits(p_random) { unmatched.another_message() } else { unmatched.decide() };
        p_missed_log10 = Some(absence.p_missed_log10);
        (absence.verdict, absence.reason)
    };
    Decision {
        verdict,
        reason,
        p_mark_log10: Some(p_mark),
        p_recipient_log10: Some(p_recipient),
        p_missed_log10,
        tried,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshmark_core::code::Code;

    /// A mark shows with fifty standard deviations.
    const TRIAL: Power = Power::Trial(50.0);

    fn random(message: &Message) -> Expected {
        Expected { carried: message.clone(), null: Null::RandomMessage }
    }

    fn evidence(estimate: Vec<f64>, scores: Vec<f64>) -> Demodulation {
        Demodulation {
            code: Code::Repetition,
            variance: vec![0.01; estimate.len()],
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
        let right = decide_among(&found, TRIAL, &random(&message), 1, 1e-6);
        assert_eq!(right.verdict, Verdict::Match);
        assert!(right.p_recipient_log10.unwrap() >= -38.6, "not below 2^-128");
        assert_eq!(decide_among(&found, TRIAL, &random(&other), 1, 1e-6).verdict, Verdict::NoMatch);
    }

    #[test]
    fn a_short_message_is_inconclusive() {
        let message = Message::from_hex("a5").unwrap();
        let found = evidence(message.signs(), message.signs().iter().map(|b| 1e4 * b).collect());
        assert_eq!(decide_among(&found, TRIAL, &random(&message), 1, 0.1).verdict, Verdict::Inconclusive);
    }

    #[test]
    fn a_significance_that_no_message_of_these_bits_reaches_is_inconclusive_and_says_so() {
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let found = evidence(message.signs(), message.signs().iter().map(|b| 40.0 * b).collect());
        let asked = decide_among(&found, TRIAL, &random(&message), 1, 1e-60);
        assert_eq!(asked.verdict, Verdict::Inconclusive);
        assert!(
            asked.reason.contains("a p-value below 10^-28.7") && asked.reason.contains("1.0e-60"),
            "{}",
            asked.reason
        );
        let short = Message::from_hex("0a1b2c").unwrap();
        let found = evidence(short.signs(), short.signs().iter().map(|b| 400.0 * b).collect());
        assert_eq!(decide_among(&found, TRIAL, &random(&short), 1, 1e-6).verdict, Verdict::Match);
        let among = decide_among(&found, TRIAL, &random(&short), 17, 1e-6);
        assert!(among.reason.contains("for each of 17 that were tried"), "{}", among.reason);
    }

    #[test]
    fn a_message_too_short_to_be_absent_is_inconclusive_and_says_so() {
        let (short, other) = (Message::from_hex("0a1b2c").unwrap(), Message::from_hex("f5e4d3").unwrap());
        let found = evidence(short.signs(), short.signs().iter().map(|b| 400.0 * b).collect());
        let decision = decide_among(&found, TRIAL, &random(&other), 1, 1e-6);
        assert_eq!(decision.verdict, Verdict::Inconclusive);
        assert!(
            decision.reason.contains("24 bits is too short") && decision.reason.contains("28 bits or more")
        );
        let [long, other] = ["0a1b2c3d", "f5e4d3c2"].map(|hex| Message::from_hex(hex).unwrap());
        let found = evidence(long.signs(), long.signs().iter().map(|b| 400.0 * b).collect());
        assert_eq!(decide_among(&found, TRIAL, &random(&other), 1, 1e-6).verdict, Verdict::NoMatch);
    }

    #[test]
    fn the_p_value_is_that_of_all_messages_tried() {
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let scores: Vec<f64> = message.signs().iter().map(|b| 4.5 * b).collect(); // 5.76 deviations
        let found = evidence(message.signs(), scores);
        let alone = decide_among(&found, TRIAL, &random(&message), 1, 1e-6);
        let among = decide_among(&found, TRIAL, &random(&message), 1000, 1e-6);
        assert!((alone.p_value_log10().unwrap() + 3.0 - among.p_value_log10().unwrap()).abs() < 1e-12);
        assert_eq!((alone.verdict, among.verdict), (Verdict::Match, Verdict::Inconclusive));
        assert_eq!(decide_among(&found, TRIAL, &random(&message), 1 << 60, 0.5).p_value_log10(), Some(0.0));
    }

    #[test]
    fn no_match_needs_a_p_value_above_a_hundredth_and_a_trial_mark_that_shows() {
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let of = |score: f64, power: Power| {
            // 128 bits of this much each against a null deviation of 100.
            let scores = message.signs().iter().map(|b| score * 100.0 / 128.0 * b).collect();
            let found = evidence(vec![0.0; 128], scores);
            decide_among(&found, power, &random(&message), 1, 1e-6).verdict
        };
        // No agreement with the recipient, whose p-value is the larger one.
        assert_eq!(of(0.0, Power::Trial(12.0)), Verdict::NoMatch);
        assert_eq!(of(0.0, Power::Trial(9.0)), Verdict::Inconclusive, "missed once in a hundred times");
        let weak: Vec<f64> =
            message.signs().iter().enumerate().map(|(j, b)| if j % 8 < 5 { *b } else { -b }).collect();
        let scores = weak.iter().map(|b| 12.0 * b).collect();
        let found = evidence(weak, scores);
        let decision = decide_among(&found, TRIAL, &random(&message), 1, 1e-6);
        assert!(decision.p_value_log10().unwrap() < -2.0, "{decision:?}");
        assert_eq!(decision.verdict, Verdict::Inconclusive);
    }

    #[test]
    fn a_mixture_of_copies_rules_nobody_out() {
        let [a, b, c] = [
            "00112233445566778899aabbccddeeff",
            "5a5a5a5a0f0f0f0f3c3c3c3c12345678",
            "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
        ]
        .map(|hex| Message::from_hex(hex).unwrap());
        let mean: Vec<f64> = a.signs().iter().zip(b.signs()).map(|(a, b)| (a + b) / 2.0).collect();
        let found = evidence(mean.clone(), mean.iter().map(|b| 40.0 * b).collect());
        let decision = decide_among(&found, Power::KeyShows, &random(&c), 1, 1e-6);
        assert_eq!(decision.verdict, Verdict::Inconclusive, "{decision:?}");
    }

    #[test]
    fn the_untouched_reference_is_no_match() {
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let untouched =
            Demodulation { chip_correlations: vec![0.0; 512], ..evidence(vec![0.0; 128], vec![0.0; 128]) };
        assert_eq!(
            decide_among(&untouched, Power::Unmoved, &random(&message), 1, 1e-6).verdict,
            Verdict::NoMatch
        );
    }

    #[test]
    fn a_suspect_in_which_a_mark_could_not_show_is_inconclusive() {
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let weak = Demodulation { expected_sum: 200.0, ..evidence(vec![0.01; 128], vec![0.1; 128]) };
        assert_eq!(
            decide_among(&weak, Power::Trial(6.0), &random(&message), 1, 1e-6).verdict,
            Verdict::Inconclusive
        );
    }

    #[test]
    fn a_serial_number_that_was_not_whitened_matches_its_own_copy_alone() {
        let [one, two] = [1, 2].map(|n| Message::from_hex(&format!("{n:032x}")).unwrap());
        let found = evidence(one.signs(), one.signs().iter().map(|b| 40.0 * b).collect());
        let of = |message: &Message, null| {
            decide_among(&found, TRIAL, &Expected { carried: message.clone(), null }, 1, 1e-6)
        };
        assert_eq!(of(&one, Null::AnyOtherMessage).verdict, Verdict::Match);
        let neighbour = of(&two, Null::AnyOtherMessage);
        assert_eq!(neighbour.verdict, Verdict::NoMatch);
        assert!(neighbour.p_value_log10().unwrap() > -1.0, "its null hypothesis holds: {neighbour:?}");
        assert!(
            neighbour.p_missed_log10.unwrap() < -3.0,
            "its copy would not carry the other: {neighbour:?}"
        );
        assert_eq!(of(&two, Null::RandomMessage).verdict, Verdict::Match, "which is what whitening is for");
    }
}
