//! Verification against many records: finds the recipient of a copy.
//!
//! Records with equal settings expect marks that differ only in the message, so the suspect is
//! registered, matched and demodulated once for all of them.

use super::{
    belonging::{check_key, is_made_from},
    conclusion::conclude,
    examination::{Examination, Suited, examine, read_reference},
    request::Request,
};
use crate::{
    Error, Result,
    inputs::texts,
    progress::Progress,
    report::{Candidates, Entry, Report},
};
use meshmark_core::{
    demodulation::Demodulation, key::SecretKey, message::Message, options::Subject, record::Record,
};
use meshmark_detection::decision::{Decision, Expected, Verdict};
use std::path::{Path, PathBuf};

/// Number of the best records in the list, which also holds every match.
const MOST_LISTED: usize = 20;

/// A record of the folder.
struct Candidate {
    file: String,
    record: Record,
    subject: Subject,
    /// The message in the record.
    message: Message,
}

/// Candidates with equal settings.
struct Group {
    request: Request,
    candidates: Vec<Candidate>,
}

/// The outcome of one candidate.
struct Outcome {
    group: usize,
    candidate: Candidate,
    decision: Decision,
    bit_errors: Option<usize>,
}

/// Verifies one suspect against every record (*.json) of a folder, each with the one of
/// `references` from which it was made. `request` holds the other settings; its mark and reference
/// are replaced by those of each record. `warn` receives the skipped files with the reasons.
///
/// # Errors
/// Fails like [`crate::verify()`], and when no record is usable.
pub fn verify_records(
    request: &Request,
    references: &[PathBuf],
    folder: &Path,
    progress: &mut Progress,
    warn: &mut dyn FnMut(&str),
) -> Result<Report> {
    let mut skipped: Vec<(String, Vec<String>)> = Vec::new();
    let mut skip = |file: &str, reason: String| match skipped.iter_mut().find(|(r, _)| *r == reason) {
        Some((_, files)) => files.push(file.into()),
        None => skipped.push((reason, vec![file.into()])),
    };
    let groups = groups(request, read_all(folder, &request.key, &mut skip)?);
    let mut examined: Vec<(Request, Examination)> = Vec::new();
    let mut of_group = Vec::new();
    for group in groups {
        for (group, seen) in examine_group(group, references, progress, &mut skip)? {
            of_group.push(group.candidates);
            examined.push((group.request, seen));
        }
    }
    let left_out = skipped.iter().map(|(_, files)| files.len()).sum();
    for (reason, files) in &skipped {
        warn(&format!("{} skipped: {reason}", folder.join(these_are(files)).display()));
    }
    let outcomes = decide_all(of_group, &examined, request.significance);
    let Some(best) = outcomes.first() else {
        return Err(Error::NoRecord { folder: folder.into() });
    };
    let (template, seen) = &examined[best.group];
    let chosen = Request {
        record: Some(best.candidate.record.clone()),
        subject: Some(best.candidate.subject.clone()),
        ..template.clone()
    };
    let report = conclude(&chosen, seen, overall(&outcomes), progress.finish());
    Ok(Report { candidates: Some(listed(&outcomes, left_out)), ..report })
}

/// Names files with a verb: "a.json is", "a.json, b.json and 31 more are".
fn these_are(files: &[String]) -> String {
    match files {
        [file] => format!("{file} is"),
        [first, second] => format!("{first} and {second} are"),
        [first, second, more @ ..] => format!("{first}, {second} and {} more are", more.len()),
        [] => unreachable!("a reason is that of a file"),
    }
}

/// Reads all readable records, in the order of file names.
fn read_all(folder: &Path, key: &SecretKey, skip: &mut dyn FnMut(&str, String)) -> Result<Vec<Candidate>> {
    let unreadable = |error: std::io::Error| Error::FolderUnread { path: folder.into(), source: error };
    let mut files = Vec::new();
    for entry in folder.read_dir().map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    let mut candidates = Vec::new();
    for path in files {
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match texts::parsed_record(&path) {
            Err(bad) => skip(&file, bad.to_string()),
            Ok(record) => match candidate(file.clone(), record, key) {
                Ok(candidate) => candidates.push(candidate),
                Err(other) => skip(&file, other.to_string()),
            },
        }
    }
    Ok(candidates)
}

/// Creates the candidate of a record that belongs to the key.
fn candidate(file: String, record: Record, key: &SecretKey) -> Result<Candidate> {
    check_key(&record, key)?;
    let (subject, message) = (record.subject()?, record.message()?);
    Ok(Candidate { file, record, subject, message })
}

/// Groups records that differ only in their message.
fn groups(request: &Request, candidates: Vec<Candidate>) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for candidate in candidates {
        let (record, bits) = (&candidate.record, candidate.message.len());
        let parameters = &record.parameters;
        let same = |group: &&mut Group| {
            let r = &group.request;
            r.parameters == *parameters && r.layers == record.layers && r.srs == record.srs && r.bits == bits
        };
        if let Some(group) = groups.iter_mut().find(same) {
            group.candidates.push(candidate);
            continue;
        }
        let (layers, srs) = (record.layers.clone(), record.srs.clone());
        let parameters = parameters.clone();
        let request = Request { parameters, layers, srs, bits, ..request.clone() };
        groups.push(Group { request, candidates: vec![candidate] });
    }
    groups
}

