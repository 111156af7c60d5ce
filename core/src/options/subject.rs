//! The subject of a mark: the recipient, or the message itself.

use crate::{key::SecretKey, message::Message, whitening::whiten};

/// The content of a mark: a name, or the bits themselves.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// The message is a keyed hash of this text.
    Recipient(String),
    /// The message, which the key whitens before it is coded.
    Message(Message),
    /// The message of a mark made before whitening existed: its own bits are coded.
    Unwhitened(Message),
}

impl Subject {
    /// Returns the bits that the code carries under a key.
    pub fn carried(&self, key: &SecretKey) -> Message {
        match self {
            Subject::Recipient(text) => key.recipient_message(text),
            Subject::Message(message) => whiten(key, message),
            Subject::Unwhitened(message) => message.clone(),
        }
    }

    /// Returns the message of records and reports for the bits that the code carries.
    pub fn message_of(&self, carried: &Message, key: &SecretKey) -> Message {
        match self {
            Subject::Message(_) => key.unwhitened(carried),
            Subject::Recipient(_) | Subject::Unwhitened(_) => carried.clone(),
        }
    }

    /// Returns the message of records and reports.
    pub fn message(&self, key: &SecretKey) -> Message {
        match self {
            Subject::Recipient(text) => key.recipient_message(text),
            Subject::Message(message) | Subject::Unwhitened(message) => message.clone(),
        }
    }

    /// Returns the recipient, when the message is made from one.
    pub fn recipient(&self) -> Option<&str> {
        match self {
            Subject::Recipient(text) => Some(text),
            Subject::Message(_) | Subject::Unwhitened(_) => None,
        }
    }
    /// Returns the message, when it is given as such.
    pub(super) fn given_message(&self) -> Option<&Message> {
        match self {
            Subject::Recipient(_) => None,
            Subject::Message(message) | Subject::Unwhitened(message) => Some(message),
        }
    }
}
