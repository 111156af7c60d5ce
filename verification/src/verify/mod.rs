//! Verification, from maps to a report.
//!
//! ```text
//! request ─► examination ─► decision ─► conclusion ─► report
//!             crs_search, detection
//! ```
//!
//! [`verify()`] tests one mark, [`verify_records`] the mark of every record of many.

mod assumption;
mod belonging;
mod candidate;
mod conclusion;
mod crs_search;
mod disclosed;
mod drawing;
mod evidence;
mod examination;
mod marks;
mod members;
mod outcomes;
mod records;
mod references;
mod request;

pub use belonging::{check_key, is_made_from};
pub use evidence::{FingerprintEvidence, Found, MessageEvidence};
pub use examination::{Examination, examine};
pub use marks::requests;
pub use records::{NamedRecord, verify_records};
pub use references::read_reference;
pub use request::{LARGEST_SIGNIFICANCE, ReadRecord, Request, Settings, Sought};

use crate::{IfSuited, Maps, Stages, Suited, report::Report};
use conclusion::{conclude, conclude_fingerprint};
use meshmark_core::options::Subject;
use meshmark_detection::decision::{Decision, Expected, Verdict};
use references::{read_bases, read_own_reference};

/// A report, and the CRS of the reference that it is about.
pub struct Verification<C> {
    /// The report.
    pub report: Report,
    /// The CRS.
    pub crs: Option<C>,
}

/// Verifies one suspect against the only reference, or against that of several from which the record
/// of the request was made. Of several requests, for marks that the suspect may have, the report is
/// that of the best one; requests that do not fit the reference do not count.
///
/// # Errors
/// Fails on unreadable input, on parameters that do not fit the reference, and on a record of
/// another reference.
pub fn verify<M: Maps>(
    maps: &mut M,
    requests: &[Request],
    stages: &mut Stages,
) -> Result<Verification<M::Crs>, M::Error> {
    let mut best: Option<Verification<M::Crs>> = None;
    let mut unfit = None;
    for request in requests {
        match verify_mark(maps, request, stages)? {
            Suited::No(error) => unfit = unfit.or(Some(error)),
            Suited::Yes(found) if found.report.verdict == Verdict::Match => return Ok(found),
            Suited::Yes(found) => {
                best = Some(match best {
                    Some(best) => better(best, found),
                    None => found,
                });
            }
        }
    }
    best.ok_or_else(|| unfit.expect("there is a request"))
}

/// Returns the better of two reports on the same suspect without a match: a mark of the key before
/// others. Of these an inconclusive one is the answer, as it cannot rule out its mark.
fn better<C>(first: Verification<C>, second: Verification<C>) -> Verification<C> {
    let rank = |Verification { report, .. }: &Verification<C>| {
        (report.shows_key(), report.verdict == Verdict::Inconclusive)
    };
    if rank(&second) > rank(&first) { second } else { first }
}

fn verify_mark<M: Maps>(
    maps: &mut M,
    request: &Request,
    stages: &mut Stages,
) -> IfSuited<Verification<M::Crs>, M::Error> {
    let (number, reference) = match read_own_reference(maps, request, stages)? {
        Suited::Yes(own) => own,
        Suited::No(error) => return Ok(Suited::No(error)),
    };
    let bases = match read_bases(maps, request)? {
        Suited::Yes(bases) => bases,
        Suited::No(error) => return Ok(Suited::No(error)),
    };
    let name = maps.name(number);
    let seen = match examine(maps, request, (&reference, name, &bases), stages)? {
        Suited::Yes(seen) => seen,
        Suited::No(error) => return Ok(Suited::No(error)),
    };
    let report = match request.sought {
        Sought::Fingerprint { .. } => conclude_fingerprint(request, &seen, 0, stages.finish()),
        Sought::Message { .. } => {
            let (subject, decision) = decide_subjects(request, &seen);
            conclude(&Request { subject, ..request.clone() }, &seen, decision, stages.finish())
        }
    };
    let report = Report { reference: number, ..report };
    Ok(Suited::Yes(Verification { report, crs: reference.crs }))
}

/// Decides on every subject that the mark may have; returns the best one and its decision.
fn decide_subjects(request: &Request, seen: &Examination) -> (Option<Subject>, Decision) {
    if let Err(reason) = &seen.found {
        return (request.subject.clone(), Decision::inconclusive(reason.clone()));
    }
    let subjects = request.subjects();
    let tried = subjects.len() + request.tried - 1;
    let decide = |subject: Subject| {
        let expected = Expected::new(&subject, &request.settings.key);
        (Some(subject), seen.decide(&expected, tried, request.settings.significance))
    };
    let p = |decision: &Decision| decision.p_value_log10().unwrap_or(f64::INFINITY);
    let decisions = subjects.into_iter().map(decide);
    let best = decisions.min_by(|(_, a), (_, b)| p(a).total_cmp(&p(b)));
    best.unwrap_or_else(|| (None, Decision::without_message()))
}
