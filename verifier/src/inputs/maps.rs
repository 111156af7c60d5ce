//! Maps: references, and maps that are marked or compared.

use super::{
    belonging_files::has_logs,
    gdal_failures::{GdalFailure, Names, forget_failure, last_failure, named_as},
    journal, plain,
    private_copy::PrivateCopy,
};
use crate::{Error, Result};
use gdal::{Dataset, DatasetOptions, GdalOpenFlags, vector::LayerAccess};
use meshmark_core::{
    fingerprint_record::BaseEntry,
    ground::Ground,
    options::{Options, Spelling},
};
use meshmark_dataset::{
    CoordinateSystem, LabelFields, MOST_VERTICES, OPEN_OPTIONS, Selection, Survey, features, marked_view,
    survey,
    traces::{self, ForeignMembers},
};
use meshmark_verification::compare::Compared;
use std::{collections::BTreeSet, path::Path};

/// The way to read a map.
pub struct Reading<'a> {
    /// Layers that form the map; all without names.
    pub layers: Option<&'a [String]>,
    /// CRS of a map that has none.
    pub srs: Option<&'a str>,
    /// CRS in which the map was marked, from its record.
    pub recorded_crs: Option<&'a str>,
    /// Attributes that become landmarks.
    pub landmarks: LabelFields<'a>,
    /// Whether to keep the geometries.
    pub geometries: bool,
}

/// Reads the reference, which is any vector dataset that GDAL opens.
pub fn reference(path: &Path, reading: &Reading) -> Result<Survey> {
    let Opened { dataset, .. } = &open_untouched("reference", path)?;
    if let LabelFields::Named(names) = reading.landmarks {
        check_fields(path, dataset, names)?;
    }
    read("reference", path, dataset, reading)
}

/// Reads a sheet of a map, unmarked.
pub fn sheet(path: &Path, reading: &Reading) -> Result<Survey> {
    if marked_view::is_named_by(path) {
        return Err(Error::MarkedView { path: path.into() });
    }
    let Opened { dataset, .. } = &open_untouched("sheet", path)?;
    read("sheet", path, dataset, reading)
}

/// Reads the reference of an edition; nothing where a map lacks its layers.
pub fn base_reference(path: &Path, entry: &BaseEntry) -> Result<Option<Survey>> {
    let (layers, srs) = (entry.layers.as_deref(), entry.srs.as_deref());
    let landmarks = LabelFields::None;
    let reading = Reading { layers, srs, recorded_crs: None, landmarks, geometries: false };
    match reference(path, &reading) {
        Ok(survey) => Ok(Some(survey)),
        Err(Error::Map { source, .. }) if source.is_of_other_layers() => Ok(None),
        Err(error) => Err(error),
    }
}

/// A dataset, and the private copy that it is opened from. They are dropped in this order.
struct Opened {
    dataset: Dataset,
    _copy: Option<(Names, PrivateCopy)>,
}

/// Opens a map, or a copy where SQLite would write to the map: it merges the logs of a database.
fn open_untouched(what: &'static str, path: &Path) -> Result<Opened> {
    if !has_logs(path) {
        return Ok(Opened { dataset: open(what, path)?, _copy: None });
    }
    let copy = PrivateCopy::make(what, path)?;
    journal::roll_back(what, &copy)?;
    let names = named_as(path, copy.copy());
    let dataset = open_with(copy.copy(), None, &[]).map_err(|source| Error::Unopened {
        what,
        path: path.into(),
        source,
    })?;
    Ok(Opened { dataset, _copy: Some((names, copy)) })
}

/// Opens a map for marking, and reads its vertices.
pub(crate) fn source(
    path: &Path,
    options: &Options,
    warn: &mut dyn FnMut(&str),
) -> Result<(Dataset, Survey)> {
    if marked_view::is_named_by(path) {
        return Err(Error::MarkedView { path: path.into() });
    }
    let dataset = open("map", path)?;
    let (layers, srs) = (options.layers.as_deref(), options.srs.as_deref());
    let landmarks = LabelFields::None;
    let reading = Reading { layers, srs, recorded_crs: None, landmarks, geometries: true };
    let survey = read("map", path, &dataset, &reading)?;
    // Foreign members of GeoJSON are read from the plain copy (distribute/plain.rs).
    let foreign = ForeignMembers { of: &|_| None, column: None };
    forget_failure();
    let found = traces::search(&dataset, &survey, options, &foreign, &last_failure)
        .and_then(|found| traces::warnings(&found, options, Spelling::Flag));
    found.map_err(|error| failed("map", path, error))?.iter().for_each(|text| warn(text));
    Ok((dataset, survey))
}

