//! Writing of a copy: it is written, read back and published.

use super::{copies::MarkedCopy, moving, opening::open, staging::Stage};
use crate::{
    Result,
    inputs::gdal_failures::{forget_failure, last_failure},
};
use gdal::vector::LayerAccess;
use meshmark_core::{
    key::SecretKey,
    options::{Options, Spelling},
    record::{Distortion, Reference},
    recorded::Recorded,
    vertices::VertexTable,
};
use meshmark_dataset::{
    Action, Error as MapError, digest_of_only_file, file_error,
    formats::Format,
    publication::{Move, Publication},
    read_back::ReadBack,
    workplace::Workplace,
};
use meshmark_marking::{self as marking, Lineage, Moves, Unmarked, damage_warning};
use std::{collections::BTreeSet, ffi::OsStr, fs, path::Path, sync::Mutex};

/// The input that all copies share.
pub struct Job<'a> {
    pub key: &'a SecretKey,
    pub options: &'a Options,
    pub vertices: &'a VertexTable,
    pub unmarked: Unmarked<'a>,
    /// What records say of the map.
    pub reference: Reference,
    /// The digest of the map, where it is one file.
    pub map_sha256: Option<String>,
    pub format: &'static Format,
    pub stage: &'a Stage,
    pub folder: &'a Path,
    /// The warnings during writing, each once.
    pub warnings: Mutex<BTreeSet<String>>,
}

/// Writes, checks and publishes a copy and its record.
pub fn write(
    job: &Job,
    copy: &MarkedCopy,
    moved: &[[f64; 2]],
    (lineage, distortion): (Lineage, Distortion),
) -> Result<()> {
    let workplace = Workplace::new(job.folder)?;
    let folder = workplace.subfolder("out")?;
    let file = folder.join(copy.file.file_name().expect("a copy has a name"));
    let (staged, moves) = (&job.stage.staged, Moves { from: job.vertices, to: moved });
    match &job.stage.plain {
        None => moving::write(staged, &file, moved)?,
        Some(plain) => {
            let warnings = plain.write(staged, workplace.folder(), &file, moves)?;
            job.warnings.lock().expect("nobody panics with them").extend(warnings);
        }
    }
    check(job, &file, moves)?;
    let (parameters, areas) = (&job.options.parameters, Some(&distortion.areas));
    let damage = damage_warning(parameters, &distortion.angles, areas, Spelling::Flag);
    job.warnings.lock().expect("nobody panics with them").extend(damage);
    let reference = (job.reference.clone(), lineage);
    let record = marking::recorded(job.options, &copy.subject(), job.key, reference, distortion);
    let record = with_digests(record, job, &folder)?;
    publish(copy, &workplace, &folder, &record.to_json(), job.format)
}

/// Returns the record with the digests of the map and, where it is one file, of the copy in
/// `folder`.
fn with_digests(record: Recorded, job: &Job, folder: &Path) -> Result<Recorded> {
    let Recorded::Fingerprint(mut record) = record else { return Ok(record) };
    record.reference.file_sha256 = job.map_sha256.clone();
    record.copy.file_sha256 =
        digest_of_only_file(folder).map_err(|error| file_error(Action::Reading, folder, error))?;
    Ok(Recorded::Fingerprint(record))
}

/// Checks that the file holds the features of the staged map, moved, within the precision of its
/// format.
fn check(job: &Job, path: &Path, moves: Moves) -> Result<()> {
    let driver = job.format.driver;
    let (staged, file) = (open(&job.stage.staged.path, "GPKG")?, open(path, driver)?);
    for number in 0..staged.layer_count() {
        let (meant, in_file) = (staged.layer(number), file.layer(number));
        let moving = meant.as_ref().ok().and_then(|layer| job.stage.staged.layer(&layer.name()));
        forget_failure();
        let comparison = ReadBack {
            digits: job.format.digits(&[]),
            place: &|point| if moving.is_some() { moves.destination(point) } else { Some(point) },
            last_failure: &last_failure,
        };
        let compared = match (moving, in_file) {
            // Its features have the order of the staged map, whose vertices are identified.
            (Some(moving), Ok(in_file)) if driver == "GPKG" => {
                comparison.in_order(in_file, moving.places(moves.to))
            }
            (_, in_file) => comparison.layers(meant, in_file, None),
        };
        compared.map_err(|difference| {
            let layer = job.stage.layers.get(number).cloned().unwrap_or_default();
            MapError::NotKept { driver, layer, difference }
        })?;
    }
    Ok(())
}

/// Moves the record and the files in `folder` into place, the main file last.
fn publish(
    copy: &MarkedCopy,
    workplace: &Workplace,
    folder: &Path,
    record: &str,
    format: &Format,
) -> Result<()> {
    let mut publication = Publication::default();
    // The path is absolute and has no links, as another process with another working directory may
    // undo the publication.
    let places = workplace.folder().parent().expect("a workplace is in a folder");
    let place = |name: Option<&OsStr>| places.join(name.expect("a copy has a name"));
    let is_there = fs::read(&copy.record).is_ok_and(|bytes| bytes == record.as_bytes());
    if !is_there {
        let staged = workplace.folder().join("record.json");
        fs::write(&staged, record).map_err(|error| file_error(Action::Writing, &staged, error))?;
        let to = place(copy.record.file_name());
        // The record of a copy that is no longer there has the digest of that one.
        if to.exists() {
            let away = workplace.folder().join("old_record.json");
            publication.retired.push(Move { from: to.clone(), to: away });
        }
        publication.companions.push(Move { from: staged, to });
    }
    let entries = fs::read_dir(folder).map_err(|error| file_error(Action::Reading, folder, error))?;
    for entry in entries.flatten() {
        if entry.path().is_dir() {
            return Err(MapError::Folder { driver: format.driver }.into());
        }
        let part = Move { to: place(Some(&entry.file_name())), from: entry.path() };
        match part.to.file_name() == copy.file.file_name() {
            true => publication.main = part,
            false => publication.companions.push(part),
        }
    }
    Ok(publication.run(workplace.folder())?)
}
