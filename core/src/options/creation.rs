//! The further options of a driver that writes.

use super::{
    table::{CREATION_OPTIONS, Kind},
    values::Values,
};
use crate::{Error, Result};

/// Where and how the marked map is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Creation {
    /// Path of the unmarked map to write.
    pub reference_path: String,
    /// GDAL's short name of the format, when it is not to follow from the file name.
    pub format: Option<String>,
    /// Whether a file that exists is replaced.
    pub overwrite: bool,
}

impl Creation {
    /// Parses the rows of [`CREATION_OPTIONS`].
    ///
    /// # Errors
    /// Fails on an unknown name, a name given twice, an illegal value, and a missing REFERENCE.
    pub fn parse<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self> {
        let values = Values::collect(CREATION_OPTIONS, pairs)?;
        let reference_path = values.text("REFERENCE")?.ok_or(Error::NoReference)?;
        let overwrite = match values.given("OVERWRITE") {
            None => false,
            Some(word) if word.eq_ignore_ascii_case("YES") => true,
            Some(word) if word.eq_ignore_ascii_case("NO") => false,
            Some(word) => {
                let kind = Kind::Choice(&["NO", "YES"]);
                return Err(Error::IllegalValue { option: "OVERWRITE", value: word.into(), kind });
            }
        };
        Ok(Creation { reference_path, format: values.text("FORMAT")?, overwrite })
    }

    /// Returns whether an option is one of [`CREATION_OPTIONS`].
    pub fn has(name: &str) -> bool {
        CREATION_OPTIONS.iter().any(|o| o.name.eq_ignore_ascii_case(name))
    }
}
