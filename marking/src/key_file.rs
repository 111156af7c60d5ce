//! Key files: a secret that others can read is none.

use std::{fs::File, os::unix::fs::PermissionsExt, path::Path};

/// The rights of the group and of all others.
const OF_OTHERS: u32 = 0o077;

/// Returns a warning about an open key file that other users may read or write. A pipe has no such
/// rights of its own.
pub fn exposure(path: &Path, file: &File) -> Option<String> {
    let metadata = file.metadata().ok().filter(|metadata| metadata.is_file())?;
    let rights = metadata.permissions().mode() & 0o777;
    (rights & OF_OTHERS != 0).then(|| {
        let path = path.display();
        format!(
            "the key file {path} has the rights {rights:04o}, so other users may have read or changed it: whoever has the \
             key can remove marks and forge them; take the rights away (chmod 600 {path}), or make a new key"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{self, Permissions};

    #[test]
    fn rights_of_others_give_a_warning_that_names_file_and_remedy() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let warning = |mode: u32| {
            fs::set_permissions(file.path(), Permissions::from_mode(mode)).unwrap();
            exposure(file.path(), &File::open(file.path()).unwrap())
        };
        for mode in [0o600, 0o400, 0o700] {
            assert_eq!(warning(mode), None, "{mode:o}");
        }
        for mode in [0o644, 0o640, 0o604, 0o620, 0o666] {
            let text = warning(mode).unwrap();
            assert!(text.contains(&format!("{mode:04o}")) && text.contains("chmod 600"), "{text}");
        }
        assert_eq!(exposure(Path::new("/dev/null"), &File::open("/dev/null").unwrap()), None);
    }
}
