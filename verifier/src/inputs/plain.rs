//! Plain files: whatever else has a name may have no end, or wait for a writer who never comes.

use crate::{Error, Result};
use std::{fs::File, io, path::Path};

/// Where the system names what a process has open already, such as the pipe of a shell.
const OPEN_ALREADY: &str = "/proc";

const REASON: &str = "it is a pipe or a device, and no plain file: save its content to a file, and give that";

/// Opens a plain file, or a pipe that this process has from its parent.
pub fn open(path: &Path) -> io::Result<File> {
    match is_special(path) {
        true => Err(io::Error::other(REASON)),
        false => File::open(path),
    }
}

/// Checks that a map is no pipe or device. What does not exist may be the address of a database.
pub fn check(what: &'static str, path: &Path) -> Result<()> {
    match is_special(path) {
        true => Err(Error::TextUnread { what, path: path.into(), source: io::Error::other(REASON) }),
        false => Ok(()),
    }
}

fn is_special(path: &Path) -> bool {
    let is_open = || path.canonicalize().map_or(true, |real| real.starts_with(OPEN_ALREADY));
    path.metadata().is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir()) && !is_open()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_refused_and_a_file_and_an_address_are_not() {
        assert!(open(Path::new("/dev/zero")).is_err() && check("map", Path::new("/dev/zero")).is_err());
        let file = tempfile::NamedTempFile::new().unwrap();
        assert!(open(file.path()).is_ok() && check("map", file.path()).is_ok());
        assert!(check("map", Path::new("PG:dbname=maps")).is_ok());
    }
}
