//! The command line: flags in, exit code out.

use crate::package_files;
use clap::{Arg, ArgMatches, Args, Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use meshmark_core::{
    key::{RECIPIENT_BITS, SecretKey},
    message::Message,
    options::{OPTIONS, Options, Spelling, Subject},
    record::Record,
};
use meshmark_verifier::{
    Demodulator, Error, ExitCode, Request, Result,
    candidates::verify_candidates,
    compare::{Comparison, compare, detail::Compared},
    distribute,
    evidence::{self, Provenance},
    evidence_map::Target,
    html,
    inputs::Inputs,
    progress::Progress,
    reading,
    registration::Start,
    report::Report,
    report_file::{Format, ReportFile},
    verify,
    verify::check_key,
};
use std::{
    io::Write,
    path::{Path, PathBuf},
};

const MARKING: &str = "Maps are marked by GDAL's ogr2ogr: ogr2ogr -f GPKG marked.gpkg MESHMARK:map.gpkg \
                       -oo KEY=key.json -oo RECIPIENT=\"ACME GmbH\" -oo RECORD=acme.json";

/// Watermarks of vector maps: make a key, verify a suspect map.
#[derive(Parser)]
#[command(name = "meshmark", version, subcommand_required = true, arg_required_else_help = true,
          after_help = MARKING)]
struct Cli {
    #[command(subcommand)]
    command: Subcommands,
}

#[derive(Subcommand)]
enum Subcommands {
    /// Make a secret key and write it to a new file that only you can read
    Keygen {
        /// The file to write; it must not exist
        key_file: PathBuf,
    },
    /// Say whether a suspect map carries a mark
    #[command(long_about = about_verify())]
    Verify(Box<VerifyArgs>),
    /// Say what marking did to a map: displacement, angles, areas, topology
    ///
    /// Features correspond by their order in each layer, vertices by their order in each feature. Exit codes: 0
    /// compared, 2 usage or maps that do not correspond, 5 unreadable input, 6 too large.
    Compare(CompareArgs),
    /// Write a marked copy of a map, and its record, for every recipient of a list
    ///
    /// The list is a CSV file with a column headed "recipient", or of one column. A copy appears when it is complete, was
    /// read back and carries its message; the same command again skips those that are there. Exit codes: 0 all copies
    /// are there, 2 usage, or a copy that could not be written, 5 unreadable map, 6 too large.
    Distribute(Box<DistributeArgs>),
    /// Write man pages and shell completions, for those who make packages
    #[command(hide = true)]
    PackageFiles {
        /// The folder to write them to
        folder: PathBuf,
    },
}

#[derive(Args)]
struct DistributeArgs {
    /// Key file made by `meshmark keygen`
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// List of the recipients, CSV
    #[arg(long, value_name = "FILE")]
    recipients: PathBuf,
    /// Folder for the copies and their records; made when it is not there
    #[arg(long, value_name = "FOLDER")]
    output_dir: PathBuf,
    /// Format of the copies, by GDAL's short name: GPKG, "ESRI Shapefile", FlatGeobuf, GeoJSON, GeoJSONSeq
    #[arg(short, long, default_value = "GPKG")]
    format: String,
    /// The map, unmarked; keep it, it is the reference of all copies
    map: PathBuf,
    #[command(flatten)]
    marking: DistributeFlags,
}

