//! Makes fixtures/vectors again: key, record, marked map and the intermediate values.
//!
//! The marked map and the record come from the driver, through ogr2ogr, as a user makes them; build
//! it first (`make build`). Its folder is target/release/gdalplugins, or GDAL_DRIVER_PATH when that
//! is set.

use meshmark_host_tests::vectors::{self, Marking, RECIPIENT};
use std::{fs, io, path::Path, process::Command};

fn main() -> io::Result<()> {
    let folder = vectors::folder();
    fs::create_dir_all(&folder)?;
    for old in ["record.json", "marked.gpkg"] {
        match fs::remove_file(folder.join(old)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    fs::write(folder.join("key.json"), vectors::key().to_json().as_bytes())?;
    mark(&folder)?;
    fs::write(folder.join("steps.json"), vectors::to_text(&Marking::new().steps()))
}

/// `ogr2ogr` through the driver, with a fixed date so that the same map has the same bytes.
fn mark(folder: &Path) -> io::Result<()> {
    let plugins = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/release/gdalplugins");
    let plugins = std::env::var_os("GDAL_DRIVER_PATH").unwrap_or(plugins.into());
    let status = Command::new("ogr2ogr")
        .current_dir(folder)
        .env("GDAL_DRIVER_PATH", plugins)
        .env("OGR_CURRENT_DATE", "2026-01-01T00:00:00.000Z")
        .args(["-f", "GPKG", "marked.gpkg", "MESHMARK:../kotka.gpkg"])
        .args(["-oo", "KEY=key.json", "-oo", "RECORD=record.json", "-oo", "CODE=REPETITION"])
        .args(["-oo", &format!("RECIPIENT={RECIPIENT}")])
        .status()?;
    if status.success() { Ok(()) } else { Err(io::Error::other(format!("ogr2ogr: {status}"))) }
}
