//! The versions of the programs that a result depends on.

use crate::{Error, Result};
use gdal::version::VersionInfo;
use meshmark_dataset::file_digest;
use std::path::PathBuf;

/// Libraries of GDAL that it computes with, by their names in its description.
const LIBRARIES: [[&str; 2]; 2] = [["GEOS", "GEOS_VERSION"], ["PROJ", "PROJ_RUNTIME_VERSION"]];

/// Returns the versions of this program and of GDAL, which reads the maps, with its libraries.
pub fn versions() -> Vec<String> {
    let own =
        [format!("meshmark {}", env!("CARGO_PKG_VERSION")), format!("GDAL {}", VersionInfo::release_name())];
    let described = VersionInfo::build_info();
    let library = |[name, key]: &[&str; 2]| Some(format!("{name} {}", described.get(*key)?));
    own.into_iter().chain(LIBRARIES.iter().filter_map(library)).collect()
}

/// Returns these versions, with what tells this very program from others of the same version: the
/// commit, where the build names it, and the digest of its file.
///
/// # Errors
/// Fails when that file cannot be read.
pub fn versions_and_program() -> Result<Vec<String>> {
    let failed = |source| Error::Undigested { path: PathBuf::from("meshmark"), source };
    let program = std::env::current_exe().and_then(|path| file_digest(&path)).map_err(failed)?;
    let mut all = versions();
    let commit = option_env!("MESHMARK_COMMIT").filter(|commit| !commit.is_empty());
    all[0] += &commit.map_or(String::new(), |commit| format!(" of commit {commit}"));
    all[0] += &format!(" (program SHA-256 {program})");
    Ok(all)
}
