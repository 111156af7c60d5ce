//! The random numbers of the attacks: ChaCha20 from a seed, so that an attack can be repeated.

use super::Map;
use crate::Result;
use meshmark_core::vertices::VertexTable;
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};

/// A stream of random numbers.
pub struct Random(ChaCha20Rng);

impl Random {
    /// Creates the stream of a seed.
    pub fn new(seed: u64) -> Self {
        Random(ChaCha20Rng::seed_from_u64(seed))
    }

    /// Returns the seed of another stream.
    pub fn seed(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Returns a number uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a number uniform in [−half_width, half_width).
    pub fn symmetric(&mut self, half_width: f64) -> f64 {
        (2.0 * self.unit() - 1.0) * half_width
    }

    /// Returns a standard normal number (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let (radius, turn) = (-2.0 * (1.0 - self.unit()).ln(), std::f64::consts::TAU * self.unit());
        radius.sqrt() * turn.cos()
    }

    /// Returns an integer uniform in 0 … count − 1; `count` is far below 2⁶⁴, so the remainder is
    /// practically uniform.
    pub fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    /// Puts a slice into random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, slice: &mut [T]) {
        for i in (1..slice.len()).rev() {
            slice.swap(i, self.below(i + 1));
        }
    }

    /// Returns which of `count` things are among `chosen` of them.
    pub fn choice(&mut self, count: usize, chosen: usize) -> Vec<bool> {
        let mut choice: Vec<bool> = (0..count).map(|i| i < chosen).collect();
        self.shuffle(&mut choice);
        choice
    }

    /// Returns which of `count` things are among a share of them.
    pub fn share(&mut self, count: usize, share: f64) -> Vec<bool> {
        self.choice(count, (share * count as f64).round() as usize)
    }
}

/// A random value for every distinct vertex of a map: occurrences of a vertex share it, and it does
/// not depend on the order of features.
pub struct PerVertex<T> {
    table: VertexTable,
    values: Vec<T>,
}

impl<T: Copy> PerVertex<T> {
    /// Draws the values.
    ///
    /// # Errors
    /// Fails on coordinates that are not finite.
    pub fn draw(map: &Map, seed: u64, draw: impl Fn(&mut Random) -> T) -> Result<Self> {
        let table = map.vertices()?;
        let mut random = Random::new(seed);
        let values = (0..table.len()).map(|_| draw(&mut random)).collect();
        Ok(PerVertex { table, values })
    }

    /// Returns the value of a vertex of that map.
    pub fn at(&self, vertex: [f64; 2]) -> T {
        self.values[self.table.index_of(vertex).expect("a vertex of the map the values were drawn for")]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shuffle_is_a_permutation_and_a_choice_has_its_size() {
        let mut numbers: Vec<usize> = (0..100).collect();
        Random::new(1).shuffle(&mut numbers);
        assert_ne!(numbers, (0..100).collect::<Vec<_>>());
        numbers.sort();
        assert_eq!(numbers, (0..100).collect::<Vec<_>>());
        assert_eq!(Random::new(2).choice(50, 20).iter().filter(|c| **c).count(), 20);
    }

    #[test]
    fn symmetric_draws_fill_their_interval() {
        let mut random = Random::new(3);
        let draws: Vec<f64> = (0..10_000).map(|_| random.symmetric(0.3)).collect();
        let mean = draws.iter().sum::<f64>() / 1e4;
        let most = draws.iter().fold(0f64, |a, b| a.max(b.abs()));
        assert!(mean.abs() < 0.01 && most <= 0.3 && most > 0.29, "{mean} {most}");
    }
}
