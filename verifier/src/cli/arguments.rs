//! Subcommands and their flags. The table of marking options generates the flags of those options.

use clap::{
    Arg, ArgGroup, ArgMatches, Args, Command, FromArgMatches, Parser, Subcommand, ValueEnum, value_parser,
};
use meshmark_core::options::{OPTIONS, OptionSpec, Spelling};
use meshmark_detection::{Demodulator, registration::Start};
use meshmark_verification::verify::LARGEST_SIGNIFICANCE;
use meshmark_verifier::{ExitCode, inputs::passphrase::Passphrase};
use std::path::PathBuf;

const MARKING: &str = "Maps are marked by GDAL's ogr2ogr: ogr2ogr -f GPKG marked.gpkg MESHMARK:map.gpkg \
                       -oo KEY=key.json -oo RECIPIENT=\"ACME GmbH\" -oo RECORD=acme.json";

/// Watermarks of vector maps: make a key, verify a suspect map.
#[derive(Parser)]
#[command(name = "meshmark", version, subcommand_required = true, arg_required_else_help = true,
          after_help = MARKING)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) command: Subcommands,
}

/// The name of the subcommand that `verify` runs as its child.
pub(super) const EXAMINE: &str = "examine";

#[derive(Subcommand)]
pub(super) enum Subcommands {
    /// Make a secret key, and a key pair that signs deposits, in new files
    ///
    /// The secret key goes to the file that you name, and the key pair beside it: for key.json
    /// key.signing.pem, which only you can read, too, and key.public.pem, which is for everybody.
    Keygen(KeygenArgs),
    /// Fix key, references and records in a signed file, before copies are handed out
    ///
    /// Who keeps the deposit, or its time stamp, can show later that nobody chose or changed any of
    /// them since. It discloses neither the key nor a recipient. With --verify the deposit is
    /// verified, with its time stamp, and compared with the key, the references and the records that
    /// are given. Nothing is sent: a command that sends the request for a time stamp is printed. Exit
    /// codes: 0 written, or verified, 2 usage, 4 something is not in the deposit or not stamped, 5
    /// unreadable input, 7 an output cannot be written.
    Deposit(Box<DepositArgs>),
    /// Determine whether a suspect map carries a mark
    #[command(long_about = about_verify())]
    Verify(Box<VerifyArgs>),
    /// Examine a suspect for `verify`, as its child, in the folder of the private copy
    #[command(name = EXAMINE, hide = true)]
    Examine {
        /// The folder, to which the results are written
        folder: PathBuf,
        /// The arguments of `verify`
        #[command(flatten)]
        args: Box<VerifyArgs>,
    },
    /// Make the bundle of a case again, from the same inputs, and compare the two byte by byte
    ///
    /// Run it in a folder that has the inputs in the same places as the folder where the bundle was made;
    /// what the bundle holds itself is there after unzipping it. Exit codes: 0 the same, 2 usage, 4 an
    /// input or the result differs, and the message names it, 5 unreadable input, 7 an output cannot be
    /// written.
    Repeat(RepeatArgs),
    /// Measure the effect of marking on a map: displacement, angles, areas, topology
    ///
    /// Features correspond by their order in each layer, vertices by their order in each feature.
    /// Exit codes: 0 compared, 2 usage or maps that do not correspond, 5 unreadable input, 6 too
    /// large, 7 an output cannot be written.
    Compare(CompareArgs),
    /// Write a marked copy of a map, and its record, for every recipient of a list
    ///
    /// The list is a CSV file with a column headed "recipient", or of one column. A copy appears
    /// when it is complete, was read back and carries its mark; the same command again skips
    /// those that are there. Exit codes: 0 all copies are there, 2 usage, 5 unreadable input, 6 too
    /// large, 7 a copy cannot be written.
    Distribute(Box<DistributeArgs>),
    /// Plan the sheets of a map, so that they are marked apart and fit together
    ///
    /// Sheets that are marked with --sheets, or SHEETS of the driver, agree on every vertex and line that
    /// they share, whoever marks them, when and in which order. Plan all sheets together, before any of
    /// them is marked, and again when one changes. Exit codes: 0 written, 2 usage, 4 sheets that do not
    /// belong together, 5 unreadable sheet, 6 too large, 7 the plan cannot be written.
    Plan(PlanArgs),
    /// List who received which copy, from the records of a folder
    ///
    /// The table is CSV: recipient, edition (SHA-256 of the vertices of the unmarked map), number of
    /// earlier editions, record, copy beside the record, its SHA-256, whether it is the recorded one,
    /// and the day on which it was last written. Exit codes: 0 listed, 2 usage, or no records,
    /// 5 unreadable input.
    Records {
        /// Folder of the records (*.json), such as the output of `meshmark distribute`
        folder: PathBuf,
    },
    /// Write man pages and shell completions, for packagers
    #[command(hide = true)]
    PackageFiles {
        /// The folder to write them to
        folder: PathBuf,
    },
}

