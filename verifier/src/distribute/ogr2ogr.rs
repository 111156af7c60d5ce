//! Copies by GDAL's own program, which keeps what no function of the `gdal` crate can write: feature ids, field
//! subtypes, defaults, domains, metadata.

use crate::{Error, Result};
use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// Copies a dataset to a new one of this format.
pub fn copy(format: &str, from: &Path, to: &Path, options: &[&str]) -> Result<()> {
    let mut command = Command::new("ogr2ogr");
    command.args(["-f", format]).args(options).arg(named(to)).arg(named(from)).stdin(Stdio::null());
    let output = command.output().map_err(|error| {
        Error::Usage(format!("ogr2ogr cannot be run ({error}): install GDAL's programs (package gdal-bin)"))
    })?;
    if output.status.success() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&output.stderr);
    let reason = text.lines().find_map(|line| line.strip_prefix("ERROR ")?.split_once(": "));
    let reason = reason.map_or_else(|| output.status.to_string(), |(_, reason)| reason.into());
    Err(Error::Unreadable(format!("{} cannot be copied to {format}: {reason}", from.display())))
}

/// A file name that begins with a dash is no option.
fn named(path: &Path) -> PathBuf {
    match path.as_os_str().as_encoded_bytes().first() {
        Some(b'-') => Path::new(".").join(path),
        _ => path.into(),
    }
}
