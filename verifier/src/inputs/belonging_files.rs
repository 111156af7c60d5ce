//! The files that belong to a map: those that a driver reads beside the one that is named.

use meshmark_dataset::workplace::folder_of;
use std::{
    ffi::OsString,
    io,
    path::{Path, PathBuf},
};

/// Extensions of formats that consist of several files with the same name.
const WITH_COMPANIONS: &[&str] = &["shp", "shx", "dbf", "tab", "mif", "gml", "csv"];

/// Endings that SQLite adds to the name of a database: its logs hold a part of its rows.
const LOGS: &[&str] = &["-wal", "-shm", "-journal"];

/// A file that belongs to a map.
pub(super) struct BelongingFile {
    /// Its name in the folder of the map, or in the map that is a folder.
    pub(super) name: PathBuf,
    /// Its path.
    pub(super) path: PathBuf,
}

/// Returns the files of a map, sorted by name; none for what is no local file or folder.
pub(super) fn files_of(path: &Path) -> io::Result<Vec<BelongingFile>> {
    let mut files = Vec::new();
    if path.is_dir() {
        collect(path, Path::new(""), &mut files)?;
    } else if path.is_file() {
        let name = PathBuf::from(path.file_name().unwrap_or_default());
        let target = path.canonicalize()?; // SQLite looks for the logs where a link points
        for ending in LOGS {
            let log = BelongingFile { name: with_ending(&name, ending), path: with_ending(&target, ending) };
            files.extend(Some(log).filter(|log| log.path.is_file()));
        }
        companions(path, &mut files)?;
        files.push(BelongingFile { name, path: path.into() });
    }
    files.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(files)
}

/// Returns the size of a map with all its files; 0 for what is no local file or folder.
pub(crate) fn size_of(path: &Path) -> u64 {
    let size = |file: BelongingFile| file.path.metadata().map_or(0, |metadata| metadata.len());
    files_of(path).unwrap_or_default().into_iter().map(size).sum()
}

/// Appends the other files with the same name and any extension, for a format that has such files.
fn companions(path: &Path, files: &mut Vec<BelongingFile>) -> io::Result<()> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if !WITH_COMPANIONS.contains(&extension.as_str()) {
        return Ok(());
    }
    for entry in folder_of(path).read_dir()? {
        let file = path.with_file_name(entry?.file_name());
        // The metadata of a.shp are in a.shp.xml.
        let belongs = [path.file_stem(), path.file_name()].contains(&file.file_stem());
        if file != path && file.is_file() && belongs {
            let name = file.file_name().unwrap_or_default().into();
            files.push(BelongingFile { name, path: file });
        }
    }
    Ok(())
}

/// Returns whether logs belong to a map, which then is a database.
pub(super) fn has_logs(path: &Path) -> bool {
    path.canonicalize().is_ok_and(|target| LOGS.iter().any(|log| with_ending(&target, log).is_file()))
}

pub(super) fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(ending);
    name.into()
}

/// Appends the files of a folder and of the folders in it. Links to folders are not followed.
fn collect(folder: &Path, name: &Path, files: &mut Vec<BelongingFile>) -> io::Result<()> {
    for entry in folder.read_dir()? {
        let entry = entry?;
        let (name, path) = (name.join(entry.file_name()), entry.path());
        if entry.file_type()?.is_dir() {
            collect(&path, &name, files)?;
        } else if path.is_file() {
            files.push(BelongingFile { name, path });
        }
    }
    Ok(())
}
