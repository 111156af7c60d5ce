//! The places of the marked map, its reference and its record, which are checked before anything is
//! written.

use crate::{
    error::{Error, Result},
    marking::MarkingRequest,
    source_files::sidecars,
};
use meshmark_core::options::Creation;
use meshmark_dataset::{
    Action, file_error,
    formats::Format,
    same_file,
    workplace::{Workplace, folder_of},
};
use std::{
    ffi::{OsStr, OsString},
    fs,
    path::{Path, PathBuf},
};

/// The file to write.
pub struct Target {
    /// Its name for messages.
    pub name: String,
    /// Its path without links.
    pub path: PathBuf,
    /// Its format.
    pub format: &'static Format,
    /// The path of the unmarked map.
    pub reference: PathBuf,
    /// Whether an existing file is replaced.
    pub replaces: bool,
}

/// Workplaces beside the files that will be published.
pub struct Places {
    /// Where the unmarked map is staged.
    pub staged: PathBuf,
    /// Where the record is staged, and its final path.
    pub record: Option<(PathBuf, PathBuf)>,
    /// The workplace of the target.
    pub main: Workplace,
    _others: Vec<Workplace>,
}

impl Target {
    /// Finds the places of the target and the reference. Files that occupy them now may vanish when
    /// the workplaces are made.
    pub fn new(name: &str, creation: &Creation) -> Result<Self> {
        let format = Format::find(creation.format.as_deref(), Path::new(name))?;
        let path = place(Path::new(name))?;
        let reference = Path::new(&creation.reference_path);
        if !reference.extension().is_some_and(|e| e.eq_ignore_ascii_case("gpkg")) {
            return Err(Error::ReferenceNotGeoPackage(creation.reference_path.clone()));
        }
        let reference = place(reference)?;
        if reference == path {
            return Err(Error::SameFile { option: "REFERENCE", other: "the target" });
        }
        Ok(Target { name: name.into(), path, format, reference, replaces: creation.overwrite })
    }

    /// Fails when a file is in the way.
    fn check_free(&self) -> Result<()> {
        let exists = |path: &Path, remedy| {
            Err(meshmark_dataset::Error::Exists { path: path.display().to_string(), remedy }.into())
        };
        if self.reference.exists() {
            return exists(
                &self.reference,
                "other copies may depend on this REFERENCE, so give another name",
            );
        }
        match (self.path.exists(), self.replaces) {
            (false, _) => Ok(()),
            (true, false) => exists(&self.path, "give another name, or say OVERWRITE=YES"),
            (true, true) => check_not_busy(&self.path),
        }
    }

    /// Returns the name of the file, without folders.
    pub fn file_name(&self) -> &OsStr {
        self.path.file_name().expect("a place has a name")
    }

    /// Makes the workplaces, which removes the remains of killed processes, and checks that no file
    /// is in the way.
    pub fn places(&self, request: &MarkingRequest) -> Result<Places> {
        if same_file(&self.path, request.key_path()) {
            return Err(Error::SameFile { option: "KEY", other: "the target" });
        }
        if let Some(option) = request.base_at(&self.path) {
            return Err(Error::SameFile { option, other: "the target" });
        }
        let record = request.record_path().map(place).transpose()?;
        if let Some(record) = &record {
            if *record == self.path {
                return Err(Error::SameFile { option: "RECORD", other: "the target" });
            }
            if *record == self.reference {
                return Err(Error::SameFile { option: "RECORD", other: "REFERENCE" });
            }
        }
        let main = Workplace::new(folder(&self.path))?;
        let mut others: Vec<Workplace> = Vec::new();
        let mut stage = |to: &Path, name: &str| -> Result<PathBuf> {
            if folder(to) == folder(&self.path) {
                return Ok(main.folder().join(name));
            }
            let other = Workplace::new(folder(to))?;
            main.join(&other)?;
            let staged = other.folder().join(name);
            others.push(other);
            Ok(staged)
        };
        let staged = stage(&self.reference, "reference.gpkg")?;
        let record = match record {
            Some(to) => Some((stage(&to, "record.json")?, to)),
            None => None,
        };
        self.check_free()?;
        Ok(Places { staged, record, main, _others: others })
    }

