//! The bases of a marking and its anchors, from the records, references and plan that options name.

use crate::{CoordinateSystem, Error, Result, Survey, sheets};
use meshmark_core::{
    fingerprint_record::{BaseEntry, FingerprintRecord},
    key::{SecretKey, read_text},
    options::{Options, join_list},
    recorded::Recorded,
};
use meshmark_marking::{Bases, Crs, ReadBase};
use std::{
    fs::{self, File},
    path::{Path, PathBuf},
};

/// The options that shape a fingerprint, which all editions of a series share.
const SHARED: [&str; 6] = ["AMPLITUDE", "PATCH_SIZE", "TOLERANCE", "PRECISION", "SHAPE", "BASIS"];

/// Reads the bases and the plan of sheets that options name, for a map that is to be marked with
/// this key. `read` reads a reference as its entry describes it.
///
/// # Errors
/// Fails on a plan that the map is not in, on a record that is unreadable or of another key, mark or map, on a reference that is
/// missing, and on the errors of `read`.
pub fn read_bases<E: From<Error> + From<meshmark_marking::Error>>(
    options: &Options,
    key: &SecretKey,
    map: &Survey,
    read: &mut ReadBase<'_, PathBuf, CoordinateSystem, E>,
) -> std::result::Result<Bases, E> {
    let anchors = sheets::anchors(options, map)?;
    let Some(named) = &options.bases else {
        return match options.base_references {
            Some(_) => Err(Error::NoBase.into()),
            None => Ok(Bases::of_one(anchors, options.parts_of(map.data.vertices.len()))),
        };
    };
    let (mut entries, mut cut): (Vec<BaseEntry>, Vec<(PathBuf, FingerprintRecord)>) = Default::default();
    let own_digest = map.data.vertices.digest();
    for path in records_at(named)? {
        let record = read_record(&path)?;
        check_record(&path, &record, options, key, map)?;
        // A copy of this very edition for somebody else is no earlier edition, but it may name some.
        if record.reference.vertices_sha256 == own_digest && record.bases.is_empty() {
            return Err(Error::BaseOfThisEdition { base: path }.into());
        }
        for entry in record.chain().into_iter().filter(|entry| entry.vertices_sha256 != own_digest) {
            match entries.iter().find(|known| known.vertices_sha256 == entry.vertices_sha256) {
                None => entries.push(entry),
                Some(known) if *known == entry => {}
                Some(_) => return Err(Error::ContradictingBase { base: path }.into()),
            }
        }
        if record.mark.part_size.is_some() {
            cut.push((path, record));
        }
    }
    let references = options.base_references.as_ref().ok_or(Error::NoBaseReference)?;
    let references: Vec<PathBuf> = references.iter().map(PathBuf::from).collect();
    let bases = Bases::find((entries, anchors), None, &references, read)?;
    for (base, record) in cut {
        let found = bases.cut_parts(&record.reference.vertices_sha256, &options.parameters);
        let found = found.map_err(meshmark_marking::Error::from)?;
        if found.is_none_or(|found| !found.iter().eq(record.parts.iter().map(|part| &part.sha256))) {
            return Err(Error::BaseOfOtherParts { base }.into());
        }
    }
    match bases.have_any_of(map) {
        true => Ok(bases),
        false => Err(Error::OtherBase { base: join_list(named) }.into()),
    }
}

/// Returns the paths of records, those of folders in the order of their names.
fn records_at(named: &[String]) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for name in named.iter().map(PathBuf::from) {
        if !name.is_dir() {
            paths.push(name);
            continue;
        }
        let unread = |source| Error::BaseUnread { base: name.clone(), source };
        let mut found = Vec::new();
        for entry in fs::read_dir(&name).map_err(unread)? {
            let path = entry.map_err(unread)?.path();
            if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
                found.push(path);
            }
        }
        if found.is_empty() {
            return Err(Error::NoRecordOfBase { folder: name });
        }
        found.sort();
        paths.extend(found);
    }
    Ok(paths)
}

fn read_record(path: &Path) -> Result<FingerprintRecord> {
    let base = || path.to_path_buf();
    let text =
        File::open(path).and_then(read_text).map_err(|source| Error::BaseUnread { base: base(), source })?;
    match Recorded::from_json(&text) {
        Ok(Recorded::Fingerprint(record)) => Ok(record),
        Ok(Recorded::Message(_)) => Err(Error::BaseOfMessage { base: base() }),
        Err(source) => Err(Error::BaseMalformed { base: base(), source }),
    }
}

/// Checks that a record of an edition and a marking are of one series.
fn check_record(
    path: &Path,
    record: &FingerprintRecord,
    options: &Options,
    key: &SecretKey,
    map: &Survey,
) -> Result<()> {
    let base = || path.to_path_buf();
    if !record.is_of(key) {
        return Err(Error::BaseOfOtherKey { base: base() });
    }
    let crs = map.crs.as_ref().map(|crs| crs.label());
    if record.reference.crs != crs {
        return Err(Error::BaseInOtherCrs { base: base() });
    }
    let recorded = record.options();
    let differs = |name: &&&str| recorded.text_of(name) != options.text_of(name);
    if let Some(option) = SHARED.iter().find(differs) {
        let (made_with, given) = (recorded.text_of(option), options.text_of(option));
        return Err(Error::BaseOfOtherMark { base: base(), option, made_with, given });
    }
    let whole = &record.reference.vertices_sha256;
    if record.is_whole() && !record.parts.iter().all(|part| part.sha256.to_string() == *whole) {
        return Err(Error::BaseOfOtherParts { base: base() });
    }
    match options.coefficients == recorded.coefficients {
        true => Ok(()),
        false => Err(Error::BaseOfOtherVersion { base: base() }),
    }
}
