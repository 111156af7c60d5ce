//! Codes: how the bits of the message become the *channel bits* that the coefficients carry.
//!
//! Repetition carries every message bit unchanged; the chip rate repeats it. LDPC is the code TC256
//! of CCSDS 231.1-O-1 (*Short Block Length LDPC Codes for TC Synchronization and Channel Coding*):
//! 128 message bits become 256, the message first, so chip rate 1 displaces vertices as much as
//! repetition with chip rate 2. Belief propagation and ordered statistics decode it (M. Fossorier,
//! S. Lin, *Soft-decision decoding of linear block codes based on ordered statistics*, IEEE
//! Transactions on Information Theory 41, 1995).

pub use crate::options::Code;

use crate::{
    Error, Result,
    message::Message,
    options::{LDPC_CHANNEL_BITS, LDPC_MESSAGE_BITS},
};
use labrador_ldpc::LDPCCode;
use serde::Serialize;
use std::ops::BitXor;

const LDPC: LDPCCode = LDPCCode::TC256;
/// Channel bits of LDPC.
const N: usize = LDPC_CHANNEL_BITS;
/// Message bits of LDPC.
const K: usize = LDPC_MESSAGE_BITS;
/// Belief propagation converges within a few dozen rounds or never.
const MOST_ROUNDS: usize = 100;
/// The order: this many bits of the most reliable basis may be wrong. Where repetition with the
/// same displacement has 4.8 % wrong bits, belief propagation reads 46 % of the messages, order 2
/// reads 68 % and order 3 reads 81 %.
const ORDER: usize = 3;

/// The decoder that read the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decoder {
    /// The sign of every bit: repetition allows nothing better.
    Sign,
    /// Belief propagation.
    BeliefPropagation,
    /// Ordered statistics, which always yield some code word.
    OrderedStatistics,
}

/// A decoded message.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded {
    /// The most likely message that was found.
    pub message: Message,
    /// Log-likelihood ratios of its bits, natural logarithm, positive = 1. With LDPC they compare
    /// the best code word with this bit, the best one without it, and the expected likelihood of
    /// the code words that were not examined. The smallest ratio bounds the trust in the message.
    pub message_llrs: Vec<f64>,
    /// Whether belief propagation reached a word that passes all parity checks, which noise alone
    /// almost never does; `None` for repetition, which has no checks.
    pub parity_holds: Option<bool>,
    /// The decoder that found the message.
    pub decoder: Decoder,
}

impl Code {
    /// Returns how many channel bits carry a message.
    ///
    /// # Errors
    /// [`Error::CodeLength`] when LDPC is to carry anything but 128 bits.
    pub fn channel_bits(self, message_bits: usize) -> Result<usize> {
        match self {
            Code::Ldpc if message_bits != K => Err(Error::CodeLength { bits: message_bits }),
            _ => Ok(message_bits * self.expansion()),
        }
    }

    /// Returns the channel bits of a message as ±1: +1 for 1, −1 for 0.
    ///
    /// # Panics
    /// Panics when [`Self::channel_bits`] fails for the length of the message.
    pub fn encode(self, message: &Message) -> Vec<f64> {
        match self {
            Code::Repetition => message.signs(),
            Code::Ldpc => Word::encode(message.bits()).signs(),
        }
    }

    /// Decodes the message from log-likelihood ratios of channel bits, positive = 1. The result
    /// depends on them alone.
    ///
    /// # Panics
    /// Panics when LDPC is given other than 256 of them.
    pub fn decode(self, llrs: &[f64]) -> Decoded {
        match self {
            Code::Repetition => Decoded {
                message: Message::from_signs(llrs),
                message_llrs: llrs.to_vec(),
                parity_holds: None,
                decoder: Decoder::Sign,
            },
            Code::Ldpc => decode_ldpc(llrs),
        }
    }
}

fn decode_ldpc(llrs: &[f64]) -> Decoded {
    assert_eq!(llrs.len(), N, "one log-likelihood ratio for every channel bit");
    let converged = believe(llrs);
    let mut search = Search::new(llrs);
    search.all(ORDER, converged.as_ref());
    let (_, best) = search.best;
    let decoder =
        if converged == Some(best) { Decoder::BeliefPropagation } else { Decoder::OrderedStatistics };
    // Both values are equally frequent among the words that were not examined.
    let unseen = log_likelihood_of_unseen(llrs) - 2f64.ln();
    let likelihood = |value: usize, j: usize| log_sum(-search.least[value][j], unseen);
    Decoded {
        message: Message::from_signs(&best.signs()[..K]),
        message_llrs: (0..K).map(|j| likelihood(1, j) - likelihood(0, j)).collect(),
        parity_holds: Some(converged.is_some()),
        decoder,
    }
}

