//! Publication: files made in workplaces appear in their places together, or none of them does.
//!
//! The order is record, reference, side files, main file; so a reader that sees the main file finds
//! the others. New files are linked, not moved: a file in both places shows that a publication was
//! interrupted, and the publication can be undone. The main file alone may replace another one, by
//! a single rename. Side files in the way are moved into the workplace first, and back if the
//! publication fails.

use crate::{
    Error, Result,
    error::{Action, file_error},
    file_id::same_file,
};
use std::{
    ffi::OsStr,
    fs::{self, File},
    io::{self, ErrorKind},
    os::unix::ffi::OsStrExt,
    path::{Path, PathBuf},
};

/// The file of a workplace that describes a publication while it runs.
pub const JOURNAL: &str = "journal";

/// The files of a publication.
#[derive(Debug, Default)]
pub struct Publication {
    /// Moves of record, reference and side files from a workplace to their places, which must be
    /// free.
    pub companions: Vec<Move>,
    /// Moves of the files of a replaced dataset from their places to where they are kept meanwhile.
    pub retired: Vec<Move>,
    /// The main file.
    pub main: Move,
    /// Whether the main file may replace another.
    pub overwrite: bool,
}

/// A move of a file.
#[derive(Debug, Default, PartialEq, Clone)]
pub struct Move {
    /// Its present path.
    pub from: PathBuf,
    /// Its new path.
    pub to: PathBuf,
}

impl Publication {
    /// Publishes all files, or leaves everything unchanged. `workplace` is that of the main file.
    pub fn run(&self, workplace: &Path) -> Result<()> {
        self.sync_content()?;
        let journal = workplace.join(JOURNAL);
        write_durably(&journal, &self.to_bytes()).map_err(|e| file_error(Action::Writing, &journal, e))?;
        let done = self.put_in_place();
        if done.is_err() {
            self.undo();
        }
        done
    }

    fn put_in_place(&self) -> Result<()> {
        for Move { from, to } in &self.retired {
            fs::rename(from, to).map_err(|e| file_error(Action::MovingAway, from, e))?;
        }
        for companion in &self.companions {
            link(companion)?;
        }
        let moves = self.companions.iter().chain([&self.main]);
        moves.clone().filter(|m| **m != self.main).try_for_each(|m| sync_folder(&m.to))?;
        match self.overwrite {
            false => link(&self.main)?,
            true => fs::rename(&self.main.from, &self.main.to)
                .map_err(|e| file_error(Action::Replacing, &self.main.to, e))?,
        }
        // The main file is in its place, so nothing may fail any more. If the power fails now, old
        // and new files are both whole.
        drop(sync_folder(&self.main.to));
        Ok(())
    }

    /// Returns whether the main file is in its place.
    fn is_done(&self) -> bool {
        !self.main.from.exists() || same_file(&self.main.from, &self.main.to)
    }

    fn undo(&self) {
        for Move { from, to } in &self.companions {
            if same_file(from, to) {
                drop(fs::remove_file(to));
            }
        }
        for Move { from, to } in &self.retired {
            if to.exists() && !from.exists() {
                drop(fs::rename(to, from));
            }
        }
    }

    /// Writes the content to disk: a power failure after the names are in place must not leave
    /// empty files.
    fn sync_content(&self) -> Result<()> {
        for Move { from, .. } in self.companions.iter().chain([&self.main]) {
            File::open(from)
                .and_then(|file| file.sync_all())
                .map_err(|e| file_error(Action::Writing, from, e))?;
        }
        Ok(())
    }

    /// Encodes every move as kind, from and to, each ended by NUL, which no path contains.
    fn to_bytes(&self) -> Vec<u8> {
        let lists = [
            ("new", &self.companions[..]),
            ("old", &self.retired),
            ("main", std::slice::from_ref(&self.main)),
        ];
        let mut bytes = Vec::new();
        for (kind, moves) in lists {
            for Move { from, to } in moves {
                for text in [kind.as_bytes(), from.as_os_str().as_bytes(), to.as_os_str().as_bytes()] {
                    bytes.extend_from_slice(text);
                    bytes.push(0);
                }
            }
        }
        bytes
    }

    /// Decodes a journal; `None` when it was not written to its end, as then nothing was published.
    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let texts: Vec<&[u8]> = bytes.strip_suffix(&[0])?.split(|&byte| byte == 0).collect();
        let path = |text: &[u8]| PathBuf::from(OsStr::from_bytes(text));
        let mut publication = Publication::default();
        let mut complete = false;
        for entry in texts.chunks(3) {
            let &[kind, from, to] = entry else { return None };
            let entry = Move { from: path(from), to: path(to) };
            match kind {
                b"new" => publication.companions.push(entry),
                b"old" => publication.retired.push(entry),
                b"main" => (publication.main, complete) = (entry, true),
                _ => return None,
            }
        }
        complete.then_some(publication)
    }
}

