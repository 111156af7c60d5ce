use meshmark_dataset::decimals::Digits;
use meshmark_marking::wkb::WkbError;
use std::{
    io::{self, ErrorKind},
    path::PathBuf,
};

/// The reasons why a map cannot be marked. Every message names the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("it is {0} already: name the dataset itself")]
    Marked(&'static str),
    #[error("the source is missing: write MESHMARK: and then the name of a vector dataset")]
    NoSource,
    #[error("the source is a raster: give a vector dataset")]
    Raster,
    #[error("the source cannot be opened: {0}")]
    SourceUnopened(String),
    #[error(
        "its file {path} was changed, or is being written, since it was marked: open the map again, and \
         write to another file than the source"
    )]
    SourceChanged { path: String },
    #[error(
        "its file {path} was overwritten while it was read; what it was is saved in {copies}: move that back, and \
         write the marked map to another file"
    )]
    SourceOverwritten { path: String, copies: String },
    #[error(
        "it is being read through MESHMARK and cannot be written at the same time{unsaved}: write the marked map to \
         another file"
    )]
    BeingRead { unsaved: String },
    #[error(
        "layer \"{layer}\", feature {fid}: the coordinates ({x}, {y}) were not there when the map was marked: \
         the source was changed while it was read, open it again"
    )]
    UnknownVertex { layer: String, fid: i64, x: f64, y: f64 },
    #[error(
        "layer \"{layer}\" has {marked} features, and {came} of them came out: the source was changed while it was \
         read, or cannot be read twice; open it again, or convert it to a GeoPackage first (ogr2ogr -f GPKG), and mark \
         that"
    )]
    OtherCount { layer: String, marked: u64, came: u64 },
    #[error("layer \"{layer}\", feature {fid}: {source}")]
    Geometry { layer: String, fid: i64, source: WkbError },
    #[error("the output {path} is the source itself: write the marked map to another place")]
    OutputIsSource { path: String },
    #[error("{0} is not UTF-8, so two names could become one: write it in UTF-8")]
    NotUtf8(String),
    #[error("option \"{0}\" is not NAME=VALUE")]
    NotAnOption(String),
    #[error(
        "there is no KEY: give KEY=<file>, or the configuration option MESHMARK_KEY, with a key file made by \
         `meshmark keygen`"
    )]
    NoKey,
    #[error(
        "the key file {path} cannot be read ({source}): {}",
        match source.kind() {
            ErrorKind::NotFound => "make one with `meshmark keygen`",
            _ => "name a key file that can be read",
        }
    )]
    KeyUnreadable { path: String, source: io::Error },
    #[error("the key file {path} is not usable: {source}")]
    KeyMalformed { path: String, source: meshmark_core::Error },
    #[error("neither RECIPIENT nor MESSAGE is given: give exactly one")]
    NoSubject,
    #[error("RECORD={path} is the same file as the {what}: give the record a file of its own")]
    RecordIsOther { path: String, what: &'static str },
    #[error("RECORD={path} is there already and has other content: move it away, or give another name")]
    RecordDiffers { path: String },
    #[error(
        "RECORD={path} cannot be written ({source}): give a file in a folder that exists and can be written"
    )]
    RecordUnwritable { path: String, source: RecordFault },
    #[error("no threads can be started ({0}): set GDAL_NUM_THREADS=1")]
    Threads(io::Error),
    #[error(
        "it is no name to write to: write MESHMARK: and then the name of a file, for example MESHMARK:{0}"
    )]
    BareTarget(String),
    #[error(
        "it cannot be opened for update, as a marked map cannot be extended: open it to read \
         (ogrinfo -ro), and leave -append, -update and -overwrite out{overwrite}"
    )]
    Extended { overwrite: &'static str },
    #[error("{path} is {what}: a marked map is written to a file of its own, in a folder that exists")]
    NotAFile { path: String, what: &'static str },
    #[error("{path} is being written by another program ({sidecar} is there): wait until it is done")]
    TargetBusy { path: String, sidecar: String },
    #[error("{option} and {other} are the same file: give each a file of its own")]
    SameFile { option: &'static str, other: &'static str },
    #[error("REFERENCE={0} is written as GeoPackage: give it a name that ends in .gpkg")]
    ReferenceNotGeoPackage(String),
    #[error("{what} failed: {reason}")]
    Writing { what: String, reason: String },
    #[error("{0}: nothing is written, what was there stays as it was")]
    Unfinished(String),
    #[error(
        "{errors} of the {bits} bits of the message cannot be read from what was written with {digits}: raise \
         AMPLITUDE{}",
        digits.more().map(|more| format!(", or keep more digits: {more}")).unwrap_or_default()
    )]
    MessageUnreadable { errors: usize, bits: usize, digits: Digits },
    #[error(
        "the signs of the recipient agree by only {score:.1} standard deviations with what was written with {digits}: raise \
         AMPLITUDE{}",
        digits.more().map(|more| format!(", or keep more digits: {more}")).unwrap_or_default()
    )]
    FingerprintUnreadable { score: f64, digits: Digits },
    #[error(transparent)]
    Dataset(#[from] meshmark_dataset::Error),
    #[error(transparent)]
    Core(#[from] meshmark_core::Error),
}

/// The reason why a record cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordFault {
    #[error("{} is no folder", .0.display())]
    NoFolder(PathBuf),
    #[error("it is a folder")]
    IsFolder,
    #[error("it is a link to a file that does not exist")]
    DanglingLink,
    #[error(transparent)]
    Io(#[from] io::Error),
}

pub type Result<T> = std::result::Result<T, Error>;

impl From<meshmark_marking::Error> for Error {
    fn from(error: meshmark_marking::Error) -> Self {
        Error::Dataset(error.into())
    }
}
