//! Checks that a record belongs to a key and a reference.

use crate::{Error, Result};
use meshmark_core::{
    fingerprint_record::FingerprintRecord, key::SecretKey, record::Record, recorded::Recorded,
};
use meshmark_marking::Survey;

/// Checks that the record is of this key, and that its message follows from key and recipient.
///
/// # Errors
/// Fails when the record is of another key, or was changed.
pub fn check_key(record: &Recorded, key: &SecretKey) -> Result<()> {
    match record {
        Recorded::Message(record) => check_message(record, key),
        Recorded::Fingerprint(record) => check_fingerprint(record, key),
    }
}

fn check_message(record: &Record, key: &SecretKey) -> Result<()> {
    if record.key_id != key.id() {
        return Err(Error::OtherKey { made_with: record.key_id.clone(), given: key.id() });
    }
    if record.subject()?.message(key) != record.message()? {
        return Err(Error::OtherMessage);
    }
    Ok(())
}

fn check_fingerprint(record: &FingerprintRecord, key: &SecretKey) -> Result<()> {
    if !record.is_of(key) {
        return Err(Error::OtherCommitment { given: key.id() });
    }
    // The examination checks the parts of other maps.
    match record.parts.as_slice() {
        _ if !record.is_whole() => Ok(()),
        [part] if part.sha256.to_string() == record.reference.vertices_sha256 => Ok(()),
        parts => Err(Error::OtherParts { parts: parts.len() }),
    }
}

/// Returns whether a record is of the reference whose vertices have this digest.
pub fn is_made_from(record: &Recorded, digest: &str) -> bool {
    record.vertices().1 == digest
}

/// Checks that the record is of this reference, whose vertices have this digest: any other has
/// another mesh. The name is for the message.
///
/// # Errors
/// Fails when the record is of another reference.
pub fn check_reference<C>(
    record: &Recorded,
    (reference, name): (&Survey<C>, Option<String>),
    digest: &str,
) -> Result<()> {
    if is_made_from(record, digest) {
        return Ok(());
    }
    Err(Error::OtherReference {
        reference: name,
        recorded: record.vertices().0,
        vertices: reference.data.vertices.len(),
    })
}