#[derive(Args)]
pub(super) struct KeygenArgs {
    /// The file to write; it must not exist
    pub(super) key_file: PathBuf,
    /// Make only the key pair, for a key file that exists
    #[arg(long)]
    pub(super) signing_key_only: bool,
    /// Protect the secret key and the signing key by a passphrase, in the format of age; it is asked for
    /// unless --passphrase-file has it
    #[arg(long)]
    pub(super) passphrase: bool,
    #[command(flatten)]
    pub(super) opening: OpeningFlags,
}

/// How protected keys are opened.
#[derive(Args)]
pub(super) struct OpeningFlags {
    /// File whose first line is the passphrase of the key; without it, the terminal asks for one that is
    /// needed
    #[arg(long, value_name = "FILE")]
    pub(super) passphrase_file: Option<PathBuf>,
}

impl KeygenArgs {
    /// Returns whether the user asks for protection: a file with a passphrase has no other purpose.
    pub(super) fn is_protected(&self) -> bool {
        self.passphrase || self.opening.passphrase_file.is_some()
    }
}

impl OpeningFlags {
    /// Returns the passphrase, which is asked for when a protected key is read.
    pub(super) fn passphrase(&self) -> Passphrase {
        Passphrase::new(self.passphrase_file.as_deref())
    }
}

#[derive(Args)]
pub(super) struct DepositArgs {
    /// Key file made by `meshmark keygen`
    #[arg(long, value_name = "FILE", required_unless_present = READ_DEPOSIT)]
    pub(super) key: Option<PathBuf>,
    #[command(flatten)]
    pub(super) opening: OpeningFlags,
    /// The map as it was before marking, a local file; repeatable
    #[arg(long, value_name = "MAP", required_unless_present = READ_DEPOSIT)]
    pub(super) reference: Vec<PathBuf>,
    /// Folder of the records (*.json) of all copies
    #[arg(long, value_name = "FOLDER", required_unless_present = READ_DEPOSIT)]
    pub(super) records: Option<PathBuf>,
    /// Signing key made by `meshmark keygen`; by default the one beside the key file
    #[arg(long, value_name = "FILE", conflicts_with = READ_DEPOSIT)]
    pub(super) signing_key: Option<PathBuf>,
    /// The deposit to write; it must not exist
    #[arg(short, long, value_name = "FILE", required_unless_present = READ_DEPOSIT, conflicts_with = READ_DEPOSIT)]
    pub(super) output: Option<PathBuf>,
    /// A deposit to verify
    #[arg(id = READ_DEPOSIT, long = "verify", value_name = "DEPOSIT")]
    pub(super) verify: Option<PathBuf>,
    #[command(flatten)]
    pub(super) trust: TrustFlags,
    /// Request for a time stamp (RFC 3161): written with a deposit, and with --verify the one that the
    /// time stamp must answer
    #[arg(long, value_name = "FILE")]
    pub(super) time_stamp_request: Option<PathBuf>,
}

