//! The marks of the copies: fingerprints, or messages where CODE or CHIP_RATE ask for them.

use super::copies::MarkedCopy;
use meshmark_core::{
    Result,
    embedding::{Embedding, Marked},
    fingerprint::Fingerprint,
    fingerprint_embedding::{self, FingerprintEmbedding},
    fingerprint_record::Divided,
    key::{RECIPIENT_BITS, SecretKey},
    map::Map,
    message::Message,
    options::Options,
    series::Series,
};
use meshmark_dataset::ScratchFiles;

/// The part of a marking that all copies share.
pub enum Marks<'a> {
    /// Of copies that carry messages.
    Messages(Box<Embedding<'a>>, &'a SecretKey),
    /// Of copies with fingerprints.
    Fingerprints(FingerprintEmbedding<'a>),
}

/// The mark of a copy before the topology of the map is settled.
pub enum Wanted {
    /// The displacements of all vertices, CRS units.
    Message(Vec<[f64; 2]>),
    /// What a fingerprint makes of the parts.
    Fingerprint(fingerprint_embedding::Wanted),
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
                let embedding = FingerprintEmbedding::new(series, key, coefficients)?;
                Marks::Fingerprints(embedding.with_columns(&ScratchFiles).for_many()?)
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

    /// Returns how the map is divided, for the record of a fingerprint.
    pub fn divided(&self, wanted: &Wanted) -> Divided {
        match (self, wanted) {
            (Marks::Fingerprints(embedding), Wanted::Fingerprint(wanted)) => embedding.divided(wanted),
            _ => Divided::default(),
        }
    }

    /// Returns how many copies are solved at once.
    pub fn batch(&self) -> usize {
        match self {
            Marks::Messages(embedding, _) => embedding.batch(),
            Marks::Fingerprints(embedding) => embedding.batch(),
        }
    }

    /// Returns the marks of the copies.
    pub fn wanted(&self, copies: &[MarkedCopy], progress: &(dyn Fn(usize) + Sync)) -> Result<Vec<Wanted>> {
        match self {
            Marks::Messages(embedding, key) => {
                let messages: Vec<Message> = copies.iter().map(|copy| copy.carried(key)).collect();
                let wanted = embedding.wanted(&messages, progress)?;
                Ok(wanted.into_iter().map(Wanted::Message).collect())
            }
            Marks::Fingerprints(embedding) => {
                let of_copy = |copy: &MarkedCopy| embedding.fingerprint(&copy.recipient);
                let fingerprints: Vec<Fingerprint> = copies.iter().map(of_copy).collect();
                let wanted = embedding.wanted(&fingerprints, progress)?;
                Ok(wanted.into_iter().map(Wanted::Fingerprint).collect())
            }
        }
    }

    /// Marks the map for a copy, whose mark is read back.
    pub fn settle(&self, copy: &MarkedCopy, wanted: Wanted) -> Result<Marked> {
        match (self, wanted) {
            (Marks::Messages(embedding, key), Wanted::Message(wanted)) => {
                embedding.settle(&copy.carried(key), &wanted)
            }
            (Marks::Fingerprints(embedding), Wanted::Fingerprint(wanted)) => {
                embedding.settle(&embedding.fingerprint(&copy.recipient), wanted)
            }
            _ => unreachable!("a mark is settled by what wanted it"),
        }
    }
}
