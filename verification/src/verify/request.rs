//! The request of a verification.

use meshmark_core::{
    fingerprint_record::{Divided, FingerprintRecord},
    hex,
    key::SecretKey,
    options::{Parameters, Subject},
    recorded::Recorded,
};
use meshmark_detection::{
    Demodulator, Mark, decision::Expected, matching::RadiusChoice, registration::Start,
};
use meshmark_marking::Lineage;
use sha2::{Digest, Sha256};

/// What a mark carries.
#[derive(Debug, Clone, PartialEq)]
pub enum Sought {
    /// A message.
    Message {
        /// Its length.
        bits: usize,
    },
    /// The fingerprint of a recipient.
    Fingerprint {
        /// Coefficients of a patch and axis that carry it.
        coefficients: usize,
        /// The possible recipients.
        recipients: Vec<String>,
        /// Number of these, and of those whose marks have other numbers or another reference.
        tried: usize,
    },
}

impl Sought {
    /// Returns whether one examination serves for both.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Sought::Message { bits: a }, Sought::Message { bits: b }) => a == b,
            (Sought::Fingerprint { coefficients: a, .. }, Sought::Fingerprint { coefficients: b, .. }) => {
                a == b
            }
            _ => false,
        }
    }
}

/// A record, and the digest of the very bytes that it was read from.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadRecord {
    /// The record.
    pub record: Recorded,
    /// SHA-256 of its text.
    pub sha256: String,
}

impl ReadRecord {
    /// Parses the text of a record of either version.
    ///
    /// # Errors
    /// Fails on any other text.
    pub fn parse(text: &str) -> meshmark_core::Result<Self> {
        let record = Recorded::from_json(text)?;
        Ok(ReadRecord { record, sha256: hex::encode(&Sha256::digest(text)) })
    }
}

/// A match at a larger significance is no evidence.
pub const LARGEST_SIGNIFICANCE: f64 = 1e-3;

/// How a suspect is verified, whatever the mark.
#[derive(Clone)]
pub struct Settings {
    /// The secret key.
    pub key: SecretKey,
    /// The start of the registration.
    pub registration: Start,
    /// The demodulator.
    pub demodulator: Demodulator,
    /// The choice of the matching radius t.
    pub radius: RadiusChoice,
    /// The significance: smaller p-values are a match.
    pub significance: f64,
    /// Whether to keep the drawing data of a report file.
    pub sketch: bool,
    /// Whether to keep the evidence map.
    pub evidence_map: bool,
    /// Whether these two hold the exact displacements of vertices.
    pub exact_displacements: bool,
}

/// The mark that a verification looks for.
#[derive(Clone)]
pub struct Request {
    /// How it looks for it.
    pub settings: Settings,
    /// The record that was written when the map was marked.
    pub record: Option<ReadRecord>,
    /// The expected subject of the mark, if it is known.
    pub subject: Option<Subject>,
    /// What the mark carries.
    pub sought: Sought,
    /// The parts of the fingerprint, the editions that it rests on and its anchors, from a record of a map
    /// that is not one part.
    pub lineage: Lineage,
    /// A reference of more vertices is cut into parts of nearly so many; 0 leaves it in one part.
    pub part_size: usize,
    /// Number of the marks that are tried, this one included, as nobody recorded which it is.
    pub tried: usize,
    /// The parameters of the mark.
    pub parameters: Parameters,
    /// Layers that were marked; all when `None`.
    pub layers: Option<Vec<String>>,
    /// CRS of the reference when it has none.
    pub srs: Option<String>,
    /// CRS of the reference when it was marked, from a record.
    pub recorded_crs: Option<String>,
}

/// Returns the lineage of a record of a map that is not one part.
pub fn lineage_of(record: &Recorded) -> Lineage {
    match record {
        Recorded::Fingerprint(record) if !record.is_whole() => {
            let FingerprintRecord { parts, bases, anchors, census, .. } = record.clone();
            Lineage { divided: Divided { parts, census }, bases, anchors }
        }
        _ => Lineage::default(),
    }
}

impl Request {
    /// Returns the bits that the code is expected to carry, if they are known.
    pub fn expected(&self) -> Option<Expected> {
        self.subject.as_ref().map(|subject| Expected::new(subject, &self.settings.key))
    }

    /// Returns the recipient from which the message follows.
    pub fn recipient(&self) -> Option<&str> {
        self.subject.as_ref().and_then(Subject::recipient)
    }

    /// Returns whether the request itself gives the message, so that the command line holds it.
    pub(super) fn is_message_given(&self) -> bool {
        self.record.is_none() && self.subject.is_some() && self.recipient().is_none()
    }

    /// Returns the properties of a mark that carries a message of this length.
    pub(super) fn mark(&self, bits: usize) -> Mark<'_> {
        Mark { key: &self.settings.key, bits, parameters: &self.parameters }
    }

    /// Returns the possible subjects of the mark. Without a record, a message may precede the
    /// introduction of whitening.
    pub(super) fn subjects(&self) -> Vec<Subject> {
        match (&self.record, &self.subject) {
            (None, Some(Subject::Message(message))) => {
                vec![Subject::Message(message.clone()), Subject::Unwhitened(message.clone())]
            }
            (_, subject) => subject.iter().cloned().collect(),
        }
    }
}
