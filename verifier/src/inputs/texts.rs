//! Keys and records.

use crate::{Error, Result};
use meshmark_core::{key::SecretKey, record::Record};
use std::{io::Read, path::Path};

/// Keys and records are a few hundred bytes; a mistaken /dev/zero has no end.
const LONGEST_TEXT: u64 = 1 << 20;

/// Reads a key file.
pub fn key(path: &Path) -> Result<SecretKey> {
    let text = zeroize::Zeroizing::new(text("key", path)?);
    SecretKey::from_json(&text).map_err(|error| Error::Usage(format!("{}: {error}", path.display())))
}

/// Reads a record.
pub fn record(path: &Path) -> Result<Record> {
    Record::from_json(&text("record", path)?)
        .map_err(|error| Error::Usage(format!("{}: {error}", path.display())))
}

fn text(what: &str, path: &Path) -> Result<String> {
    let unreadable =
        |reason: String| Error::Usage(format!("the {what} {} cannot be read: {reason}", path.display()));
    let file = std::fs::File::open(path).map_err(|error| unreadable(error.to_string()))?;
    let mut text = String::new();
    let mut longest = file.take(LONGEST_TEXT + 1);
    longest.read_to_string(&mut text).map_err(|error| unreadable(error.to_string()))?;
    match text.len() as u64 {
        0..=LONGEST_TEXT => Ok(text),
        _ => Err(unreadable(format!("it is longer than the {LONGEST_TEXT} bytes of any key or record"))),
    }
}
