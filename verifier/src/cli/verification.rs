//! `verify`: the parent, which publishes the results, and its child, which examines the suspect.

use super::{
    arguments::VerifyArgs,
    command_line, deposit,
    printing::{WARNING, print, warn, warn_of_displacements},
    request::requests,
};
use meshmark_verifier::{
    Error, ExitCode, Result,
    confinement::{self, End, Handover, Limits},
    deposit::Expected,
    html,
    inputs::{case_file, digests::Digests, gdal_failures, private_copy::PrivateCopy, versions::versions},
    outputs::{EvidenceMapFile, Format, ReportFile, write_evidence_map},
    progress::{Bar, Progress},
    report::{self, Provenance, Report},
    verify, verify_records,
};
use signal_hook::low_level::emulate_default_handler;
use std::{fs, io, path::Path};

/// A shell adds this to the number of the signal that ended a process.
const BY_SIGNAL: i32 = 128;

/// Has a child examine the suspect, publishes the results and returns the exit code.
pub(super) fn run(args: &VerifyArgs) -> Result<u8> {
    let file = args.report.as_deref().map(ReportFile::new).transpose()?;
    let evidence_map = args.evidence_map.as_deref().map(EvidenceMapFile::new).transpose()?;
    warn_of_displacements(args.exact_displacements);
    let passphrase = args.opening.passphrase().for_child(&args.key)?;
    let suspect = PrivateCopy::make("suspect", &args.suspect)?;
    let arguments = command_line::of_examination(suspect.folder().as_os_str());
    let places = (args.suspect.as_path(), suspect.folder());
    let bar = Bar::default();
    let mut show = |line: &str| {
        let warning = line.strip_prefix(WARNING);
        warning.inspect(|text| warn(text)).is_some() || bar.show(line)
    };
    let end = confinement::examine(arguments, passphrase.as_deref(), places, &limits(args), &mut show);
    bar.finish();
    let code = match end? {
        End::Code(code) => code,
        End::Signal(signal) => {
            drop(suspect);
            drop(emulate_default_handler(signal));
            return Ok((BY_SIGNAL + signal) as u8);
        }
    };
    let handover = Handover(suspect.folder());
    let Some(answer) = passed(&handover.answer())? else { return Ok(code) };
    if let Some(target) = evidence_map.filter(|_| handover.evidence_map().exists()) {
        target.publish(&handover.evidence_map())?;
    }
    print(&answer)?;
    if let Some((file, text)) = file.zip(passed(&handover.report())?) {
        file.write(&text)?;
    }
    Ok(code)
}

fn limits(args: &VerifyArgs) -> Limits {
    let maps = args.reference.iter().chain([&args.suspect]).map(|path| path.as_path());
    Limits::new(args.memory_limit, args.time_limit, maps)
}

/// Returns a text that the child passed; `None` when it passed none.
fn passed(path: &Path) -> Result<Option<String>> {
    match fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(Error::NotConfined { source }),
    }
}

/// Examines the suspect in the folder of its private copy, to which the results are written.
pub(super) fn examine(args: VerifyArgs, folder: &Path) -> Result<ExitCode> {
    let limits = limits(&args);
    let path = args.suspect.clone();
    confinement::enter(folder, &limits, &args.reference)?;
    let examined = examine_confined(args, folder);
    if gdal_failures::ran_out_of_memory() {
        return Err(Error::MemoryLimit { path, megabytes: limits.memory_mb });
    }
    let Examined { answer, report, code } = examined?;
    let handover = Handover(folder);
    let write = |path: &Path, text: &str| {
        fs::write(path, text).map_err(|error| Error::unwritten(path.display(), error))
    };
    if let Some(report) = report {
        write(&handover.report(), &report)?;
    }
    write(&handover.answer(), &answer)?; // it states that all is written
    Ok(code)
}

/// The results of an examination.
struct Examined {
    answer: String,
    report: Option<String>,
    code: ExitCode,
}

fn examine_confined(args: VerifyArgs, folder: &Path) -> Result<Examined> {
    let format = args.report.as_deref().map(ReportFile::format_of).transpose()?;
    let references = args.reference.clone();
    let suspect = PrivateCopy::made_in(folder, &args.suspect)?;
    let case = args.case.as_deref().map(case_file::read).transpose()?;
    let wanted = args.explain || format.is_some();
    let digest = || Digests::read(&args.key, &references, &suspect, args.record.as_deref());
    let digests = wanted.then(digest).transpose()?;
    let (json, explain, records) = (args.json, args.explain, args.records.clone());
    let requests = requests(&args, &suspect)?;
    let files = args.deposit.as_deref().map(|path| deposit::files(path, &args.trust, None));
    let expected = files.map(|files| Expected::read(&files, &references)).transpose()?;
    let mut progress = Progress::of_child();
    let mut report = match &records {
        Some(folder) => verify_records(&requests[0], &references, folder, &mut progress, &mut warn)?,
        None => verify(&requests, &references, &mut progress)?,
    };
    if let Some(expected) = expected {
        report.deposit = Some(expected.compare(&requests[0], args.record.as_deref(), &report)?);
    }
    if let Some(map) = report.evidence_map.take() {
        write_evidence_map(&map, &Handover(folder).evidence_map())?;
    }
    let evidence = report.evidence.take(); // only a report file holds it
    let code = report.exit_code();
    let mut answer = if json { report.to_json() } else { report.to_text() };
    let Some(digests) = digests else { return Ok(Examined { answer, report: None, code }) };
    let best = || Some(records.as_ref()?.join(&report.candidates.as_ref()?.list.first()?.record));
    let inputs = digests.of_verification(&report.reference, best().as_deref())?;
    if explain {
        answer += &format!("\n{}", report::explain(&inputs, &report));
    }
    let report = format.map(|format| {
        let provenance = Provenance {
            inputs,
            reference_vertices_sha256: report.reference_digest.clone(),
            suspect_crs: report.suspect_crs.clone(),
            command: command_line::own(),
            versions: versions(),
        };
        let report = Report { provenance: Some(provenance), evidence, case, ..report.into_file() };
        match format {
            Format::Html => html::verification(&report),
            Format::Json => report.to_json(),
        }
    });
    Ok(Examined { answer, report, code })
}
