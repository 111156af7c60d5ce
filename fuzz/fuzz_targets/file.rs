//! A file with the bytes of an input, for functions that read files.

use std::{fs, path::Path, sync::OnceLock};
use tempfile::TempDir;

/// Returns the folder of the files of a target.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder for temporary files")).path()
}

/// Writes a file of this name, calls `f` with its path, and removes it.
pub fn with<T>(name: &str, bytes: &[u8], f: impl FnOnce(&Path) -> T) -> T {
    let path = folder().join(name);
    fs::write(&path, bytes).expect("a temporary file");
    let result = f(&path);
    fs::remove_file(&path).expect("the file that was written");
    result
}
