//! Writes fixtures/vectors anew: key, record, marked map and the intermediate values of both
//! versions of the mark.
//!
//! The marked map and the record come from the driver, through ogr2ogr, as a user makes them; build
//! it first (`make build`).

use meshmark_host_tests::{
    Result, fingerprint_vectors,
    product::{Product, marking_arguments},
    vectors::{self, RECIPIENT, ReferenceMarking},
};
use std::{fs, io, path::Path};

fn main() -> Result<()> {
    let folder = vectors::folder();
    fs::create_dir_all(&folder)?;
    for old in ["record.json", "marked.gpkg"] {
        match fs::remove_file(folder.join(old)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error.into()),
            _ => {}
        }
    }
    fs::write(folder.join("key.json"), vectors::key().to_json().as_bytes())?;
    mark(&folder, &["KEY=key.json", "RECORD=record.json", "CODE=REPETITION"], "../kotka.gpkg")?;
    let steps = vectors::to_text(&ReferenceMarking::new().steps());
    fs::write(folder.join("steps.json"), steps)?;
    let (folder, (steps, record)) = (fingerprint_vectors::folder(), fingerprint_vectors::steps_and_record());
    fs::create_dir_all(&folder)?;
    fs::write(folder.join("steps.json"), vectors::to_text(&steps))?;
    let _ = fs::remove_file(folder.join("marked.gpkg"));
    mark(&folder, &["KEY=../key.json"], "../../kotka.gpkg")?;
    Ok(fs::write(folder.join("record.json"), record.to_json())?)
}

/// Runs `ogr2ogr` through the driver, with a fixed date so that the same map has the same bytes.
fn mark(folder: &Path, options: &[&str], source: &str) -> Result<()> {
    let options = options.iter().map(|option| option.to_string());
    let options = options.chain([format!("RECIPIENT={RECIPIENT}")]);
    let status = Product::of_this_build()?
        .ogr2ogr()
        .current_dir(folder)
        .env("OGR_CURRENT_DATE", "2026-01-01T00:00:00.000Z")
        .args(marking_arguments("GPKG", "marked.gpkg", source, options))
        .status()?;
    if status.success() { Ok(()) } else { Err(format!("ogr2ogr: {status}").into()) }
}
