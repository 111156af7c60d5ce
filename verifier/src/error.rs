//! The errors that end a command early. Every message names the input and the remedy.

use crate::{
    deposit::DepositFault,
    exit_code::ExitCode,
    inputs::{gdal_failures::GdalFailure, unsuitable::Unsuitable},
    time_stamp::StampFault,
};
use gdal::errors::GdalError;
use meshmark_core::{counted, options::Spelling};
use meshmark_dataset::Error as MapError;
use meshmark_marking::{self as marking, NotMoved, wkb::WkbError};
use std::{io, path::PathBuf, process::ExitStatus, string::FromUtf8Error};

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// An error that ends a command early.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Error {
    // --- the command line, and the files it names ---
    #[error("{}", .0.text(Spelling::Flag))]
    Core(#[from] meshmark_core::Error),
    #[error("{}", .0.text(Spelling::Flag))]
    Dataset(#[from] MapError),
    #[error("{}", .0.text(Spelling::Flag))]
    Verification(#[from] meshmark_verification::Error),
    #[error("the {what} {}: {}", path.display(), source.text(Spelling::Flag))]
    Map { what: &'static str, path: PathBuf, source: Box<MapError> },
    #[error("the map {}: {}", path.display(), source.text(Spelling::Flag))]
    Refused { path: PathBuf, source: Box<MapError> },
    #[error("{}: {source}", path.display())]
    Malformed { path: PathBuf, source: meshmark_core::Error },
    #[error("the {what} {} cannot be read: {source}", path.display())]
    TextUnread { what: &'static str, path: PathBuf, source: io::Error },
    #[error("the passphrase does not open {}: give the one that it was made with", path.display())]
    WrongPassphrase { path: PathBuf },
    #[error("the passphrase is empty: give one, on the first line of the file if it is in one")]
    NoPassphrase,
    #[error(
        "the passphrase has more than {most} bytes: give the first line of the right file, or a shorter one"
    )]
    LongPassphrase { most: u64 },
    #[error("the passphrase was not the same again: start anew")]
    OtherPassphrase,
    #[error(
        "there is no terminal to ask for the passphrase ({source}): give it in a file, by --passphrase-file"
    )]
    NoTerminal { source: io::Error },
    #[error("the key cannot be protected by a passphrase ({reason}): protect it with age, as age -p -a does")]
    Unprotected { reason: String },
    #[error(
        "the case file {} is not understood ({reason}): write TOML with the texts number, examiner and date, and a list of \
         texts, custody",
        path.display()
    )]
    CaseFile { path: PathBuf, reason: String },
    #[error("the record {}: {source}", path.display())]
    OfRecord { path: PathBuf, source: Box<Error> },
    #[error("{} is no signing key: give the file that `meshmark keygen` wrote, which ends in .signing.pem", path.display())]
    NoSigningKey { path: PathBuf },
    #[error("{} is no public key: give the file that `meshmark keygen` wrote, which ends in .public.pem", path.display())]
    NoPublicKey { path: PathBuf },
    #[error(
        "the reference {} is no local file, whose digest could be deposited: export it to one with ogr2ogr, and deposit \
         that",
        path.display()
    )]
    NoFileToDeposit { path: PathBuf },
    #[error("the input {} cannot be in a bundle, as {reason}", path.display())]
    NotBundled { path: PathBuf, reason: String },
    #[error("the folder {} cannot be read: {source}", path.display())]
    FolderUnread { path: PathBuf, source: io::Error },
    #[error("the map {} is a marked view already: name the dataset itself", path.display())]
    MarkedView { path: PathBuf },
    #[error("the reference {} has no field \"{field}\": --landmark may name {known}", path.display())]
    UnknownField { path: PathBuf, field: String, known: String },
    #[error(
        "the {what} is a connection with a password in it, which reports and messages would repeat: give the password by \
         a PGPASSFILE or service file, or an environment variable of the database's driver"
    )]
    Password { what: &'static str },
    #[error(
        "no file of {} is a record of this key and this reference: give the folder the records were written to",
        folder.display()
    )]
    NoRecord { folder: PathBuf },
    #[error(
        "the folder {} has no sheet in a format that marked maps are written to: name a folder of such files, or the \
         files themselves",
        folder.display()
    )]
    NoSheet { folder: PathBuf },
    #[error(
        "the sheets {} ({}) and {} ({}) are not in the same CRS: bring all sheets into one CRS first",
        paths[0].display(), names[0], paths[1].display(), names[1]
    )]
    SheetsOfOtherCrs { paths: [PathBuf; 2], names: [String; 2] },
    #[error(
        "the sheets {} and {} have the same vertices: leave one of them out",
        paths[0].display(), paths[1].display()
    )]
    SameSheet { paths: [PathBuf; 2] },
    #[error(
        "the sheets {} and {} disagree on {}, for example ({}, {}) in one and ({}, {}) in the other: make both from one \
         source, in which these have the same coordinates to the last digit",
        paths[0].display(), paths[1].display(), counted(*vertices, "vertex"),
        places[0][0], places[0][1], places[1][0], places[1][1]
    )]
    SheetsDisagree { paths: [PathBuf; 2], places: [[f64; 2]; 2], vertices: usize },
    #[error("{} is one sheet, and a plan is about what several share: name all sheets of the map", path.display())]
    OneSheet { path: PathBuf },
    #[error("the sheet {} was changed while it was planned: plan again when nobody writes to it", path.display())]
    SheetChanged { path: PathBuf },
    #[error("the folder {} has no record (*.json): give the folder the records were written to", folder.display())]
    NothingListed { folder: PathBuf },
    #[error("--time-stamp-request has nothing to answer it: give the response to it with --time-stamp")]
    NoAnswer,
    #[error(
        "the marked map {} is in {other} and the reference in {own}: compare the copy that was marked, before it is brought \
         into another CRS",
        path.display()
    )]
    OtherCrs { path: PathBuf, own: String, other: String },
    #[error("the list of recipients {} {reason}", path.display())]
    Recipients { path: PathBuf, reason: String },
    #[error("the {what} {} {reason}", path.display())]
    OutputName { what: &'static str, path: PathBuf, reason: String },
    #[error("{} exists{remedy}", path.display())]
    Exists { path: PathBuf, remedy: &'static str },
    #[error("{} cannot be written: its folder does not exist", path.display())]
    NoFolderFor { path: PathBuf },
    #[error("{} {why}: move it away, or give another --output-dir", path.display())]
    InTheWay { path: PathBuf, why: &'static str },
    #[error("ogr2ogr cannot be run ({source}): install GDAL's programs (package gdal-bin)")]
    NoOgr2ogr { source: io::Error },
    #[error("this GDAL writes FlatGeobuf as no other that was seen: write GPKG, and convert the copies")]
    UnknownFlatGeobuf,
    #[error("no threads can be started ({source})")]
    Threads { source: io::Error },
    #[error("the operating system gives no random bytes: {source}")]
    Random { source: getrandom::Error },

    // --- what does not belong together ---
    #[error(
        "the {what} is not in the deposit: it was chosen or changed after the deposit, or belongs to another one; give the \
         files that were deposited, unchanged"
    )]
    NotDeposited { what: String },
    #[error("the bundle {} is not made again from what is here: {differences}", path.display())]
    NotRepeated { path: PathBuf, differences: String },
    #[error("the time stamp {} {source}", path.display())]
    TimeStamp { path: PathBuf, source: StampFault },
    #[error("{} holds no certificate: give a bundle of the authorities that you trust, PEM", path.display())]
    NoAuthorities { path: PathBuf },
    #[error("the deposit {} {source}", path.display())]
    Deposit { path: PathBuf, source: DepositFault },

    // --- inputs that cannot be read ---
    #[error("the {what} {} cannot be opened: {source}", path.display())]
    Unopened { what: &'static str, path: PathBuf, source: GdalFailure },
    #[error("the suspect {} {reason}: convert it with \"{command}\"{place}, and verify the copy", path.display())]
    Unconverted {
        path: PathBuf,
        #[source]
        reason: Box<Unsuitable>,
        command: String,
        place: &'static str,
    },
    #[error("the {what} {}: {source}", path.display())]
    Unmeasured { what: &'static str, path: PathBuf, source: Box<MapError> },
    #[error("{} cannot be read to its end: {source}", path.display())]
    Undigested { path: PathBuf, source: io::Error },
    #[error("the suspect {} is not a file here: give a local file", path.display())]
    NoFile { path: PathBuf },
    #[error(
        "the {what} {} cannot be copied to {} for its examination ({source}): make room there, or name another folder \
         by TMPDIR",
        path.display(), place.display()
    )]
    Uncopied { what: &'static str, path: PathBuf, place: PathBuf, source: io::Error },
    #[error("the suspect {} was changed while it was examined: verify it again when nobody writes to it", path.display())]
    SuspectChanged { path: PathBuf },
    #[error(
        "an input was changed while the suspect was examined ({what}): verify again when nobody writes to any of them"
    )]
    InputChanged { what: String },
    #[error("{} is no bundle of a case ({reason}): give the file that `meshmark verify --bundle` wrote", path.display())]
    NoBundle { path: PathBuf, reason: String },
    #[error("GDAL takes no option: {source}")]
    NoOption { source: GdalError },
    #[error("the suspect {} is made of other tables: copy it to a plain file, for example with ogr2ogr", path.display())]
    OtherTables { path: PathBuf },
    #[error("the suspect {} cannot be read: {source}", path.display())]
    Unread { path: PathBuf, source: Box<Cause> },
    #[error(
        "the suspect {} has a virtual table \"{table}\", which may point at other files: copy its layers to a plain file, \
         for example with ogr2ogr",
        path.display()
    )]
    VirtualTable { path: PathBuf, table: String },
    #[error(
        "the {what} {} has a journal of an unfinished transaction over several databases, which names another file: open \
         it with SQLite where it was written, and verify it then",
        path.display()
    )]
    SuperJournal { what: &'static str, path: PathBuf },
    #[error(
        "the {what} {} has the journal of an unfinished transaction, which cannot be rolled back ({source}): verify the \
         file without its journal, or repair it with SQLite's .recover",
        path.display()
    )]
    Journal { what: &'static str, path: PathBuf, source: rusqlite::Error },
    #[error("the map as a GeoPackage cannot be read: {source}")]
    StagedUnread { source: Cause },
    #[error("ogr2ogr cannot copy {} to {format}: {reason}", path.display())]
    Ogr2ogr { path: PathBuf, format: String, reason: String },
    #[error(
        "the map was changed while it was read, or ogr2ogr reads other features of it: convert it to a GeoPackage, and \
         distribute that"
    )]
    MapChanged,

    // --- outputs that cannot be written ---
    #[error("{what} cannot be written: {source}{remedy}")]
    Unwritten { what: String, source: Box<Cause>, remedy: String },
    #[error("the answer cannot be printed: {source}")]
    Unprinted { source: io::Error },
    #[error("the output folder {} cannot be made ({source}): name one that can be", path.display())]
    NoFolder { path: PathBuf, source: io::Error },

    // --- an examination that did not end by itself ---
    #[error(
        "the examination of the suspect {} was stopped, as it needs more memory than its limit of {megabytes} MB: give a \
         larger --memory-limit if you trust the file",
        path.display()
    )]
    MemoryLimit { path: PathBuf, megabytes: u64 },
    #[error(
        "the examination of the suspect {} was stopped, as it takes longer than its limit of {seconds} s: give a larger \
         --time-limit if you trust the file",
        path.display()
    )]
    TimeLimit { path: PathBuf, seconds: u64 },
    #[error(
        "the examination of the suspect {} was stopped, as it writes a file larger than its limit of {megabytes} MB: give \
         a larger --memory-limit, which limits files, too, if you trust the suspect",
        path.display()
    )]
    FileLimit { path: PathBuf, megabytes: u64 },
    #[error(
        "the examination of the suspect {} was killed from outside, as a machine without free memory does: give a \
         --memory-limit below {megabytes} MB, or free some memory",
        path.display()
    )]
    Killed { path: PathBuf, megabytes: u64 },
    #[error(
        "the examination of the suspect {} ended early ({status}), as the file makes a library fail that reads it, or \
         needs more memory than its limit of {megabytes} MB: convert it with another program and verify the copy, or give \
         a larger --memory-limit if you trust the file",
        path.display()
    )]
    EarlyEnd { path: PathBuf, status: ExitStatus, megabytes: u64 },
    #[error(
        "no process can be started that examines the suspect ({source}): end other programs, and verify again"
    )]
    NotConfined { source: io::Error },

    // --- one of many copies ---
    #[error("\"{recipient}\": {source}")]
    Copy { recipient: String, source: Box<Error> },
    #[error(
        "{source}; {done} of {} written, and the same command again makes the rest",
        if *all == 1 { "1 copy was".into() } else { format!("{all} copies were") }
    )]
    Stopped { source: Box<Error>, done: usize, all: usize },
}