/// Demodulates the suspect for the records of a group, for each reference those that were made from
/// it. Records of no reference are skipped.
fn examine_group(
    mut group: Group,
    references: &[PathBuf],
    progress: &mut Progress,
    skip: &mut dyn FnMut(&str, String),
) -> Result<Vec<(Group, Examination)>> {
    let mut examined = Vec::new();
    let mut other = None;
    for path in references {
        if group.candidates.is_empty() {
            return Ok(examined);
        }
        let request = Request { reference: path.clone(), ..group.request.clone() };
        let reference = match read_reference(&request, progress)? {
            Suited::Yes(reference) => reference,
            Suited::No(error) => {
                other = Some(error.to_string());
                continue;
            }
        };
        let digest = reference.data.vertices.digest();
        let (own, rest) = group.candidates.into_iter().partition(|c| is_made_from(&c.record, &digest));
        group.candidates = rest;
        let own = Group { request, candidates: own };
        if own.candidates.is_empty() {
            continue;
        }
        match examine(&own.request, &reference, progress)? {
            Suited::Yes(seen) => examined.push((own, seen)),
            Suited::No(error) => skip_all(&own, &error.to_string(), skip),
        }
    }
    let reason = match (references, other) {
        ([_], Some(unfit)) => unfit,
        ([one], None) => {
            format!("made from another reference than {}: give its file, too, unchanged", one.display())
        }
        _ => format!(
            "made from none of the {} references given: give their files, too, unchanged",
            references.len()
        ),
    };
    skip_all(&group, &reason, skip);
    Ok(examined)
}

/// Skips all records of a group.
fn skip_all(group: &Group, reason: &str, skip: &mut dyn FnMut(&str, String)) {
    group.candidates.iter().for_each(|candidate| skip(&candidate.file, reason.into()));
}

/// Decides on every candidate; the best one comes first.
fn decide_all(
    of_group: Vec<Vec<Candidate>>,
    examined: &[(Request, Examination)],
    significance: f64,
) -> Vec<Outcome> {
    let tried = of_group.iter().map(Vec::len).sum();
    let found = |group: usize| examined[group].1.found.as_ref();
    let messages: Vec<_> =
        (0..examined.len()).map(|group| found(group).ok().map(Demodulation::message)).collect();
    let decide = |(group, candidate): (usize, Candidate)| {
        let expected = Expected::new(&candidate.subject, &examined[group].0.key);
        let decision = examined[group].1.decide(&expected, tried, significance);
        let bit_errors = messages[group].as_ref().map(|message| message.errors(&expected.carried));
        Outcome { group, candidate, decision, bit_errors }
    };
    let all = of_group
        .into_iter()
        .enumerate()
        .flat_map(|(g, candidates)| candidates.into_iter().map(move |c| (g, c)));
    let mut outcomes: Vec<Outcome> = all.map(decide).collect();
    let rank = |outcome: &Outcome| {
        let p = outcome.decision.p_value_log10().unwrap_or(f64::INFINITY);
        (outcome.decision.verdict != Verdict::Match, p)
    };
    outcomes.sort_by(|a, b| {
        let ((a_other, a_p), (b_other, b_p)) = (rank(a), rank(b));
        let by_errors = a.bit_errors.cmp(&b.bit_errors);
        a_other
            .cmp(&b_other)
            .then(a_p.total_cmp(&b_p))
            .then(by_errors)
            .then(a.candidate.file.cmp(&b.candidate.file))
    });
    outcomes
}

/// Returns the decision on all candidates, with the grounds of the best one.
fn overall(outcomes: &[Outcome]) -> Decision {
    let matches = count_matches(outcomes);
    let mut best = outcomes[0].decision.clone();
    if matches == 0 {
        best.p_missed_log10 = outcomes.iter().filter_map(|o| o.decision.p_missed_log10).reduce(f64::max);
    }
    let unclear = outcomes.iter().find(|o| o.decision.verdict == Verdict::Inconclusive);
    match (matches, unclear) {
        (0, Some(unclear)) => {
            let reason = unclear.decision.reason.clone();
            Decision { verdict: Verdict::Inconclusive, reason, ..best }
        }
        (0, None) => Decision {
            reason: "a mark with this key, this reference and the message and options of any of these records would \
                     have shown, and none does"
                .into(),
            ..best
        },
        (1, _) => best,
        _ => Decision {
            reason: format!(
                "for {matches} of the records the probability that key and message fit so well by chance is below the \
                 significance"
            ),
            ..best
        },
    }
}

fn count_matches(outcomes: &[Outcome]) -> usize {
    outcomes.iter().filter(|o| o.decision.verdict == Verdict::Match).count()
}

fn listed(outcomes: &[Outcome], skipped: usize) -> Candidates {
    let matches = count_matches(outcomes);
    let entry = |outcome: &Outcome| Entry {
        record: outcome.candidate.file.clone(),
        recipient: outcome.candidate.record.recipient.clone(),
        message: outcome.candidate.message.to_hex(),
        p_value_log10: outcome.decision.p_value_log10(),
        bit_errors: outcome.bit_errors,
    };
    let list = outcomes.iter().take(MOST_LISTED.max(matches)).map(entry).collect();
    Candidates { tried: outcomes.len(), skipped, list, matches }
}
