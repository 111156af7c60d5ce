//! A copy of the staged map with moved geometries: written, read back, published.

use super::{Job, copies::Copy, ogr2ogr};
use crate::{
    Error, Result,
    reading::{forget_failure, last_failure},
};
use gdal::{
    Dataset, DatasetOptions, GdalOpenFlags,
    vector::{Geometry, LayerAccess, sql::Dialect},
};
use meshmark_core::record::Distortion;
use meshmark_dataset::{
    Error as MapError,
    formats::Format,
    marking::{self, Moves, NotMoved},
    publication::{Move, Publication},
    read_back::Comparison,
    workplace::{Workplace, file_error},
};
use std::{ffi::OsStr, fs, path::Path};

/// What happens to files that nobody sees before they are synced and published.
const UNSEEN: [(&str, &str); 2] = [("OGR_SQLITE_SYNCHRONOUS", "OFF"), ("OGR_SQLITE_JOURNAL", "OFF")];

/// Writes, checks and publishes a copy and its record.
pub fn write(job: &Job, copy: &Copy, moved: &[[f64; 2]], distortion: Distortion) -> Result<()> {
    for (option, value) in UNSEEN {
        gdal::config::set_thread_local_config_option(option, value).map_err(MapError::from)?;
    }
    let moves = Moves { from: job.vertices, to: moved };
    let workplace = Workplace::new(job.folder)?;
    let folder = workplace.subfolder("out")?;
    let file = folder.join(copy.file.file_name().expect("a copy has a name"));
    if job.format.driver == "GPKG" {
        write_geopackage(job, &file, moves)?;
    } else {
        let staged = workplace.folder().join("marked.gpkg");
        write_geopackage(job, &staged, moves)?;
        ogr2ogr::copy(job.format.driver, &staged, &file, &[])?;
    }
    check(job, &file, moves)?;
    let reference = job.reference.clone();
    let record = marking::record(job.options, &copy.subject(), job.key, reference, distortion);
    publish(copy, &workplace, &folder, &record.to_json(), job.format)
}

/// The staged map with moved geometries, as a GeoPackage.
fn write_geopackage(job: &Job, path: &Path, moves: Moves) -> Result<()> {
    fs::copy(job.staged, path).map_err(|error| file_error("writing", path, error))?;
    let staged = open(job.staged, "GPKG", GdalOpenFlags::GDAL_OF_READONLY)?;
    let mut output = open(path, "GPKG", GdalOpenFlags::GDAL_OF_UPDATE)?;
    let failed = |error: gdal::errors::GdalError| Error::Usage(format!("writing failed: {}", why(error)));
    forget_failure();
    let transaction = output.start_transaction().map_err(failed)?;
    for number in 0..staged.layer_count() {
        let mut layer = staged.layer(number).map_err(failed)?;
        let name = layer.name();
        if !job.marks_layer(&name) {
            continue;
        }
        let target = transaction.layer(number).map_err(failed)?;
        for mut feature in layer.features() {
            let Ok(geometry) = feature.geometry_by_index(0) else { continue }; // a null geometry
            let mut bytes = geometry.iso_wkb().map_err(failed)?;
            match moves.geometry(&mut bytes) {
                Ok(0) => continue,
                Ok(_) => {}
                Err(error) => return Err(unknown(&name, feature.fid(), &error).into()),
            }
            feature.set_geometry(Geometry::from_wkb(&bytes).map_err(failed)?).map_err(failed)?;
            target.set_feature(feature).map_err(failed)?;
        }
    }
    transaction.commit().map_err(failed)?;
    for layer in output.layers() {
        let Some(column) = layer.defn().geom_fields().next() else { continue };
        let quoted = |name: String| name.replace('\'', "''");
        let (layer, column) = (layer.name(), column.name());
        let extent = format!("RECOMPUTE EXTENT ON {layer}");
        let index = format!("SELECT CreateSpatialIndex('{}', '{}')", quoted(layer), quoted(column));
        for sql in [extent, index] {
            output.execute_sql(sql, None, Dialect::DEFAULT).map_err(failed)?;
        }
    }
    output.close().map_err(failed)?;
    match last_failure() {
        None => Ok(()),
        Some(reason) => Err(Error::Usage(format!("writing failed: {reason}"))),
    }
}

