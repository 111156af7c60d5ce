//! The exceptions, with the sentences of the driver and the command.

use meshmark_core::options::Spelling;
use pyo3::{create_exception, exceptions::PyValueError, prelude::*};

create_exception!(meshmark, MeshmarkError, PyValueError, "The base of all exceptions of meshmark.");
create_exception!(meshmark, OptionError, MeshmarkError, "An option has a value that is not legal.");
create_exception!(meshmark, KeyFileError, MeshmarkError, "A key file cannot be read.");
create_exception!(meshmark, RecordError, MeshmarkError, "A record cannot be read.");
create_exception!(meshmark, MapError, MeshmarkError, "A map cannot be marked.");

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
pub fn of_map(error: impl Into<meshmark_marking::Error>) -> PyErr {
    MapError::new_err(error.into().text(Spelling::Keyword))
}
