//! The target of ogr2ogr, read from its command line.
//!
//! Writers of several files, like that of Shapefiles, append to the files of a folder without
//! a call of the driver that reads them. With `ogr2ogr folder MESHMARK:folder` the marked features
//! would go into the source itself, so this is refused before anything is written. A record in the
//! place of the output is refused too, as one would overwrite the other. Other hosts are not
//! examined.

use crate::{
    error::{Error, Result},
    source_files::{SourceFiles, same_place},
};
use meshmark_dataset::marked_view;
use std::path::Path;

/// Options of ogr2ogr that name another input.
const INPUT_OPTIONS: [&str; 2] = ["-clipsrc", "-clipdst"];

/// Fails when this process is an ogr2ogr whose target is the source, or the folder of its files.
pub fn check_is_not_source(files: &SourceFiles) -> Result<()> {
    match target(&arguments(), |path| files.contain_or_lie_in(path)) {
        Some(path) => Err(Error::OutputIsSource { path: path.into() }),
        None => Ok(()),
    }
}

/// Fails when this process is an ogr2ogr whose target is the record.
pub fn check_is_not_record(record: &str) -> Result<()> {
    match target(&arguments(), |path| same_place(path, Path::new(record))) {
        Some(_) => Err(Error::RecordIsOther { path: record.into(), what: "output" }),
        None => Ok(()),
    }
}

/// Fails when this process is an ogr2ogr whose target is another input of the marking, which `option`
/// names.
pub fn check_is_not_input(option: &'static str, paths: &[String]) -> Result<()> {
    let is_input = |path: &Path| paths.iter().any(|input| same_place(path, Path::new(input)));
    match target(&arguments(), is_input) {
        Some(_) => Err(Error::SameFile { option, other: "the output" }),
        None => Ok(()),
    }
}

fn arguments() -> Vec<String> {
    std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect()
}

/// Returns what follows the name of the program on the command line of this process, if it is an
/// ogr2ogr.
pub fn ogr2ogr_arguments() -> Option<Vec<String>> {
    of_ogr2ogr(&arguments()).map(<[String]>::to_vec)
}

fn of_ogr2ogr(arguments: &[String]) -> Option<&[String]> {
    let (program, rest) = arguments.split_first()?;
    (Path::new(program).file_name()? == "ogr2ogr").then_some(rest)
}

/// Returns the target of ogr2ogr, if `is_accepted` accepts it. The target precedes the source;
/// options and their values stand before and between them.
fn target(arguments: &[String], is_accepted: impl Fn(&Path) -> bool) -> Option<&str> {
    let rest = of_ogr2ogr(arguments)?;
    let source = rest.iter().position(marked_view::is_named_by)?;
    let is_input = |at: usize| at > 0 && INPUT_OPTIONS.contains(&rest[at - 1].as_str());
    let named = (0..source).find(|&at| !is_input(at) && is_accepted(Path::new(&rest[at])))?;
    Some(&rest[named])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(line: &str) -> bool {
        let arguments: Vec<String> = line.split(' ').map(String::from).collect();
        target(&arguments, |path| path == Path::new("map")).is_some()
    }

    #[test]
    fn only_a_target_of_ogr2ogr_that_is_the_source_is_refused() {
        assert!(refused("/usr/bin/ogr2ogr map MESHMARK:map -oo KEY=k"));
        assert!(refused("ogr2ogr -append map -oo KEY=k meshmark:map/roads.shp"));
        assert!(!refused("ogr2ogr out MESHMARK:map map"), "a layer of that name");
        assert!(!refused("ogr2ogr -clipsrc map out MESHMARK:map"), "another input");
        assert!(!refused("python3 map MESHMARK:map"), "another program");
        assert!(!refused("ogr2ogr out map"), "without us");
    }
}
