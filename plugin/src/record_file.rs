//! The record as a file, which is written whole or not at all, and never over another one.

use crate::error::{Error, Result};
use meshmark_dataset::workplace::folder_of;
use std::{
    fs::{self, Permissions},
    io::{self, ErrorKind, Write},
    os::unix::fs::PermissionsExt,
    path::Path,
};

/// Checks, before the mark is computed, that a record can be written to this path.
pub fn check_folder(path: &Path) -> Result<()> {
    let reason = match folder_of(path) {
        folder if !folder.is_dir() => format!("{} is no folder", folder.display()),
        _ if path.is_dir() => "it is a folder".into(),
        _ => return Ok(()),
    };
    Err(Error::RecordUnwritable { path: path.display().to_string(), reason })
}

/// Writes the record. An existing file with the same content is accepted, as hosts open a map more
/// than once.
pub fn write(path: &Path, text: &str) -> Result<()> {
    let unwritable =
        |e: io::Error| Error::RecordUnwritable { path: path.display().to_string(), reason: e.to_string() };
    if is_same(path, text)? {
        return Ok(());
    }
    let mut file = tempfile::Builder::new()
        .prefix(".meshmark-record-")
        .permissions(Permissions::from_mode(0o666)) // less the process's umask, as for any file
        .tempfile_in(folder_of(path))
        .map_err(unwritable)?;
    file.write_all(text.as_bytes()).map_err(unwritable)?;
    file.as_file().sync_all().map_err(unwritable)?;
    match file.persist_noclobber(path) {
        Ok(_) => Ok(()),
        Err(failed) if failed.error.kind() == ErrorKind::AlreadyExists => match is_same(path, text)? {
            true => Ok(()),
            false => Err(unwritable(io::Error::other("it is a link to a file that does not exist"))),
        },
        Err(failed) => Err(unwritable(failed.error)),
    }
}

/// Returns whether the file exists with exactly this content; fails when it has another content.
fn is_same(path: &Path, text: &str) -> Result<bool> {
    match fs::read(path) {
        Ok(bytes) if bytes == text.as_bytes() => Ok(true),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        _ => Err(Error::RecordDiffers { path: path.display().to_string() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_written_once_and_never_over_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("record.json");
        write(&path, "one").unwrap();
        write(&path, "one").unwrap();
        assert!(matches!(write(&path, "two"), Err(Error::RecordDiffers { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), "one");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary is left");
    }

    #[test]
    fn a_record_without_a_folder_goes_into_the_current_one() {
        assert_eq!(folder_of(Path::new("record.json")), Path::new("."));
        assert!(check_folder(Path::new("record.json")).is_ok());
        assert!(check_folder(Path::new("no/such/folder/record.json")).is_err());
        assert!(check_folder(Path::new("/")).is_err());
    }
}