/// Undoes the publication of a killed process unless its main file is in place.
pub fn recover(workplace: &Path) {
    let publication =
        fs::read(workplace.join(JOURNAL)).ok().and_then(|bytes| Publication::from_bytes(&bytes));
    if let Some(publication) = publication.filter(|publication| !publication.is_done()) {
        publication.undo();
    }
}

/// Links a file to a free place.
fn link(Move { from, to }: &Move) -> Result<()> {
    fs::hard_link(from, to).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => {
            Error::Exists { path: to.display().to_string(), remedy: "move it away, or give another name" }
        }
        _ => file_error(Action::Making, to, error),
    })
}

fn sync_folder(path: &Path) -> Result<()> {
    let folder = path.parent().unwrap_or(path);
    File::open(folder)
        .and_then(|folder| folder.sync_all())
        .map_err(|e| file_error(Action::WritingInto, folder, e))
}

fn write_durably(path: &Path, bytes: &[u8]) -> io::Result<()> {
    fs::write(path, bytes)?;
    File::open(path)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Scene {
        folder: tempfile::TempDir,
        publication: Publication,
    }

    impl Scene {
        fn new(overwrite: bool) -> Self {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            for name in ["work", "work/old"] {
                fs::create_dir(path(name)).unwrap();
            }
            for name in ["work/map.shp", "work/map.dbf", "work/ref.gpkg"] {
                fs::write(path(name), "new").unwrap();
            }
            let part = |from: &str, to: &str| Move { from: path(from), to: path(to) };
            let mut publication = Publication {
                companions: vec![part("work/ref.gpkg", "ref.gpkg"), part("work/map.dbf", "map.dbf")],
                retired: Vec::new(),
                main: part("work/map.shp", "map.shp"),
                overwrite,
            };
            if overwrite {
                for name in ["map.shp", "map.dbf"] {
                    fs::write(path(name), "old").unwrap();
                }
                publication.retired.push(part("map.dbf", "work/old/map.dbf"));
            }
            Scene { folder, publication }
        }

        fn read(&self, name: &str) -> Option<String> {
            fs::read_to_string(self.folder.path().join(name)).ok()
        }

        fn state(&self) -> [Option<String>; 3] {
            ["map.shp", "map.dbf", "ref.gpkg"].map(|name| self.read(name))
        }

        fn work(&self) -> PathBuf {
            self.folder.path().join("work")
        }
    }

    fn all(text: &str) -> [Option<String>; 3] {
        [(); 3].map(|()| Some(text.into()))
    }

    #[test]
    fn all_files_appear_and_replace_old_ones_only_when_told() {
        for overwrite in [false, true] {
            let scene = Scene::new(overwrite);
            scene.publication.run(&scene.work()).unwrap();
            recover(&scene.work());
            assert_eq!(scene.state(), all("new"), "and recovery leaves what is complete");
        }
    }

    #[test]
    fn a_place_that_is_taken_undoes_everything() {
        for taken in ["map.shp", "map.dbf", "ref.gpkg"] {
            let scene = Scene::new(false);
            fs::write(scene.folder.path().join(taken), "mine").unwrap();
            assert!(scene.publication.run(&scene.work()).is_err());
            let left: Vec<_> = scene.state().into_iter().flatten().collect();
            assert_eq!(left, ["mine"]);
        }
        let scene = Scene::new(true);
        fs::write(scene.folder.path().join("ref.gpkg"), "mine").unwrap();
        assert!(scene.publication.run(&scene.work()).is_err());
        assert_eq!(scene.state(), [Some("old".into()), Some("old".into()), Some("mine".into())]);
    }

    #[test]
    fn a_publication_that_was_cut_short_is_undone() {
        let scene = Scene::new(true);
        write_durably(&scene.work().join(JOURNAL), &scene.publication.to_bytes()).unwrap();
        let before = scene.state();
        for done in 0..3 {
            if done > 0 {
                fs::rename(&scene.publication.retired[0].from, &scene.publication.retired[0].to).unwrap();
            }
            scene.publication.companions.iter().take(done).for_each(|c| link(c).unwrap());
            recover(&scene.work());
            assert_eq!(scene.state(), before, "after {done} links");
        }
    }

    #[test]
    fn a_journal_that_ends_early_means_nothing_was_done() {
        let bytes = Scene::new(true).publication.to_bytes();
        for end in 0..bytes.len() {
            assert!(Publication::from_bytes(&bytes[..end]).is_none(), "{end}");
        }
        assert!(Publication::from_bytes(&bytes).is_some());
    }
}
