//! The index of copies: who received which copy of which edition, from the records of a folder.

use crate::{Error, Result, inputs::texts};
use der::DateTime;
use meshmark_core::recorded::Recorded;
use meshmark_dataset::{file_digest, formats::Format};
use meshmark_verification::words::printable;
use serde::Serialize;
use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

/// A copy as its record describes it, and the file beside the record. The names are the columns of
/// the table.
#[derive(Debug, PartialEq, Serialize)]
pub struct IndexedCopy {
    /// The recipient; empty for a message that was given as such.
    pub recipient: String,
    /// SHA-256 of the vertices of the unmarked map, which names the edition.
    pub edition_sha256: String,
    /// Number of earlier editions that it rests on.
    pub earlier_editions: usize,
    /// Name of the record in its folder.
    pub record: String,
    /// Name of the copy; empty where it is not beside the record.
    pub copy: String,
    /// SHA-256 of the copy: that of the file, else the recorded one; empty where neither is there.
    pub copy_sha256: String,
    /// What the record says of the file.
    pub state: State,
    /// The day on which the copy was last written, or its record where the copy is not there, UTC.
    pub written: String,
}

impl IndexedCopy {
    /// Makes all names printable; they are then for readers, not for programs.
    pub fn make_printable(&mut self) {
        for name in [&mut self.recipient, &mut self.record, &mut self.copy] {
            *name = printable(name);
        }
    }
}

/// How the file of a copy compares with its record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// It has the recorded digest.
    Recorded,
    /// It has another digest.
    Changed,
    /// The record has no digest, as another program wrote the file.
    Undigested,
    /// It is not beside the record.
    Absent,
}

/// The copies of which a folder has the records, and the errors of those that are missing from the list.
pub struct Index {
    /// The copies, in the order of recipient, edition and record.
    pub copies: Vec<IndexedCopy>,
    /// One error for each record or copy that cannot be read.
    pub faults: Vec<Error>,
}

/// Lists the copies of which a folder has the records. `warn` receives the names of files that are no
/// records.
///
/// # Errors
/// Fails on a folder that is unreadable, and where there is no record.
pub fn index(folder: &Path, warn: &mut dyn FnMut(&str)) -> Result<Index> {
    let records = texts::each_record(folder, warn)?;
    if records.is_empty() {
        return Err(Error::NothingListed { folder: folder.into() });
    }
    let maps = maps(folder)?;
    let mut index = Index { copies: Vec::new(), faults: Vec::new() };
    for record in records {
        match record.and_then(|(path, read)| indexed(&path, &read.record, &maps)) {
            Ok(copy) => index.copies.push(copy),
            Err(fault) => index.faults.push(fault),
        }
    }
    index
        .copies
        .sort_by_cached_key(|copy| [&copy.recipient, &copy.edition_sha256, &copy.record].map(String::clone));
    Ok(index)
}

/// Returns the index as CSV (RFC 4180), with a header.
pub fn to_csv(copies: &[IndexedCopy]) -> String {
    let mut table = csv::Writer::from_writer(Vec::new());
    copies.iter().for_each(|copy| table.serialize(copy).expect("memory takes all"));
    String::from_utf8(table.into_inner().expect("memory takes all")).expect("texts are UTF-8")
}

fn indexed(record_file: &Path, record: &Recorded, maps: &BTreeMap<String, PathBuf>) -> Result<IndexedCopy> {
    let (recipient, recorded, earlier_editions) = match record {
        Recorded::Message(record) => (record.recipient.clone(), None, 0),
        Recorded::Fingerprint(record) => {
            (Some(record.recipient.clone()), record.copy.file_sha256.clone(), record.bases.len())
        }
    };
    let unread = |path: &Path| {
        let path = path.to_path_buf();
        move |source: io::Error| Error::Undigested { path, source }
    };
    let copy = maps.get(&*record_file.file_stem().unwrap_or_default().to_string_lossy());
    let found = copy.map(|copy| file_digest(copy).map_err(unread(copy))).transpose()?;
    let state = match (&found, &recorded) {
        (None, _) => State::Absent,
        (Some(_), None) => State::Undigested,
        (Some(found), Some(recorded)) if found == recorded => State::Recorded,
        _ => State::Changed,
    };
    let written = copy.map_or(record_file, PathBuf::as_path);
    Ok(IndexedCopy {
        recipient: recipient.unwrap_or_default(),
        edition_sha256: record.vertices().1.into(),
        earlier_editions,
        record: name(record_file),
        copy: copy.map(|copy| name(copy)).unwrap_or_default(),
        copy_sha256: found.or(recorded).unwrap_or_default(),
        state,
        written: day(written).map_err(unread(written))?,
    })
}

/// Returns the maps of a folder by their names without endings; the first one of equal names.
fn maps(folder: &Path) -> Result<BTreeMap<String, PathBuf>> {
    let unread = |source| Error::FolderUnread { path: folder.into(), source };
    let mut maps = BTreeMap::new();
    for entry in fs::read_dir(folder).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        let name = name(&path);
        let is_json = name.to_ascii_lowercase().ends_with(".json");
        if let Some(stem) = Format::stem(&name).filter(|_| !is_json && path.is_file()) {
            let first = maps.entry(stem.to_string()).or_insert_with(|| path.clone());
            if path < *first {
                *first = path;
            }
        }
    }
    Ok(maps)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn day(path: &Path) -> io::Result<String> {
    let time = fs::metadata(path)?.modified()?;
    let date = DateTime::from_system_time(time).map_err(io::Error::other)?;
    Ok(format!("{:04}-{:02}-{:02}", date.year(), date.month(), date.day()))
}