/// Returns ln of the summed likelihoods of all code words, as if they were drawn at random, on the
/// scale where a word of distance w has e⁻ʷ (J. Feng, K. Duffy, M. Médard, *Leveraging code
/// structure to improve soft output for GRAND, GCD, OSD, and SCL*, arXiv 2503.16677, 2025). The
/// near words that were examined count twice, which errs on the safe side.
fn log_likelihood_of_unseen(llrs: &[f64]) -> f64 {
    let mean = |llr: &f64| (-llr.abs()).exp().ln_1p() - 2f64.ln();
    K as f64 * 2f64.ln() + llrs.iter().map(mean).sum::<f64>()
}

/// Returns ln(eᵃ + eᵇ).
fn log_sum(a: f64, b: f64) -> f64 {
    a.max(b) + (-(a - b).abs()).exp().ln_1p()
}

/// Returns the word that belief propagation reaches, if it passes all parity checks.
fn believe(llrs: &[f64]) -> Option<Word> {
    let mut beliefs: Vec<f64> = vec![0.0; LDPC.decode_ms_working_len()];
    let mut signs = vec![0; LDPC.decode_ms_working_u8_len()];
    let mut output = vec![0; LDPC.output_len()];
    let for_zero: Vec<f64> = llrs.iter().map(|llr| -llr).collect(); // positive = 0 over there
    let (holds, _) = LDPC.decode_ms(&for_zero, &mut output, &mut beliefs, &mut signs, MOST_ROUNDS);
    // Zeros pass every check, and the absence of information is no evidence.
    (holds && llrs.iter().any(|llr| *llr != 0.0)).then(|| Word::from_bytes(&output))
}

/// The search for code words near the received word, which starts from the most reliable bits.
struct Search {
    /// A basis of the code: row i alone has a 1 at the i-th of the K most reliable independent
    /// places.
    rows: Vec<Word>,
    /// |llr| at those places, descending.
    costs: Vec<f64>,
    /// The received word, bit by bit.
    received: Word,
    /// The code word that agrees with it at all of those places.
    start: Word,
    /// Σ |llr| over the places where byte b of a difference is v.
    weights: Vec<[f64; 256]>,
    /// The distance of the nearest code word so far, and that word.
    best: (f64, Word),
    /// The distance of the nearest code word whose message bit j is 0, and of the one where it is
    /// 1.
    least: [[f64; K]; 2],
    /// The largest of these distances: words further away do not matter.
    relevant: f64,
}

impl Search {
    fn new(llrs: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..N).collect();
        // The sort is stable, so ties leave no choice.
        order.sort_by(|&a, &b| llrs[b].abs().total_cmp(&llrs[a].abs()));
        let unit = |i: usize| Word::encode(&std::array::from_fn::<bool, K, _>(|j| j == i));
        let mut rows: Vec<Word> = (0..K).map(unit).collect();
        let mut basis = Vec::with_capacity(K);
        for place in order {
            let rank = basis.len();
            let Some(pivot) = (rank..K).find(|&row| rows[row].bit(place)) else { continue };
            rows.swap(rank, pivot);
            let pivot = rows[rank];
            for (row, word) in rows.iter_mut().enumerate() {
                if row != rank && word.bit(place) {
                    *word = *word ^ pivot;
                }
            }
            basis.push(place);
        }
        let received = Word::from_bits(|i| llrs[i] > 0.0);
        let agreeing = basis.iter().zip(&rows).filter(|(place, _)| received.bit(**place));
        let start = agreeing.fold(Word::default(), |sum, (_, row)| sum ^ *row);
        let weight = |byte: usize| {
            std::array::from_fn(|value| {
                (0..8).map(|i| (value >> i & 1) as f64 * llrs[8 * byte + i].abs()).sum()
            })
        };
        Search {
            rows,
            costs: basis.iter().map(|&place| llrs[place].abs()).collect(),
            received,
            start,
            weights: (0..N / 8).map(weight).collect(),
            best: (f64::INFINITY, start),
            least: [[f64::INFINITY; K]; 2],
            relevant: f64::INFINITY,
        }
    }

    /// Examines every code word that differs from the start in at most `order` places of the basis,
    /// and one more word.
    fn all(&mut self, order: usize, more: Option<&Word>) {
        self.look_at(self.start);
        if let Some(word) = more {
            self.look_at(*word);
        }
        self.around(self.start, 0.0, K, order);
    }

    /// Flips up to `flips` of the first `end` places of the basis, from the least reliable on. A
    /// word is at least as far away as its flipped places cost, so words that are too far already
    /// are skipped without loss.
    fn around(&mut self, word: Word, cost: f64, end: usize, flips: usize) {
        for row in (0..if flips == 0 { 0 } else { end }).rev() {
            let cost = cost + self.costs[row];
            if cost >= self.relevant {
                break;
            }
            let word = word ^ self.rows[row];
            self.look_at(word);
            self.around(word, cost, row, flips - 1);
        }
    }

    fn look_at(&mut self, word: Word) {
        let difference = (word ^ self.received).0;
        let bytes = difference.iter().flat_map(|part| part.to_le_bytes());
        let distance: f64 =
            bytes.zip(&self.weights).map(|(value, weights)| weights[usize::from(value)]).sum();
        if distance < self.best.0 {
            self.best = (distance, word);
        }
        if distance < self.relevant {
            for j in 0..K {
                let least = &mut self.least[usize::from(word.bit(j))][j];
                *least = least.min(distance);
            }
            self.relevant = self.least.iter().flatten().fold(0.0, |most, least| most.max(*least));
        }
    }
}

