//! Secret keys.

use crate::errors::KeyFileError;
use meshmark_core::key::{SecretKey, read_text};
use pyo3::{
    exceptions::{PyOSError, PyUserWarning},
    prelude::*,
};
use std::{
    fs::File,
    io::{self, Write},
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// A secret key. It marks maps and recognises the marks; whoever has it can remove and forge them.
#[pyclass(module = "meshmark", frozen)]
pub struct Key(pub SecretKey);

#[pymethods]
impl Key {
    /// Make a new key of the operating system's random bytes.
    #[staticmethod]
    fn generate() -> PyResult<Self> {
        let key = SecretKey::filled(getrandom::fill);
        key.map(Key).map_err(|error| PyOSError::new_err(format!("the system has no random bytes: {error}")))
    }

    /// Read a key file, that of `meshmark keygen` or of `write`.
    #[staticmethod]
    fn read(py: Python, path: PathBuf) -> PyResult<Self> {
        let file = File::open(&path).map_err(|error| of_file(&path, error))?;
        warn_if_exposed(py, &path, &file)?;
        let text = read_text(file).map_err(|error| of_file(&path, error))?;
        let key = SecretKey::from_json(&text);
        key.map(Key).map_err(|error| KeyFileError::new_err(format!("{}: {error}", path.display())))
    }

    /// Write the key to a new file that its owner alone can read.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let write = || {
            // A temporary file has these rights, and appears under its name when it is complete.
            let mut file = NamedTempFile::new_in(folder.unwrap_or(Path::new(".")))?;
            file.write_all(self.0.to_json().as_bytes())?;
            file.as_file().sync_all()?;
            file.persist_noclobber(&path)?;
            Ok(())
        };
        write().map_err(|error| of_file(&path, error))
    }

    /// The public id, 16 hexadecimal digits.
    #[getter]
    fn id(&self) -> String {
        self.0.id()
    }

    fn __repr__(&self) -> String {
        format!("<meshmark.Key {}>", self.0.id())
    }
}

/// Warns of a key file that others can read.
fn warn_if_exposed(py: Python, path: &Path, file: &File) -> PyResult<()> {
    #[cfg(unix)]
    if let Some(text) = meshmark_marking::exposure(path, file) {
        let text = std::ffi::CString::new(text).expect("a path has no null character");
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    #[cfg(not(unix))]
    let _ = (py, path, file);
    Ok(())
}

/// Returns the exception of a file, of the class that Python has for it.
pub fn of_file(path: &Path, error: io::Error) -> PyErr {
    match error.raw_os_error() {
        Some(code) => PyOSError::new_err((code, error.to_string(), path.display().to_string())),
        None => KeyFileError::new_err(format!("{}: {error}", path.display())),
    }
}
