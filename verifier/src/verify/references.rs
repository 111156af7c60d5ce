//! Several references, such as the editions of a map: every record finds its own.

use super::{
    examination::{Suited, read_reference},
    request::Request,
};
use crate::{Error, Result, progress::Progress};
use meshmark_core::record::Record;
use std::path::PathBuf;

/// Returns the request with that of several references from which its record was made.
///
/// # Errors
/// Fails when a reference is unreadable, when there is no record to choose by, and when the record
/// is of none of them.
pub fn with_reference_of_record(
    request: &Request,
    references: &[PathBuf],
    progress: &mut Progress,
) -> Result<Request> {
    let Some(record) = request.record.as_ref().filter(|_| references.len() > 1) else {
        return match references.len() {
            1 => Ok(request.clone()),
            _ => Err(Error::SeveralReferences),
        };
    };
    for path in references {
        let request = Request { reference: path.clone(), ..request.clone() };
        if let Suited::Yes(reference) = read_reference(&request, progress)?
            && is_made_from(record, &reference.data.vertices.digest())
        {
            return Ok(request);
        }
    }
    Err(Error::NoReferenceOfRecord { references: references.len() })
}

/// Returns whether a record is of the reference whose vertices have this digest.
pub fn is_made_from(record: &Record, digest: &str) -> bool {
    record.reference.vertices_sha256 == digest
}
