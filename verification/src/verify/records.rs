//! Verification against many records: finds the recipient of a copy.
//!
//! Records with equal settings expect marks that differ only in the message or recipient, so the
//! suspect is examined once for all of them. Records of both versions of the mark count together.

use super::{
    Verification,
    belonging::is_made_from,
    candidate::Candidate,
    conclusion::{conclude, conclude_fingerprint},
    examination::{Examination, examine},
    outcomes::{Overall, decide_all, listed, overall},
    references::{read_bases, read_reference},
    request::{ReadRecord, Request, Settings, Sought, lineage_of},
};
use crate::{Error, Maps, Stages, Suited, error::this_one, report::Report};
use meshmark_core::{key::SecretKey, options::Options};
use meshmark_marking::Survey;

/// A record of many.
pub struct NamedRecord {
    /// The name of its file, or another one that messages and reports call it.
    pub name: String,
    /// The record, or the reason why it cannot be read.
    pub read: Result<ReadRecord, String>,
}

/// Candidates with equal settings.
struct Group {
    request: Request,
    candidates: Vec<Candidate>,
}

/// A group of candidates with its reference, and the number of that.
struct Located<C> {
    group: Group,
    number: usize,
    reference: Survey<C>,
}

/// The records that do not count, by the reasons.
#[derive(Default)]
struct Skipped(Vec<(String, Vec<String>)>);

impl Skipped {
    fn skip(&mut self, name: &str, reason: String) {
        match self.0.iter_mut().find(|(r, _)| *r == reason) {
            Some((_, names)) => names.push(name.into()),
            None => self.0.push((reason, vec![name.into()])),
        }
    }

    /// Skips all records of a group.
    fn skip_all(&mut self, group: &Group, reason: &str) {
        group.candidates.iter().for_each(|candidate| self.skip(&candidate.name, reason.into()));
    }

    fn count(&self) -> usize {
        self.0.iter().map(|(_, names)| names.len()).sum()
    }
}

/// Verifies one suspect against every one of these records, each with the reference from which it was
/// made. `warn` receives the skipped records with the reasons.
///
/// # Errors
/// Fails like [`verify()`](super::verify()), and with [`Error::NoRecord`] when no record is usable.
pub fn verify_records<M: Maps>(
    maps: &mut M,
    settings: &Settings,
    records: Vec<NamedRecord>,
    stages: &mut Stages,
    warn: &mut dyn FnMut(&str),
) -> Result<Verification<M::Crs>, M::Error> {
    let mut skipped = Skipped::default();
    let groups = groups(settings, candidates::<M>(records, &settings.key, &mut skipped));
    let mut located = Vec::new();
    for group in groups {
        located.extend(group_by_reference(maps, group, stages, &mut skipped)?);
    }
    let tried = located.iter().map(|located| located.group.candidates.len()).sum();
    let mut examined: Vec<(Request, Examination)> = Vec::new();
    let (mut of_group, mut of_reference) = (Vec::new(), Vec::new());
    for Located { group, number, reference } in located {
        let request = group.request(tried);
        let bases = match read_bases(maps, &request)? {
            Suited::Yes(bases) => bases,
            Suited::No(lost) => {
                skipped.skip_all(&group, &lost.to_string());
                continue;
            }
        };
        let name = maps.name(number);
        match examine(maps, &request, (&reference, name, &bases), stages)? {
            Suited::Yes(seen) => {
                of_group.push(group.candidates);
                of_reference.push((number, reference.crs));
                examined.push((request, seen));
            }
            Suited::No(error) => skipped.skip_all(&group, &error.to_string()),
        }
    }
    for (reason, names) in &skipped.0 {
        warn(&format!("{} skipped: {reason}", these_are(names)));
    }
    let outcomes = decide_all(of_group, &examined, tried, settings.significance);
    let Some(best) = outcomes.first() else { return Err(Error::NoRecord.into()) };
    let (template, seen) = &examined[best.place[0]];
    let chosen = Request {
        record: Some(best.candidate.read.clone()),
        subject: best.candidate.options.subject.clone(),
        ..template.clone()
    };
    let report = match &best.answer.decision {
        Some(decision) => conclude(&chosen, seen, decision.clone(), stages.finish()),
        None => conclude_fingerprint(&chosen, seen, best.place[1], stages.finish()),
    };
    let (reference, crs) = of_reference[best.place[0]].clone();
    let Overall { verdict, reason, p_missed_log10 } = overall(&outcomes);
    let candidates = Some(listed(&outcomes, skipped.count()));
    let report = Report { verdict, reason, p_missed_log10, candidates, reference, ..report };
    Ok(Verification { report, crs })
}