#[derive(Args)]
struct CompareArgs {
    /// The map as it was before marking
    reference: PathBuf,
    /// The marked map
    marked: PathBuf,
    /// Comma-separated layers to compare; all by default
    #[arg(long, value_delimiter = ',')]
    layers: Vec<String>,
    /// Grid of the marked map, CRS units: overlaps up to a cell of it count as slivers
    #[arg(long)]
    precision: Option<f64>,
    /// Print the comparison as one JSON object
    #[arg(long)]
    json: bool,
    /// Write a report to read and print (.html), or to process (.json); the file must not exist
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

#[derive(Args)]
struct VerifyArgs {
    /// Key file made by `meshmark keygen`
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// The map as it was before marking
    #[arg(long, value_name = "MAP")]
    reference: PathBuf,
    /// Record the driver wrote when it marked the map
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Folder of records (*.json): which of their recipients' copies is it?
    #[arg(long, value_name = "FOLDER", conflicts_with = "record")]
    records: Option<PathBuf>,
    /// The map in question
    suspect: PathBuf,
    /// Field of the reference to find landmarks by, matched with any field of the suspect by value; repeatable,
    /// all string and integer fields by default
    #[arg(long, value_name = "FIELD")]
    landmark: Vec<String>,
    /// How to bring the suspect onto the reference
    #[arg(long, value_enum, default_value = "auto")]
    registration: Start,
    /// How to demodulate
    #[arg(long, value_enum, default_value = "joint")]
    demodulator: Demodulator,
    /// Radius within which vertices match, metres on the ground
    #[arg(long, value_name = "METRES", default_value_t = 1.0, value_parser = positive, allow_negative_numbers = true)]
    radius: f64,
    /// The verdict is match when the p-value is below this
    #[arg(long, value_name = "P", default_value_t = 1e-6, value_parser = probability, allow_negative_numbers = true)]
    significance: f64,
    /// Print the report as one JSON object
    #[arg(long)]
    json: bool,
    /// Say in sentences what was compared, found and not tested
    #[arg(long, conflicts_with = "json")]
    explain: bool,
    /// GeoPackage to write: displacements of the matched vertices as lines, and the patches with their scores
    #[arg(long, value_name = "FILE")]
    evidence_map: Option<PathBuf>,
    /// Write a report to read and print (.html), or to process (.json); the file must not exist
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    marking: MarkingFlags,
}

/// The marking options as flags of `verify`, from the one table.
struct MarkingFlags(Vec<(&'static str, String)>);

/// Those of `distribute`, whose subjects are in its list.
struct DistributeFlags(Vec<(&'static str, String)>);

const SUBJECTS: [&str; 2] = ["RECIPIENT", "MESSAGE"];

/// A flag for every option that shapes the mark.
fn flags(heading: &'static str) -> impl Iterator<Item = Arg> {
    OPTIONS.iter().filter(|option| option.shapes_mark).map(move |option| {
        let default = option.default.map_or(String::new(), |d| format!(" [default: {d}]"));
        Arg::new(option.name)
            .long(Spelling::Flag.name(option.name)[2..].to_string())
            .value_name(option.name)
            .allow_negative_numbers(true)
            .help_heading(heading)
            .help(format!("{}{default}", option.help))
    })
}

/// What was given of them.
fn given(matches: &ArgMatches) -> Vec<(&'static str, String)> {
    let value = |name: &'static str| Some((name, matches.try_get_one::<String>(name).ok()??.clone()));
    OPTIONS.iter().filter_map(|option| value(option.name)).collect()
}

impl Args for MarkingFlags {
    fn augment_args(command: Command) -> Command {
        let heading = "How the map was marked (taken from the record when there is one)";
        command.args(flags(heading).map(|flag| flag.conflicts_with("records")))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for MarkingFlags {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        Ok(MarkingFlags(given(matches)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for DistributeFlags {
    fn augment_args(command: Command) -> Command {
        let is_subject = |flag: &Arg| SUBJECTS.iter().any(|subject| flag.get_id() == subject);
        command.args(flags("How the map is marked").filter(|flag| !is_subject(flag)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for DistributeFlags {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        Ok(DistributeFlags(given(matches)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("give a number greater than 0".into()),
    }
}

fn probability(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err("give a number between 0 and 1".into()),
    }
}

fn about_verify() -> String {
    let codes = ExitCode::ALL.map(|code| format!("{} {}", code as u8, code.meaning())).join(", ");
    format!("Say whether a suspect map carries a mark\n\nExit codes: {codes}.")
}

/// Runs the command of this process.
pub fn run() -> ExitCode {
    reading::quieten_gdal();
    let result = match Cli::parse().command {
        Subcommands::Keygen { key_file } => keygen(&key_file),
        Subcommands::Verify(args) => run_verify(*args),
        Subcommands::Compare(args) => run_compare(&args),
        Subcommands::PackageFiles { folder } => write_package_files(&folder),
        Subcommands::Distribute(args) => run_distribute(*args),
    };
    result.unwrap_or_else(|error| {
        eprintln!("meshmark: {error}");
        error.exit_code()
    })
}

fn keygen(path: &PathBuf) -> Result<ExitCode> {
    let mut secret = zeroize::Zeroizing::new([0; 32]);
    getrandom::fill(secret.as_mut_slice())
        .map_err(|error| Error::Usage(format!("the operating system gives no random bytes: {error}")))?;
    let key = SecretKey::from_bytes(*secret);
    let failed = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => Error::Usage(format!(
            "{} exists, and a key is never overwritten: name another file",
            path.display()
        )),
        _ => Error::Usage(format!("the key file {} cannot be written: {error}", path.display())),
    };
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path).map_err(failed)?;
    let written = file.write_all(key.to_json().as_bytes()).and_then(|()| file.sync_all());
    if let Err(error) = written {
        let _ = std::fs::remove_file(path); // half a key is worse than none
        return Err(failed(error));
    }
    println!("key {} written to {}", key.id(), path.display());
    Ok(ExitCode::Match)
}

fn write_package_files(folder: &Path) -> Result<ExitCode> {
    package_files::write(Cli::command(), folder).map_err(|error| {
        Error::Usage(format!("man pages and completions cannot be written to {}: {error}", folder.display()))
    })?;
    Ok(ExitCode::Match)
}

fn run_compare(args: &CompareArgs) -> Result<ExitCode> {
    let layers = (!args.layers.is_empty()).then_some(args.layers.as_slice());
    let file = args.report.as_deref().map(ReportFile::new).transpose()?;
    let provenance =
        file.as_ref().map(|_| Compared::read(&args.reference, &args.marked, command_line())).transpose()?;
    let mut comparison = compare(&args.reference, &args.marked, layers, args.precision, file.is_some())?;
    let detail = comparison.detail.take(); // a report file has it
    print!("{}", if args.json { comparison.to_json() } else { comparison.to_text() });
    if let Some((file, mut detail)) = file.zip(detail) {
        detail.provenance = provenance;
        let comparison = Comparison { detail: Some(detail), ..comparison };
        file.write(&match file.format() {
            Format::Html => html::comparison(&comparison),
            Format::Json => comparison.to_json(),
        })?;
    }
    Ok(ExitCode::Match)
}

fn run_distribute(args: DistributeArgs) -> Result<ExitCode> {
    let flags = args.marking.0.iter().map(|(name, value)| (*name, value.as_str()));
    let request = distribute::Request {
        options: Options::parse(flags)?,
        key: reading::key(&args.key)?,
        map: args.map,
        recipients: args.recipients,
        folder: args.output_dir,
        format: args.format,
    };
    let mut warn = |text: &str| eprintln!("meshmark: {text}");
    let done = distribute::distribute(&request, &mut Progress::default(), &mut warn)?;
    let copies = |count| if count == 1 { "1 copy".into() } else { format!("{count} copies") };
    let before = match done.finished_before {
        0 => String::new(),
        count => format!(", {} there already", copies(count)),
    };
    println!("{} written to {}{before}", copies(done.written), request.folder.display());
    Ok(ExitCode::Match)
}

fn run_verify(args: VerifyArgs) -> Result<ExitCode> {
    let file = args.report.as_deref().map(ReportFile::new).transpose()?;
    let evidence_map = args.evidence_map.as_deref().map(Target::new).transpose()?;
    let wanted = args.explain || file.is_some();
    let inputs = wanted.then(|| Inputs::read(&args.key, &args.reference, &args.suspect)).transpose()?;
    let (json, explain) = (args.json, args.explain);
    let (records, record) = (args.records.clone(), args.record.clone());
    let request = request(args)?;
    let mut progress = Progress::default();
    let mut warn = |text: &str| eprintln!("meshmark: {text}");
    let mut report = match &records {
        Some(folder) => verify_candidates(&request, folder, &mut progress, &mut warn)?,
        None => verify(&request, &mut progress)?,
    };
    if let Some((target, map)) = evidence_map.zip(report.evidence_map.take()) {
        map.write(&target)?;
    }
    let evidence = report.evidence.take(); // a report file has it
    print!("{}", if json { report.to_json() } else { report.to_text() });
    let Some(inputs) = inputs else { return Ok(report.exit_code()) };
    let best = || Some(records.as_ref()?.join(&report.candidates.as_ref()?.list.first()?.record));
    let inputs = inputs.with_record(record.or_else(best).as_deref())?;
    if explain {
        print!("\n{}", inputs.explain(&report));
    }
    if let Some(file) = file {
        let provenance = Provenance::new(&report, inputs, command_line());
        let report = Report { seconds: None, provenance: Some(provenance), evidence, ..report.clone() };
        file.write(&match file.format() {
            Format::Html => html::verification(&report),
            Format::Json => report.to_json(),
        })?;
    }
    Ok(report.exit_code())
}

/// That of this process.
fn command_line() -> String {
    evidence::command_line(std::env::args_os().map(|word| word.to_string_lossy().into_owned()))
}

/// Puts key, record and flags together.
fn request(args: VerifyArgs) -> Result<Request> {
    let key = reading::key(&args.key)?;
    let record = args.record.as_deref().map(reading::record).transpose()?;
    let flags = args.marking.0.iter().map(|(name, value)| (*name, value.as_str()));
    let options = Options::parse(flags)?;
    let options = match &record {
        Some(record) => {
            check_flags(&args.marking.0, record)?;
            check_key(record, &key)?;
            from_record(record)?
        }
        None => options,
    };
    let expected = options.subject.as_ref().map(|subject| subject.message(&key));
    Ok(Request {
        bits: expected.as_ref().map_or(RECIPIENT_BITS, Message::len),
        recipient: options.subject.and_then(|subject| match subject {
            Subject::Recipient(text) => Some(text),
            Subject::Message(_) => None,
        }),
        expected,
        key,
        reference: args.reference,
        suspect: args.suspect,
        record,
        parameters: options.parameters,
        layers: options.layers,
        srs: options.srs,
        landmarks: args.landmark,
        registration: args.registration,
        demodulator: args.demodulator,
        radius_m: args.radius,
        significance: args.significance,
        sketch: args.report.is_some(),
        evidence_map: args.evidence_map.is_some(),
    })
}

/// The options a record was made with.
fn from_record(record: &Record) -> Result<Options> {
    Ok(Options {
        key_path: None,
        subject: Some(record.subject()?),
        parameters: record.parameters()?,
        layers: record.layers.clone(),
        srs: record.srs.clone(),
        record_path: None,
    })
}

/// A flag may repeat what the record says, not contradict it.
fn check_flags(flags: &[(&'static str, String)], record: &Record) -> Result<()> {
    let recorded = from_record(record)?;
    for (name, value) in flags {
        let alone = Options::parse([(*name, value.as_str())])?;
        let agrees = match *name {
            "RECIPIENT" => alone.subject == recorded.subject,
            "MESSAGE" => matches!(&alone.subject, Some(Subject::Message(m)) if *m == record.message()?),
            "AMPLITUDE" => alone.parameters.amplitude_m == recorded.parameters.amplitude_m,
            "CODE" => alone.parameters.code == recorded.parameters.code,
            "CHIP_RATE" => alone.parameters.chip_rate == recorded.parameters.chip_rate,
            "PATCH_SIZE" => alone.parameters.patch_size == recorded.parameters.patch_size,
            "TOLERANCE" => alone.parameters.tolerance_m == recorded.parameters.tolerance_m,
            "SHAPE" => alone.parameters.shape == recorded.parameters.shape,
            "BASIS" => alone.parameters.laplacian == recorded.parameters.laplacian,
            "PRECISION" => alone.parameters.precision == recorded.parameters.precision,
            "LAYERS" => alone.layers == recorded.layers,
            "SRS" => alone.srs == recorded.srs,
            other => unreachable!("{other} does not shape the mark"),
        };
        if !agrees {
            let flag = Spelling::Flag.value(name, value);
            return Err(Error::Usage(format!("{flag} contradicts the record: leave one of them out")));
        }
    }
    Ok(())
}
