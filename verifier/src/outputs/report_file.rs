//! A report as a file: HTML for readers or JSON for programs. It is written completely or not at
//! all, and never replaces another file.

use crate::{Error, Result};
use meshmark_dataset::workplace::folder_of;
use std::{
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// The file of a report.
pub struct ReportFile {
    path: PathBuf,
    format: Format,
}

/// The format of a report file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// HTML, for readers.
    Html,
    /// JSON, for programs.
    Json,
}

impl ReportFile {
    /// Checks, before the comparison starts, that the file can be written.
    ///
    /// # Errors
    /// Fails on another extension than html and json, on a file that exists, and on a folder that
    /// is missing or not writable.
    pub fn new(path: &Path) -> Result<Self> {
        let format = Self::format_of(path)?;
        let refused = |reason: &str| Err(Error::ReportName { path: path.into(), reason: reason.into() });
        if path.symlink_metadata().is_ok() {
            return refused("exists, and a report is never overwritten: name another file");
        }
        if !folder_of(path).is_dir() {
            let folder = folder_of(path).display();
            return refused(&format!("cannot be written: {folder} is no folder, make it first"));
        }
        let file = ReportFile { path: path.into(), format };
        file.temporary()?; // checks that the folder is writable
        Ok(file)
    }

    /// Returns the format that the name of a file asks for.
    ///
    /// # Errors
    /// Fails on another extension than html and json.
    pub fn format_of(path: &Path) -> Result<Format> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("html" | "htm") => Ok(Format::Html),
            Some("json") => Ok(Format::Json),
            _ => Err(Error::ReportName {
                path: path.into(),
                reason: "ends neither in .html nor in .json: name a file that does".into(),
            }),
        }
    }

    /// Returns the format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Returns the path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the report.
    ///
    /// # Errors
    /// Fails when the disk or the folder does not accept the file, and when the file exists by now.
    pub fn write(&self, text: &str) -> Result<()> {
        let failed = |error| self.failed(error);
        let mut file = self.temporary()?;
        file.write_all(text.as_bytes()).map_err(|error| failed(without_path(error)))?;
        file.as_file().sync_all().map_err(failed)?;
        file.persist_noclobber(&self.path).map_err(|error| failed(error.error))?;
        Ok(())
    }

    fn temporary(&self) -> Result<NamedTempFile> {
        let mut options = tempfile::Builder::new();
        options.prefix(".meshmark-report-");
        #[cfg(unix)] // the umask of the process applies, as for any file
        options.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        options.tempfile_in(folder_of(&self.path)).map_err(|error| self.failed(without_path(error)))
    }

    fn failed(&self, error: std::io::Error) -> Error {
        let remedy = match error.kind() {
            ErrorKind::AlreadyExists => ", and a report is never overwritten: name another file",
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                ": make room, or name a file on another disk"
            }
            _ => ": name a file in a folder you may write to",
        };
        Error::Unwritten {
            what: format!("the report {}", self.path.display()),
            source: Box::new(error.into()),
            remedy,
        }
    }
}

/// Removes the path of the temporary file from an error, as it does not help the reader.
fn without_path(error: std::io::Error) -> std::io::Error {
    error.kind().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_cannot_be_written_to_is_told_before_the_work() {
        let refused = ReportFile::new(Path::new("/proc/report.html")).err().unwrap();
        assert!(refused.to_string().contains("cannot be written"), "{refused}");
    }

    #[test]
    fn a_report_is_written_once_and_never_over_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Bericht für ACME.HTML");
        let file = ReportFile::new(&path).unwrap();
        assert_eq!(file.format(), Format::Html);
        file.write("one").unwrap();
        assert!(file.write("two").is_err() && ReportFile::new(&path).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "one");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary is left");
    }
}
