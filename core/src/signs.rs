//! Secret signs: sequences of ±1 that a seed determines.

use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use rayon::prelude::*;
use std::sync::Arc;

/// Coefficients of a patch and axis that carry a fingerprint by default.
pub const COEFFICIENTS: usize = 256;

/// Every so many coefficients of a fingerprint there is a pilot, see [`crate::fingerprint`].
pub(crate) const PILOT_EVERY: usize = 8;

/// Returns whether coefficient `i`, counted from 1, is a pilot.
pub(crate) fn is_pilot(i: usize) -> bool {
    i.is_multiple_of(PILOT_EVERY)
}

/// A mark as the sign of every coefficient.
pub trait Signs: Sync {
    /// Returns the signs of coefficients 1 … `count` of a patch and axis (0 = x, 1 = y).
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64>;
}

impl Signs for &dyn Signs {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        (**self).signs(patch, axis, count)
    }
}

/// Secret signs for all coefficients of the parts of a map. Every part has a seed of its own; the
/// signs of a patch and axis are the bits of its ChaCha20 stream 2·patch + axis, with patches counted
/// from the first one of the part, least significant bit of each 64-bit word first; a 1 is +1, a 0 is
/// −1.
#[derive(Clone)]
pub struct Sequence {
    parts: Arc<[PartSeed]>,
}

/// The seed of a part, and the number of its first patch.
#[derive(Clone, Copy)]
struct PartSeed {
    first: usize,
    seed: [u8; 32],
}

impl Sequence {
    /// Creates the sequence of a seed, for a map of one part.
    pub(crate) fn new(seed: [u8; 32]) -> Self {
        Self::of_parts(std::iter::once((0, seed)))
    }

    /// Creates the sequence of parts, given the number of the first patch and the seed of each; the
    /// numbers ascend from 0.
    pub(crate) fn of_parts(parts: impl Iterator<Item = (usize, [u8; 32])>) -> Self {
        Sequence { parts: parts.map(|(first, seed)| PartSeed { first, seed }).collect() }
    }

    /// Returns the sequence of one part alone.
    pub(crate) fn part(&self, number: usize) -> Self {
        Self::new(self.parts[number].seed)
    }

    /// Returns the signs of a patch and axis, 64 in each word.
    pub(crate) fn words(&self, patch: usize, axis: usize) -> impl Iterator<Item = u64> {
        let part = self.parts[self.parts.partition_point(|part| part.first <= patch) - 1];
        let mut stream = ChaCha20Rng::from_seed(part.seed);
        stream.set_stream((2 * (patch - part.first) + axis) as u64);
        std::iter::repeat_with(move || stream.next_u64())
    }
}

impl Signs for Sequence {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        let of_word = |word: u64| (0..64).map(move |i| if word >> i & 1 == 1 { 1.0 } else { -1.0 });
        self.words(patch, axis).flat_map(of_word).take(count).collect()
    }
}

/// Returns the value with the sign of bit `i` of a word of a [`Sequence`].
pub(crate) fn signed(value: f64, word: u64, i: usize) -> f64 {
    f64::from_bits(value.to_bits() ^ (!word >> i) << 63)
}

/// Returns Σ ±a_i for `count` decoys, whose random signs decoy k takes from ChaCha20 stream k.
pub(crate) fn decoy_sums(values: &[f64], count: usize, seed: [u8; 32]) -> Vec<f64> {
    let sum = |decoy: usize| {
        let mut stream = ChaCha20Rng::from_seed(seed);
        stream.set_stream(decoy as u64);
        let sum_word = |values: &[f64]| {
            let word = stream.next_u64();
            values
                .iter()
                .enumerate()
                .map(|(i, a)| f64::from_bits(a.to_bits() ^ (word >> i << 63)))
                .sum::<f64>()
        };
        values.chunks(64).map(sum_word).sum()
    };
    (0..count).into_par_iter().map(sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_has_the_signs_that_it_has_alone() {
        let seeds = [[1; 32], [2; 32], [3; 32]];
        let joined = Sequence::of_parts([0, 4, 5].into_iter().zip(seeds));
        for (patch, part, own) in [(0, 0, 0), (3, 0, 3), (4, 1, 0), (5, 2, 0), (9, 2, 4)] {
            let alone = Sequence::new(seeds[part]).signs(own, 1, 200);
            assert_eq!(joined.signs(patch, 1, 200), alone);
            assert_eq!(joined.part(part).signs(own, 1, 200), alone);
        }
    }

    #[test]
    fn a_value_times_its_sign_has_the_sign_of_its_bit() {
        let sequence = Sequence::new([9; 32]);
        let signs = sequence.signs(7, 1, 100);
        let words: Vec<u64> = sequence.words(7, 1).take(2).collect();
        for (i, sign) in signs.iter().enumerate() {
            assert_eq!(signed(-2.5, words[i / 64], i % 64), -2.5 * sign, "{i}");
        }
    }
}
