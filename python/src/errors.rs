//! The exceptions, with the sentences of the driver and the command.

use meshmark_core::options::Spelling;
use meshmark_marking as marking;
use meshmark_verification as verification;
use pyo3::{create_exception, exceptions::PyValueError, prelude::*};
use std::fmt;

create_exception!(meshmark, MeshmarkError, PyValueError, "The base of all exceptions of meshmark.");
create_exception!(meshmark, OptionError, MeshmarkError, "An option has a value that is not legal.");
create_exception!(meshmark, KeyFileError, MeshmarkError, "A key file cannot be read.");
create_exception!(
    meshmark,
    RecordError,
    MeshmarkError,
    "A record cannot be read, or does not belong to a key or a reference."
);
create_exception!(meshmark, MapError, MeshmarkError, "A map cannot be marked or compared.");

/// Adds the exceptions to the module.
pub fn add(module: &Bound<PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("MeshmarkError", py.get_type::<MeshmarkError>())?;
    module.add("OptionError", py.get_type::<OptionError>())?;
    module.add("KeyFileError", py.get_type::<KeyFileError>())?;
    module.add("RecordError", py.get_type::<RecordError>())?;
    module.add("MapError", py.get_type::<MapError>())
}

/// Returns the exception of options that are not legal.
pub fn of_options(error: meshmark_core::Error) -> PyErr {
    OptionError::new_err(error.text(Spelling::Keyword))
}

/// Returns the exception of a map that cannot be marked.
pub fn of_map(error: impl Into<marking::Error>) -> PyErr {
    let error = error.into();
    let text = error.text(Spelling::Keyword);
    match error {
        marking::Error::UnknownSrs(_) => OptionError::new_err(text),
        _ => MapError::new_err(text),
    }
}

/// The error of maps that are verified.
pub enum VerificationError {
    /// What does not belong together.
    Verification(verification::Error),
    /// A map of this name, or one that is missing.
    Map { name: Option<String>, source: marking::Error },
    /// A map that cannot be compared, for this reason, with the remedy.
    Uncompared { name: String, reason: &'static str },
}

impl From<verification::Error> for VerificationError {
    fn from(error: verification::Error) -> Self {
        VerificationError::Verification(error)
    }
}

impl From<marking::Error> for VerificationError {
    fn from(source: marking::Error) -> Self {
        VerificationError::Map { name: None, source }
    }
}

impl fmt::Display for VerificationError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            VerificationError::Verification(error) => f.write_str(&error.text(Spelling::Keyword)),
            VerificationError::Map { name: None, source } => f.write_str(&source.text(Spelling::Keyword)),
            VerificationError::Uncompared { name, reason } => write!(f, "{name}: {reason}"),
            VerificationError::Map { name: Some(name), source } => {
                write!(f, "{name}: {}", source.text(Spelling::Keyword))
            }
        }
    }
}

impl From<VerificationError> for PyErr {
    fn from(error: VerificationError) -> Self {
        use verification::Error::{Contradiction, Core, NoRecord, PaperOfFingerprint, SeveralReferences};
        let text = error.to_string();
        match error {
            VerificationError::Map { source: marking::Error::UnknownSrs(_), .. } => {
                OptionError::new_err(text)
            }
            VerificationError::Map { source: marking::Error::LostBase { .. }, .. } => {
                RecordError::new_err(text)
            }
            VerificationError::Map { .. } | VerificationError::Uncompared { .. } => MapError::new_err(text),
            VerificationError::Verification(error) => match error {
                Core(_) | Contradiction { .. } | PaperOfFingerprint | SeveralReferences => {
                    OptionError::new_err(text)
                }
                NoRecord => RecordError::new_err(text),
                error if error.is_of_others() => RecordError::new_err(text),
                _ => MapError::new_err(text),
            },
        }
    }
}
