//! A file that does not exist yet. It is written completely or not at all, and never replaces
//! another file.

use crate::{Error, Result};
use meshmark_dataset::workplace::folder_of;
use std::{
    fs,
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// A file that is to be written.
pub struct NewFile {
    /// What it is, for messages: "report".
    what: &'static str,
    path: PathBuf,
    /// Its rights, of which the umask of the process takes some away.
    mode: u32,
}

/// The rights of a file that anyone may read, and of one that holds a secret.
const OF_ALL: u32 = 0o666;
const OF_OWNER: u32 = 0o600;

impl NewFile {
    /// Checks, before the work starts, that the file can be written.
    ///
    /// # Errors
    /// Fails on a file that exists, and on a folder that is missing or not writable.
    pub fn new(what: &'static str, path: &Path) -> Result<Self> {
        NewFile { what, path: path.into(), mode: OF_ALL }.checked()
    }

    /// Checks the same for a file that only its owner may read.
    ///
    /// # Errors
    /// Fails as [`NewFile::new`] does.
    pub fn secret(what: &'static str, path: &Path) -> Result<Self> {
        NewFile { what, path: path.into(), mode: OF_OWNER }.checked()
    }

    fn checked(self) -> Result<Self> {
        let NewFile { what, path, .. } = &self;
        let refused = |reason: String| Err(Error::OutputName { what, path: path.clone(), reason });
        if path.symlink_metadata().is_ok() {
            return refused(format!("exists, and a {what} is never overwritten: name another file"));
        }
        if !folder_of(path).is_dir() {
            let folder = folder_of(path).display();
            return refused(format!("cannot be written: {folder} is no folder, make it first"));
        }
        self.temporary()?; // checks that the folder is writable
        Ok(self)
    }

    /// Returns the path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file.
    ///
    /// # Errors
    /// Fails when the disk or the folder does not accept the file, and when the file exists by now.
    pub fn write(&self, bytes: &[u8]) -> Result<()> {
        let failed = |error| self.failed(error);
        let mut file = self.temporary()?;
        file.write_all(bytes).map_err(|error| failed(without_path(error)))?;
        file.as_file().sync_all().map_err(failed)?;
        file.persist_noclobber(&self.path).map_err(|error| failed(error.error))?;
        Ok(())
    }

    /// Writes files that belong together: all of them, or none.
    ///
    /// # Errors
    /// Fails as [`NewFile::write`] does.
    pub fn write_all(files: &[(NewFile, &[u8])]) -> Result<()> {
        for (number, (file, bytes)) in files.iter().enumerate() {
            if let Err(error) = file.write(bytes) {
                files[..number].iter().for_each(|(written, _)| drop(fs::remove_file(&written.path)));
                return Err(error);
            }
        }
        Ok(())
    }

    fn temporary(&self) -> Result<NamedTempFile> {
        let mut options = tempfile::Builder::new();
        options.prefix(".meshmark-new-");
        #[cfg(unix)]
        options.permissions(std::os::unix::fs::PermissionsExt::from_mode(self.mode));
        options.tempfile_in(folder_of(&self.path)).map_err(|error| self.failed(without_path(error)))
    }

    fn failed(&self, error: io::Error) -> Error {
        let what = self.what;
        let remedy = match error.kind() {
            ErrorKind::AlreadyExists => format!(", and a {what} is never overwritten: name another file"),
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                ": make room, or name a file on another disk".into()
            }
            _ => ": name a file in a folder you may write to".into(),
        };
        let what = format!("the {what} {}", self.path.display());
        Error::Unwritten { what, source: Box::new(error.into()), remedy }
    }
}

/// Removes the path of the temporary file from an error, as it does not help the reader.
fn without_path(error: io::Error) -> io::Error {
    error.kind().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_cannot_be_written_to_is_told_before_the_work() {
        let refused = NewFile::new("report", Path::new("/proc/report.html")).err().unwrap();
        assert!(refused.to_string().contains("cannot be written"), "{refused}");
    }

    #[test]
    fn a_file_is_written_once_and_never_over_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Bericht für ACME.HTML");
        let file = NewFile::new("report", &path).unwrap();
        file.write(b"one").unwrap();
        assert!(file.write(b"two").is_err() && NewFile::new("report", &path).is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "one");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary is left");
    }

    #[test]
    fn files_that_belong_together_are_written_together_and_secrets_for_their_owner() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
        let both = || {
            let secret = NewFile::secret("key file", &first).unwrap();
            [(secret, b"1".as_slice()), (NewFile::new("deposit", &second).unwrap(), b"2".as_slice())]
        };
        let late = both();
        fs::write(&second, "in the way").unwrap();
        assert!(NewFile::write_all(&late).is_err());
        assert!(!first.exists() && second.exists());
        fs::remove_file(&second).unwrap();
        NewFile::write_all(&both()).unwrap();
        let mode = fs::metadata(&first).unwrap().permissions().mode() & 0o777;
        assert_eq!((mode, second.exists()), (0o600, true));
    }
}
