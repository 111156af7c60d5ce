//! The files a marked dataset is read from: nobody may write to them meanwhile, least of all us.

use crate::error::{Error, Result};
use std::{
    fs::{self, Metadata},
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

/// What SQLite puts beside a database that is being written.
const SIDECARS: [&str; 2] = ["-journal", "-wal"];

/// Every open source of this process, for [`is_being_read`].
static OPEN: Mutex<Vec<OpenSource>> = Mutex::new(Vec::new());
static NEXT_NUMBER: AtomicU64 = AtomicU64::new(0);

struct OpenSource {
    number: u64,
    files: Vec<FileId>,
    /// The folders of a dataset of several files: GDAL can open the folder in its place.
    folders: Vec<FileId>,
}

/// The files of one dataset.
pub struct SourceFiles {
    number: u64,
    files: Vec<Watched>,
}

struct Watched {
    path: PathBuf,
    state: State,
    sidecars: [u64; 2],
}

#[derive(PartialEq, Clone, Copy)]
struct FileId {
    device: u64,
    inode: u64,
}

/// Another state is another content.
#[derive(PartialEq)]
struct State {
    id: FileId,
    length: u64,
    modified: (i64, i64),
}

impl SourceFiles {
    /// Watches those of `paths` that are files of the local file system.
    pub fn watch(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        let files: Vec<Watched> = paths.into_iter().filter_map(Watched::new).collect();
        let number = NEXT_NUMBER.fetch_add(1, Ordering::Relaxed);
        let folders = match files.len() {
            0 | 1 => Vec::new(),
            _ => files.iter().filter_map(|file| FileId::of(file.path.parent()?)).collect(),
        };
        open_sources().push(OpenSource {
            number,
            files: files.iter().map(|file| file.state.id).collect(),
            folders,
        });
        SourceFiles { number, files }
    }

    /// Whether `path` is one of the files, by any name.
    pub fn contain(&self, path: &Path) -> bool {
        FileId::of(path).is_some_and(|id| self.files.iter().any(|file| file.state.id == id))
    }

    /// Fails when a file is not what it was, or when a transaction on it is under way.
    pub fn check(&self) -> Result<()> {
        match self.files.iter().find(|file| !file.is_unchanged()) {
            Some(file) => Err(Error::SourceChanged { path: file.path.display().to_string() }),
            None => Ok(()),
        }
    }
}

impl Drop for SourceFiles {
    fn drop(&mut self) {
        open_sources().retain(|source| source.number != self.number);
    }
}

impl Watched {
    fn new(path: PathBuf) -> Option<Self> {
        let metadata = fs::metadata(&path).ok().filter(Metadata::is_file)?;
        Some(Watched { sidecars: sidecar_lengths(&path), path, state: State::of(&metadata) })
    }

    fn is_unchanged(&self) -> bool {
        let same = fs::metadata(&self.path).is_ok_and(|metadata| State::of(&metadata) == self.state);
        // They may go (another reader closed last) but not grow (a writer is at work).
        same && sidecar_lengths(&self.path).iter().zip(&self.sidecars).all(|(now, then)| now <= then)
    }
}

impl FileId {
    fn of(path: &Path) -> Option<Self> {
        fs::metadata(path).ok().map(|metadata| State::of(&metadata).id)
    }
}

impl State {
    fn of(metadata: &Metadata) -> Self {
        State {
            id: FileId { device: metadata.dev(), inode: metadata.ino() },
            length: metadata.len(),
            modified: (metadata.mtime(), metadata.mtime_nsec()),
        }
    }
}

/// Whether both paths lead to one file that exists.
pub fn same_file(a: &Path, b: &Path) -> bool {
    FileId::of(a).is_some_and(|id| FileId::of(b) == Some(id))
}

/// Whether writing to `path` would destroy the source of a marked dataset that is open in this process.
pub fn is_being_read(path: &Path) -> bool {
    let sources = open_sources();
    if sources.is_empty() {
        return false;
    }
    let Some(id) = FileId::of(path) else { return false };
    sources.iter().any(|source| source.files.contains(&id) || source.folders.contains(&id))
}

fn sidecar_lengths(path: &Path) -> [u64; 2] {
    SIDECARS.map(|suffix| {
        let mut sidecar = path.as_os_str().to_owned();
        sidecar.push(suffix);
        fs::metadata(sidecar).map_or(0, |metadata| metadata.len())
    })
}

fn open_sources() -> MutexGuard<'static, Vec<OpenSource>> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}
