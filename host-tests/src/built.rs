//! The programs that cargo built, unless their sources are newer: no test may pass with outdated
//! programs.

use crate::Result;
use std::{
    fs,
    path::{Path, PathBuf},
    time::SystemTime,
};

/// Returns the folder that cargo builds into: that of this program, for a test the one above.
///
/// # Errors
/// Fails if the operating system does not name this program.
pub fn folder() -> Result<PathBuf> {
    let program = std::env::current_exe()?;
    let folder = program.parent().ok_or("this program has no folder")?;
    Ok(if folder.ends_with("deps") { folder.with_file_name("") } else { folder.into() })
}

/// Refuses a file that is missing, or older than one of the sources that cargo lists in `rule`, a
/// file NAME.d.
///
/// # Errors
/// Fails with a sentence that names the file, the source and the remedy.
pub fn check(file: &Path, rule: &Path) -> Result<()> {
    const REMEDY: &str = "run `make build` first";
    let built = modified(file).ok_or_else(|| format!("{} is missing: {REMEDY}", file.display()))?;
    let text = fs::read_to_string(rule).map_err(|e| format!("{}: {e}: {REMEDY}", rule.display()))?;
    match sources(&text).into_iter().find(|source| modified(source).is_none_or(|time| time > built)) {
        Some(source) => {
            Err(format!("{} is older than {}: {REMEDY}", file.display(), source.display()).into())
        }
        None => Ok(()),
    }
}

fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|metadata| metadata.modified()).ok()
}

/// Returns the files on the right of a rule; a backslash precedes a space in a name.
fn sources(rule: &str) -> Vec<PathBuf> {
    let (_, files) = rule.split_once(": ").unwrap_or_default();
    files.replace("\\ ", "\0").split_whitespace().map(|file| file.replace('\0', " ").into()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{fs::File, time::Duration};

    #[test]
    fn a_file_is_as_good_as_its_sources() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let check = || check(&path("program"), &path("program.d")).map_err(|error| error.to_string());
        let spaced = path("a source.rs").display().to_string().replace(' ', "\\ ");
        fs::write(path("program.d"), format!("program: {} {spaced}\n", path("lib.rs").display())).unwrap();
        assert!(check().unwrap_err().contains("program is missing"));
        let at = |name: &str, seconds: u64| {
            let time = SystemTime::UNIX_EPOCH + Duration::from_secs(seconds);
            File::create(path(name)).unwrap().set_modified(time).unwrap();
        };
        at("program", 20);
        at("lib.rs", 10);
        at("a source.rs", 21);
        assert!(check().unwrap_err().contains("a source.rs: run `make build`"));
        at("a source.rs", 20);
        assert_eq!(check(), Ok(()));
        fs::remove_file(path("lib.rs")).unwrap();
        assert!(check().unwrap_err().contains("lib.rs"), "a source that is gone");
    }
}