/// 256 bits; bit i is bit i mod 64 of part i / 64.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Word([u64; N / 64]);

impl Word {
    fn from_bits(bit: impl Fn(usize) -> bool) -> Self {
        Word(std::array::from_fn(|part| (0..64).fold(0, |word, i| word | u64::from(bit(64 * part + i)) << i)))
    }

    /// Reads bytes whose most significant bit comes first.
    fn from_bytes(bytes: &[u8]) -> Self {
        Word::from_bits(|i| bytes[i / 8] >> (7 - i % 8) & 1 == 1)
    }

    fn encode(message: &[bool]) -> Self {
        assert_eq!(message.len(), K, "LDPC carries {K} bits");
        let mut bytes = [0; N / 8];
        for (i, bit) in message.iter().enumerate() {
            bytes[i / 8] |= u8::from(*bit) << (7 - i % 8);
        }
        LDPC.encode(&mut bytes);
        Word::from_bytes(&bytes)
    }

    fn bit(&self, i: usize) -> bool {
        self.0[i / 64] >> (i % 64) & 1 == 1
    }

    fn signs(&self) -> Vec<f64> {
        (0..N).map(|i| if self.bit(i) { 1.0 } else { -1.0 }).collect()
    }
}

impl BitXor for Word {
    type Output = Word;

