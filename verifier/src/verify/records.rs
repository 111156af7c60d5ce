//! Verification against many records: finds the recipient of a copy.
//!
//! Records with equal settings expect marks that differ only in the message or recipient, so the
//! suspect is examined once for all of them. Records of both versions of the mark count together.

use super::{
    belonging::{check_key, is_made_from},
    conclusion::{conclude, conclude_fingerprint},
    disclosed,
    evidence::Found,
    examination::{Examination, Suited, examine, read_reference},
    references::read_bases,
    request::{Request, Sought, lineage_of},
};
use crate::{
    Error, Result,
    inputs::texts::{self, ReadRecord},
    progress::Progress,
    report::{Candidates, Entry, Report},
};
use meshmark_core::{
    key::SecretKey,
    message::Message,
    options::{Options, Spelling, Subject},
    recorded::Recorded,
};
use meshmark_dataset::Survey;
use meshmark_detection::decision::{Decision, Expected, Verdict};
use std::path::{Path, PathBuf};

/// Number of the best records in the list, which also holds every match.
const MOST_LISTED: usize = 20;

/// A record of the folder.
struct Candidate {
    file: String,
    read: ReadRecord,
    /// The options in the record.
    options: Options,
    /// The message in the record; none of a fingerprint.
    message: Option<Message>,
}

/// Candidates with equal settings.
struct Group {
    request: Request,
    candidates: Vec<Candidate>,
}

/// The outcome of one candidate.
struct Outcome {
    /// The numbers of its group, and of the candidate in the group.
    place: [usize; 2],
    candidate: Candidate,
    answer: Answered,
    bit_errors: Option<usize>,
}

/// The answer about a candidate.
struct Answered {
    verdict: Verdict,
    reason: String,
    p_value_log10: Option<f64>,
    p_missed_log10: Option<f64>,
    /// The decision on a message.
    decision: Option<Decision>,
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
    let mut of_references = Vec::new();
    for group in groups {
        of_references.extend(group_by_reference(group, references, progress, &mut skip)?);
    }
    let tried = of_references.iter().map(|(group, _)| group.candidates.len()).sum();
    let mut examined: Vec<(Request, Examination)> = Vec::new();
    let mut of_group = Vec::new();
    for (group, reference) in of_references {
        let request = group.request(tried);
        let bases = match read_bases(&request, references) {
            Err(Error::Dataset(lost)) => {
                skip_all(&group, &lost.text(Spelling::Flag), &mut skip);
                continue;
            }
            bases => bases?,
        };
        match examine(&request, (&reference, &bases), progress)? {
            Suited::Yes(seen) => {
                of_group.push(group.candidates);
                examined.push((request, seen));
            }
            Suited::No(error) => skip_all(&group, &error.to_string(), &mut skip),
        }
    }
    let left_out = skipped.iter().map(|(_, files)| files.len()).sum();
    for (reason, files) in &skipped {
        warn(&format!("{} skipped: {reason}", folder.join(these_are(files)).display()));
    }
    let outcomes = decide_all(of_group, &examined, tried, request.significance);
    let Some(best) = outcomes.first() else {
        return Err(Error::NoRecord { folder: folder.into() });
    };
    let (template, seen) = &examined[best.place[0]];
    let chosen = Request {
        record: Some(best.candidate.read.clone()),
        subject: best.candidate.options.subject.clone(),
        ..template.clone()
    };
    let report = match &best.answer.decision {
        Some(decision) => conclude(&chosen, seen, decision.clone(), progress.finish()),
        None => conclude_fingerprint(&chosen, seen, best.place[1], progress.finish()),
    };
    let Overall { verdict, reason, p_missed_log10 } = overall(&outcomes);
    Ok(Report { verdict, reason, p_missed_log10, candidates: Some(listed(&outcomes, left_out)), ..report })
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
    let mut candidates = Vec::new();
    for path in texts::possible_records(folder)? {
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match texts::parsed_record(&path) {
            Err(bad) => skip(&file, bad.to_string()),
            Ok(read) => match candidate(file.clone(), read, key) {
                Ok(candidate) => candidates.push(candidate),
                Err(other) => skip(&file, other.to_string()),
            },
        }
    }
    Ok(candidates)
}