impl From<marking::Error> for Error {
    fn from(error: marking::Error) -> Self {
        Error::Dataset(error.into())
    }
}

/// A failure of a library in one of many steps of a piece of work.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Cause {
    Io(#[from] io::Error),
    Gdal(#[from] GdalError),
    GdalFailure(#[from] GdalFailure),
    Sqlite(#[from] rusqlite::Error),
    Wkb(#[from] WkbError),
    NotMoved(#[from] NotMoved),
    NotUtf8(#[from] FromUtf8Error),
    /// The fault of a spatial index.
    #[error("{0}")]
    SpatialIndex(&'static str),
}

impl Error {
    /// Creates the error of an output for which there is no remedy but another try.
    pub fn unwritten(what: impl ToString, source: impl Into<Cause>) -> Self {
        Error::Unwritten { what: what.to_string(), source: Box::new(source.into()), remedy: String::new() }
    }

    /// Returns whether the layers and the CRS that a request names allow no mark on a map.
    pub(crate) fn is_about_options(&self) -> bool {
        use MapError::*;
        let Error::Map { source, .. } = self else { return false };
        match &**source {
            NoLayers => true,
            Map(fault) => fault.is_about_options(),
            _ => false,
        }
    }

    /// Returns the exit code of this error.
    pub fn exit_code(&self) -> ExitCode {
        use Error::*;
        match self {
            Map { source, .. } => of_map_that_is_read(source),
            Dataset(MapError::File { .. } | MapError::NotKept { .. } | MapError::Gdal(_))
            | Core(meshmark_core::Error::Column { .. }) => ExitCode::Unwritable,
            Dataset(error) if error.is_of_other_base() => ExitCode::DoesNotBelong,
            Verification(error) if error.is_of_others() => ExitCode::DoesNotBelong,
            NotDeposited { .. }
            | NotRepeated { .. }
            | SheetsOfOtherCrs { .. }
            | SameSheet { .. }
            | SheetsDisagree { .. } => ExitCode::DoesNotBelong,
            TextUnread { .. }
            | FolderUnread { .. }
            | NoBundle { .. }
            | InputChanged { .. }
            | Unopened { .. }
            | Unconverted { .. }
            | Unmeasured { .. }
            | Undigested { .. }
            | NoFile { .. }
            | SuspectChanged { .. }
            | SheetChanged { .. }
            | NoOption { .. }
            | OtherTables { .. }
            | Unread { .. }
            | VirtualTable { .. }
            | SuperJournal { .. }
            | Journal { .. }
            | StagedUnread { .. }
            | Ogr2ogr { .. }
            | MapChanged => ExitCode::Unreadable,
            Unwritten { .. } | Uncopied { .. } | Unprinted { .. } | NoFolder { .. } => ExitCode::Unwritable,
            MemoryLimit { .. }
            | TimeLimit { .. }
            | FileLimit { .. }
            | Killed { .. }
            | EarlyEnd { .. }
            | NotConfined { .. } => ExitCode::Stopped,
            TimeStamp { source, .. } if !source.is_malformed() => ExitCode::DoesNotBelong,
            Deposit { source, .. } if !source.is_malformed() => ExitCode::DoesNotBelong,
            Copy { source, .. } | Stopped { source, .. } | OfRecord { source, .. } => source.exit_code(),
            _ => ExitCode::Usage,
        }
    }
}

fn of_map_that_is_read(error: &MapError) -> ExitCode {
    match error {
        MapError::Map(marking::Error::TooLarge { .. }) => ExitCode::TooLarge,
        MapError::Map(marking::Error::UnknownSrs(_)) => ExitCode::Usage,
        error if error.is_of_other_layers() => ExitCode::Usage,
        _ => ExitCode::Unreadable,
    }
}