/// The name of the flag that names a deposit to read, of either subcommand.
const READ_DEPOSIT: &str = "read_deposit";

/// Who vouches for a deposit.
#[derive(Args)]
pub(super) struct TrustFlags {
    /// Public key made by `meshmark keygen`, which the deposit must be signed with
    #[arg(long, value_name = "FILE", requires = READ_DEPOSIT)]
    pub(super) public_key: Option<PathBuf>,
    /// Time stamp of the deposit: the response of an authority
    #[arg(long, value_name = "FILE", requires_all = [READ_DEPOSIT, "authorities"])]
    pub(super) time_stamp: Option<PathBuf>,
    /// Certificates of the time-stamping authorities that you trust, PEM
    #[arg(long, value_name = "FILE", requires = "time_stamp")]
    pub(super) authorities: Option<PathBuf>,
}

#[derive(Args)]
pub(super) struct DistributeArgs {
    /// Key file made by `meshmark keygen`
    #[arg(long, value_name = "FILE")]
    pub(super) key: PathBuf,
    #[command(flatten)]
    pub(super) opening: OpeningFlags,
    /// List of the recipients, CSV
    #[arg(long, value_name = "FILE")]
    pub(super) recipients: PathBuf,
    /// Folder for the copies and their records; made when it is not there
    #[arg(long, value_name = "FOLDER")]
    pub(super) output_dir: PathBuf,
    /// Format of the copies, by GDAL's short name: GPKG, "ESRI Shapefile", FlatGeobuf, GeoJSON,
    /// GeoJSONSeq
    #[arg(short, long, default_value = "GPKG")]
    pub(super) format: String,
    /// The map, unmarked; keep it, it is the reference of all copies
    pub(super) map: PathBuf,
    #[command(flatten)]
    pub(super) marking: DistributeFlags,
}

#[derive(Args)]
pub(super) struct PlanArgs {
    /// The sheets, unmarked, or folders of them
    #[arg(required = true)]
    pub(super) sheets: Vec<PathBuf>,
    /// The plan to write; it must not exist
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Comma-separated layers that are marked, those with a comma in double quotes; all by default
    #[arg(long)]
    pub(super) layers: Option<String>,
    /// CRS of sheets that have none, for example EPSG:3067
    #[arg(long)]
    pub(super) srs: Option<String>,
    /// The tolerance with which the sheets are marked, metres on the ground [default: 0.75]
    #[arg(long, allow_negative_numbers = true)]
    pub(super) tolerance: Option<String>,
}

#[derive(Args)]
pub(super) struct RepeatArgs {
    /// The bundle that `meshmark verify --bundle` wrote
    pub(super) bundle: PathBuf,
    #[command(flatten)]
    pub(super) opening: OpeningFlags,
}

#[derive(Args)]
pub(super) struct CompareArgs {
    /// The map as it was before marking
    pub(super) reference: PathBuf,
    /// The marked map
    pub(super) marked: PathBuf,
    /// Comma-separated layers to compare, those with a comma in double quotes; all by default
    #[arg(long)]
    pub(super) layers: Option<String>,
    /// Grid of the marked map, CRS units: overlaps up to a cell of it count as slivers
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub(super) precision: Option<f64>,
    /// Print the comparison as one JSON object
    #[arg(long)]
    pub(super) json: bool,
    /// Write a report to read and print (.html), or to process (.json); the file must not exist
    #[arg(long, value_name = "FILE")]
    pub(super) report: Option<PathBuf>,
    /// Include exact displacements of vertices in the report, which then must be kept as secret as
    /// the records
    #[arg(long, requires = "report")]
    pub(super) exact_displacements: bool,
}

