//! Checks that a record belongs to a key and a reference.

use super::request::Request;
use crate::{Error, Result};
use meshmark_core::{key::SecretKey, record::Record};
use meshmark_dataset::Survey;

/// Checks that the record is of this key, and that its message follows from key and recipient.
///
/// # Errors
/// Fails when the record is of another key, or was changed.
pub fn check_key(record: &Record, key: &SecretKey) -> Result<()> {
    if record.key_id != key.id() {
        return Err(Error::OtherKey { made_with: record.key_id.clone(), given: key.id() });
    }
    if record.subject()?.message(key) != record.message()? {
        return Err(Error::OtherMessage);
    }
    Ok(())
}

/// Returns whether a record is of the reference whose vertices have this digest.
pub fn is_made_from(record: &Record, digest: &str) -> bool {
    record.reference.vertices_sha256 == digest
}

/// Checks that the record is of this reference, whose vertices have this digest: any other has
/// another mesh.
///
/// # Errors
/// Fails when the record is of another reference.
pub fn check_reference(record: &Record, request: &Request, reference: &Survey, digest: &str) -> Result<()> {
    if is_made_from(record, digest) {
        return Ok(());
    }
    Err(Error::OtherReference {
        path: request.reference.clone(),
        recorded: record.reference.vertices,
        vertices: reference.data.vertices.len(),
    })
}