    fn bitxor(self, other: Word) -> Word {
        Word(std::array::from_fn(|part| self.0[part] ^ other.0[part]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::{
        ChaCha20Rng,
        rand_core::{Rng, SeedableRng},
    };
    use std::collections::HashSet;

    struct Random(ChaCha20Rng);

    impl Random {
        fn new(seed: u64) -> Self {
            Random(ChaCha20Rng::seed_from_u64(seed))
        }

        fn message(&mut self) -> Message {
            let mut bytes = [0; 16];
            self.0.fill_bytes(&mut bytes);
            Message::from_bytes(&bytes)
        }

        /// In (0, 1).
        fn uniform(&mut self) -> f64 {
            ((self.0.next_u64() >> 11) as f64 + 0.5) / 2f64.powi(53)
        }

        fn normal(&mut self) -> f64 {
            (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
        }

        /// Log-likelihood ratios of ±1 with noise of deviation σ: 2 (b′ + σ z) / σ².
        fn received(&mut self, signs: &[f64], deviation: f64) -> Vec<f64> {
            signs.iter().map(|b| 2.0 * (b + deviation * self.normal()) / deviation.powi(2)).collect()
        }
    }

    #[test]
    fn what_was_encoded_is_decoded_by_belief_propagation() {
        let mut random = Random::new(1);
        for _ in 0..200 {
            let message = random.message();
            let signs = Code::Ldpc.encode(&message);
            assert_eq!(signs[..K], message.signs(), "the message comes first");
            let decoded = Code::Ldpc.decode(&signs);
            assert_eq!(decoded.message, message);
            assert_eq!((decoded.parity_holds, decoded.decoder), (Some(true), Decoder::BeliefPropagation));
            assert_eq!(Message::from_signs(&decoded.message_llrs), message);
        }
        let short = Message::from_hex("8f01").unwrap();
        assert_eq!(Code::Repetition.encode(&short), short.signs());
        assert_eq!(Code::Repetition.decode(&short.signs()).message, short);
        assert!(matches!(Code::Ldpc.channel_bits(16), Err(Error::CodeLength { bits: 16 })));
    }

    #[test]
    fn fifteen_channel_bits_may_be_wrong() {
        let mut random = Random::new(2);
        for _ in 0..300 {
            let message = random.message();
            let mut signs = Code::Ldpc.encode(&message);
            let mut wrong = HashSet::new();
            while wrong.len() < 15 {
                let place = random.0.next_u32() as usize % N;
                if wrong.insert(place) {
                    signs[place] = -signs[place];
                }
            }
            assert_eq!(Code::Ldpc.decode(&signs).message, message);
        }
    }

    #[test]
    fn ldpc_reads_messages_from_noise_in_which_repetition_fails() {
        let mut random = Random::new(3);
        let (mut repeated, mut coded, mut by_statistics) = (0, 0, 0);
        for _ in 0..200 {
            let message = random.message();
            // 9 % of the signs are wrong.
            let received = random.received(&Code::Ldpc.encode(&message), 0.75);
            let decoded = Code::Ldpc.decode(&received);
            coded += usize::from(decoded.message == message);
            by_statistics += usize::from(decoded.message == message && decoded.parity_holds == Some(false));
            let twice: Vec<f64> = [message.signs(), message.signs()].concat();
            let received = random.received(&twice, 0.75);
            let sums: Vec<f64> = (0..K).map(|j| received[j] + received[j + K]).collect();
            repeated += usize::from(Code::Repetition.decode(&sums).message == message);
        }
        assert!(coded >= 180 && repeated <= 20, "{coded} {repeated} of 200");
        assert!(by_statistics > 0, "ordered statistics read what belief propagation leaves");
    }

    #[test]
    fn bits_are_less_often_wrong_than_they_say() {
        let mut random = Random::new(4);
        let (mut wrong, mut expected, mut sure) = (0.0, 0.0, 0);
        for _ in 0..200 {
            let message = random.message();
            let decoded = Code::Ldpc.decode(&random.received(&Code::Ldpc.encode(&message), 0.9));
            wrong += decoded.message.errors(&message) as f64;
            expected += decoded.message_llrs.iter().map(|llr| 1.0 / (1.0 + llr.abs().exp())).sum::<f64>();
            let agrees = |(llr, sign): (&f64, &f64)| llr * sign >= 0.0;
            assert!(decoded.message_llrs.iter().zip(&decoded.message.signs()).all(agrees));
            if decoded.message_llrs.iter().all(|llr| llr.abs() > 1000f64.ln()) {
                assert_eq!(decoded.message, message);
                sure += 1;
            }
        }
        assert!((0.25..1.0).contains(&(wrong / expected)), "{wrong} wrong bits, {expected} expected");
        assert!(sure > 40, "{sure} of 200 messages are sure");
    }

    #[test]
    fn nothing_received_passes_no_parity_check() {
        let decoded = Code::Ldpc.decode(&[0.0; N]);
        assert_eq!(decoded.parity_holds, Some(false));
        assert!(decoded.message_llrs.iter().all(|llr| llr.abs() < 1e-9));
    }

    /// Returns the columns of the generator: bit i of a random code word is the product of the
    /// message with column i.
    fn columns() -> Vec<u128> {
        let unit = |i: usize| Word::encode(&std::array::from_fn::<bool, K, _>(|j| j == i));
        let rows: Vec<Word> = (0..K).map(unit).collect();
        (0..N).map(|i| (0..K).fold(0, |column, j| column | u128::from(rows[j].bit(i)) << j)).collect()
    }

    #[test]
    fn any_four_bits_of_a_random_code_word_are_independent() {
        // No one, two, three or four columns add up to 0.
        let columns = columns();
        let mut sums: HashSet<u128> = HashSet::from([0]);
        assert!(columns.iter().all(|column| sums.insert(*column)));
        for (i, a) in columns.iter().enumerate() {
            assert!(columns[..i].iter().all(|b| sums.insert(a ^ b)));
        }
    }

    #[test]
    fn random_code_words_agree_with_an_estimate_as_often_as_random_bits_would() {
        let mut random = Random::new(5);
        // Estimates as a cropped map gives them: some bits known, most hardly.
        let estimate: Vec<f64> = (0..N).map(|_| random.normal() * random.uniform().powi(2)).collect();
        let size = estimate.iter().map(|b| b * b).sum::<f64>().sqrt();
        let count = 400_000;
        let mut scores: Vec<f64> = (0..count)
            .map(|_| {
                let signs = Code::Ldpc.encode(&random.message());
                signs.iter().zip(&estimate).map(|(a, b)| a * b).sum::<f64>() / size
            })
            .collect();
        let spread = (scores.iter().map(|s| s * s).sum::<f64>() / f64::from(count)).sqrt();
        assert!((0.99..1.01).contains(&spread), "{spread}");
        scores.sort_by(f64::total_cmp);
        for (deviations, normal) in [(2.0, 0.022_750), (3.0, 0.001_349_9), (4.0, 3.167e-5)] {
            let expected = normal * f64::from(count);
            let above = scores.iter().rev().take_while(|s| **s > deviations).count() as f64;
            assert!(above < 1.5 * expected, "{above} instead of {expected} above {deviations}");
        }
    }
}
