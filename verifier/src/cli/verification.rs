//! `verify`: the parent, which publishes the results, and its child, which examines the suspect.

use super::{
    arguments::{TrustFlags, VerifyArgs},
    command_line, deposit,
    printing::{WARNING, print, warn, warn_of_displacements},
    request::requests,
};
use meshmark_detection::decision::Verdict;
use meshmark_verification::{
    Error as Mismatch, Stages, html,
    report::{self, Inputs, Provenance, Report},
    verify::{Verification, verify, verify_records},
};
use meshmark_verifier::{
    Error, ExitCode, Result,
    bundle::{Bundle, Manifest, Role, Used},
    confinement::{self, End, Handover, Limits},
    deposit::Expected,
    inputs::{
        case_file, digests::Digests, gdal_failures, map_files::MapFiles, private_copy::PrivateCopy, texts,
        versions::versions_and_program,
    },
    outputs::{EvidenceMapFile, Format, NewFile, ReportFile, write_evidence_map},
    progress::{Bar, Progress},
};
use signal_hook::low_level::emulate_default_handler;
use std::{fs, io, path::Path};

/// A shell adds this to the number of the signal that ended a process.
const BY_SIGNAL: i32 = 128;

/// Has a child examine the suspect, publishes the results and returns the exit code.
pub(super) fn run(args: &VerifyArgs) -> Result<u8> {
    let file = args.report.as_deref().map(ReportFile::new).transpose()?;
    let bundle = args.bundle.as_deref().map(|path| NewFile::new("bundle", path)).transpose()?;
    let manifest = bundle.as_ref().map(|_| manifest(args)).transpose()?;
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
    publish(&handover, file, bundle.zip(manifest))?;
    Ok(code)
}

/// Publishes the report file and the bundle, which the manifest describes, where a child passed what they
/// consist of.
fn publish(handover: &Handover, file: Option<ReportFile>, bundle: Option<(NewFile, Manifest)>) -> Result<()> {
    let report = |format: Format| passed(&handover.report(format.ending()));
    if let Some(file) = file
        && let Some(text) = report(file.format())?
    {
        file.write(&text)?;
    }
    if let Some((bundle, manifest)) = bundle
        && let (Some(page), Some(json)) = (report(Format::Html)?, report(Format::Json)?)
    {
        let changed = manifest.other_inputs();
        if !changed.is_empty() {
            return Err(Error::InputChanged { what: changed.join("; ") });
        }
        bundle.write(&Bundle::new(manifest, page, json)?.to_bytes()?)?;
    }
    Ok(())
}

/// Describes the inputs of this command.
fn manifest(args: &VerifyArgs) -> Result<Manifest> {
    let TrustFlags { public_key, time_stamp, authorities } = &args.trust;
    let optional = [
        (Role::Record, &args.record),
        (Role::Records, &args.records),
        (Role::Case, &args.case),
        (Role::Deposit, &args.deposit),
        (Role::PublicKey, public_key),
        (Role::TimeStamp, time_stamp),
        (Role::Authorities, authorities),
    ];
    let mut used: Vec<Used> = vec![(Role::Suspect, &args.suspect), (Role::Key, &args.key)];
    used.extend(args.reference.iter().map(|path| (Role::Reference, path.as_path())));
    used.extend(optional.into_iter().filter_map(|(role, path)| Some((role, path.as_deref()?))));
    Manifest::new(command_line::own_repeatable(), &used)
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
    let Examined { answer, reports, code } = examined?;
    let handover = Handover(folder);
    let write = |path: &Path, text: &str| {
        fs::write(path, text).map_err(|error| Error::unwritten(path.display(), error))
    };
    for (format, text) in reports {
        write(&handover.report(format.ending()), &text)?;
    }
    write(&handover.answer(), &answer)?; // it states that all is written
    Ok(code)
}

/// The results of an examination.
struct Examined {
    answer: String,
    reports: Vec<(Format, String)>,
    code: ExitCode,
}

fn examine_confined(args: VerifyArgs, folder: &Path) -> Result<Examined> {
    let format = args.report.as_deref().map(ReportFile::format_of).transpose()?;
    let formats = match args.bundle {
        Some(_) => vec![Format::Html, Format::Json],
        None => Vec::from_iter(format),
    };
    let references = args.reference.clone();
    let suspect = PrivateCopy::made_in(folder, &args.suspect)?;
    let case = args.case.as_deref().map(case_file::read).transpose()?;
    let wanted = args.explain || !formats.is_empty();
    let digest = || Digests::read(&args.key, &references, &suspect, args.record.as_deref());
    let digests = wanted.then(digest).transpose()?;
    let (json, explain, records) = (args.json, args.explain, args.records.clone());
    let show_recipients = args.show_recipients;
    let requests = requests(&args)?;
    let files = args.deposit.as_deref().map(|path| deposit::files(path, &args.trust, None));
    let expected = files.map(|files| Expected::read(&files, &references)).transpose()?;
    let progress = Progress::of_child();
    let show = |event| progress.show(event);
    let mut stages = Stages::new(&show);
    let landmarks = args.landmark.clone();
    let mut maps = MapFiles { references: references.clone(), suspect: suspect.clone(), landmarks };
    let Verification { mut report, crs } = match &records {
        Some(folder) => {
            let mut warn = |text: &str| warn(&folder.join(text).display().to_string());
            let candidates = texts::named_records(folder)?;
            let settings = &requests[0].settings;
            verify_records(&mut maps, settings, candidates, &mut stages, &mut warn).map_err(|error| {
                match error {
                    Error::Verification(Mismatch::NoRecord) => Error::NoRecord { folder: folder.clone() },
                    other => other,
                }
            })?
        }
        None => verify(&mut maps, &requests, &mut stages)?,
    };
    if let Some(expected) = expected {
        report.deposit = Some(expected.compare(&requests[0], args.record.as_deref(), &report)?);
    }
    let best = || Some(records.as_ref()?.join(&report.candidates.as_ref()?.best()?.record));
    let best = best().filter(|_| show_recipients || report.verdict == Verdict::Match);
    if !show_recipients {
        report.hide_others();
    }
    if let Some(map) = report.evidence_map.take() {
        write_evidence_map(&map, crs.as_ref(), &Handover(folder).evidence_map())?;
    }
    let evidence = report.evidence.take(); // only a report file holds it
    report.warning().iter().for_each(|text| warn(text));
    let code = ExitCode::from(report.verdict);
    let mut answer = if json { report.to_json() } else { report.to_text() };
    let Some(digests) = digests else { return Ok(Examined { answer, reports: Vec::new(), code }) };
    let inputs = digests.of_verification(&references[report.reference], best.as_deref())?;
    if explain {
        answer += &format!("\n{}", report::explain(&inputs, &report));
    }
    let report = Report { evidence, case, ..report.into_file() };
    let reports = written(report, inputs, &formats)?;
    Ok(Examined { answer, reports, code })
}

/// Returns a report in these forms, with the means to repeat it.
fn written(report: Report, inputs: Inputs, formats: &[Format]) -> Result<Vec<(Format, String)>> {
    let provenance = Provenance {
        inputs,
        reference_vertices_sha256: report.reference_digest.clone(),
        suspect_crs: report.suspect_crs.clone(),
        command: command_line::own(),
        versions: versions_and_program()?,
    };
    let report = Report { provenance: Some(provenance), ..report };
    let text = |format: &Format| match format {
        Format::Html => html::verification(&report),
        Format::Json => report.to_json(),
    };
    Ok(formats.iter().map(|format| (*format, text(format))).collect())
}
