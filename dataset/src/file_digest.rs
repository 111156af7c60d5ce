//! Digests of files.

use meshmark_core::hex;
use sha2::{Digest, Sha256};
use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// Returns the SHA-256 of a file, 64 hexadecimal digits.
///
/// # Errors
/// Fails when the file cannot be read to its end.
pub fn file_digest(path: &Path) -> io::Result<String> {
    let (mut file, mut hash) = (File::open(path)?, Sha256::new());
    let mut buffer = vec![0; 1 << 20];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(hex::encode(&hash.finalize())),
            count => hash.update(&buffer[..count]),
        }
    }
}

/// Returns the SHA-256 of the only file of a folder; `None` where it holds more than one.
///
/// # Errors
/// Fails when the folder or the file cannot be read to its end.
pub fn digest_of_only_file(folder: &Path) -> io::Result<Option<String>> {
    let entries: Vec<_> = folder.read_dir()?.collect::<io::Result<_>>()?;
    match entries.as_slice() {
        [entry] if entry.path().is_file() => file_digest(&entry.path()).map(Some),
        _ => Ok(None),
    }
}