fn unknown(layer: &str, fid: Option<u64>, error: &NotMoved) -> MapError {
    let reason = match error {
        NotMoved::UnknownVertex([x, y]) => format!("({x}, {y}) was not there when the map was read"),
        NotMoved::Wkb(error) => error.to_string(),
    };
    let fid = fid.map_or("without id".into(), |fid| fid.to_string());
    MapError::Geometry { layer: layer.into(), fid, reason }
}

/// Fails unless the file holds the features of the staged map, moved, within the precision of its format.
fn check(job: &Job, path: &Path, moves: Moves) -> Result<()> {
    let driver = job.format.driver;
    let staged = open(job.staged, "GPKG", GdalOpenFlags::GDAL_OF_READONLY)?;
    let file = open(path, driver, GdalOpenFlags::GDAL_OF_READONLY)?;
    let magnitude = moves.to.iter().flatten().fold(0f64, |most, v| most.max(v.abs()));
    for number in 0..staged.layer_count() {
        let (meant, in_file) = (staged.layer(number), file.layer(number));
        let layer = meant.as_ref().map_or_else(|_| number.to_string(), LayerAccess::name);
        let is_marked = job.marks_layer(&layer);
        forget_failure();
        let comparison = Comparison {
            tolerance: job.format.tolerance(&[], magnitude),
            place: &|point| if is_marked { moves.of(point) } else { Some(point) },
            last_failure: &last_failure,
        };
        let compared = comparison.layers(meant, in_file, None);
        compared.map_err(|difference| MapError::NotKept { driver, layer, difference })?;
    }
    Ok(())
}

/// Puts the record and the files in `folder` into their places, the main file last.
fn publish(copy: &Copy, workplace: &Workplace, folder: &Path, record: &str, format: &Format) -> Result<()> {
    let mut publication = Publication::default();
    // Without links and from the root: who takes a publication back may be elsewhere.
    let places = workplace.folder().parent().expect("a workplace is in a folder");
    let place = |name: Option<&OsStr>| places.join(name.expect("a copy has a name"));
    let is_there = fs::read(&copy.record).is_ok_and(|bytes| bytes == record.as_bytes());
    if !is_there {
        let staged = workplace.folder().join("record.json");
        fs::write(&staged, record).map_err(|error| file_error("writing", &staged, error))?;
        publication.companions.push(Move { from: staged, to: place(copy.record.file_name()) });
    }
    let entries = fs::read_dir(folder).map_err(|error| file_error("reading", folder, error))?;
    for entry in entries.flatten() {
        if entry.path().is_dir() {
            return Err(MapError::Folder { driver: format.driver }.into());
        }
        let part = Move { to: place(Some(&entry.file_name())), from: entry.path() };
        match part.to.file_name() == copy.file.file_name() {
            true => publication.main = part,
            false => publication.companions.push(part),
        }
    }
    Ok(publication.run(workplace.folder())?)
}

fn open(path: &Path, driver: &str, mode: GdalOpenFlags) -> Result<Dataset> {
    let options = DatasetOptions {
        open_flags: mode | GdalOpenFlags::GDAL_OF_VECTOR,
        allowed_drivers: Some(&[driver]),
        ..DatasetOptions::default()
    };
    forget_failure();
    Dataset::open_ex(path, options)
        .map_err(|error| Error::Usage(format!("opening {} failed: {}", path.display(), why(error))))
}

fn why(error: gdal::errors::GdalError) -> String {
    last_failure().unwrap_or_else(|| error.to_string())
}
