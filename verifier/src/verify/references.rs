//! Several references, such as the editions of a map: every record finds its own.

use super::{
    belonging::{check_reference, is_made_from},
    examination::{Suited, read_reference},
    request::Request,
};
use crate::{Error, Result, inputs::maps, progress::Progress};
use meshmark_dataset::{Bases, Survey};
use meshmark_marking::Lineage;
use std::path::PathBuf;

/// Reads the only reference, or that of several from which the record of the request was made.
/// Returns it with the request that names it.
///
/// # Errors
/// Fails when a reference is unreadable, when there is no record to choose by, and when the record
/// is of none of them.
pub fn read_own_reference(
    request: &Request,
    references: &[PathBuf],
    progress: &mut Progress,
) -> Result<(Request, Survey)> {
    if let [path] = references {
        let request = Request { reference: path.clone(), ..request.clone() };
        let reference = read_reference(&request, progress)?.or_fail()?;
        if let Some(read) = &request.record {
            check_reference(&read.record, &request, &reference, &reference.data.vertices.digest())?;
        }
        return Ok((request, reference));
    }
    let Some(read) = &request.record else { return Err(Error::SeveralReferences) };
    for path in references {
        let request = Request { reference: path.clone(), ..request.clone() };
        if let Suited::Yes(reference) = read_reference(&request, progress)?
            && is_made_from(&read.record, &reference.data.vertices.digest())
        {
            return Ok((request, reference));
        }
    }
    Err(Error::NoReferenceOfRecord { references: references.len() })
}

/// Finds the editions that the record of a request rests on among the references, and takes its anchors.
///
/// # Errors
/// Fails when a reference is unreadable, and when one is missing.
pub fn read_bases(request: &Request, references: &[PathBuf]) -> Result<Bases> {
    let Lineage { bases, anchors, .. } = request.lineage.clone();
    let part_size = Some(request.part_size).filter(|part_size| *part_size > 0);
    Bases::find((bases, anchors), part_size, references, &mut maps::base_reference)
}