    /// Returns the files of the replaced dataset other than its main file: those that the new one
    /// in `made` has too, and those that readers of Shapefiles would take for parts of the new one.
    pub fn side_files(&self, made: &Path) -> Result<Vec<PathBuf>> {
        if !self.path.is_file() {
            return Ok(Vec::new());
        }
        let entries = fs::read_dir(made).map_err(|e| file_error(Action::Reading, made, e))?;
        let mut names: Vec<OsString> = entries.flatten().map(|entry| entry.file_name()).collect();
        if names.len() > 1 {
            let stale = ["dbf", "shx", "prj", "cpg", "qix", "sbn", "sbx", "qpj", "idm", "ind"];
            let of = |extension| {
                self.path.with_extension(extension).file_name().unwrap_or_default().to_os_string()
            };
            names.extend(stale.into_iter().map(of));
        }
        names.sort();
        names.dedup();
        let paths = names.into_iter().map(|name| self.path.with_file_name(name));
        Ok(paths.filter(|path| *path != self.path && path.is_file()).collect())
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().expect("a place is in a folder")
}

/// Returns the absolute path of a file that exists, with links followed, or that can be made.
fn place(path: &Path) -> Result<PathBuf> {
    let refused = |what| Err(Error::NotAFile { path: path.display().to_string(), what });
    if path.to_string_lossy().starts_with("/vsi") {
        return refused("a virtual file");
    }
    if path.symlink_metadata().is_ok() {
        return match path.canonicalize() {
            Ok(path) if path.is_file() => Ok(path),
            Ok(path) if path.is_dir() => refused("a folder"),
            Ok(_) => refused("no regular file"),
            Err(_) => refused("a link to nowhere"),
        };
    }
    let Some(name) = path.file_name() else { return refused("no file name") };
    match folder_of(path).canonicalize() {
        Ok(folder) if folder.is_dir() => Ok(folder.join(name)),
        _ => refused("in no folder that exists"),
    }
}

/// Fails when another program writes to the file, as its journal would be applied to the new one.
fn check_not_busy(path: &Path) -> Result<()> {
    let is_written = |sidecar: &PathBuf| sidecar.metadata().is_ok_and(|metadata| metadata.len() > 0);
    match sidecars(path).into_iter().find(is_written) {
        None => Ok(()),
        Some(sidecar) => {
            let [path, sidecar] = [path, &sidecar].map(|path| path.display().to_string());
            Err(Error::TargetBusy { path, sidecar })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the fault of a target, or an empty text.
    fn fault(folder: &Path, name: &str, reference: &str, overwrite: bool) -> String {
        let path = |name: &str| folder.join(name).display().to_string();
        let creation = Creation { reference_path: path(reference), format: None, overwrite };
        let free = Target::new(&path(name), &creation).and_then(|target| target.check_free());
        free.map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn only_a_new_file_or_one_that_may_be_replaced_is_a_target() {
        let home = tempfile::tempdir().unwrap();
        for name in ["old.gpkg", "busy.gpkg", "busy.gpkg-wal"] {
            fs::write(home.path().join(name), "x").unwrap();
        }
        fs::create_dir(home.path().join("sub.gpkg")).unwrap();
        std::os::unix::fs::symlink("nowhere.gpkg", home.path().join("dangling.gpkg")).unwrap();
        let fault = |name, reference, overwrite| fault(home.path(), name, reference, overwrite);
        assert_eq!(fault("new.gpkg", "ref.gpkg", false), "");
        assert_eq!(fault("old.gpkg", "ref.gpkg", true), "");
        assert!(fault("old.gpkg", "ref.gpkg", false).contains("OVERWRITE=YES"));
        assert!(fault("new.gpkg", "old.gpkg", true).contains("other copies may depend"));
        assert!(fault("busy.gpkg", "ref.gpkg", true).contains("busy.gpkg-wal"));
        assert!(fault("sub.gpkg", "ref.gpkg", true).contains("is a folder"));
        assert!(fault("dangling.gpkg", "ref.gpkg", true).contains("link to nowhere"));
        assert!(fault("no/new.gpkg", "ref.gpkg", true).contains("in no folder that exists"));
        assert!(fault("new.gpkg", "new.gpkg", false).contains("same file"));
        assert!(fault("new.gpkg", "ref.shp", false).contains("ends in .gpkg"));
    }
}
