//! The comparison of two files: `meshmark compare REFERENCE MARKED`.

use crate::{
    Error, Result,
    inputs::{digests::digest, maps, versions::versions},
};
use meshmark_dataset::GeosOfGdal;
use meshmark_verification::{
    self as verification,
    compare::{self, Comparison, Details, detail::ComparedFiles},
};
use std::path::Path;

/// Compares two files, and keeps these details. `precision` is the cell size of the grid of the marked
/// file, CRS units.
///
/// # Errors
/// Fails on unreadable input, a reference without a CRS, and maps whose features do not correspond.
pub fn compare(
    reference: &Path,
    marked: &Path,
    layers: Option<&[String]>,
    precision: Option<f64>,
    details: Details,
) -> Result<Comparison> {
    let ground = maps::ground(reference, layers)?;
    let before = maps::geometries("reference", reference, layers)?;
    let after = maps::geometries("marked map", marked, layers)?;
    let compared = compare::compare(before, after, (&ground, &GeosOfGdal), precision, details);
    compared.map_err(|error| match error {
        verification::Error::OtherCrs { own, other } => Error::OtherCrs { path: marked.into(), own, other },
        other => other.into(),
    })
}

/// Digests the files of a comparison.
///
/// # Errors
/// Fails when one of them cannot be read to its end.
pub fn compared_files(reference: &Path, marked: &Path, command: String) -> Result<ComparedFiles> {
    let versions = versions();
    Ok(ComparedFiles { reference: digest(reference)?, marked: digest(marked)?, command, versions })
}
