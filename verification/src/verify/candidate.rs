//! A record of the key, which a suspect may carry the mark of.

use super::{
    belonging::check_key,
    request::{ReadRecord, Sought},
};
use crate::Result;
use meshmark_core::{
    key::SecretKey,
    message::Message,
    options::{Options, Subject},
    recorded::Recorded,
};

/// A record of the key.
pub struct Candidate {
    /// The name of the record.
    pub name: String,
    /// The record.
    pub read: ReadRecord,
    /// The options in the record.
    pub options: Options,
    /// The message in the record; none of a fingerprint.
    pub message: Option<Message>,
}

impl Candidate {
    /// Creates the candidate of a record.
    ///
    /// # Errors
    /// Fails when the record is not of the key.
    pub fn new(name: String, read: ReadRecord, key: &SecretKey) -> Result<Self> {
        let record = &read.record;
        check_key(record, key)?;
        let message = match record {
            Recorded::Message(record) => Some(record.message()?),
            Recorded::Fingerprint(_) => None,
        };
        let options = record.options()?;
        Ok(Candidate { name, options, message, read })
    }

    /// Returns what the mark carries, without naming a recipient.
    pub fn sought(&self) -> Sought {
        match (self.options.coefficients, &self.message) {
            (Some(coefficients), _) => Sought::Fingerprint { coefficients, recipients: Vec::new(), tried: 0 },
            (None, message) => Sought::Message { bits: message.as_ref().map_or(0, Message::len) },
        }
    }

    /// Returns the recipient, where one is recorded.
    pub fn recipient(&self) -> Option<String> {
        self.options.subject.as_ref().and_then(Subject::recipient).map(String::from)
    }
}
