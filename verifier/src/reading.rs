//! Reading: key, record, reference and suspect, with errors that name the file.

use crate::{Error, Result, report::printable};
use gdal::{Dataset, DatasetOptions, GdalOpenFlags, vector::LayerAccess};
use meshmark_core::{
    ground::Ground,
    key::{SecretKey, read_text},
    options::{Options, Spelling},
    record::Record,
    scale::ScaleLattice,
};
use meshmark_dataset::{
    CoordinateSystem, FeatureGeometry, LabelFields, MOST_VERTICES, Selection, Survey, TargetCrs, features,
    marked_view, marking, survey,
};
use std::{
    cell::RefCell,
    collections::BTreeSet,
    fs::File,
    io,
    path::{Path, PathBuf},
};

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

thread_local! {
    /// GDAL's last error message on this thread, kept instead of printed.
    static LAST_FAILURE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps GDAL from printing; its messages become part of ours. Call once, before anything else.
pub fn quieten_gdal() {
    gdal::config::set_error_handler(|kind, _, message| {
        if matches!(kind, gdal::errors::CplErrType::Failure | gdal::errors::CplErrType::Fatal) {
            LAST_FAILURE.set(Some(message.to_string()));
        }
    });
}

/// GDAL's last error message on this thread since [`forget_failure`].
pub(crate) fn last_failure() -> Option<String> {
    LAST_FAILURE.with_borrow(Clone::clone)
}

/// What failed before does not concern what comes now.
pub(crate) fn forget_failure() {
    LAST_FAILURE.set(None);
}

/// Reads a key file.
pub fn key(path: &Path) -> Result<SecretKey> {
    let text = text("key", path)?;
    SecretKey::from_json(&text).map_err(|error| Error::Usage(format!("{}: {error}", path.display())))
}

/// Reads a record.
pub fn record(path: &Path) -> Result<Record> {
    Record::from_json(&text("record", path)?)
        .map_err(|error| Error::Usage(format!("{}: {error}", path.display())))
}

fn text(what: &str, path: &Path) -> Result<zeroize::Zeroizing<String>> {
    let unreadable =
        |error: io::Error| Error::Usage(format!("the {what} {} cannot be read: {error}", path.display()));
    File::open(path).and_then(read_text).map_err(unreadable)
}

/// How to read a map.
pub struct Reading<'a> {
    /// Layers that form it.
    pub layers: Option<&'a [String]>,
    /// Its CRS when it has none.
    pub srs: Option<&'a str>,
    /// Attributes to take as landmarks.
    pub landmarks: LabelFields<'a>,
    /// Whether to keep its geometries.
    pub geometries: bool,
}

/// Reads the reference: any vector dataset GDAL opens.
pub fn reference(path: &Path, reading: &Reading) -> Result<Survey> {
    let dataset = open("reference", path, None)?;
    if let LabelFields::Named(names) = reading.landmarks {
        check_fields(path, &dataset, names)?;
    }
    read("reference", path, &dataset, reading, TargetCrs::Own)
}

/// Opens a map to be marked, and reads its vertices.
pub(crate) fn source(
    path: &Path,
    options: &Options,
    warn: &mut dyn FnMut(&str),
) -> Result<(Dataset, Survey)> {
    if marked_view::is_named_by(path) {
        let path = path.display();
        return Err(Error::Usage(format!(
            "the map {path} is a marked view already: name the dataset itself"
        )));
    }
    let dataset = open("map", path, None)?;
    let (layers, srs) = (options.layers.as_deref(), options.srs.as_deref());
    let reading = Reading { layers, srs, landmarks: LabelFields::None, geometries: true };
    let survey = read("map", path, &dataset, &reading, TargetCrs::Own)?;
    marking::coordinates_as_text(&dataset).iter().for_each(|text| warn(text));
    Ok((dataset, survey))
}

/// The geometries of a map in order, for a comparison, and the first CRS of a layer.
pub fn geometries(
    what: &str,
    path: &Path,
    layers: Option<&[String]>,
) -> Result<(Vec<FeatureGeometry>, Option<CoordinateSystem>)> {
    let dataset = open(what, path, None)?;
    forget_failure();
    let found = features(&dataset, layers, &last_failure);
    Ok((found.map_err(|error| of_map(what, path, &error))?, first_crs(&dataset)))
}

