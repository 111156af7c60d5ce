//! The files from which a marked dataset is read, which nobody may overwrite meanwhile.
//!
//! `ogr2ogr map.gpkg MESHMARK:map.gpkg` must not destroy the map. Before a writer of GDAL makes a
//! file, it deletes the file of that name, and before it appends, it opens that file for update;
//! the driver receives both calls and refuses them ([`is_being_read`]). Most writers then fail.
//! Some truncate the file all the same: for them it is copied first ([`save_copies`]).

use crate::error::{Error, Result};
use meshmark_dataset::{FileId, same_file, workplace::folder_of};
use std::{
    fs::{self, File, Metadata},
    io,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

/// Every open source of this process, for [`is_being_read`].
static OPEN: Mutex<Vec<OpenSource>> = Mutex::new(Vec::new());
static NEXT_NUMBER: AtomicU64 = AtomicU64::new(0);

struct OpenSource {
    number: u64,
    files: Vec<(PathBuf, FileId)>,
    /// The folders of a dataset of several files: GDAL can open the folder instead.
    folders: Vec<FileId>,
    copies: Vec<PathBuf>,
}

/// The files of one dataset.
pub struct SourceFiles {
    number: u64,
    files: Vec<Watched>,
}

struct Watched {
    path: PathBuf,
    state: FileState,
    sidecars: [u64; 2],
}

/// The state of a file. Another state means another content.
#[derive(PartialEq)]
struct FileState {
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
            _ => files.iter().filter_map(|file| FileId::at(file.path.parent()?)).collect(),
        };
        let ids = files.iter().map(|file| (file.path.clone(), file.state.id)).collect();
        open_sources().push(OpenSource { number, files: ids, folders, copies: Vec::new() });
        SourceFiles { number, files }
    }

    /// Returns whether `path` is one of the files, by any name.
    pub fn contain(&self, path: &Path) -> bool {
        FileId::at(path).is_some_and(|id| self.files.iter().any(|file| file.state.id == id))
    }

    /// Returns whether `path` is one of the files, or the folder of a dataset of several files.
    pub fn contain_or_lie_in(&self, path: &Path) -> bool {
        let several = self.files.len() > 1;
        let is_folder = |id| self.files.iter().any(|f| f.path.parent().and_then(FileId::at) == Some(id));
        self.contain(path) || several && FileId::at(path).is_some_and(is_folder)
    }

    /// Fails when a file has changed, or when a transaction on it is under way.
    pub fn check(&self) -> Result<()> {
        let Some(file) = self.files.iter().find(|file| !file.is_unchanged()) else { return Ok(()) };
        let path = file.path.display().to_string();
        let open = open_sources();
        let copies =
            open.iter().filter(|source| source.number == self.number).flat_map(|source| &source.copies);
        let copies: Vec<String> = copies.map(|copy| copy.display().to_string()).collect();
        match copies.is_empty() {
            true => Err(Error::SourceChanged { path }),
            false => Err(Error::SourceOverwritten { path, copies: copies.join(", ") }),
        }
    }
}

impl Drop for SourceFiles {
    fn drop(&mut self) {
        let unchanged = self.check().is_ok();
        let mut open = open_sources();
        let Some(at) = open.iter().position(|source| source.number == self.number) else { return };
        let copies = open.swap_remove(at).copies;
        if unchanged {
            // Nothing was lost, so the copies are removed.
            copies.iter().for_each(|copy| drop(fs::remove_file(copy)));
        }
    }
}

impl Watched {
    fn new(path: PathBuf) -> Option<Self> {
        let metadata = fs::metadata(&path).ok().filter(Metadata::is_file)?;
        Some(Watched { sidecars: sidecar_lengths(&path), path, state: FileState::new(&metadata) })
    }

    fn is_unchanged(&self) -> bool {
        let same = fs::metadata(&self.path).is_ok_and(|metadata| FileState::new(&metadata) == self.state);
        // Sidecars may vanish (another reader closed last) but not grow (a writer is at work).
        same && sidecar_lengths(&self.path).iter().zip(&self.sidecars).all(|(now, then)| now <= then)
    }
}

impl FileState {
    fn new(metadata: &Metadata) -> Self {
        FileState {
            id: FileId::of_metadata(metadata),
            length: metadata.len(),
            modified: (metadata.mtime(), metadata.mtime_nsec()),
        }
    }
}

/// Returns whether both paths lead to one file, which need not exist yet.
pub fn same_place(a: &Path, b: &Path) -> bool {
    let folder = |path: &Path| fs::canonicalize(folder_of(path)).ok();
    same_file(a, b) || a.file_name() == b.file_name() && folder(a).is_some_and(|f| folder(b) == Some(f))
}

/// Returns whether writing to `path` would destroy the source of a marked dataset that is open in
/// this process.
pub fn is_being_read(path: &Path) -> bool {
    let sources = open_sources();
    if sources.is_empty() {
        return false;
    }
    let Some(id) = FileId::at(path) else { return false };
    sources.iter().any(|source| source.is_written_by(id))
}

