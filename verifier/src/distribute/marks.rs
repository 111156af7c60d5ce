//! The marks of the copies: fingerprints, or messages where CODE or CHIP_RATE ask for them.

use super::copies::MarkedCopy;
use meshmark_core::{
    Result,
    embedding::{Embedding, Marked},
    fingerprint::{Fingerprint, FingerprintEmbedding},
    fingerprint_record::PartEntry,
    key::{RECIPIENT_BITS, SecretKey},
    map::Map,
    message::Message,
    options::Options,
    series::Series,
};

/// The part of a marking that all copies share.
pub enum Marks<'a> {
    /// Of copies that carry messages.
    Messages(Box<Embedding<'a>>, &'a SecretKey),
    /// Of copies with fingerprints.
    Fingerprints(FingerprintEmbedding<'a>),
}

impl<'a> Marks<'a> {
    /// Meshes the map, the newest of its series, and prepares for many copies.
    pub fn new(
        map: &'a Map<'a>,
        series: &'a Series<'a>,
        key: &'a SecretKey,
        options: &'a Options,
    ) -> Result<Self> {
        let parameters = &options.parameters;
        Ok(match options.coefficients {
            Some(coefficients) => {
                Marks::Fingerprints(FingerprintEmbedding::new(series, key, coefficients)?.for_many()?)
            }
            None => {
                let embedding = Embedding::new(map, key, RECIPIENT_BITS, parameters)?.for_many()?;
                Marks::Messages(Box::new(embedding), key)
            }
        })
    }

    /// Returns how many patches there are.
    pub fn patches(&self) -> usize {
        match self {
            Marks::Messages(embedding, _) => embedding.patches(),
            Marks::Fingerprints(embedding) => embedding.patches(),
        }
    }

    /// Returns the parts of fingerprints for records.
    pub fn part_entries(&self) -> Vec<PartEntry> {
        match self {
            Marks::Messages(..) => Vec::new(),
            Marks::Fingerprints(embedding) => embedding.part_entries(),
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
