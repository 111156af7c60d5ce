//! A report as a file: HTML for readers or JSON for programs.

use super::NewFile;
use crate::{Error, Result};
use std::path::Path;

/// The file of a report.
pub struct ReportFile {
    file: NewFile,
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

/// What the file is, in messages.
const REPORT: &str = "report";

impl ReportFile {
    /// Checks, before the comparison starts, that the file can be written.
    ///
    /// # Errors
    /// Fails on another extension than html and json, and as [`NewFile::new`] does.
    pub fn new(path: &Path) -> Result<Self> {
        let format = Self::format_of(path)?;
        Ok(ReportFile { file: NewFile::new(REPORT, path)?, format })
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
            _ => Err(Error::OutputName {
                what: REPORT,
                path: path.into(),
                reason: "ends neither in .html nor in .json: name a file that does".into(),
            }),
        }
    }

    /// Returns the format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Writes the report.
    ///
    /// # Errors
    /// Fails as [`NewFile::write`] does.
    pub fn write(&self, text: &str) -> Result<()> {
        self.file.write(text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_report_chooses_its_format() {
        let format = |name: &str| ReportFile::format_of(Path::new(name)).ok();
        assert_eq!(format("Bericht für ACME.HTML"), Some(Format::Html));
        assert_eq!(format("a.htm"), Some(Format::Html));
        assert_eq!(format("a.json"), Some(Format::Json));
        assert_eq!(format("a.pdf"), None);
    }
}
