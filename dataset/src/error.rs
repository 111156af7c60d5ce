use crate::read_back::Difference;
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
    Unreadable { layer: String, reason: String },
    Traces(Vec<String>),
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
    OtherBase { base: String },
    BaseReferenceUnread { path: PathBuf, reason: String },
    SheetsUnread { plan: String, source: io::Error },
    SheetsMalformed { plan: String, source: meshmark_core::Error },
    SheetsOfOtherTolerance { plan: String, made_with: f64, given: f64 },
    SheetsInOtherCrs { plan: String, planned: String, own: String },
    SheetNotPlanned { plan: String },
    SheetsWithPrecision { plan: String },
    Gdal(GdalError),
    Map(meshmark_marking::Error),
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
            Error::File { source, .. }
            | Error::BaseUnread { source, .. }
            | Error::SheetsUnread { source, .. } => Some(source),
            Error::BaseMalformed { source, .. } | Error::SheetsMalformed { source, .. } => Some(source),
            Error::Gdal(source) => Some(source),
            Error::Map(source) => Some(source),
            _ => None,
        }
    }
}

impl From<GdalError> for Error {
    fn from(error: GdalError) -> Self {
        Error::Gdal(error)
    }
}

impl From<meshmark_marking::Error> for Error {
    fn from(error: meshmark_marking::Error) -> Self {
        Error::Map(error)
    }
}

impl From<meshmark_core::Error> for Error {
    fn from(error: meshmark_core::Error) -> Self {
        Error::Map(error.into())
    }
}

impl Error {
    /// Returns whether a map lacks the layers or the CRS that options give it.
    pub fn is_of_other_layers(&self) -> bool {
        matches!(self, Error::Map(error) if error.is_of_other_layers())
    }

    /// Returns whether bases do not belong to a map, to its key or to each other.
    pub fn is_of_other_base(&self) -> bool {
        matches!(
            self,
            Error::Map(meshmark_marking::Error::LostBase { .. })
                | Error::OtherBase { .. }
                | Error::ContradictingBase { .. }
                | Error::BaseOfThisEdition { .. }
                | Error::BaseOfOtherParts { .. }
                | Error::BaseOfOtherKey { .. }
                | Error::BaseInOtherCrs { .. }
                | Error::BaseOfOtherMark { .. }
                | Error::BaseOfOtherVersion { .. }
                | Error::SheetNotPlanned { .. }
                | Error::SheetsInOtherCrs { .. }
                | Error::SheetsOfOtherTolerance { .. }
        )
    }

    /// Returns the message, with options spelled as in the user's front end.
    pub fn text(&self, spelling: Spelling) -> String {
        let base = |path: &Path| spelling.value("BASE", path.display());
        let sheets = |plan: &str| spelling.value("SHEETS", plan);
        match self {
            Error::NoLayers => "the map has no vector layer: give a vector dataset that GDAL can open".into(),
            Error::Unreadable { layer, reason } => {
                format!("layer \"{layer}\" cannot be read to its end: {reason}")
            }
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
                "{} has an edition that another base has with other layers, anchors or bases, so its vertices have two places: name \
                 one of them",
                base(path)
            ),
            Error::NoRecordOfBase { folder } => {
                format!("{} is a folder without records: name the folder they were written to", base(folder))
            }
            Error::OtherBase { base: named } => format!(
                "no vertex of the map is in the references of {}, so it is no edition of the same map: leave {} out, or \
                 name the records of its earlier editions",
                spelling.value("BASE", named),
                spelling.name("BASE")
            ),
            Error::BaseReferenceUnread { path, reason } => {
                format!("{} cannot be read: {reason}", spelling.value("BASE_REFERENCE", path.display()))
            }
            Error::SheetsUnread { plan, source } => {
                format!("{} cannot be read ({source}): name a plan that `meshmark plan` wrote", sheets(plan))
            }
            Error::SheetsMalformed { plan, source } => {
                format!("{} is no plan: {}", sheets(plan), source.text(spelling))
            }
            Error::SheetsOfOtherTolerance { plan, made_with, given } => format!(
                "{} was made with {}, and this sheet is marked with {}: make a plan with the {} of the mark",
                sheets(plan),
                spelling.value("TOLERANCE", made_with),
                spelling.value("TOLERANCE", given),
                spelling.name("TOLERANCE")
            ),
            Error::SheetsInOtherCrs { plan, planned, own } => format!(
                "{} is of sheets in another CRS ({planned}) than this map ({own}): mark sheets in the CRS in which they \
                 were planned",
                sheets(plan)
            ),
            Error::SheetsWithPrecision { plan } => format!(
                "{} keeps what sheets share in place, and {} would round it: leave {} out, and round the whole map \
                 before it is cut into sheets",
                sheets(plan),
                spelling.name("PRECISION"),
                spelling.name("PRECISION")
            ),
            Error::SheetNotPlanned { plan } => format!(
                "{} has no sheet with the vertices of this map: plan all sheets again if one of them has changed, with \
                 the {} that are marked",
                sheets(plan),
                spelling.name("LAYERS")
            ),
            Error::Gdal(error) => error.to_string(),
            Error::Map(error) => error.text(spelling),
        }
    }
}
