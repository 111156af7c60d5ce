//! Inputs: maps, suspects, keys and records, read with errors that name the file, the digests of
//! the files, and the versions of the programs that read them.

mod belonging_files;
pub mod case_file;
pub mod digests;
pub mod gdal_failures;
mod journal;
pub mod map_files;
pub mod maps;
pub mod passphrase;
pub mod plain;
pub mod private_copy;
mod suspect_formats;
pub mod suspects;
mod svg;
mod tables;
pub mod texts;
pub mod unsuitable;
pub mod versions;

pub(crate) use belonging_files::size_of;
