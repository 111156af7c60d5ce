//! Files of keys, records and deposits.

use super::{passphrase::Passphrase, plain};
use crate::{Error, Result};
use meshmark_core::key::{SecretKey, read_text};
use meshmark_marking::exposure;
use meshmark_verification::verify::{NamedRecord, ReadRecord};
use serde_json::Value;
use std::{
    io::{self, Read},
    path::{Path, PathBuf},
};
use zeroize::Zeroizing;

/// A deposit has 140 bytes for each record; a mistaken /dev/zero has no end.
const MOST_BYTES: u64 = 1 << 30;

/// Reads a key file; `warn` receives a warning if others can read it too.
pub fn key(path: &Path, passphrase: &Passphrase, warn: &mut dyn FnMut(&str)) -> Result<SecretKey> {
    let (text, exposed) = secret_and_exposure("key", path)?;
    let text = passphrase.open(path, text)?;
    let key = SecretKey::from_json(&text).map_err(|source| Error::Malformed { path: path.into(), source })?;
    exposed.iter().for_each(|text| warn(text));
    Ok(key)
}

/// Reads the text of a file that holds a secret; `warn` receives a warning if others can read it too.
pub fn secret(
    what: &'static str,
    path: &Path,
    passphrase: &Passphrase,
    warn: &mut dyn FnMut(&str),
) -> Result<Zeroizing<String>> {
    let (text, exposed) = secret_and_exposure(what, path)?;
    exposed.iter().for_each(|text| warn(text));
    passphrase.open(path, text)
}

fn secret_and_exposure(what: &'static str, path: &Path) -> Result<(Zeroizing<String>, Option<String>)> {
    let unread = |source| Error::TextUnread { what, path: path.into(), source };
    let file = plain::open(path).map_err(unread)?;
    let exposed = exposure(path, &file);
    Ok((read_text(file).map_err(unread)?, exposed))
}

/// Reads a short text.
pub fn small(what: &'static str, path: &Path) -> Result<Zeroizing<String>> {
    text(path).map_err(|source| Error::TextUnread { what, path: path.into(), source })
}

/// Reads a file as bytes.
pub fn bytes(what: &'static str, path: &Path) -> Result<Vec<u8>> {
    let read = || {
        let mut bytes = Vec::new();
        let file = plain::open(path)?;
        match file.take(MOST_BYTES + 1).read_to_end(&mut bytes)? as u64 {
            0..=MOST_BYTES => Ok(bytes),
            _ => Err(io::Error::other(format!("it is longer than {MOST_BYTES} bytes"))),
        }
    };
    read().map_err(|source| Error::TextUnread { what, path: path.into(), source })
}

/// Reads a record of either version.
pub fn record(path: &Path) -> Result<ReadRecord> {
    parsed_record(path).map_err(|bad| of_record(path, bad))
}

fn of_record(path: &Path, bad: BadRecord) -> Error {
    match bad {
        BadRecord::Unread(source) => Error::TextUnread { what: "record", path: path.into(), source },
        BadRecord::Malformed(source) => Error::Malformed { path: path.into(), source },
    }
}

/// The reason why a file is not a record.
#[derive(Debug, thiserror::Error)]
enum BadRecord {
    #[error("it cannot be read: {0}")]
    Unread(io::Error),
    #[error("{0}")]
    Malformed(meshmark_core::Error),
}

/// Reads what may be records in a folder (*.json), in the order of their names.
///
/// # Errors
/// Fails when the folder cannot be read.
pub fn named_records(folder: &Path) -> Result<Vec<NamedRecord>> {
    let read = |path: PathBuf| NamedRecord {
        name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        read: parsed_record(&path).map_err(|bad| bad.to_string()),
    };
    Ok(possible_records(folder)?.into_iter().map(read).collect())
}

/// Reads a record of many; the caller adds its name to errors.
fn parsed_record(path: &Path) -> std::result::Result<ReadRecord, BadRecord> {
    parsed(&text(path).map_err(BadRecord::Unread)?)
}

fn parsed(text: &str) -> std::result::Result<ReadRecord, BadRecord> {
    ReadRecord::parse(text).map_err(BadRecord::Malformed)
}

/// Returns the files of a folder that may be records (*.json), in the order of their names.
pub(crate) fn possible_records(folder: &Path) -> Result<Vec<PathBuf>> {
    let unreadable = |error: io::Error| Error::FolderUnread { path: folder.into(), source: error };
    let mut files = Vec::new();
    for entry in folder.read_dir().map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        // A link to nothing and a pipe cannot be read, and whoever wants all records has to know.
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) && !path.is_dir() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// A record of a folder, with its path, or the error of a file that cannot be read or is a malformed record.
pub type OneRecord = Result<(PathBuf, ReadRecord)>;

/// Reads all records of a folder. `warn` receives the names of files that are no records, among which
/// a record that was damaged is none.
///
/// # Errors
/// Fails on an unreadable file, and on a record that is malformed.
pub fn records(folder: &Path, warn: &mut dyn FnMut(&str)) -> Result<Vec<(PathBuf, ReadRecord)>> {
    each_record(folder, warn)?.into_iter().collect()
}

/// Reads the records of a folder, each by itself. `warn` is as in [`records`].
///
/// # Errors
/// Fails when the folder cannot be read.
pub fn each_record(folder: &Path, warn: &mut dyn FnMut(&str)) -> Result<Vec<OneRecord>> {
    let mut records = Vec::new();
    for path in possible_records(folder)? {
        let text = match small("record", &path) {
            Ok(text) => text,
            Err(unread) => {
                records.push(Err(unread));
                continue;
            }
        };
        match parsed(&text) {
            Ok(read) => records.push(Ok((path, read))),
            Err(bad) if claims_to_be_record(&text) => records.push(Err(of_record(&path, bad))),
            Err(_) => warn(&format!("{} is no record, and is left out", path.display())),
        }
    }
    Ok(records)
}

/// Returns whether a text calls itself a record, or is so damaged that nobody can say: no JSON at all.
fn claims_to_be_record(text: &str) -> bool {
    serde_json::from_str::<Value>(text).map_or(true, |value| value.get("meshmark_record").is_some())
}

fn text(path: &Path) -> io::Result<Zeroizing<String>> {
    plain::open(path).and_then(read_text)
}
