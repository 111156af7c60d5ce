//! The message of m bits that a mark carries.

use crate::{Error, Result};

/// Fewer bits without an error agree by chance more often than once in a million times.
pub const LEAST_IDENTIFYING_BITS: usize = 24;
/// So many leave room for several messages that are tried: the best p-value of 24 bits is near the
/// default significance.
pub const ADVISED_BITS: usize = 32;

/// A message: m bits, a multiple of four, most significant bit of the first hex digit first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    bits: Vec<bool>,
}

impl Message {
    /// Parses 2 to 256 hexadecimal digits: m = 4 × digits.
    ///
    /// # Errors
    /// [`Error::Message`] for anything else.
    pub fn from_hex(hex: &str) -> Result<Self> {
        let bad = || Error::Message(hex.chars().take(260).collect());
        if !(2..=256).contains(&hex.len()) {
            return Err(bad());
        }
        let digits: Option<Vec<u32>> = hex.chars().map(|c| c.to_digit(16)).collect();
        let digits = digits.ok_or_else(bad)?;
        let bits = digits.iter().flat_map(|d| (0..4).rev().map(move |i| d >> i & 1 == 1)).collect();
        Ok(Message { bits })
    }

    /// Creates the message of these bytes, 8 bits each.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let bits = bytes.iter().flat_map(|b| (0..8).rev().map(move |i| b >> i & 1 == 1)).collect();
        Message { bits }
    }

    /// Creates the message of these bits, a multiple of four.
    pub(crate) fn from_bits(bits: Vec<bool>) -> Self {
        Message { bits }
    }

    /// Creates the message whose bit j is 1 where `values[j]` is positive.
    pub fn from_signs(values: &[f64]) -> Self {
        Message { bits: values.iter().map(|v| *v > 0.0).collect() }
    }

    /// Returns the bits.
    pub fn bits(&self) -> &[bool] {
        &self.bits
    }

    /// Returns the bits as ±1: b′_j = +1 for 1, −1 for 0.
    pub fn signs(&self) -> Vec<f64> {
        self.bits.iter().map(|b| if *b { 1.0 } else { -1.0 }).collect()
    }

    /// Returns m, the number of bits.
    #[allow(clippy::len_without_is_empty)] // a message is never empty
    pub fn len(&self) -> usize {
        self.bits.len()
    }

    /// Counts the bits that differ from those of `other`, which has the same length.
    pub fn errors(&self, other: &Message) -> usize {
        self.bits.iter().zip(&other.bits).filter(|(a, b)| a != b).count()
    }

    /// Returns the message with one bit flipped.
    ///
    /// # Panics
    /// Panics when there is no such bit.
    pub fn with_flipped(&self, bit: usize) -> Self {
        let mut flipped = self.clone();
        flipped.bits[bit] = !flipped.bits[bit];
        flipped
    }

    /// Returns the message as lower-case hexadecimal digits.
    pub fn to_hex(&self) -> String {
        let digit = |bits: &[bool]| bits.iter().fold(0, |value, bit| value << 1 | u32::from(*bit));
        self.bits.chunks(4).filter_map(|bits| char::from_digit(digit(bits), 16)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_digits_are_bits_in_reading_order() {
        let message = Message::from_hex("8F01").unwrap();
        assert_eq!(message.len(), 16);
        assert_eq!(message.to_hex(), "8f01");
        assert_eq!(message.bits()[..5], [true, false, false, false, true]);
        assert_eq!(Message::from_bytes(&[0x8f, 0x01]), message);
    }

    #[test]
    fn only_2_to_256_hex_digits_are_a_message() {
        for bad in ["", "a", "xy", "0x12", "12 34", "é1", &"a".repeat(257)] {
            assert!(Message::from_hex(bad).is_err(), "{bad}");
        }
        assert_eq!(Message::from_hex(&"a".repeat(256)).unwrap().len(), 1024);
    }
}
