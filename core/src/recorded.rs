//! The record of a marking, of either version of the mark.

use crate::{
    Error, Result,
    error::RecordFault,
    fingerprint_record::{self, FingerprintRecord},
    key::SecretKey,
    options::Options,
    record::{self, Record},
};
use serde::Deserialize;

/// A record of either version.
#[derive(Debug, Clone, PartialEq)]
pub enum Recorded {
    /// Version 1, the record of a message.
    Message(Record),
    /// Version 2, the record of a fingerprint.
    Fingerprint(FingerprintRecord),
}

#[derive(Deserialize)]
struct Versioned {
    meshmark_record: u32,
}

impl Recorded {
    /// Reads a record's text, whichever version it names, and checks that its values are legal.
    ///
    /// # Errors
    /// [`Error::Record`] describes the fault.
    pub fn from_json(text: &str) -> Result<Self> {
        match serde_json::from_str(text) {
            Ok(Versioned { meshmark_record: fingerprint_record::VERSION }) => {
                FingerprintRecord::from_json(text).map(Recorded::Fingerprint)
            }
            Ok(Versioned { meshmark_record: found }) if found != record::VERSION => {
                Err(Error::Record(RecordFault::UnknownVersion { found }))
            }
            _ => Record::from_json(text).map(Recorded::Message),
        }
    }

    /// Returns the options that made the mark.
    ///
    /// # Errors
    /// Returns the errors of [`Record::options`].
    pub fn options(&self) -> Result<Options> {
        match self {
            Recorded::Message(record) => record.options(),
            Recorded::Fingerprint(record) => Ok(record.options()),
        }
    }

    /// Returns the text of the record.
    pub fn to_json(&self) -> String {
        match self {
            Recorded::Message(record) => record.to_json(),
            Recorded::Fingerprint(record) => record.to_json(),
        }
    }

    /// Returns whether the record was made with this key.
    pub fn is_of(&self, key: &SecretKey) -> bool {
        match self {
            Recorded::Message(record) => record.key_id == key.id(),
            Recorded::Fingerprint(record) => record.is_of(key),
        }
    }

    /// Returns the CRS of the reference as authority and code, or as WKT; `None` where it had none.
    pub fn crs(&self) -> Option<&str> {
        match self {
            Recorded::Message(record) => record.reference.crs.as_deref(),
            Recorded::Fingerprint(record) => record.reference.crs.as_deref(),
        }
    }

    /// Returns the number of vertices of the reference, and their digest.
    pub fn vertices(&self) -> (usize, &str) {
        match self {
            Recorded::Message(Record { reference, .. }) => (reference.vertices, &reference.vertices_sha256),
            Recorded::Fingerprint(FingerprintRecord { reference, .. }) => {
                (reference.vertices, &reference.vertices_sha256)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(path: &str) -> String {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/vectors");
        std::fs::read_to_string(format!("{folder}/{path}")).unwrap()
    }

    #[test]
    fn the_version_in_the_text_chooses_the_record() {
        let texts = ["record.json", "fingerprint/record.json"].map(written);
        let [first, second] = texts.each_ref().map(|text| Recorded::from_json(text).unwrap());
        assert_eq!(first, Recorded::Message(Record::from_json(&texts[0]).unwrap()));
        assert_eq!(second, Recorded::Fingerprint(FingerprintRecord::from_json(&texts[1]).unwrap()));
        assert_eq!(first.vertices(), second.vertices());
        let key = SecretKey::from_json(&written("key.json")).unwrap();
        for record in [first, second] {
            assert!(record.is_of(&key) && !record.is_of(&SecretKey::from_bytes([1; 32])));
            assert_eq!(record.options().unwrap().text_of("RECIPIENT").as_deref(), Some("ACME GmbH"));
        }
    }

    #[test]
    fn an_unknown_version_and_a_text_without_one_are_refused() {
        let error = |text: &str| Recorded::from_json(text).unwrap_err().to_string();
        let later = written("fingerprint/record.json").replace("_record\": 2", "_record\": 3");
        assert!(error(&later).contains("version 3 instead of 1 or 2"), "{}", error(&later));
        for text in ["{}", "[]", "", "{ \"meshmark_record\": \"2\" }"] {
            assert!(error(text).contains("malformed record"), "{text}");
        }
        let other = written("record.json").replace("_record\": 1", "_record\": 2");
        assert!(error(&other).contains("malformed record: unknown field"), "{}", error(&other));
    }
}
