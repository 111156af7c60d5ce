//! The private copy of a suspect, or of a reference with logs. GDAL and SQLite write to what they read, also when they only read:
//! a log is merged into its database and deleted, a lost index is made anew. They therefore never
//! see the suspect itself, which stays as it was.

use super::belonging_files::{BelongingFile, files_of, with_ending};
use crate::{Error, Result};
use meshmark_dataset::workplace::Workplace;
use std::{
    env, fs, io,
    path::{Component, Path, PathBuf},
    sync::Arc,
};

/// Tiles are named by their folders: zoom, column, row.
const NAMED_BY: usize = 3;

/// The part of the folder that only holds the copy.
const SUBFOLDER: &str = "suspect";

/// A suspect and the copy of it that is examined.
#[derive(Clone)]
pub struct PrivateCopy {
    original: PathBuf,
    copy: PathBuf,
    folder: PathBuf,
    /// The owner of the folder removes it.
    _workplace: Option<Arc<Workplace>>,
}

impl PrivateCopy {
    /// Copies a file with all that belongs to it, or a folder, into the folder of temporary files.
    ///
    /// # Errors
    /// Fails for what is neither a file nor a folder, and where it cannot be read or copied.
    pub fn make(what: &'static str, original: &Path) -> Result<Self> {
        if !original.is_file() && !original.is_dir() {
            return Err(Error::NoFile { path: original.into() });
        }
        let unread = |source: io::Error| Error::Undigested { path: original.into(), source };
        let place = env::temp_dir();
        let uncopied =
            |source: io::Error| Error::Uncopied { what, path: original.into(), place: place.clone(), source };
        let workplace = Workplace::new(&place)?;
        let files = files_of(original).map_err(unread)?;
        workplace.subfolder(SUBFOLDER)?;
        let copied = Self::made_in(workplace.folder(), original)?;
        let copy = &copied.copy;
        let folder = match original.is_dir() {
            true => copy,
            false => copy.parent().expect("a file is in a folder"),
        };
        fs::create_dir_all(folder).map_err(uncopied)?;
        for BelongingFile { name, path } in files {
            let target = folder.join(name);
            fs::create_dir_all(target.parent().expect("a file is in a folder")).map_err(uncopied)?;
            let mut source = fs::File::open(&path).map_err(|source| Error::Undigested { path, source })?;
            let mut target = fs::File::create(target).map_err(uncopied)?;
            io::copy(&mut source, &mut target).map_err(uncopied)?;
        }
        Ok(PrivateCopy { _workplace: Some(Arc::new(workplace)), ..copied })
    }

    /// Returns the copy that another process has made in its folder, and removes.
    ///
    /// # Errors
    /// Fails when the original is no longer there.
    pub fn made_in(folder: &Path, original: &Path) -> Result<Self> {
        let full =
            original.canonicalize().map_err(|source| Error::Undigested { path: original.into(), source })?;
        let copy = folder.join(SUBFOLDER).join(last_names(&full, original));
        Ok(PrivateCopy { original: original.into(), copy, folder: folder.into(), _workplace: None })
    }

    /// Returns the folder of the copy, to which its examination may write.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the path of the suspect, for messages.
    pub fn original(&self) -> &Path {
        &self.original
    }

    /// Returns the path of the copy, for reading.
    pub fn copy(&self) -> &Path {
        &self.copy
    }

    /// Returns the path of the log of a database, which need not exist.
    pub(super) fn copy_of_log(&self, ending: &str) -> PathBuf {
        with_ending(&self.copy, ending)
    }

    /// Returns the path of the suspect's own file for one of the copy.
    pub fn original_of(&self, copied: &Path) -> PathBuf {
        match copied.strip_prefix(&self.copy) {
            Ok(rest) if !rest.as_os_str().is_empty() => self.original.join(rest),
            _ => self.original.clone(),
        }
    }
}

/// Returns the last names of a full path, of which the very last is that of the path as it was given.
fn last_names(full: &Path, given: &Path) -> PathBuf {
    let names: Vec<&std::ffi::OsStr> = full
        .components()
        .filter_map(|component| match component {
            Component::Normal(name) => Some(name),
            _ => None,
        })
        .collect();
    let mut path: PathBuf = names[names.len().saturating_sub(NAMED_BY)..].iter().collect();
    if let Some(name) = given.file_name() {
        path.set_file_name(name);
    }
    path
}
