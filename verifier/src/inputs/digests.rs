//! The files of a verification and their digests.

use crate::{Error, Result, words::printable};
use meshmark_core::hex;
use meshmark_dataset::{file_digest, workplace::folder_of};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::{
    fmt::Write as _,
    io,
    path::{Path, PathBuf},
};

/// The files, digested before GDAL reads them.
#[derive(Debug, Clone, Serialize)]
pub struct Inputs {
    /// The key.
    pub key: Digested,
    /// The reference.
    pub reference: Digested,
    /// The suspect.
    pub suspect: Digested,
    /// The record, or the best one of many; null without.
    pub record: Option<Digested>,
}

/// A file or folder and its digest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Digested {
    /// The path as given.
    pub path: String,
    /// "SHA-256 …", or the reason why there is none.
    pub digest: String,
}

/// The digests of all files that a verification may use.
pub struct Digests<'a> {
    key: Digested,
    references: Vec<(&'a Path, Digested)>,
    suspect: Digested,
    record: Option<Digested>,
}

impl<'a> Digests<'a> {
    /// Digests the files.
    ///
    /// # Errors
    /// Fails when one of them cannot be read to its end.
    pub fn read(
        key: &Path,
        references: &'a [PathBuf],
        suspect: &Path,
        record: Option<&Path>,
    ) -> Result<Self> {
        let references = references.iter().map(|path| Ok((path.as_path(), digest(path)?)));
        Ok(Digests {
            key: digest(key)?,
            references: references.collect::<Result<_>>()?,
            suspect: digest(suspect)?,
            record: record.map(digest).transpose()?,
        })
    }

    /// Returns the files of a verification with this reference, and with this one of many records.
    ///
    /// # Errors
    /// Fails when that record is no longer readable.
    pub fn of_verification(self, reference: &Path, best_record: Option<&Path>) -> Result<Inputs> {
        let Digests { key, references, suspect, record } = self;
        let best_record = best_record.map(digest).transpose()?;
        let reference = references.into_iter().find(|(path, _)| *path == reference);
        let (_, reference) = reference.expect("the verification has one of the references");
        Ok(Inputs { key, reference, suspect, record: record.or(best_record) })
    }
}

/// Returns the SHA-256 of a file. For a folder with all in it, or a file with companions of the same name, it is
/// that of the sorted list of their digests as `sha256sum` prints it.
pub(crate) fn digest(path: &Path) -> Result<Digested> {
    let failed = |error: io::Error| Error::Undigested { path: path.into(), source: error };
    let shown = printable(&path.display().to_string());
    let files = files_of(path).map_err(failed)?;
    let digest = match files.as_slice() {
        [] => "it is not a local file, so it has no digest".into(),
        [file] if file == path => format!("SHA-256 {}", file_digest(file).map_err(failed)?),
        files => {
            let mut list = String::new();
            let folder = if path.is_dir() { path } else { folder_of(path) };
            for file in files {
                let name = file.strip_prefix(folder).unwrap_or(file).to_string_lossy();
                let _ = writeln!(list, "{}  {name}", file_digest(file).map_err(failed)?);
            }
            format!(
                "SHA-256 {} of the sha256sum list of its {} files",
                text_digest(list.as_bytes()),
                files.len()
            )
        }
    };
    Ok(Digested { path: shown, digest })
}

/// Extensions of formats that consist of several files with the same name.
const WITH_COMPANIONS: &[&str] = &["shp", "shx", "dbf", "tab", "mif"];

/// Returns the files of a map, sorted.
fn files_of(path: &Path) -> io::Result<Vec<PathBuf>> {
    if path.is_file() {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if !WITH_COMPANIONS.contains(&extension.as_str()) {
            return Ok(vec![path.into()]);
        }
    } else if !path.is_dir() {
        return Ok(Vec::new());
    }
    let mut files = Vec::new();
    if path.is_dir() {
        collect(path, &mut files)?;
    } else {
        for entry in folder_of(path).read_dir()? {
            let file = entry?.path();
            files.extend(Some(file).filter(|file| file.is_file() && file.file_stem() == path.file_stem()));
        }
    }
    files.sort();
    Ok(files)
}

/// Appends the files of a folder and of the folders in it. Links to folders are not followed.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in folder.read_dir()? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            collect(&entry.path(), files)?;
        } else if entry.path().is_file() {
            files.push(entry.path());
        }
    }
    Ok(())
}

fn text_digest(bytes: &[u8]) -> String {
    hex::encode(&Sha256::digest(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// This is the SHA-256 of "abc" (FIPS 180-4).
    const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn a_file_has_its_own_digest_and_a_folder_that_of_its_sorted_list() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        for name in ["b.shp", "a.dbf", "a.shp"] {
            std::fs::write(file(name), "abc").unwrap();
        }
        std::fs::write(file("map.gpkg"), "abc").unwrap();
        assert_eq!(digest(&file("map.gpkg")).unwrap().digest, format!("SHA-256 {ABC}"));
        let list = |names: &[&str]| names.iter().map(|n| format!("{ABC}  {n}\n")).collect::<String>();
        let expected = text_digest(list(&["a.dbf", "a.shp"]).as_bytes());
        assert_eq!(
            digest(&file("a.shp")).unwrap().digest,
            format!("SHA-256 {expected} of the sha256sum list of its 2 files")
        );
        let all = text_digest(list(&["a.dbf", "a.shp", "b.shp", "map.gpkg"]).as_bytes());
        assert!(digest(folder.path()).unwrap().digest.contains(&all));
        std::fs::create_dir_all(file("9/1")).unwrap();
        std::fs::write(file("9/1/2.pbf"), "abc").unwrap();
        let all = text_digest(list(&["9/1/2.pbf", "a.dbf", "a.shp", "b.shp", "map.gpkg"]).as_bytes());
        assert!(digest(folder.path()).unwrap().digest.contains(&all), "tiles lie in folders");
        assert!(digest(&file("none")).unwrap().digest.contains("no digest"));
    }
}
