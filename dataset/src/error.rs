use crate::{read_back::Difference, wkb::GeometryFault};
use gdal::errors::GdalError;
use meshmark_core::options::Spelling;
use std::{
    fmt, io,
    path::{Path, PathBuf},
};

/// The errors of datasets. Every message names the input and the remedy.
#[derive(Debug)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Error {
    NoLayers,
    UnknownLayer { name: String, known: String },
    MixedCrs { first: String, first_crs: String, second: String, second_crs: String },
    NoCrs,
    ContradictingSrs { crs: String, srs: String },
    UnknownSrs(String),
    Geocentric(String),
    NotFinite { layer: String, fid: String, x: f64, y: f64 },
    TooFar { layer: String, fid: String, x: f64, y: f64 },
    Geometry { layer: String, fid: String, source: GeometryFault },
    Unreadable { layer: String, reason: String },
    Reprojection { layer: String, source: GdalError },
    FewPlaces { layer: String, crs: String },
    TooLarge { most: usize },
    TooSmall { size_m: f64, tolerance_m: f64 },
    Traces(Vec<String>),
    UnevenScale { ends: [[f64; 2]; 2], off_percent: f64, crs: String },
    UnknownFormat { named: Option<String>, extension: Option<String>, known: String },
    OneLayer { driver: &'static str },
    NotWgs84 { driver: &'static str, layer: String },
    Folder { driver: &'static str },
    NotKept { driver: &'static str, layer: String, difference: Difference },
    File { action: Action, path: PathBuf, source: io::Error },
    Exists { path: String, remedy: &'static str },
    NoBase,
    NoBaseReference,
    BaseUnread { base: PathBuf, source: io::Error },
    BaseMalformed { base: PathBuf, source: meshmark_core::Error },
    BaseOfMessage { base: PathBuf },
    BaseOfOtherKey { base: PathBuf },
    BaseOfOtherVersion { base: PathBuf },
    BaseInOtherCrs { base: PathBuf },
    BaseOfOtherMark { base: PathBuf, option: &'static str, made_with: Option<String>, given: Option<String> },
    ContradictingBase { base: PathBuf },
    BaseOfThisEdition { base: PathBuf },
    BaseOfOtherParts { base: PathBuf },
    NoRecordOfBase { folder: PathBuf },
    LostBase { vertices_sha256: String },
    OtherBase { base: String },
    BaseReferenceUnread { path: PathBuf, reason: String },
    Gdal(GdalError),
    Core(meshmark_core::Error),
}

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// An action on a file or a folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // the names are the documentation
pub enum Action {
    Reading,
    Writing,
    WritingInto,
    Making,
    MovingAway,
    Replacing,
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Action::Reading => "reading",
            Action::Writing => "writing",
            Action::WritingInto => "writing into",
            Action::Making => "making",
            Action::MovingAway => "moving away",
            Action::Replacing => "replacing",
        })
    }
}

/// Creates the error of an action on a file.
pub fn file_error(action: Action, path: &Path, source: io::Error) -> Error {
    Error::File { action, path: path.into(), source }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text(Spelling::OpenOption))
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Geometry { source, .. } => Some(source),
            Error::Reprojection { source, .. } => Some(source),
            Error::File { source, .. } | Error::BaseUnread { source, .. } => Some(source),
            Error::BaseMalformed { source, .. } => Some(source),
            Error::Gdal(source) => Some(source),
            Error::Core(source) => Some(source),
            _ => None,
        }
    }
}

impl From<GdalError> for Error {
    fn from(error: GdalError) -> Self {
        Error::Gdal(error)
    }
}

impl From<meshmark_core::Error> for Error {
    fn from(error: meshmark_core::Error) -> Self {
        Error::Core(error)
    }
}

impl Error {
    /// Returns whether a map lacks the layers or the CRS that options give it.
    pub fn is_of_other_layers(&self) -> bool {
        matches!(self, Error::UnknownLayer { .. } | Error::ContradictingSrs { .. })
    }

    /// Returns whether bases do not belong to a map, to its key or to each other.
    pub fn is_of_other_base(&self) -> bool {
        matches!(
            self,
            Error::LostBase { .. }
                | Error::OtherBase { .. }
                | Error::ContradictingBase { .. }
                | Error::BaseOfThisEdition { .. }
                | Error::BaseOfOtherParts { .. }
                | Error::BaseOfOtherKey { .. }
                | Error::BaseInOtherCrs { .. }
                | Error::BaseOfOtherMark { .. }
                | Error::BaseOfOtherVersion { .. }
        )
    }

