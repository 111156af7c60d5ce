//! The formats of suspects: those that are read, and the command that converts any other.

use super::{
    gdal_failures::GdalFailure,
    unsuitable::{BadDrawing, Unsuitable},
};
use crate::{Error, words::quoted};
use gdal::{DriverManager, Metadata};
use std::path::{Path, PathBuf};

/// A format, and GDAL's driver for it.
struct Format {
    name: &'static str,
    /// The driver; `None` for a format that refers to other data or that no driver reads safely.
    driver: Option<&'static str>,
    /// The endings of file names, lower case.
    endings: &'static [&'static str],
}

/// The formats with drivers that some versions of GDAL lack, and those that are never read.
const FORMATS: &[Format] = &[
    // ".osm.pbf" precedes ".pbf".
    Format { name: "OpenStreetMap data", driver: None, endings: &[".osm.pbf", ".osm", ".osm.bz2"] },
    Format { name: "a spreadsheet", driver: None, endings: &[".xlsx", ".xls", ".ods"] },
    Format { name: "a File Geodatabase", driver: Some("OpenFileGDB"), endings: &[".gdb", ".gdb.zip"] },
    Format { name: "a GPX file", driver: Some("GPX"), endings: &[".gpx"] },
    Format { name: "a vector tile", driver: Some("MVT"), endings: &[".pbf", ".mvt"] },
    Format { name: "an MBTiles file", driver: Some("MBTiles"), endings: &[".mbtiles"] },
    Format { name: "a PMTiles file", driver: Some("PMTiles"), endings: &[".pmtiles"] },
    Format { name: "a GeoParquet file", driver: Some("Parquet"), endings: &[".parquet", ".geoparquet"] },
    Format { name: "a PDF file", driver: Some("PDF"), endings: &[".pdf"] },
];

/// The drivers for suspects: local files of plain formats. Formats that refer to other data (VRT,
/// SQL, network) are excluded, as a suspect may be manipulated, and so is MESHMARK.
const DRIVERS: &[&str] = &[
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
    "OpenFileGDB",
    "GPX",
    "MVT",
    "MBTiles",
    "PMTiles",
    "Parquet",
    "PDF",
];

/// Returns the drivers for suspects that this GDAL has.
pub(super) fn drivers() -> Vec<&'static str> {
    DRIVERS.iter().copied().filter(|name| reads(name)).collect()
}

/// Returns whether this GDAL has the driver, and has it with the libraries that it reads with.
fn reads(driver: &str) -> bool {
    DriverManager::get_driver_by_name(driver)
        .is_ok_and(|driver| driver.metadata_item("DCAP_OPEN", "").is_some_and(|yes| yes == "YES"))
}

/// Returns whether a file name has an ending of the driver.
fn has_ending(driver: &str, name: &str) -> bool {
    let extensions = DriverManager::get_driver_by_name(driver).ok();
    let extensions = extensions.and_then(|driver| driver.metadata_item("DMD_EXTENSIONS", ""));
    extensions.is_some_and(|all| all.split(' ').any(|ending| name.ends_with(&format!(".{ending}"))))
}

/// Refuses a suspect in a format for which there is no driver.
pub(super) fn check(path: &Path) -> Result<(), Error> {
    let name = file_name(path).to_lowercase();
    let is_format = |format: &&Format| format.endings.iter().any(|ending| name.ends_with(ending));
    let Some(Format { name, driver, .. }) = FORMATS.iter().find(is_format) else { return Ok(()) };
    let (reason, place) = match driver {
        None => (Unsuitable::Format { name }, ""),
        Some(driver) if !reads(driver) => {
            (Unsuitable::NoDriver { name, driver }, " on a machine whose GDAL has this driver")
        }
        Some(_) => return Ok(()),
    };
    Err(Error::Unconverted { path: path.into(), reason: Box::new(reason), command: conversion(path), place })
}

/// Returns the error for a suspect that no driver opens.
pub(super) fn unopened(path: &Path, source: GdalFailure) -> Error {
    let name = file_name(path);
    let lower = name.to_lowercase();
    let shown = word(path);
    let (reason, command) = if lower.ends_with(".svgz") {
        (Unsuitable::CompressedDrawing, format!("gunzip -c {shown} > {}", word(&renamed(path, "svg"))))
    } else if lower.ends_with(".gz") {
        (Unsuitable::Compressed, format!("gunzip -k {shown}"))
    } else if lower.ends_with(".zip") {
        (Unsuitable::Zip { source }, format!("unzip {shown}"))
    } else if drivers().into_iter().any(|driver| has_ending(driver, &lower)) {
        return Error::Unopened { what: "suspect", path: path.into(), source }; // a broken file
    } else {
        let known = drivers().join(", ");
        (Unsuitable::Unopened { source, known }, conversion(path))
    };
    unconverted(path, reason, command)
}

/// Returns the error for an SVG file that is refused.
pub(super) fn unread_drawing(path: &Path, reason: BadDrawing) -> Error {
    let copy = word(&renamed(path, "svg"));
    let command = format!("inkscape --export-plain-svg --export-filename={copy} {}", word(path));
    unconverted(path, reason.into(), command)
}

/// Returns the error for a table in which no column is recognised as coordinates.
pub(super) fn table_without_coordinates(path: &Path) -> Error {
    let options = "-oo X_POSSIBLE_NAMES=column -oo Y_POSSIBLE_NAMES=column";
    let command = format!("{} {options}", conversion(path));
    unconverted(path, Unsuitable::NoCoordinates, command)
}

fn unconverted(path: &Path, reason: Unsuitable, command: String) -> Error {
    Error::Unconverted { path: path.into(), reason: Box::new(reason), command, place: "" }
}

/// Returns the command that converts a suspect to a GeoPackage.
fn conversion(path: &Path) -> String {
    format!("ogr2ogr {} {}", word(&renamed(path, "gpkg")), word(path))
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the path with another extension, or with another name where that would be the same path.
fn renamed(path: &Path, extension: &str) -> PathBuf {
    let renamed = path.with_extension(extension);
    if renamed == path { path.with_extension(format!("copy.{extension}")) } else { renamed }
}

fn word(path: &Path) -> String {
    quoted(&path.display().to_string())
}
