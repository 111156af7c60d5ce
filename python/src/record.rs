//! The record of a marking.

use crate::{errors::RecordError, key::of_file};
use meshmark_core::{key::read_text, recorded::Recorded};
use pyo3::prelude::*;
use std::{fs::File, path::PathBuf};

/// The record of a marking, which an auditor needs besides the key and the reference.
#[pyclass(module = "meshmark", frozen)]
pub struct Record(pub Recorded);

#[pymethods]
impl Record {
    /// Read a record.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let text = File::open(&path).and_then(read_text).map_err(|error| of_file(&path, error))?;
        let recorded = Recorded::from_json(&text);
        recorded.map(Record).map_err(|error| RecordError::new_err(format!("{}: {error}", path.display())))
    }

    /// Return the text of the record, that of the driver and the command.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// Return the record with the SHA-256 digests, hexadecimal, of the file of the reference and of that of
    /// the copy, as the driver adds them to the record of a fingerprint; that of a message has none.
    #[pyo3(signature = (reference, copy=None))]
    fn with_file_digests(&self, reference: String, copy: Option<String>) -> Self {
        let mut recorded = self.0.clone();
        if let Recorded::Fingerprint(record) = &mut recorded {
            record.reference.file_sha256 = Some(reference);
            record.copy.file_sha256 = copy;
        }
        Record(recorded)
    }

    /// The recipient; None for a message.
    #[getter]
    fn recipient(&self) -> Option<&str> {
        match &self.0 {
            Recorded::Message(record) => record.recipient.as_deref(),
            Recorded::Fingerprint(record) => Some(&record.recipient),
        }
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}