/// Where to start the registration.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum StartArg {
    /// As it stands, by landmarks or by geometry, whichever is best
    Auto,
    /// Features with the same attribute values
    Landmarks,
    /// Features of the same shape
    Geometry,
    /// Nowhere: the suspect is taken as it stands
    None,
}

impl From<StartArg> for Start {
    fn from(start: StartArg) -> Self {
        match start {
            StartArg::Auto => Start::Auto,
            StartArg::Landmarks => Start::Landmarks,
            StartArg::Geometry => Start::Geometry,
            StartArg::None => Start::None,
        }
    }
}

/// How to demodulate.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum DemodulatorArg {
    /// The detector of Ohbuchi, Ueda and Endoh
    Paper,
    /// Least squares over the vertices that were found
    Joint,
}

impl From<DemodulatorArg> for Demodulator {
    fn from(demodulator: DemodulatorArg) -> Self {
        match demodulator {
            DemodulatorArg::Paper => Demodulator::Paper,
            DemodulatorArg::Joint => Demodulator::Joint,
        }
    }
}

#[derive(Args)]
#[command(group = ArgGroup::new("files").multiple(true).args(["report", "bundle", "evidence_map"]))]
#[command(group = ArgGroup::new("reports").multiple(true).args(["report", "bundle"]))]
pub(super) struct VerifyArgs {
    /// Key file made by `meshmark keygen`
    #[arg(long, value_name = "FILE")]
    pub(super) key: PathBuf,
    #[command(flatten)]
    pub(super) opening: OpeningFlags,
    /// The map as it was before marking; several, such as editions, where records choose among them
    #[arg(long, value_name = "MAP", required = true)]
    pub(super) reference: Vec<PathBuf>,
    /// Record the driver wrote when it marked the map
    #[arg(long, value_name = "FILE")]
    pub(super) record: Option<PathBuf>,
    /// Folder of records (*.json), to find the recipient of the copy
    #[arg(long, value_name = "FOLDER", conflicts_with = "record")]
    pub(super) records: Option<PathBuf>,
    /// Deposit of key, reference and record, made by `meshmark deposit`
    #[arg(id = READ_DEPOSIT, long = "deposit", value_name = "FILE")]
    pub(super) deposit: Option<PathBuf>,
    #[command(flatten)]
    pub(super) trust: TrustFlags,
    /// The map in question
    pub(super) suspect: PathBuf,
    /// Field of the reference to find landmarks by, matched with any field of the suspect by value;
    /// repeatable, all string and integer fields by default
    #[arg(long, value_name = "FIELD")]
    pub(super) landmark: Vec<String>,
    /// How to bring the suspect onto the reference
    #[arg(long, value_enum, default_value = "auto")]
    pub(super) registration: StartArg,
    /// How to demodulate
    #[arg(long, value_enum, default_value = "joint")]
    pub(super) demodulator: DemodulatorArg,
    /// Radius within which vertices match, metres on the ground; by default it follows from the
    /// suspect
    #[arg(long, value_name = "METRES", value_parser = positive, allow_negative_numbers = true)]
    pub(super) radius: Option<f64>,
    /// The verdict is match when the p-value is below this
    #[arg(long, value_name = "P", default_value_t = 1e-6, value_parser = probability, allow_negative_numbers = true)]
    pub(super) significance: f64,
    /// Print the report as one JSON object
    #[arg(long)]
    pub(super) json: bool,
    /// Describe in sentences what was compared, found and not tested
    #[arg(long, conflicts_with = "json")]
    pub(super) explain: bool,
    /// GeoPackage to write: the matched vertices, and the patches with their scores
    #[arg(long, value_name = "FILE")]
    pub(super) evidence_map: Option<PathBuf>,
    /// Write a report to read and print (.html), or to process (.json); the file must not exist
    #[arg(long, value_name = "FILE")]
    pub(super) report: Option<PathBuf>,
    /// Bundle of the case to write (.zip): the report in both forms, the deposit with what vouches for it,
    /// and the digests of all inputs, which must lie in the current folder; `meshmark repeat` makes it
    /// again
    #[arg(long, value_name = "FILE")]
    pub(super) bundle: Option<PathBuf>,
    /// Name recipients, too, whose records were tried and do not match
    #[arg(long, requires = "records")]
    pub(super) show_recipients: bool,
    /// Case file for the report, TOML: number, examiner, date, custody (a list)
    #[arg(long, value_name = "FILE", requires = "reports")]
    pub(super) case: Option<PathBuf>,
    /// Include exact displacements of vertices in the report and the evidence map, which then must be
    /// kept as secret as the records
    #[arg(long, requires = "files")]
    pub(super) exact_displacements: bool,
    /// Most memory of the examination, and the largest file that it writes; by default 1000 MB, 50 MB
    /// for each processor and 400 times the size of the maps, at most half of the machine's memory
    #[arg(long, value_name = "MB", value_parser = value_parser!(u64).range(1..))]
    pub(super) memory_limit: Option<u64>,
    /// Longest time of the examination; by default ten minutes, and one more for every 12 MB of the
    /// maps
    #[arg(long, value_name = "SECONDS", value_parser = value_parser!(u64).range(1..))]
    pub(super) time_limit: Option<u64>,
    #[command(flatten)]
    pub(super) marking: MarkingFlags,
}