/// Creates the candidate of a record that belongs to the key.
fn candidate(file: String, read: ReadRecord, key: &SecretKey) -> Result<Candidate> {
    let record = &read.record;
    check_key(record, key)?;
    let message = match record {
        Recorded::Message(record) => Some(record.message()?),
        Recorded::Fingerprint(_) => None,
    };
    let options = record.options()?;
    Ok(Candidate { file, options, message, read })
}

impl Candidate {
    /// Returns what the mark carries, without naming a recipient.
    fn sought(&self) -> Sought {
        match (self.options.coefficients, &self.message) {
            (Some(coefficients), _) => Sought::Fingerprint { coefficients, recipients: Vec::new(), tried: 0 },
            (None, message) => Sought::Message { bits: message.as_ref().map_or(0, Message::len) },
        }
    }

    fn recipient(&self) -> Option<String> {
        self.options.subject.as_ref().and_then(Subject::recipient).map(String::from)
    }
}

impl Group {
    /// Returns the request for all candidates of the group, among all that are `tried`.
    fn request(&self, tried: usize) -> Request {
        let sought = match &self.request.sought {
            Sought::Fingerprint { coefficients, .. } => {
                let recipients = self.candidates.iter().filter_map(Candidate::recipient).collect();
                Sought::Fingerprint { coefficients: *coefficients, recipients, tried }
            }
            message => message.clone(),
        };
        Request { sought, ..self.request.clone() }
    }
}

/// Groups records that differ only in their message or recipient.
fn groups(request: &Request, candidates: Vec<Candidate>) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for candidate in candidates {
        let (sought, part_size) = (candidate.sought(), candidate.options.part_size);
        let Options { parameters, layers, srs, .. } = &candidate.options;
        let lineage = lineage_of(&candidate.read.record);
        let same = |group: &&mut Group| {
            let r = &group.request;
            r.parameters == *parameters
                && r.layers == *layers
                && r.srs == *srs
                && r.sought.is_like(&sought)
                && r.lineage == lineage
                && r.part_size == part_size
        };
        if let Some(group) = groups.iter_mut().find(same) {
            group.candidates.push(candidate);
            continue;
        }
        let (parameters, layers, srs) = (parameters.clone(), layers.clone(), srs.clone());
        let request = Request { parameters, layers, srs, sought, lineage, part_size, ..request.clone() };
        groups.push(Group { request, candidates: vec![candidate] });
    }
    groups
}