/// Returns the geometries of a map in order, for a comparison, and the first CRS of a layer.
pub fn geometries(
    what: &'static str,
    path: &Path,
    layers: Option<&[String]>,
) -> Result<Compared<CoordinateSystem>> {
    let Opened { dataset, .. } = &open_untouched(what, path)?;
    forget_failure();
    let found = features(dataset, layers, &last_failure);
    Ok((
        found.map_err(|error| Error::Unmeasured { what, path: path.into(), source: Box::new(error) })?,
        first_crs(dataset),
    ))
}

pub(super) fn first_crs(dataset: &Dataset) -> Option<CoordinateSystem> {
    dataset.layers().find_map(|layer| layer.spatial_ref()).and_then(CoordinateSystem::of_layer)
}

/// Returns the ground metric of the reference of a comparison.
pub fn ground(path: &Path, layers: Option<&[String]>) -> Result<Ground> {
    let landmarks = LabelFields::None;
    let reading = Reading { layers, srs: None, recorded_crs: None, landmarks, geometries: false };
    let survey = reference(path, &reading)?;
    survey.measure().cloned().map_err(|error| Error::Unmeasured {
        what: "reference",
        path: path.into(),
        source: Box::new(error.into()),
    })
}

/// Checks the names of landmark fields, as a misspelt field would silently give no landmark.
fn check_fields(path: &Path, dataset: &Dataset, names: &[String]) -> Result<()> {
    let fields_of = |layer: gdal::vector::Layer| layer.defn().fields().map(|f| f.name()).collect::<Vec<_>>();
    let known: BTreeSet<String> = dataset.layers().flat_map(fields_of).collect();
    let unknown = names.iter().find(|name| !known.iter().any(|field| field.eq_ignore_ascii_case(name)));
    let Some(name) = unknown else { return Ok(()) };
    let known = known.into_iter().collect::<Vec<_>>().join(", ");
    Err(Error::UnknownField { path: path.into(), field: name.clone(), known })
}

fn open(what: &'static str, path: &Path) -> Result<Dataset> {
    plain::check(what, path)?;
    if holds_password(path) {
        return Err(Error::Password { what });
    }
    open_with(path, None, &[]).map_err(|source| Error::Unopened { what, path: path.into(), source })
}

/// Opens a dataset with these drivers, all without names, and with open options beside the usual ones.
pub(super) fn open_with(
    path: &Path,
    allowed_drivers: Option<&[&str]>,
    options: &[String],
) -> std::result::Result<Dataset, GdalFailure> {
    forget_failure();
    let mut open_options = OPEN_OPTIONS.to_vec();
    open_options.push("@WRITE_GFS=NO"); // reading a map creates no file beside it
    open_options.extend(options.iter().map(String::as_str));
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_VECTOR | GdalOpenFlags::GDAL_OF_VERBOSE_ERROR,
        open_options: Some(&open_options),
        allowed_drivers,
        ..Default::default()
    };
    Dataset::open_ex(path, options).map_err(GdalFailure::new)
}

/// Returns whether the connection string of a database holds its password: as `password=…`, `pwd=…`
/// or `scheme://user:password@host`.
fn holds_password(path: &Path) -> bool {
    let text = path.to_string_lossy().to_lowercase();
    let of_url = || text.split_once("://").and_then(|(_, rest)| rest.split('/').next()?.split_once('@'));
    !path.exists()
        && (["password", "passwd", "pwd"]
            .iter()
            .any(|word| text.split(word).skip(1).any(|rest| rest.trim_start().starts_with('=')))
            || of_url().is_some_and(|(user, _)| user.contains(':')))
}

fn read(what: &'static str, path: &Path, dataset: &Dataset, reading: &Reading) -> Result<Survey> {
    forget_failure();
    survey(dataset, &selection(reading)).map_err(|error| failed(what, path, error))
}

pub(super) fn selection<'a>(reading: &Reading<'a>) -> Selection<'a> {
    Selection {
        layers: reading.layers,
        srs: reading.srs,
        recorded_crs: reading.recorded_crs,
        labels: reading.landmarks,
        geometries: reading.geometries,
        most_vertices: MOST_VERTICES,
        last_failure: &last_failure,
    }
}

pub(crate) fn failed(what: &'static str, path: &Path, source: impl Into<meshmark_dataset::Error>) -> Error {
    Error::Map { what, path: path.into(), source: Box::new(source.into()) }
}