fn first_crs(dataset: &Dataset) -> Option<CoordinateSystem> {
    dataset.layers().find_map(|layer| layer.spatial_ref()).and_then(CoordinateSystem::of_layer)
}

/// What the reference of a comparison is measured with.
pub fn scales(path: &Path, layers: Option<&[String]>) -> Result<(Ground, Option<ScaleLattice>)> {
    let survey =
        reference(path, &Reading { layers, srs: None, landmarks: LabelFields::None, geometries: false })?;
    survey.into_scales().map_err(|error| of_map("reference", path, &error))
}

fn of_map(what: &str, path: &Path, error: &meshmark_dataset::Error) -> Error {
    Error::Unreadable(format!("the {what} {}: {error}", path.display()))
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

/// A suspect as it was read.
pub struct Suspect {
    /// In the CRS of the reference, where both CRS are known and its coordinates make sense in its own.
    pub map: Survey,
    /// Whether the numbers of `map` are as they stand in the file.
    pub is_raw: bool,
    /// CRS of its layers.
    pub layer_crs: Vec<String>,
    /// The first CRS of a layer.
    pub crs: Option<CoordinateSystem>,
}

/// Reads the suspect in the CRS of the reference, where both are known; its numbers as they stand when they
/// cannot be brought there.
pub fn suspect(path: &Path, reading: &Reading, reference: &Survey) -> Result<Suspect> {
    let dataset = open_suspect(path)?;
    let layer_crs = crs_of(&dataset);
    let crs = first_crs(&dataset);
    if let (Some(target), Some(_)) = (&reference.crs, &crs) {
        match survey_of(&dataset, reading, TargetCrs::Crs(target)) {
            Ok(map) => return Ok(Suspect { map, is_raw: false, layer_crs, crs }),
            // PROJ, or the limits of what a map may be: the CRS is not that of the coordinates.
            Err(meshmark_dataset::Error::Reprojection { .. } | meshmark_dataset::Error::Core(_)) => {}
            Err(error) => return Err(failed("suspect", path, error)),
        }
    }
    let map = read("suspect", path, &dataset, reading, TargetCrs::Raw)?;
    Ok(Suspect { map, is_raw: true, layer_crs, crs })
}

/// Reads the numbers of the suspect as they stand.
pub fn raw_suspect(path: &Path, reading: &Reading) -> Result<Survey> {
    read("suspect", path, &open_suspect(path)?, reading, TargetCrs::Raw)
}

fn open_suspect(path: &Path) -> Result<Dataset> {
    if !path.is_file() && !path.is_dir() {
        let path = path.display();
        return Err(Error::Unreadable(format!("the suspect {path} is not a file here: give a local file")));
    }
    forbid_network().map_err(|error| Error::Unreadable(format!("GDAL takes no option: {error}")))?;
    check_table(path)?;
    let dataset = open("suspect", path, Some(SUSPECT_DRIVERS))?;
    check_plain(path, &dataset)?;
    Ok(dataset)
}

/// A suspect may name addresses: as the CRS of a GeoJSON file, as the schema of a GML file. Nobody shall learn
/// from a request that it is being looked at, nor answer it.
fn forbid_network() -> gdal::errors::Result<()> {
    for (option, value) in [
        ("GDAL_HTTP_PROXY", "127.0.0.1:0"), // no one can listen there
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

/// Refuses MapInfo tables that are made of others, which may be anywhere.
fn check_table(path: &Path) -> Result<()> {
    let is_table = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tab"));
    let tables: Vec<PathBuf> = match path.read_dir() {
        Ok(entries) => entries.flatten().map(|entry| entry.path()).filter(|p| is_table(p)).collect(),
        Err(_) => is_table(path).then(|| path.into()).into_iter().collect(),
    };
    for table in tables.iter().filter(|table| table.is_file()) {
        let Ok(bytes) = std::fs::read(table) else { continue }; // GDAL will say why
        let text = String::from_utf8_lossy(&bytes).to_lowercase();
        let seamless = text.lines().any(|line| line.contains("isseamless") && line.contains("true"));
        if seamless || text.contains("create view") {
            return Err(Error::Unreadable(format!(
                "the suspect {} is made of other tables: copy it to a plain file, for example with ogr2ogr",
                table.display()
            )));
        }
    }
    Ok(())
}

/// Virtual tables that hold what is in the database itself; any other may point at other files.
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

/// Refuses a database with virtual tables that take their rows from elsewhere.
fn check_plain(path: &Path, dataset: &Dataset) -> Result<()> {
    if !matches!(dataset.driver().short_name().as_str(), "GPKG" | "SQLite") {
        return Ok(());
    }
    let failed = |error: gdal::errors::GdalError| {
        Error::Unreadable(format!("the suspect {} cannot be read: {error}", path.display()))
    };
    // A forged schema may have any type, page and spacing; its text is what SQLite goes by.
    let query = "SELECT name, sql FROM sqlite_master WHERE sql LIKE '%VIRTUAL%USING%'";
    let tables = dataset.execute_sql(query, None, gdal::vector::sql::Dialect::DEFAULT).map_err(failed)?;
    let Some(mut tables) = tables else { return Ok(()) };
    for table in tables.features() {
        let text = |field: usize| table.field_as_string(field).ok().flatten().unwrap_or_default();
        if !is_plain(&text(1)) {
            return Err(Error::Unreadable(format!(
                "the suspect {} has a virtual table \"{}\", which may point at other files: copy its layers to \
                 a plain file, for example with ogr2ogr",
                path.display(),
                text(0).escape_debug()
            )));
        }
    }
    Ok(())
}

/// Whether the module of CREATE VIRTUAL TABLE name USING module(…) is a plain one. A name that has "using" in
/// it finds no plain module, or the right one: every USING must be of a plain module.
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

fn open(what: &str, path: &Path, allowed_drivers: Option<&[&str]>) -> Result<Dataset> {
    if holds_password(path) {
        return Err(Error::Usage(format!(
            "the {what} is a connection with a password in it, which reports and messages would repeat: give the \
             password by a PGPASSFILE or service file, or an environment variable of the database's driver"
        )));
    }
    forget_failure();
    let mut open_options = marking::OPEN_OPTIONS.to_vec();
    open_options.push("@WRITE_GFS=NO"); // a map that is read leaves nothing beside it
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_VECTOR | GdalOpenFlags::GDAL_OF_VERBOSE_ERROR,
        open_options: Some(&open_options),
        allowed_drivers,
        ..Default::default()
    };
    Dataset::open_ex(path, options).map_err(|error| {
        let reason = last_failure().unwrap_or_else(|| error.to_string());
        let formats =
            allowed_drivers.map_or(String::new(), |d| format!(" (a suspect may be {})", d.join(", ")));
        Error::Unreadable(format!("the {what} {} cannot be opened: {reason}{formats}", path.display()))
    })
}

/// Whether a connection to a database says its password: as `password=…`, `pwd=…` or `scheme://user:password@host`.
fn holds_password(path: &Path) -> bool {
    let text = path.to_string_lossy().to_lowercase();
    let of_url = || text.split_once("://").and_then(|(_, rest)| rest.split('/').next()?.split_once('@'));
    !path.exists()
        && (["password", "passwd", "pwd"]
            .iter()
            .any(|word| text.split(word).skip(1).any(|rest| rest.trim_start().starts_with('=')))
            || of_url().is_some_and(|(user, _)| user.contains(':')))
}

fn read(what: &str, path: &Path, dataset: &Dataset, reading: &Reading, target: TargetCrs) -> Result<Survey> {
    survey_of(dataset, reading, target).map_err(|error| failed(what, path, error))
}

fn survey_of(dataset: &Dataset, reading: &Reading, target: TargetCrs) -> meshmark_dataset::Result<Survey> {
    forget_failure();
    let selection = Selection {
        layers: reading.layers,
        srs: reading.srs,
        labels: reading.landmarks,
        target,
        geometries: reading.geometries,
        most_vertices: MOST_VERTICES,
        last_failure: &last_failure,
    };
    survey(dataset, &selection)
}

pub(crate) fn failed(what: &str, path: &Path, error: meshmark_dataset::Error) -> Error {
    let text = format!("the {what} {}: {}", path.display(), error.text(Spelling::Flag));
    match error {
        meshmark_dataset::Error::TooLarge { .. } => Error::TooLarge(text),
        meshmark_dataset::Error::UnknownLayer { .. }
        | meshmark_dataset::Error::UnknownSrs(_)
        | meshmark_dataset::Error::ContradictingSrs { .. } => Error::Usage(text),
        _ => Error::Unreadable(text),
    }
}
