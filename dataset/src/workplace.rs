//! Workplaces: private folders beside the places of files, in which the files are made before their
//! publication.
//!
//! A workplace belongs to the process that holds the lock in it. A workplace whose lock is free was
//! left by a killed process: the next process that writes to the same folder undoes a partial
//! publication ([`crate::publication::recover`]) and removes the workplace.

use crate::{
    Result,
    error::{Action, file_error},
    publication,
};
use std::{
    ffi::OsStr,
    fs::{self, File, Permissions, TryLockError},
    io,
    os::unix::{
        ffi::OsStrExt,
        fs::{MetadataExt, PermissionsExt},
    },
    path::{Path, PathBuf},
};

const PREFIX: &str = ".meshmark-write-";
const LOCK: &str = "lock";
/// Names the other workplaces of the same publication, each ended by NUL.
const PEERS: &str = "peers";

/// A private folder that is removed when this is dropped.
pub struct Workplace {
    folder: PathBuf,
    _lock: File,
}

impl Workplace {
    /// Removes the workplaces of killed processes in `parent` and makes a workplace there.
    pub fn new(parent: &Path) -> Result<Self> {
        let failed = |e: io::Error| file_error(Action::WritingInto, parent, e);
        let parent = parent.canonicalize().map_err(failed)?;
        loop {
            // Staged files are unmarked, so no other user may read them.
            let private = Permissions::from_mode(0o700);
            let folder = tempfile::Builder::new().prefix(PREFIX).permissions(private).tempdir_in(&parent);
            let folder = folder.map_err(failed)?.keep();
            match lock(&folder) {
                Ok(Some(lock)) => {
                    sweep(&parent, folder.metadata().map_err(failed)?.uid());
                    return Ok(Workplace { folder, _lock: lock });
                }
                Ok(None) => {} // somebody swept it before it was locked
                Err(error) => {
                    drop(fs::remove_dir_all(&folder));
                    return Err(failed(error));
                }
            }
        }
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Makes a folder in it.
    pub fn subfolder(&self, name: &str) -> Result<PathBuf> {
        let path = self.folder.join(name);
        fs::create_dir(&path).map_err(|e| file_error(Action::Making, &path, e))?;
        Ok(path)
    }

    /// Records that both workplaces belong to one publication.
    pub fn join(&self, other: &Workplace) -> Result<()> {
        for (one, other) in [(self, other), (other, self)] {
            let path = one.folder.join(PEERS);
            let mut peers = fs::read(&path).unwrap_or_default();
            peers.extend_from_slice(other.folder.as_os_str().as_bytes());
            peers.push(0);
            fs::write(&path, peers).map_err(|e| file_error(Action::Writing, &path, e))?;
        }
        Ok(())
    }
}

impl Drop for Workplace {
    fn drop(&mut self) {
        // Without its journal it does not count as an interrupted publication.
        drop(fs::remove_file(self.folder.join(publication::JOURNAL)));
        drop(fs::remove_dir_all(&self.folder));
    }
}

/// Returns the folder of a file, which need not exist.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Removes the workplaces in `parent` whose processes have ended, except those of other users.
fn sweep(parent: &Path, user: u32) {
    let Ok(entries) = fs::read_dir(parent) else { return };
    for entry in entries.flatten() {
        sweep_one(&entry.path(), user);
    }
}

fn sweep_one(folder: &Path, user: u32) {
    let is_workplace = folder.file_name().is_some_and(|name| name.as_bytes().starts_with(PREFIX.as_bytes()));
    // Links are not followed, so that nobody can have files elsewhere removed.
    let is_ours = |m: fs::Metadata| m.is_dir() && m.uid() == user && m.mode() & 0o077 == 0;
    if !is_workplace || !folder.symlink_metadata().is_ok_and(is_ours) {
        return;
    }
    // A workplace without a lock is empty and possibly about to be locked, or its process was
    // killed while it removed it.
    let lock = || File::open(folder.join(LOCK)).ok();
    let Some(file) = lock().or_else(|| if fs::remove_dir(folder).is_err() { lock() } else { None }) else {
        drop(fs::remove_dir_all(folder));
        return;
    };
    if file.try_lock().is_err() {
        return;
    }
    publication::recover(folder);
    for peer in fs::read(folder.join(PEERS)).unwrap_or_default().split(|&byte| byte == 0) {
        sweep_one(Path::new(OsStr::from_bytes(peer)), user);
    }
    drop(fs::remove_file(folder.join(publication::JOURNAL)));
    drop(fs::remove_dir_all(folder));
}

/// Locks a new workplace; `None` when another process removed it meanwhile.
fn lock(folder: &Path) -> io::Result<Option<File>> {
    let path = folder.join(LOCK);
    let file = match File::create(&path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    match file.try_lock() {
        Ok(()) => Ok(path.exists().then_some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    /// Leaves what a killed process leaves: the folder with a free lock.
    fn abandon(workplace: Workplace) -> PathBuf {
        let folder = workplace.folder.clone();
        let copy = folder.with_file_name("copy");
        fs::create_dir(&copy).unwrap();
        for name in names(&folder) {
            fs::rename(folder.join(&name), copy.join(&name)).unwrap();
        }
        drop(workplace);
        fs::rename(&copy, &folder).unwrap();
        fs::set_permissions(&folder, Permissions::from_mode(0o700)).unwrap();
        folder
    }

    #[test]
    fn a_workplace_in_use_stays_and_an_abandoned_one_goes() {
        let parent = tempfile::tempdir().unwrap();
        let running = Workplace::new(parent.path()).unwrap();
        let left = abandon(Workplace::new(parent.path()).unwrap());
        fs::write(left.join("big"), "x").unwrap();
        for name in [".meshmark-write-empty", ".meshmark-write-unlocked"] {
            let folder = abandon(Workplace::new(parent.path()).unwrap());
            fs::remove_file(folder.join(LOCK)).unwrap();
            fs::rename(&folder, parent.path().join(name)).unwrap();
        }
        fs::write(parent.path().join(".meshmark-write-unlocked/rest"), "killed while it was removed")
            .unwrap();
        fs::create_dir(parent.path().join("other")).unwrap();
        let next = Workplace::new(parent.path()).unwrap();
        assert!(running.folder.exists() && next.folder.exists() && !left.exists());
        drop((running, next));
        assert_eq!(names(parent.path()), ["other"]);
    }

    #[test]
    fn an_abandoned_workplace_takes_its_peers_along() {
        let [one, two] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let [a, b] = [&one, &two].map(|parent| Workplace::new(parent.path()).unwrap());
        a.join(&b).unwrap();
        let folders = [abandon(a), abandon(b)];
        drop(Workplace::new(two.path()).unwrap());
        assert!(folders.iter().all(|folder| !folder.exists()));
    }

    #[test]
    fn what_a_link_points_to_is_not_touched() {
        let [parent, elsewhere] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        fs::write(elsewhere.path().join(LOCK), "").unwrap();
        std::os::unix::fs::symlink(elsewhere.path(), parent.path().join(".meshmark-write-x")).unwrap();
        drop(Workplace::new(parent.path()).unwrap());
        assert_eq!(names(elsewhere.path()), [LOCK]);
    }
}
