//! The marks of the copies: fingerprints, or messages where CODE or CHIP_RATE ask for them.

use super::copies::MarkedCopy;
use meshmark_core::{
    Result,
    embedding::{Embedding, Marked},
    fingerprint::{Fingerprint, FingerprintEmbedding},
    key::{RECIPIENT_BITS, SecretKey},
    map::Map,
    message::Message,
    options::Options,
};

/// The part of a marking that all copies share.
pub enum Marks<'a> {
    /// Of copies that carry messages.
    Messages(Embedding<'a>, &'a SecretKey),
    /// Of copies with fingerprints.
    Fingerprints(FingerprintEmbedding<'a>),
}

impl<'a> Marks<'a> {
    /// Meshes the map and prepares for many copies.
    pub fn new(map: &'a Map<'a>, key: &'a SecretKey, options: &'a Options) -> Result<Self> {
        let parameters = &options.parameters;
        Ok(match options.coefficients {
            Some(coefficients) => Marks::Fingerprints(
                FingerprintEmbedding::new(map, key, coefficients, parameters)?.for_many()?,
            ),
            None => Marks::Messages(Embedding::new(map, key, RECIPIENT_BITS, parameters)?.for_many()?, key),
        })
    }

    /// Returns how many patches there are.
    pub fn patches(&self) -> usize {
        match self {
            Marks::Messages(embedding, _) => embedding.patches(),
            Marks::Fingerprints(embedding) => embedding.patches(),
        }
    }

    /// Returns how many copies are solved at once.
    pub fn batch(&self) -> usize {
        match self {
            Marks::Messages(embedding, _) => embedding.batch(),
            Marks::Fingerprints(embedding) => embedding.batch(),
        }
    }

    /// Returns the displacements that are the marks of the copies, of all vertices, CRS units.
    pub fn wanted(
        &self,
        copies: &[MarkedCopy],
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Vec<[f64; 2]>>> {
        match self {
            Marks::Messages(embedding, key) => {
                let messages: Vec<Message> = copies.iter().map(|copy| copy.carried(key)).collect();
                embedding.wanted(&messages, progress)
            }
            Marks::Fingerprints(embedding) => {
                let of_copy = |copy: &MarkedCopy| embedding.fingerprint(&copy.recipient);
                let fingerprints: Vec<Fingerprint> = copies.iter().map(of_copy).collect();
                embedding.wanted(&fingerprints, progress)
            }
        }
    }

    /// Marks the map for a copy, whose mark is read back.
    pub fn settle(&self, copy: &MarkedCopy, wanted: &[[f64; 2]]) -> Result<Marked> {
        match self {
            Marks::Messages(embedding, key) => embedding.settle(&copy.carried(key), wanted),
            Marks::Fingerprints(embedding) => {
                embedding.settle(&embedding.fingerprint(&copy.recipient), wanted)
            }
        }
    }
}
