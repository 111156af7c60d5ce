//! Whitening: messages that differ in one bit are carried as bits that differ in half of their
//! places.
//!
//! A message that a producer chooses may be a serial number, and the numbers of two copies then
//! differ in very few bits. A keyed pseudorandom permutation of all messages of one length makes
//! the carried bits of every message those of a random one, as the null hypothesis of the verdict
//! assumes. The permutation is a balanced Feistel network (M. Luby, C. Rackoff, *How to construct
//! pseudorandom permutations from pseudorandom functions*, SIAM Journal on Computing 17, 1988) of
//! ten rounds, as many as NIST SP 800-38G has, over HMAC-SHA-256.

use crate::{key::SecretKey, message::Message};

const ROUNDS: u8 = 10;

/// Returns the bits that carry a message under a key, as many as the message has.
pub(crate) fn whiten(key: &SecretKey, message: &Message) -> Message {
    permute(key, message, 0..ROUNDS)
}

impl SecretKey {
    /// Returns the message that this key whitens to these bits.
    pub fn unwhitened(&self, carried: &Message) -> Message {
        permute(self, carried, (0..ROUNDS).rev())
    }
}

/// Adds, in every round, a keyed function of one half to the other half: even rounds change the
/// first half, odd rounds the second, so that a round is its own inverse.
fn permute(key: &SecretKey, message: &Message, rounds: impl Iterator<Item = u8>) -> Message {
    let mut bits = message.bits().to_vec();
    let (first, second) = bits.split_at_mut(message.len() / 2);
    for round in rounds {
        let (half, other): (&mut [bool], &[bool]) =
            if round.is_multiple_of(2) { (first, second) } else { (second, first) };
        let mask = key.round_bits(message.len(), round, other);
        half.iter_mut().zip(mask).for_each(|(bit, mask)| *bit ^= mask);
    }
    Message::from_bits(bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn message(text: &str) -> Message {
        Message::from_hex(text).unwrap()
    }

    fn key(byte: u8) -> SecretKey {
        SecretKey::from_bytes([byte; 32])
    }

    proptest! {
        #[test]
        fn unwhitening_takes_back_whitening(hex in "[0-9a-f]{2,256}", byte: u8) {
            let (key, message) = (key(byte), message(&hex));
            let carried = whiten(&key, &message);
            prop_assert_eq!(carried.len(), message.len());
            prop_assert_eq!(key.unwhitened(&carried), message);
        }
    }

    #[test]
    fn whitening_permutes_all_messages_of_a_length() {
        let carried = (0..4096).map(|n| whiten(&key(5), &message(&format!("{n:03x}"))).to_hex());
        assert_eq!(carried.collect::<std::collections::BTreeSet<_>>().len(), 4096);
    }

    #[test]
    fn serial_numbers_are_carried_as_unlike_as_random_messages() {
        let carried: Vec<Message> =
            (0..200).map(|n| whiten(&key(9), &message(&format!("{n:032x}")))).collect();
        let pairs =
            carried.iter().enumerate().flat_map(|(i, a)| carried[..i].iter().map(move |b| a.errors(b)));
        let errors: Vec<usize> = pairs.collect();
        let mean = errors.iter().sum::<usize>() as f64 / errors.len() as f64;
        // 19 900 pairs of 128 random bits: a standard deviation of 5.66 about 64 each.
        assert!((mean - 64.0).abs() < 0.3, "{mean}");
        assert!(errors.iter().all(|e| (32..=96).contains(e)), "{:?}", errors.iter().min());
        assert_ne!(whiten(&key(1), &carried[0]), whiten(&key(2), &carried[0]), "keys whiten differently");
    }
}
