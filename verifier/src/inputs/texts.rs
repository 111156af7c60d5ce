//! Keys and records.

use crate::{Error, Result};
use meshmark_core::{
    key::{SecretKey, read_text},
    record::Record,
};
use std::{fs::File, io, path::Path};
use zeroize::Zeroizing;

/// Reads a key file.
pub fn key(path: &Path) -> Result<SecretKey> {
    let text = text("key", path)?;
    SecretKey::from_json(&text).map_err(|error| Error::Usage(format!("{}: {error}", path.display())))
}

/// Reads a record.
pub fn record(path: &Path) -> Result<Record> {
    Record::from_json(&text("record", path)?)
        .map_err(|error| Error::Usage(format!("{}: {error}", path.display())))
}

fn text(what: &str, path: &Path) -> Result<Zeroizing<String>> {
    let unreadable =
        |error: io::Error| Error::Usage(format!("the {what} {} cannot be read: {error}", path.display()));
    File::open(path).and_then(read_text).map_err(unreadable)
}
