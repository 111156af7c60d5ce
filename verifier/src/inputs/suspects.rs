//! Suspects, which may be manipulated: only local files of plain formats are read, without network.

use super::{
    gdal_failures::{GdalFailure, forget_failure, named_as},
    journal,
    maps::{Reading, failed, first_crs, open_with, selection},
    private_copy::PrivateCopy,
    suspect_formats, svg, tables,
};
use crate::{Cause, Error, Result};
use gdal::{Dataset, vector::LayerAccess};
use meshmark_dataset::{CoordinateSystem, LabelFields, numbers};
use meshmark_marking::Crs;
use meshmark_verification::{Suspect, words::printable};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

/// A suspect is read whole, with all its attributes.
const WHOLE: Reading =
    Reading { layers: None, srs: None, recorded_crs: None, landmarks: LabelFields::All, geometries: false };

/// Reads the suspect.
pub fn suspect(suspect: &PrivateCopy) -> Result<Suspect<CoordinateSystem>> {
    let _names = named_as(suspect.original(), suspect.copy());
    let dataset = open_suspect(suspect)?;
    let (layer_crs, crs) = (crs_of(&dataset), first_crs(&dataset));
    forget_failure();
    let numbers = numbers(&dataset, &selection(&WHOLE));
    let numbers = numbers.map_err(|error| failed("suspect", suspect.original(), error))?;
    Ok(Suspect { numbers, layer_crs, crs })
}

fn open_suspect(suspect: &PrivateCopy) -> Result<Dataset> {
    let (path, copy) = (suspect.original(), suspect.copy());
    forbid_network().map_err(|source| Error::NoOption { source })?;
    check_table(suspect)?;
    suspect_formats::check(path)?;
    if svg::is_named(copy) {
        return svg::open(copy, path);
    }
    journal::roll_back("suspect", suspect)?;
    restore_indices(copy).map_err(|source| Error::NoOption { source })?;
    let place = highest_zoom(copy).unwrap_or_else(|| copy.into());
    let dataset = open_plain(&place, &[]).map_err(|failure| suspect_formats::unopened(path, failure))?;
    check_plain(suspect, &dataset)?;
    if dataset.driver().short_name() == "CSV" && tables::is_without_geometry(&dataset) {
        return open_table(suspect, &dataset);
    }
    Ok(dataset)
}

fn open_plain(path: &Path, options: &[String]) -> std::result::Result<Dataset, GdalFailure> {
    open_with(path, Some(&suspect_formats::drivers()), options)
}

/// Opens a table again, with the columns of its coordinates.
fn open_table(suspect: &PrivateCopy, table: &Dataset) -> Result<Dataset> {
    let path = suspect.original();
    let options =
        tables::open_options(table).ok_or_else(|| suspect_formats::table_without_coordinates(path))?;
    open_plain(suspect.copy(), &options).map_err(|failure| suspect_formats::unopened(path, failure))
}

/// Returns the folder of the highest zoom of a folder of tiles, named z/x/y.pbf.
fn highest_zoom(path: &Path) -> Option<PathBuf> {
    let zooms = numbered(path).into_iter().filter(|(_, zoom)| !numbered(zoom).is_empty());
    Some(zooms.max_by_key(|&(zoom, _)| zoom)?.1)
}

/// Returns what a folder has under numbers.
fn numbered(folder: &Path) -> Vec<(u32, PathBuf)> {
    let entries = folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
    entries.filter_map(|entry| Some((entry.file_name()?.to_str()?.parse().ok()?, entry))).collect()
}

/// Prevents network access. A suspect may name addresses, as the CRS of a GeoJSON file or as the
/// schema of a GML file; a request would reveal the examination, and its answer could falsify it.
fn forbid_network() -> gdal::errors::Result<()> {
    for (option, value) in [
        ("GDAL_HTTP_PROXY", "127.0.0.1:0"), // no process can listen on port 0
        ("GDAL_HTTPS_PROXY", "127.0.0.1:0"),
        ("CPL_VSIL_CURL_ALLOWED_FILENAME", "none"),
        ("GML_DOWNLOAD_SCHEMA", "NO"),
        ("GML_SKIP_RESOLVE_ELEMS", "ALL"),
        ("ALLOW_OGR_SQL_FUNCTIONS_FROM_TRIGGER_AND_VIEW", "NO"),
        ("OGR_SQLITE_LOAD_EXTENSIONS", ""),
        ("SPATIALITE_SECURITY", "strict"),
    ] {
        gdal::config::set_thread_local_config_option(option, value)?;
    }
    Ok(())
}

/// Makes the lost indices of Shapefiles anew, beside the copy. GDAL would replace those that are there.
fn restore_indices(copy: &Path) -> gdal::errors::Result<()> {
    const RESTORE: &str = "SHAPE_RESTORE_SHX";
    let lost = |shape: &PathBuf| !["shx", "SHX"].iter().any(|ending| shape.with_extension(ending).exists());
    for shape in files_with_ending(copy, "shp").iter().filter(|shape| lost(shape)) {
        gdal::config::set_thread_local_config_option(RESTORE, "YES")?;
        drop(open_plain(shape, &[])); // the reason of a failure comes later
        gdal::config::clear_thread_local_config_option(RESTORE)?;
    }
    Ok(())
}

