//! The files of a verification and their digests.

use super::{belonging_files::files_of, private_copy::PrivateCopy};
use crate::{Error, Result};
use meshmark_core::hex;
use meshmark_dataset::file_digest;
use meshmark_verification::{
    report::{Digested, Inputs},
    words::printable,
};
use sha2::{Digest, Sha256};
use std::{
    fmt::Write as _,
    io,
    path::{Path, PathBuf},
};

/// The digests of all files that a verification may use.
pub struct Digests<'a> {
    key: Digested,
    references: Vec<(&'a Path, Digested)>,
    suspect: (&'a PrivateCopy, Digested),
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
        suspect: &'a PrivateCopy,
        record: Option<&Path>,
    ) -> Result<Self> {
        let references = references.iter().map(|path| Ok((path.as_path(), digest(path)?)));
        Ok(Digests {
            key: digest(key)?,
            references: references.collect::<Result<_>>()?,
            suspect: (suspect, of_copy(suspect)?),
            record: record.map(digest).transpose()?,
        })
    }

    /// Returns the files of a verification with this reference, and with this one of many records.
    ///
    /// # Errors
    /// Fails when that record is no longer readable, and when the suspect is no longer what was
    /// examined.
    pub fn of_verification(self, reference: &Path, best_record: Option<&Path>) -> Result<Inputs> {
        let Digests { key, references, suspect: (suspect, examined), record } = self;
        if digest(suspect.original())? != examined {
            return Err(Error::SuspectChanged { path: suspect.original().into() });
        }
        let best_record = best_record.map(digest).transpose()?;
        let (own, others): (Vec<_>, Vec<_>) =
            references.into_iter().partition(|(path, _)| *path == reference);
        let (_, reference) = own.into_iter().next().expect("the verification has one of the references");
        let other_references = others.into_iter().map(|(_, digested)| digested).collect();
        Ok(Inputs { key, reference, other_references, suspect: examined, record: record.or(best_record) })
    }
}

/// Returns the digest of what is examined, before anything has read it.
fn of_copy(suspect: &PrivateCopy) -> Result<Digested> {
    let path = printable(&suspect.original().display().to_string());
    Ok(Digested { path, ..digest(suspect.copy())? })
}

/// Returns the names and the SHA-256 of the files of a map; none for what is no local file or folder.
///
/// # Errors
/// Fails when one of them cannot be read to its end.
pub fn files_digests(path: &Path) -> Result<Vec<(String, String)>> {
    let failed = |error: io::Error| Error::Undigested { path: path.into(), source: error };
    let files = files_of(path).map_err(failed)?;
    let digested = files.into_iter().map(|file| {
        let digest = file_digest(&file.path).map_err(failed)?;
        Ok((file.name.to_string_lossy().into_owned(), digest))
    });
    digested.collect()
}

/// Returns the SHA-256 of a file. For a folder with all in it, or a file with companions of the same name, it is
/// that of the sorted list of their digests as `sha256sum` prints it.
pub(crate) fn digest(path: &Path) -> Result<Digested> {
    let failed = |error: io::Error| Error::Undigested { path: path.into(), source: error };
    let shown = printable(&path.display().to_string());
    let files = files_of(path).map_err(failed)?;
    let digest = match files.as_slice() {
        [] => "it is not a local file, so it has no digest".into(),
        [file] if file.path == path => format!("SHA-256 {}", file_digest(path).map_err(failed)?),
        files => {
            let mut list = String::new();
            for file in files {
                let digest = file_digest(&file.path).map_err(failed)?;
                let _ = writeln!(list, "{digest}  {}", file.name.to_string_lossy());
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
