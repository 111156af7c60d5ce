//! The identity of files, by which two paths to one file are recognised.

use std::{
    fs::{self, Metadata},
    os::unix::fs::MetadataExt,
    path::Path,
};

/// The identity of a file, whatever its names.
#[derive(PartialEq, Clone, Copy)]
pub struct FileId {
    device: u64,
    inode: u64,
}

impl FileId {
    /// Returns the identity of the file at a path, if there is one.
    pub fn at(path: &Path) -> Option<Self> {
        fs::metadata(path).ok().map(|metadata| FileId::of_metadata(&metadata))
    }

    /// Returns the identity of the file with these metadata.
    pub fn of_metadata(metadata: &Metadata) -> Self {
        FileId { device: metadata.dev(), inode: metadata.ino() }
    }
}

/// Returns whether both paths lead to one file that exists.
pub fn same_file(a: &Path, b: &Path) -> bool {
    FileId::at(a).is_some_and(|id| FileId::at(b) == Some(id))
}
