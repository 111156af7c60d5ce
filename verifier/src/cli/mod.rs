//! The command line: it turns flags into an exit code.

mod arguments;
mod command_line;
mod printing;
mod request;
mod verification;

use crate::package_files;
use arguments::{Cli, CompareArgs, DistributeArgs, Subcommands};
use clap::{CommandFactory, Parser};
use meshmark_core::{counted, key::SecretKey, options::Options};
use meshmark_verifier::{
    Error, Result,
    compare::{Comparison, Details, compare, detail::ComparedFiles},
    distribute, html,
    inputs::{gdal_failures, texts},
    outputs::{Format, ReportFile},
    progress::Progress,
};
use printing::{print, warn, warn_of_displacements};
use std::{
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
};

/// The exit code of a command that succeeds; a match has the same code.
const DONE: u8 = 0;

/// Runs the command of this process and returns its exit code.
pub fn run() -> u8 {
    gdal_failures::quieten_gdal();
    let result = match Cli::parse().command {
        Subcommands::Keygen { key_file } => keygen(&key_file).map(|()| DONE),
        Subcommands::Verify(args) => verification::run(&args),
        Subcommands::Examine { folder, args } => verification::examine(*args, &folder).map(|code| code as u8),
        Subcommands::Compare(args) => run_compare(&args).map(|()| DONE),
        Subcommands::PackageFiles { folder } => write_package_files(&folder).map(|()| DONE),
        Subcommands::Distribute(args) => run_distribute(*args).map(|()| DONE),
    };
    result.unwrap_or_else(|error| {
        warn(&error.to_string());
        error.exit_code() as u8
    })
}

fn keygen(path: &PathBuf) -> Result<()> {
    let key = SecretKey::filled(getrandom::fill).map_err(|source| Error::Random { source })?;
    let failed = |error: std::io::Error| match error.kind() {
        ErrorKind::AlreadyExists => Error::Exists {
            path: path.clone(),
            remedy: ", and a key is never overwritten: name another file",
        },
        _ => Error::unwritten(format!("the key file {}", path.display()), error),
    };
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path).map_err(failed)?;
    let written = file.write_all(key.to_json().as_bytes()).and_then(|()| file.sync_all());
    if let Err(error) = written {
        let _ = std::fs::remove_file(path); // an incomplete key is worse than none
        return Err(failed(error));
    }
    print(&format!("key {} written to {}\n", key.id(), path.display()))?;
    Ok(())
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
        .map(|_| ComparedFiles::read(&args.reference, &args.marked, command_line::own()))
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
        key: texts::key(&args.key, &mut warn)?,
        map: args.map,
        recipients: args.recipients,
        folder: args.output_dir,
        format: args.format,
    };
    let done = distribute::distribute(&request, &mut Progress::default(), &mut warn)?;
    let before = match done.finished_before {
        0 => String::new(),
        count => format!(", {} there already", counted(count, "copy")),
    };
    print(&format!("{} written to {}{before}\n", counted(done.written, "copy"), request.folder.display()))?;
    Ok(())
}
