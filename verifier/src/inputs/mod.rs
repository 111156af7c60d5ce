//! Inputs: maps, suspects, keys and records, read with errors that name the file, and the digests
//! of the files.

pub mod digests;
pub mod gdal_failures;
pub mod maps;
pub mod suspects;
pub mod texts;