    /// Returns the fault of a feature without the remedy.
    pub(crate) fn fault(&self) -> String {
        match self {
            Error::NotFinite { layer, fid, x, y } => format!(
                "layer \"{layer}\", feature {fid}: the coordinates ({x:?}, {y:?}) are not finite numbers"
            ),
            Error::TooFar { layer, fid, x, y } => format!(
                "layer \"{layer}\", feature {fid}: the coordinates ({x:?}, {y:?}) are further away than any place in the \
                 CRS of the map"
            ),
            other => other.to_string(),
        }
    }

    /// Returns the message, with options spelled as in the user's front end.
    pub fn text(&self, spelling: Spelling) -> String {
        let srs = |crs: &str| spelling.value("SRS", crs);
        let base = |path: &Path| spelling.value("BASE", path.display());
        match self {
            Error::NoLayers => "the map has no vector layer: give a vector dataset that GDAL can open".into(),
            Error::UnknownLayer { name, known } => {
                format!("the map has no layer \"{name}\": {} may name {known}", spelling.name("LAYERS"))
            }
            Error::MixedCrs { first, first_crs, second, second_crs } => format!(
                "layers \"{first}\" ({first_crs}) and \"{second}\" ({second_crs}) are not in the same CRS, and a mark \
                 needs one: choose layers of one CRS with {}, or reproject first",
                spelling.name("LAYERS")
            ),
            Error::NoCrs => format!(
                "the map has no CRS and all its coordinates could be degrees: say which CRS it is, for example {}",
                srs("EPSG:4326")
            ),
            Error::ContradictingSrs { crs, srs: given } => format!(
                "the map has a CRS of its own ({crs}), and {} is another one: leave {} out",
                srs(given),
                spelling.name("SRS")
            ),
            Error::UnknownSrs(text) => {
                format!("{} is not a CRS that PROJ knows: use for example EPSG:3067", srs(text))
            }
            Error::Geocentric(crs) => {
                format!(
                    "the CRS {crs} is geocentric, and a map needs a projected or geographic one: reproject first"
                )
            }
            Error::NotFinite { .. } | Error::TooFar { .. } => {
                format!("{}: correct the feature, or leave it out", self.fault())
            }
            Error::Geometry { layer, fid, source } => format!("layer \"{layer}\", feature {fid}: {source}"),
            Error::Unreadable { layer, reason } => {
                format!("layer \"{layer}\" cannot be read to its end: {reason}")
            }
            Error::Reprojection { layer, source } => {
                format!(
                    "coordinates of layer \"{layer}\" cannot be brought into the CRS of the reference: {source}"
                )
            }
            Error::FewPlaces { layer, crs } => {
                format!("most coordinates of layer \"{layer}\" have no place in {crs}: it is not their CRS")
            }
            Error::TooLarge { most } => format!("the map has more than {most} vertices: cut it into sheets"),
            Error::TooSmall { size_m, tolerance_m } => format!(
                "the whole map is {size_m:.1e} m wide, and the mark moves vertices by up to {} m: if the units are not \
                 those of its CRS, correct that ({}, -a_srs), else lower {} and {}",
                spelling.value("TOLERANCE", tolerance_m),
                spelling.name("SRS"),
                spelling.name("TOLERANCE"),
                spelling.name("AMPLITUDE")
            ),
            Error::UnevenScale { ends: [shortest, longest], off_percent, crs } => format!(
                "the scale of {crs} differs by {off_percent:.0} % from the one that the mark of a message takes for the whole \
                 map, so vertices would move further than is asked for: a unit is the shortest at the vertex ({}, {}), and \
                 the longest at ({}, {}); mark for a recipient without {} and {}, reproject the map, for example to its UTM zone or to \
                 EPSG:4326, or leave out what lies far from the rest",
                shortest[0],
                shortest[1],
                longest[0],
                longest[1],
                spelling.name("CODE"),
                spelling.name("CHIP_RATE")
            ),
            Error::Traces(traces) => {
                format!(
                    "{}, and {} marks no such map",
                    traces.join("; "),
                    spelling.value("ATTRIBUTES", "REFUSE")
                )
            }
            Error::UnknownFormat { named, extension, known } => {
                let what = match (named, extension) {
                    (Some(name), _) => spelling.value("FORMAT", name),
                    (None, Some(extension)) => format!("extension \"{extension}\""),
                    (None, None) => "a name without extension".into(),
                };
                format!(
                    "{what} is not a format that a marked map is written to, only {known} are: write a GPKG and \
                     convert it, or mark by reading (ogr2ogr -f <format> <target> MESHMARK:<source>); both keep the mark"
                )
            }
            Error::OneLayer { driver } => {
                format!("{driver} holds one layer, and this is the second: choose one, or write a GeoPackage")
            }
            Error::NotWgs84 { driver, layer } => format!(
                "layer \"{layer}\" is not in WGS 84, into which {driver} would bring it after it was marked: add -t_srs \
                 EPSG:4326"
            ),
            Error::Folder { driver } => {
                format!("{driver} would make a folder of it: write one layer, or a GeoPackage")
            }
            Error::NotKept { driver, layer, difference } => format!(
                "layer \"{layer}\": {driver} has not kept what was written ({difference}): nothing is written; {}",
                difference.remedy()
            ),
            Error::File { action, path, source } => format!("{action} {} failed: {source}", path.display()),
            Error::Exists { path, remedy } => format!("{path} exists: {remedy}"),
            Error::NoBase => format!(
                "{} is given without {}: name the records of those editions, too",
                spelling.name("BASE_REFERENCE"),
                spelling.name("BASE")
            ),
            Error::NoBaseReference => format!(
                "{} is given without {}: name the references of those editions, too",
                spelling.name("BASE"),
                spelling.name("BASE_REFERENCE")
            ),
            Error::BaseUnread { base: path, source } => {
                format!("{} cannot be read ({source}): name a record, or a folder of records", base(path))
            }
            Error::BaseMalformed { base: path, source } => {
                format!("{} is no base: {}", base(path), source.text(spelling))
            }
            Error::BaseOfMessage { base: path } => format!(
                "{} is the record of a message, and a fingerprint alone can be a base: mark this edition without {}",
                base(path),
                spelling.name("BASE")
            ),
            Error::BaseOfOtherKey { base: path } => {
                format!("{} was made with another key: give the key of the series", base(path))
            }
            Error::BaseOfOtherVersion { base: path } => format!(
                "{} was made with another number of coefficients than this version of meshmark takes: mark with that version",
                base(path)
            ),
            Error::BaseInOtherCrs { base: path } => format!(
                "{} is of a map in another CRS, where no vertex is the same: bring the new edition into that CRS first",
                base(path)
            ),
            Error::BaseOfOtherMark { base: path, option, made_with, given } => {
                let value = |value: &Option<String>| match value {
                    Some(value) => format!("with {}", spelling.value(option, value)),
                    None => format!("without {}", spelling.name(option)),
                };
                format!(
                    "{} was made {}, and this edition is marked {}: all editions of a series are marked alike",
                    base(path),
                    value(made_with),
                    value(given)
                )
            }
            Error::BaseOfThisEdition { base: path } => format!(
                "{} is of this very edition, and not of an earlier one: name the record of the edition before, or leave \
                 {} out",
                base(path),
                spelling.name("BASE")
            ),
            Error::BaseOfOtherParts { base: path } => {
                format!(
                    "{} names parts that are not those of its reference: give the record as it was written",
                    base(path)
                )
            }
            Error::ContradictingBase { base: path } => format!(
                "{} has an edition that another base has with other layers or bases, so its vertices have two places: name \
                 one of them",
                base(path)
            ),
            Error::NoRecordOfBase { folder } => {
                format!("{} is a folder without records: name the folder they were written to", base(folder))
            }
            Error::LostBase { vertices_sha256 } => format!(
                "no map given is the reference of a base whose vertices have the SHA-256 {vertices_sha256}: give its file, \
                 unchanged, with those of all editions that the bases rest on"
            ),
            Error::OtherBase { base: named } => format!(
                "no vertex of the map is in the references of {}, so it is no edition of the same map: leave {} out, or \
                 name the records of its earlier editions",
                spelling.value("BASE", named),
                spelling.name("BASE")
            ),
            Error::BaseReferenceUnread { path, reason } => {
                format!("{} cannot be read: {reason}", spelling.value("BASE_REFERENCE", path.display()))
            }
            Error::Gdal(error) => error.to_string(),
            Error::Core(error) => error.text(spelling),
        }
    }
}
