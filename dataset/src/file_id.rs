//! Whether two paths lead to one file.

use std::{
    fs::{self, Metadata},
    os::unix::fs::MetadataExt,
    path::Path,
};

/// What a file is, whatever its names.
#[derive(PartialEq, Clone, Copy)]
pub struct FileId {
    device: u64,
    inode: u64,
}

impl FileId {
    /// The file at a path, if there is one.
    pub fn at(path: &Path) -> Option<Self> {
        fs::metadata(path).ok().map(|metadata| FileId::of_metadata(&metadata))
    }

    /// The file these metadata are of.
    pub fn of_metadata(metadata: &Metadata) -> Self {
        FileId { device: metadata.dev(), inode: metadata.ino() }
    }
}

/// Whether both paths lead to one file that exists.
pub fn same_file(a: &Path, b: &Path) -> bool {
    FileId::at(a).is_some_and(|id| FileId::at(b) == Some(id))
}
