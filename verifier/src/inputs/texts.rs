//! Files of keys and records.

use crate::{Error, Result};
use meshmark_core::{
    key::{SecretKey, read_text},
    recorded::Recorded,
};
use meshmark_dataset::exposure;
use std::{fs::File, io, path::Path};
use zeroize::Zeroizing;

/// Reads a key file; `warn` receives a warning if others can read it too.
pub fn key(path: &Path, warn: &mut dyn FnMut(&str)) -> Result<SecretKey> {
    let unread = |source| Error::TextUnread { what: "key", path: path.into(), source };
    let file = File::open(path).map_err(unread)?;
    let exposed = exposure(path, &file);
    let text = read_text(file).map_err(unread)?;
    let key = SecretKey::from_json(&text).map_err(|source| Error::Malformed { path: path.into(), source })?;
    exposed.iter().for_each(|text| warn(text));
    Ok(key)
}

/// Reads a record of either version.
pub fn record(path: &Path) -> Result<Recorded> {
    parsed_record(path).map_err(|bad| match bad {
        BadRecord::Unread(source) => Error::TextUnread { what: "record", path: path.into(), source },
        BadRecord::Malformed(source) => Error::Malformed { path: path.into(), source },
    })
}

/// The reason why a file is not a record.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BadRecord {
    #[error("it cannot be read: {0}")]
    Unread(io::Error),
    #[error("{0}")]
    Malformed(meshmark_core::Error),
}

/// Reads a record of many; the caller adds its name to errors.
pub(crate) fn parsed_record(path: &Path) -> std::result::Result<Recorded, BadRecord> {
    Recorded::from_json(&text(path).map_err(BadRecord::Unread)?).map_err(BadRecord::Malformed)
}

fn text(path: &Path) -> io::Result<Zeroizing<String>> {
    File::open(path).and_then(read_text)
}
