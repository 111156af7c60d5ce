//! The command line: it turns flags into an exit code.

mod arguments;
mod command_line;
mod deposit;
mod keygen;
mod printing;
mod repeat;
mod request;
mod verification;

use crate::package_files;
use arguments::{Cli, CompareArgs, DistributeArgs, PlanArgs, Subcommands};
use clap::{CommandFactory, Parser};
use meshmark_core::{counted, options::Options, sheet_plan::PlannedSheet};
use meshmark_verification::{
    compare::{Comparison, Details},
    html,
};
use meshmark_verifier::{
    Error, Result,
    compare::{compare, compared_files},
    copies_index::{self, Index, IndexedCopy},
    distribute,
    inputs::{gdal_failures, texts},
    outputs::{Format, NewFile, ReportFile},
    progress::Progress,
    sheets,
};
use printing::{print, warn, warn_of_displacements};
use std::{
    io::{IsTerminal, stdout},
    path::Path,
};

/// The exit code of a command that succeeds; a match has the same code.
const DONE: u8 = 0;

/// Runs the command of this process and returns its exit code.
pub fn run() -> u8 {
    gdal_failures::quieten_gdal();
    let result = match Cli::parse().command {
        Subcommands::Keygen(args) => keygen::run(&args).map(|()| DONE),
        Subcommands::Deposit(args) => deposit::run(&args).map(|()| DONE),
        Subcommands::Verify(args) => verification::run(&args),
        Subcommands::Examine { folder, args } => verification::examine(*args, &folder).map(|code| code as u8),
        Subcommands::Repeat(args) => repeat::run(&args).map(|()| DONE),
        Subcommands::Compare(args) => run_compare(&args).map(|()| DONE),
        Subcommands::PackageFiles { folder } => write_package_files(&folder).map(|()| DONE),
        Subcommands::Distribute(args) => run_distribute(*args).map(|()| DONE),
        Subcommands::Plan(args) => plan_sheets(&args).map(|()| DONE),
        Subcommands::Records { folder } => list_copies(&folder),
    };
    result.unwrap_or_else(|error| {
        warn(&error.to_string());
        error.exit_code() as u8
    })
}

fn write_package_files(folder: &Path) -> Result<()> {
    package_files::write(Cli::command(), folder).map_err(|source| {
        let what = format!("the folder {} for man pages and completions", folder.display());
        Error::unwritten(what, source)
    })?;
    Ok(())
}

fn run_compare(args: &CompareArgs) -> Result<()> {
    let layers = Options::parse(args.layers.as_deref().map(|layers| ("LAYERS", layers)))?.layers;
    let file = args.report.as_deref().map(ReportFile::new).transpose()?;
    let provenance = file
        .as_ref()
        .map(|_| compared_files(&args.reference, &args.marked, command_line::own()))
        .transpose()?;
    let details = match (&file, args.exact_displacements) {
        (None, _) => Details::None,
        (Some(_), false) => Details::Places,
        (Some(_), true) => Details::Displacements,
    };
    warn_of_displacements(args.exact_displacements);
    let mut comparison = compare(&args.reference, &args.marked, layers.as_deref(), args.precision, details)?;
    let detail = comparison.detail.take(); // only a report file holds it
    print(&if args.json { comparison.to_json() } else { comparison.to_text() })?;
    if let Some((file, mut detail)) = file.zip(detail) {
        detail.provenance = provenance;
        let comparison = Comparison { detail: Some(detail), ..comparison };
        file.write(&match file.format() {
            Format::Html => html::comparison(&comparison),
            Format::Json => comparison.to_json(),
        })?;
    }
    Ok(())
}

fn run_distribute(args: DistributeArgs) -> Result<()> {
    let flags = args.marking.0.iter().map(|(name, value)| (*name, value.as_str()));
    let request = distribute::DistributeRequest {
        options: Options::parse_for_recipients(flags)?,
        key: texts::key(&args.key, &args.opening.passphrase(), &mut warn)?,
        map: args.map,
        recipients: args.recipients,
        folder: args.output_dir,
        format: args.format,
    };
    let done = distribute::distribute(&request, &Progress::default(), &mut warn)?;
    let before = match done.finished_before {
        0 => String::new(),
        count => format!(", {} there already", counted(count, "copy")),
    };
    print(&format!("{} written to {}{before}\n", counted(done.written, "copy"), request.folder.display()))?;
    Ok(())
}

fn plan_sheets(args: &PlanArgs) -> Result<()> {
    let PlanArgs { sheets: named, output, layers, srs, tolerance } = args;
    let file = NewFile::new("plan", output)?;
    let flags = [("LAYERS", layers), ("SRS", srs), ("TOLERANCE", tolerance)];
    let given = flags.iter().filter_map(|(name, value)| Some((*name, value.as_deref()?)));
    let options = Options::parse_for_recipients(given)?;
    let plan = sheets::plan(&options, named, &Progress::default(), &mut warn)?;
    file.write(plan.to_json().as_bytes())?;
    let count = |number: fn(&PlannedSheet) -> usize| plan.sheets.iter().map(number).sum::<usize>();
    print(&format!(
        "plan of {} written to {}: {} of {} stay in place\n",
        counted(plan.sheets.len(), "sheet"),
        output.display(),
        count(|sheet| sheet.anchors.as_slice().len()),
        counted(count(|sheet| sheet.vertices), "vertex")
    ))
}

/// Prints the table of copies: as it is for programs, and so that names cannot control it for a
/// terminal. Records that cannot be listed are named, and the exit code is that of the first one.
fn list_copies(folder: &Path) -> Result<u8> {
    let Index { mut copies, faults } = copies_index::index(folder, &mut warn)?;
    if stdout().is_terminal() {
        copies.iter_mut().for_each(IndexedCopy::make_printable);
    }
    print(&copies_index::to_csv(&copies))?;
    faults.iter().for_each(|fault| warn(&fault.to_string()));
    Ok(faults.first().map_or(DONE, |fault| fault.exit_code() as u8))
}
