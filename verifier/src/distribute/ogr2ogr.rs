//! Copies by the program `ogr2ogr` of GDAL, which keeps what no function of the `gdal` crate can
//! write: feature ids, field subtypes, defaults, domains, metadata.

use crate::{Error, Result};
use meshmark_dataset::OPEN_OPTIONS;
use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// Copies a dataset to a new one of this format; returns the warnings of `ogr2ogr`.
pub fn copy(format: &str, from: &Path, to: &Path, options: &[&str]) -> Result<Vec<String>> {
    let mut command = Command::new("ogr2ogr");
    command
        .args(["-f", format])
        .args(OPEN_OPTIONS.iter().flat_map(|option| ["-oo", option]))
        .args(options)
        .arg(named(to))
        .arg(named(from))
        .stdin(Stdio::null());
    command.env("OGR2OGR_USE_ARROW_API", "NO"); // the Arrow path rounds FLOAT columns to 32 bits
    let output = command.output().map_err(|error| Error::NoOgr2ogr { source: error })?;
    let text = String::from_utf8_lossy(&output.stderr);
    let said = |kind: &str| -> Vec<String> {
        let lines = text.lines().filter_map(|line| line.strip_prefix(kind)?.split_once(": "));
        lines.map(|(_, text)| text.into()).collect()
    };
    let [warnings, errors] = ["Warning ", "ERROR "].map(said);
    if output.status.success() {
        // An error after which `ogr2ogr` continues is a warning here.
        let texts = warnings.into_iter().chain(errors);
        return Ok(grouped(texts)
            .into_iter()
            .map(|text| format!("ogr2ogr: {}", nameless(text, to)))
            .collect());
    }
    let reason = errors.into_iter().next().unwrap_or_else(|| output.status.to_string());
    Err(Error::Ogr2ogr { path: from.into(), format: format.into(), reason })
}

/// Groups texts that differ only in numbers, such as those of features, and returns the first of
/// each group with the number of the others.
fn grouped(texts: impl Iterator<Item = String>) -> Vec<String> {
    let (mut groups, mut known): (Vec<(String, usize)>, HashMap<String, usize>) = Default::default();
    for text in texts {
        let group = *known.entry(without_numbers(&text)).or_insert(groups.len());
        match groups.get_mut(group) {
            Some((_, more)) => *more += 1,
            None => groups.push((text, 0)),
        }
    }
    let said = |(text, more): (String, usize)| match more {
        0 => text,
        _ => format!("{text} (and {more} more like this)"),
    };
    groups.into_iter().map(said).collect()
}

/// Replaces numbers outside quotes; a quoted number is a name.
fn without_numbers(text: &str) -> String {
    let is_number = |word: &str| word.trim_end_matches(['.', ',', ':', ';']).parse::<f64>().is_ok();
    text.split(' ').map(|word| if is_number(word) { "0" } else { word }).collect::<Vec<_>>().join(" ")
}

/// Removes the folder of a private file from a text.
fn nameless(text: String, file: &Path) -> String {
    file.parent().map_or(text.clone(), |folder| text.replace(&format!("{}/", folder.display()), ""))
}

/// Prefixes a file name that begins with a dash, so that it is not read as an option.
fn named(path: &Path) -> PathBuf {
    match path.as_os_str().as_encoded_bytes().first() {
        Some(b'-') => Path::new(".").join(path),
        _ => path.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_that_differ_in_numbers_are_one() {
        let texts = [
            "value 1 of feature 7: cut",
            "name 'a1' to 'b'",
            "value 2.5 of feature 8: cut",
            "name 'a2' to 'b'",
        ];
        let expected =
            ["value 1 of feature 7: cut (and 1 more like this)", "name 'a1' to 'b'", "name 'a2' to 'b'"];
        assert_eq!(grouped(texts.iter().map(|text| text.to_string())), expected);
    }
}
