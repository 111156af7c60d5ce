//! Copies by GDAL's own program, which keeps what no function of the `gdal` crate can write: feature ids, field
//! subtypes, defaults, domains, metadata.

use crate::{Error, Result};
use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// Copies a dataset to a new one of this format; what `ogr2ogr` warned of.
pub fn copy(format: &str, from: &Path, to: &Path, options: &[&str]) -> Result<Vec<String>> {
    let mut command = Command::new("ogr2ogr");
    // A GeoJSON file may say in its own words what extent it had.
    command
        .args(["-f", format, "-noNativeData"])
        .args(options)
        .arg(named(to))
        .arg(named(from))
        .stdin(Stdio::null());
    command.env("OGR2OGR_USE_ARROW_API", "NO"); // which rounds what a column FLOAT holds to 32 bits
    let output = command.output().map_err(|error| {
        Error::Usage(format!("ogr2ogr cannot be run ({error}): install GDAL's programs (package gdal-bin)"))
    })?;
    let text = String::from_utf8_lossy(&output.stderr);
    let said = |kind: &str| -> Vec<String> {
        let lines = text.lines().filter_map(|line| line.strip_prefix(kind)?.split_once(": "));
        lines.map(|(_, text)| text.into()).collect()
    };
    if output.status.success() {
        return Ok(said("Warning ")
            .into_iter()
            .map(|text| format!("ogr2ogr: {}", nameless(text, to)))
            .collect());
    }
    let reason = said("ERROR ").into_iter().next().unwrap_or_else(|| output.status.to_string());
    Err(Error::Unreadable(format!("{} cannot be copied to {format}: {reason}", from.display())))
}

/// Without the folder of a file that nobody is to look for.
fn nameless(text: String, file: &Path) -> String {
    file.parent().map_or(text.clone(), |folder| text.replace(&format!("{}/", folder.display()), ""))
}

/// A file name that begins with a dash is no option.
fn named(path: &Path) -> PathBuf {
    match path.as_os_str().as_encoded_bytes().first() {
        Some(b'-') => Path::new(".").join(path),
        _ => path.into(),
    }
}
