//! The record as a file, which is written whole or not at all, and never over another one.

use crate::error::{Error, RecordFault, Result};
use meshmark_dataset::workplace::folder_of;
use std::{
    fs::{self, Permissions},
    io::{self, ErrorKind, Write},
    os::unix::fs::PermissionsExt,
    path::Path,
};

/// Checks, before the mark is computed, that a record can be written to this path.
pub fn check_folder(path: &Path) -> Result<()> {
    match folder_of(path) {
        folder if !folder.is_dir() => Err(unwritable(path, RecordFault::NoFolder(folder.into()))),
        _ if path.is_dir() => Err(unwritable(path, RecordFault::IsFolder)),
        _ => Ok(()),
    }
}

fn unwritable(path: &Path, source: RecordFault) -> Error {
    Error::RecordUnwritable { path: path.display().to_string(), source }
}

/// Writes the record. An existing file with the same content is accepted, as hosts open a map more
/// than once.
pub fn write(path: &Path, text: &str) -> Result<()> {
    let failed = |error: io::Error| unwritable(path, error.into());
    if is_same(path, text)? {
        return Ok(());
    }
    let mut file = tempfile::Builder::new()
        .prefix(".meshmark-record-")
        .permissions(Permissions::from_mode(0o666)) // less the process's umask, as for any file
        .tempfile_in(folder_of(path))
        .map_err(failed)?;
    file.write_all(text.as_bytes()).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    match file.persist_noclobber(path) {
        Ok(_) => Ok(()),
        Err(persist) if persist.error.kind() == ErrorKind::AlreadyExists => match is_same(path, text)? {
            true => Ok(()),
            false => Err(unwritable(path, RecordFault::DanglingLink)),
        },
        Err(persist) => Err(failed(persist.error)),
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