/// Names records with a verb: "a.json is", "a.json, b.json and 31 more are".
fn these_are(names: &[String]) -> String {
    match names {
        [file] => format!("{file} is"),
        [first, second] => format!("{first} and {second} are"),
        [first, second, more @ ..] => format!("{first}, {second} and {} more are", more.len()),
        [] => unreachable!("a reason is that of a file"),
    }
}

/// Returns those of the records that are of the key.
fn candidates<M: Maps>(records: Vec<NamedRecord>, key: &SecretKey, skipped: &mut Skipped) -> Vec<Candidate> {
    let mut candidates = Vec::new();
    for NamedRecord { name, read } in records {
        match read {
            Err(reason) => skipped.skip(&name, reason),
            Ok(read) => match Candidate::new(name.clone(), read, key) {
                Ok(candidate) => candidates.push(candidate),
                Err(other) => skipped.skip(&name, M::Error::from(other).to_string()),
            },
        }
    }
    candidates
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
fn groups(settings: &Settings, candidates: Vec<Candidate>) -> Vec<Group> {
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
                && r.recorded_crs.as_deref() == candidate.read.record.crs()
                && r.sought.is_like(&sought)
                && r.lineage == lineage
                && r.part_size == part_size
        };
        if let Some(group) = groups.iter_mut().find(same) {
            group.candidates.push(candidate);
            continue;
        }
        let request = Request {
            settings: settings.clone(),
            record: None,
            subject: None,
            sought,
            lineage,
            part_size,
            tried: 1,
            parameters: parameters.clone(),
            layers: layers.clone(),
            srs: srs.clone(),
            recorded_crs: candidate.read.record.crs().map(String::from),
        };
        groups.push(Group { request, candidates: vec![candidate] });
    }
    groups
}

/// Divides the records of a group among the references that they were made from. Records of no
/// reference are skipped.
fn group_by_reference<M: Maps>(
    maps: &mut M,
    mut group: Group,
    stages: &mut Stages,
    skipped: &mut Skipped,
) -> Result<Vec<Located<M::Crs>>, M::Error> {
    let mut divided = Vec::new();
    let mut other = None;
    for number in 0..maps.references() {
        if group.candidates.is_empty() {
            return Ok(divided);
        }
        let reference = match read_reference(maps, number, &group.request, stages)? {
            Suited::Yes(reference) => reference,
            Suited::No(error) => {
                other = Some(error.to_string());
                continue;
            }
        };
        let digest = reference.data.vertices.digest();
        let (own, rest) = group.candidates.into_iter().partition(|c| is_made_from(&c.read.record, &digest));
        group.candidates = rest;
        let own = Group { request: group.request.clone(), candidates: own };
        if !own.candidates.is_empty() {
            divided.push(Located { group: own, number, reference });
        }
    }
    let reason = match (maps.references(), other) {
        (1, Some(unfit)) => unfit,
        (1, None) => {
            let name = maps.name(0);
            format!("made from another reference than {}: give its file, too, unchanged", this_one(&name))
        }
        (references, _) => {
            format!("made from none of the {references} references given: give their files, too, unchanged")
        }
    };
    skipped.skip_all(&group, &reason);
    Ok(divided)
}