/// Divides the records of a group among the references that they were made from. Records of no
/// reference are skipped.
fn group_by_reference(
    mut group: Group,
    references: &[PathBuf],
    progress: &mut Progress,
    skip: &mut dyn FnMut(&str, String),
) -> Result<Vec<(Group, Survey)>> {
    let mut divided = Vec::new();
    let mut other = None;
    for path in references {
        if group.candidates.is_empty() {
            return Ok(divided);
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
        let (own, rest) = group.candidates.into_iter().partition(|c| is_made_from(&c.read.record, &digest));
        group.candidates = rest;
        let own = Group { request, candidates: own };
        if !own.candidates.is_empty() {
            divided.push((own, reference));
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
    Ok(divided)
}

/// Skips all records of a group.
fn skip_all(group: &Group, reason: &str, skip: &mut dyn FnMut(&str, String)) {
    group.candidates.iter().for_each(|candidate| skip(&candidate.file, reason.into()));
}

/// Returns the answer about every candidate; the best one comes first.
fn decide_all(
    of_group: Vec<Vec<Candidate>>,
    examined: &[(Request, Examination)],
    tried: usize,
    significance: f64,
) -> Vec<Outcome> {
    let message = |group: usize| examined[group].1.message().map(|found| found.demodulation.message());
    let messages: Vec<_> = (0..examined.len()).map(message).collect();
    let decide = |(place, candidate): ([usize; 2], Candidate)| {
        let (group, number) = (place[0], place[1]);
        let (request, seen) = &examined[group];
        let expected = |_: &Message| {
            let subject = candidate.options.subject.as_ref().expect("a record has one");
            Expected::new(subject, &request.key)
        };
        let expected = candidate.message.as_ref().map(expected);
        let answer = match &expected {
            Some(expected) => Answered::of_message(seen.decide(expected, tried, significance)),
            None => Answered::of_fingerprint(seen, number),
        };
        let bit_errors =
            messages[group].as_ref().zip(expected).map(|(m, expected)| m.errors(&expected.carried));
        Outcome { place, candidate, answer, bit_errors }
    };
    let numbered = |(group, candidates): (usize, Vec<Candidate>)| {
        candidates.into_iter().enumerate().map(move |(number, candidate)| ([group, number], candidate))
    };
    let all = of_group.into_iter().enumerate().flat_map(numbered);
    let mut outcomes: Vec<Outcome> = all.map(decide).collect();
    let rank = |outcome: &Outcome| {
        let p = outcome.answer.p_value_log10.unwrap_or(f64::INFINITY);
        (outcome.answer.verdict != Verdict::Match, p)
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

impl Answered {
    fn of_message(decision: Decision) -> Self {
        Answered {
            verdict: decision.verdict,
            reason: decision.reason.clone(),
            p_value_log10: decision.p_value_log10(),
            p_missed_log10: decision.p_missed_log10,
            decision: Some(decision),
        }
    }

    /// Returns the answer about the fingerprint of this number in an examination.
    fn of_fingerprint(seen: &Examination, number: usize) -> Self {
        match &seen.found {
            Ok(Found::Fingerprint(found)) => {
                let (standing, answer) = &found.recipients[number];
                Answered {
                    verdict: answer.verdict,
                    reason: answer.reason.clone(),
                    p_value_log10: Some(standing.p_value_log10),
                    p_missed_log10: answer.p_missed_log10,
                    decision: None,
                }
            }
            Ok(Found::Message(_)) => unreachable!("a fingerprint is sought"),
            Err(reason) => {
                let (verdict, reason) = (Verdict::Inconclusive, reason.clone());
                Answered { verdict, reason, p_value_log10: None, p_missed_log10: None, decision: None }
            }
        }
    }
}

/// The answer about all candidates.
struct Overall {
    verdict: Verdict,
    reason: String,
    p_missed_log10: Option<f64>,
}

/// Returns the answer about all candidates, with the grounds of the best one.
fn overall(outcomes: &[Outcome]) -> Overall {
    let matches = count_matches(outcomes);
    let Answered { verdict, reason, p_missed_log10, .. } = &outcomes[0].answer;
    let best = Overall { verdict: *verdict, reason: reason.clone(), p_missed_log10: *p_missed_log10 };
    let missed = || outcomes.iter().filter_map(|o| o.answer.p_missed_log10).reduce(f64::max);
    let unclear = outcomes.iter().find(|o| o.answer.verdict == Verdict::Inconclusive);
    match (matches, unclear) {
        (0, Some(unclear)) => Overall {
            verdict: Verdict::Inconclusive,
            reason: unclear.answer.reason.clone(),
            p_missed_log10: missed(),
        },
        (0, None) => Overall {
            reason: "a mark with this key, this reference and the message and options of any of these records would \
                     have shown, and none does"
                .into(),
            p_missed_log10: missed(),
            ..best
        },
        (1, _) => best,
        _ => Overall {
            reason: format!(
                "for {matches} of the records the probability of so good a fit by chance is below the significance"
            ),
            ..best
        },
    }
}

fn count_matches(outcomes: &[Outcome]) -> usize {
    outcomes.iter().filter(|o| o.answer.verdict == Verdict::Match).count()
}

fn listed(outcomes: &[Outcome], skipped: usize) -> Candidates {
    let matches = count_matches(outcomes);
    let entry = |outcome: &Outcome| {
        let is_match = outcome.answer.verdict == Verdict::Match;
        Entry {
            record: outcome.candidate.file.clone(),
            sha256: outcome.candidate.read.sha256.clone(),
            recipient: outcome.candidate.recipient(),
            p_value_log10: disclosed::p_log10(outcome.answer.p_value_log10, is_match),
            bit_errors: outcome.bit_errors.filter(|_| is_match),
        }
    };
    let mut entries = outcomes.iter().map(entry);
    let list = entries.by_ref().take(MOST_LISTED.max(matches)).collect();
    let next_p_value_log10 = entries.next().and_then(|next| next.p_value_log10);
    Candidates { tried: outcomes.len(), skipped, list, next_p_value_log10, matches }
}
