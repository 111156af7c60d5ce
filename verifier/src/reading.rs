//! Reading: key, record, reference and suspect, with errors that name the file.

use crate::{Error, Result};
use gdal::{Dataset, DatasetOptions, GdalOpenFlags, vector::LayerAccess};
use meshmark_core::{key::SecretKey, record::Record};
use meshmark_dataset::{LabelFields, MOST_VERTICES, Selection, Survey, Target, survey};
use std::{collections::BTreeSet, path::Path, sync::Mutex};

/// What a suspect may be: local files of plain formats. No format that points at other data (VRT,
/// SQL, network), for a suspect may be made to mislead; and not MESHMARK.
const SUSPECT_DRIVERS: &[&str] = &[
    "GPKG",
    "ESRI Shapefile",
    "GeoJSON",
    "GeoJSONSeq",
    "FlatGeobuf",
    "GML",
    "KML",
    "LIBKML",
    "MapInfo File",
    "DXF",
    "CSV",
    "SQLite",
    "TopoJSON",
];

/// GDAL's last error message, kept instead of printed.
static LAST_FAILURE: Mutex<Option<String>> = Mutex::new(None);

/// Keeps GDAL from printing; its messages become part of ours. Call once, before anything else.
pub fn quieten_gdal() {
    gdal::config::set_error_handler(|kind, _, message| {
        if matches!(kind, gdal::errors::CplErrType::Failure | gdal::errors::CplErrType::Fatal) {
            *last_failure() = Some(message.to_string());
        }
    });
}

fn last_failure() -> std::sync::MutexGuard<'static, Option<String>> {
    LAST_FAILURE.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Reads a key file.
pub fn key(path: &Path) -> Result<SecretKey> {
    let text = zeroize::Zeroizing::new(text("key", path)?);
    SecretKey::from_json(&text).map_err(|error| Error::Usage(format!("{}: {error}", path.display())))
}

/// Reads a record.
pub fn record(path: &Path) -> Result<Record> {
    Record::from_json(&text("record", path)?)
        .map_err(|error| Error::Usage(format!("{}: {error}", path.display())))
}

fn text(what: &str, path: &Path) -> Result<String> {
    std::fs::read_to_string(path)
        .map_err(|error| Error::Usage(format!("the {what} {} cannot be read: {error}", path.display())))
}

/// How to read a map.
pub struct Reading<'a> {
    /// Layers that form it.
    pub layers: Option<&'a [String]>,
    /// Its CRS when it has none.
    pub srs: Option<&'a str>,
    /// Attributes to take as landmarks.
    pub landmarks: LabelFields<'a>,
}

/// Reads the reference: any vector dataset GDAL opens.
pub fn reference(path: &Path, reading: &Reading) -> Result<Survey> {
    let dataset = open("reference", path, None)?;
    if let LabelFields::Named(names) = reading.landmarks {
        check_fields(path, &dataset, names)?;
    }
    read("reference", path, &dataset, reading, Target::Own)
}

/// A misspelt field would leave no landmark, and nobody would know why.
fn check_fields(path: &Path, dataset: &Dataset, names: &[String]) -> Result<()> {
    let fields_of = |layer: gdal::vector::Layer| layer.defn().fields().map(|f| f.name()).collect::<Vec<_>>();
    let known: BTreeSet<String> = dataset.layers().flat_map(fields_of).collect();
    let unknown = names.iter().find(|name| !known.iter().any(|field| field.eq_ignore_ascii_case(name)));
    let Some(name) = unknown else { return Ok(()) };
    let known = known.into_iter().collect::<Vec<_>>().join(", ");
    let path = path.display();
    Err(Error::Usage(format!("the reference {path} has no field \"{name}\": --landmark may name {known}")))
}

/// Reads the suspect in the CRS of the reference, where both are known.
pub fn suspect(path: &Path, reading: &Reading, reference: &Survey) -> Result<Survey> {
    if !path.exists() {
        let path = path.display();
        return Err(Error::Unreadable(format!("the suspect {path} is not a file here: give a local file")));
    }
    let dataset = open("suspect", path, Some(SUSPECT_DRIVERS))?;
    let target = reference.crs.as_ref().map_or(Target::Raw, Target::Crs);
    read("suspect", path, &dataset, reading, target)
}

fn open(what: &str, path: &Path, allowed_drivers: Option<&[&str]>) -> Result<Dataset> {
    *last_failure() = None;
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_VECTOR | GdalOpenFlags::GDAL_OF_VERBOSE_ERROR,
        allowed_drivers,
        ..Default::default()
    };
    Dataset::open_ex(path, options).map_err(|error| {
        let reason = last_failure().take().unwrap_or_else(|| error.to_string());
        let formats =
            allowed_drivers.map_or(String::new(), |d| format!(" (a suspect may be {})", d.join(", ")));
        Error::Unreadable(format!("the {what} {} cannot be opened: {reason}{formats}", path.display()))
    })
}

fn read(what: &str, path: &Path, dataset: &Dataset, reading: &Reading, target: Target) -> Result<Survey> {
    *last_failure() = None;
    let selection = Selection {
        layers: reading.layers,
        srs: reading.srs,
        labels: reading.landmarks,
        target,
        most_vertices: MOST_VERTICES,
        last_failure: &|| last_failure().clone(),
    };
    survey(dataset, &selection).map_err(|error| {
        let text = format!("the {what} {}: {error}", path.display());
        match error {
            meshmark_dataset::Error::TooLarge { .. } => Error::TooLarge(text),
            meshmark_dataset::Error::UnknownLayer { .. }
            | meshmark_dataset::Error::UnknownSrs(_)
            | meshmark_dataset::Error::ContradictingSrs { .. } => Error::Usage(text),
            _ => Error::Unreadable(text),
        }
    })
}