/// Returns a file, or the files in a folder, if they have this ending.
fn files_with_ending(path: &Path, ending: &str) -> Vec<PathBuf> {
    let has_ending =
        |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) && path.is_file();
    match path.read_dir() {
        Ok(entries) => entries.flatten().map(|entry| entry.path()).filter(|p| has_ending(p)).collect(),
        Err(_) => has_ending(path).then(|| path.into()).into_iter().collect(),
    }
}

/// Refuses MapInfo tables that refer to other tables, which may be anywhere.
fn check_table(suspect: &PrivateCopy) -> Result<()> {
    for table in files_with_ending(suspect.copy(), "tab") {
        let Ok(bytes) = std::fs::read(&table) else { continue }; // GDAL reports the reason later
        let text = String::from_utf8_lossy(&bytes).to_lowercase();
        let seamless = text.lines().any(|line| line.contains("isseamless") && line.contains("true"));
        if seamless || text.contains("create view") {
            return Err(Error::OtherTables { path: suspect.original_of(&table) });
        }
    }
    Ok(())
}

/// Virtual tables with their data in the database itself; all others may refer to other files.
const PLAIN_MODULES: &[&str] = &[
    "rtree",
    "rtree_i32",
    "fts3",
    "fts4",
    "fts5",
    "virtualspatialindex",
    "virtualelementary",
    "virtualknn",
    "virtualknn2",
];

/// What a forged schema says of tables may have any type, page and spacing, and SQLite uses only its text.
const VIRTUAL_TABLES: &str = "SELECT name, sql FROM sqlite_master WHERE sql LIKE '%VIRTUAL%USING%'";

/// Refuses a database with virtual tables that take their rows from elsewhere.
fn check_plain(suspect: &PrivateCopy, dataset: &Dataset) -> Result<()> {
    let path = suspect.original();
    let failed = |cause: Cause| Error::Unread { path: path.into(), source: Box::new(cause) };
    let tables = match dataset.driver().short_name().as_str() {
        "GPKG" | "SQLite" => virtual_tables(dataset).map_err(|error| failed(error.into()))?,
        "MBTiles" => virtual_tables_of_tiles(suspect.copy()).map_err(|error| failed(error.into()))?,
        _ => return Ok(()),
    };
    match tables.into_iter().find(|(_, sql)| !is_plain(sql)) {
        Some((table, _)) => {
            Err(Error::VirtualTable { path: path.into(), table: table.escape_debug().to_string() })
        }
        None => Ok(()),
    }
}

/// Returns names and definitions.
fn virtual_tables(dataset: &Dataset) -> gdal::errors::Result<Vec<(String, String)>> {
    let tables = dataset.execute_sql(VIRTUAL_TABLES, None, gdal::vector::sql::Dialect::DEFAULT)?;
    let Some(mut tables) = tables else { return Ok(Vec::new()) };
    let text = |table: &gdal::vector::Feature, field: usize| {
        table.field_as_string(field).ok().flatten().unwrap_or_default()
    };
    Ok(tables.features().map(|table| (text(&table, 0), text(&table, 1))).collect())
}

/// Returns names and definitions; GDAL's driver for MBTiles accepts no SQL.
fn virtual_tables_of_tiles(path: &Path) -> rusqlite::Result<Vec<(String, String)>> {
    let database = rusqlite::Connection::open_with_flags(path, rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    let text = |row: &rusqlite::Row, column: usize| {
        row.get_ref(column)
            .map(|value| String::from_utf8_lossy(value.as_bytes().unwrap_or_default()).into_owned())
    };
    let mut query = database.prepare(VIRTUAL_TABLES)?;
    query.query_map((), |row| Ok((text(row, 0)?, text(row, 1)?)))?.collect()
}

/// Returns whether the module of CREATE VIRTUAL TABLE name USING module(…) is a plain one. Every
/// "using" must precede a plain module, so a name that contains "using" cannot hide another module.
fn is_plain(sql: &str) -> bool {
    let sql = sql.to_lowercase();
    let modules = sql.split("using").skip(1).map(|rest| {
        let word = rest.trim_start().split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        word.into_iter().next().unwrap_or_default()
    });
    let mut modules = modules.peekable();
    modules.peek().is_some() && modules.all(|module| PLAIN_MODULES.contains(&module))
}

fn crs_of(dataset: &Dataset) -> Vec<String> {
    let label = |layer: gdal::vector::Layer| {
        let crs = layer.spatial_ref().and_then(CoordinateSystem::of_layer);
        crs.map(|crs| printable(&crs.brief_name())).unwrap_or_else(|| "no CRS".into())
    };
    dataset.layers().map(label).collect::<BTreeSet<_>>().into_iter().collect()
}