/// The marking options as flags of `verify`, generated from the table.
pub(super) struct MarkingFlags(pub(super) Vec<(&'static str, String)>);

/// The marking options as flags of `distribute`; its list holds the subjects.
pub(super) struct DistributeFlags(pub(super) Vec<(&'static str, String)>);

/// Options that shape no mark by themselves, and concern those who distribute.
const OF_DISTRIBUTE: [&str; 4] = ["ATTRIBUTES", "BASE", "BASE_REFERENCE", "SHEETS"];

const SUBJECTS: [&str; 2] = ["RECIPIENT", "MESSAGE"];

/// Returns a flag for every option that `is_wanted`.
fn flags(heading: &'static str, is_wanted: fn(&OptionSpec) -> bool) -> impl Iterator<Item = Arg> {
    OPTIONS.iter().filter(move |option| is_wanted(option)).map(move |option| {
        let default = option.default.map_or(String::new(), |d| format!(" [default: {d}]"));
        Arg::new(option.name)
            .long(Spelling::Flag.name(option.name)[2..].to_string())
            .value_name(option.name)
            .allow_negative_numbers(true)
            .help_heading(heading)
            .help(format!("{}{default}", option.help))
    })
}

/// Returns the given flags and their values.
fn given(matches: &ArgMatches) -> Vec<(&'static str, String)> {
    let value = |name: &'static str| Some((name, matches.try_get_one::<String>(name).ok()??.clone()));
    OPTIONS.iter().filter_map(|option| value(option.name)).collect()
}

impl Args for MarkingFlags {
    fn augment_args(command: Command) -> Command {
        let heading = "How the map was marked (taken from the record when there is one)";
        command.args(flags(heading, |option| option.shapes_mark).map(|flag| flag.conflicts_with("records")))
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
        let is_wanted = |option: &OptionSpec| {
            option.shapes_mark && !SUBJECTS.contains(&option.name) || OF_DISTRIBUTE.contains(&option.name)
        };
        command.args(flags("How the map is marked", is_wanted))
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
        Ok(value) if value > 0.0 && value <= LARGEST_SIGNIFICANCE => Ok(value),
        _ => Err(format!("give a number greater than 0 and at most {LARGEST_SIGNIFICANCE}")),
    }
}

fn about_verify() -> String {
    let codes = ExitCode::ALL.map(|code| format!("{} {}", code as u8, code.meaning())).join(", ");
    format!("Determine whether a suspect map carries a mark\n\nExit codes: {codes}.")
}