/// Copies the files of the open source that is about to be overwritten at `path`. The copies stay
/// only if the source is overwritten.
pub fn save_copies(path: &Path) -> io::Result<()> {
    let Some(id) = FileId::at(path) else { return Ok(()) };
    let mut open = open_sources();
    for source in open.iter_mut().filter(|source| source.copies.is_empty() && source.is_written_by(id)) {
        for (file, _) in &source.files {
            let (copy, mut to) = create_copy_file(file)?;
            source.copies.push(copy);
            io::copy(&mut File::open(file)?, &mut to)?;
        }
    }
    Ok(())
}

/// Creates `map.kml.saved`, or a numbered file when one exists from an earlier accident.
fn create_copy_file(file: &Path) -> io::Result<(PathBuf, File)> {
    let names = std::iter::once(".saved".to_string()).chain((2..100).map(|i| format!(".saved{i}")));
    for name in names.map(|suffix| with_suffix(file, &suffix)) {
        match File::create_new(&name) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            created => return created.map(|to| (name, to)),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

impl OpenSource {
    fn is_written_by(&self, id: FileId) -> bool {
        self.folders.contains(&id) || self.files.iter().any(|(_, file)| *file == id)
    }
}

/// Returns the files that SQLite puts beside a database that is being written.
pub fn sidecars(path: &Path) -> [PathBuf; 2] {
    ["-journal", "-wal"].map(|suffix| with_suffix(path, suffix))
}

fn sidecar_lengths(path: &Path) -> [u64; 2] {
    sidecars(path).map(|sidecar| fs::metadata(sidecar).map_or(0, |metadata| metadata.len()))
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

fn open_sources() -> MutexGuard<'static, Vec<OpenSource>> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tempfile::TempDir;

    fn folder_with(names: &[&str]) -> (TempDir, Vec<PathBuf>) {
        let folder = tempfile::tempdir().unwrap();
        let paths: Vec<_> = names.iter().map(|name| folder.path().join(name)).collect();
        paths.iter().for_each(|path| fs::write(path, "map").unwrap());
        (folder, paths)
    }

    #[test]
    fn a_write_a_replacement_and_a_transaction_are_changes() {
        let (folder, paths) = folder_with(&["map.gpkg"]);
        let journal = folder.path().join("map.gpkg-journal");
        let files = SourceFiles::watch(paths.clone());
        assert!(files.check().is_ok());
        fs::write(&journal, "pages").unwrap();
        assert!(files.check().is_err());
        fs::remove_file(&journal).unwrap();
        assert!(files.check().is_ok());
        fs::write(folder.path().join("new"), "map").unwrap();
        fs::rename(folder.path().join("new"), &paths[0]).unwrap();
        assert!(files.check().is_err(), "the same bytes in another file");
    }

    #[test]
    fn only_open_sources_are_being_read() {
        let (folder, paths) = folder_with(&["map.shp", "map.dbf"]);
        let files = SourceFiles::watch(paths.clone());
        assert!(paths.iter().all(|path| is_being_read(path)) && is_being_read(folder.path()));
        assert!(files.contain(&folder.path().join("../").join(&paths[1])));
        drop(files);
        assert!(!paths.iter().any(|path| is_being_read(path)) && !is_being_read(folder.path()));
    }

    #[test]
    fn a_place_is_known_before_there_is_a_file() {
        let (folder, paths) = folder_with(&["map.gpkg"]);
        let at = |name: &str| folder.path().join(name);
        assert!(same_place(&at("new.json"), &at("./new.json")) && same_place(&paths[0], &at("map.gpkg")));
        assert!(same_place(Path::new("new.json"), Path::new("./new.json")));
        assert!(!same_place(&at("new.json"), &at("other.json")) && !same_place(&at("new"), Path::new("new")));
    }

    #[test]
    fn a_file_alone_does_not_claim_its_folder() {
        let (folder, paths) = folder_with(&["map.gpkg"]);
        let _files = SourceFiles::watch(paths);
        assert!(!is_being_read(folder.path()));
    }

    #[test]
    fn copies_stay_only_if_the_source_was_lost() {
        let (folder, paths) = folder_with(&["map.tab", "map.dat"]);
        let saved = |name: &str| fs::read_to_string(folder.path().join(name)).ok();

        let files = SourceFiles::watch(paths.clone());
        save_copies(&paths[1]).unwrap();
        assert_eq!(saved("map.tab.saved").as_deref(), Some("map"));
        drop(files);
        assert_eq!(saved("map.tab.saved"), None);

        fs::write(folder.path().join("map.dat.saved"), "of another day").unwrap();
        let files = SourceFiles::watch(paths.clone());
        save_copies(&paths[0]).unwrap();
        fs::write(&paths[0], "").unwrap();
        let error = files.check().unwrap_err().to_string();
        assert!(error.contains("map.tab.saved") && error.contains("map.dat.saved2"), "{error}");
        drop(files);
        assert_eq!(saved("map.tab.saved").as_deref(), Some("map"));
        assert_eq!(saved("map.dat.saved2").as_deref(), Some("map"));
        assert_eq!(saved("map.dat.saved").as_deref(), Some("of another day"));
    }
}
