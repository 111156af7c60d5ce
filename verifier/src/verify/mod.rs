//! Verification, from files to a report.
//!
//! ```text
//! request ─► examination ─► decision ─► conclusion ─► report
//!             crs_search, detection
//! ```
//!
//! [`verify()`] tests one mark, [`verify_records`] the mark of every record of a folder.

mod belonging;
mod conclusion;
mod crs_search;
mod disclosed;
mod drawing;
mod evidence;
mod examination;
mod members;
mod records;
mod references;
mod request;

pub use belonging::{check_key, check_reference, is_made_from};
pub use evidence::{FingerprintEvidence, Found, MessageEvidence};
pub use examination::{Examination, Suited, examine, read_reference};
pub use records::verify_records;
pub use request::{Request, Sought, lineage_of};

use crate::{Error, Result, progress::Progress, report::Report};
use conclusion::{conclude, conclude_fingerprint};
use meshmark_core::options::Subject;
use meshmark_detection::decision::{Decision, Expected, Verdict};
use references::{read_bases, read_own_reference};
use std::path::PathBuf;

/// Verifies one suspect against the only reference, or against that of several from which the record
/// of the request was made. Of several requests, for marks that the suspect may have, the report is
/// that of the best one; requests that do not fit the reference do not count.
///
/// # Errors
/// Fails on unreadable input, on parameters that do not fit the reference, and on a record of
/// another reference.
pub fn verify(requests: &[Request], references: &[PathBuf], progress: &mut Progress) -> Result<Report> {
    let mut best: Option<Report> = None;
    let mut unfit = None;
    for request in requests {
        match verify_mark(request, references, progress) {
            Err(error) if requests.len() > 1 && is_unfit(&error) => unfit = unfit.or(Some(error)),
            Err(error) => return Err(error),
            Ok(report) if report.verdict == Verdict::Match => return Ok(report),
            Ok(report) => {
                best = Some(match best {
                    Some(best) => better(best, report),
                    None => report,
                });
            }
        }
    }
    best.ok_or_else(|| unfit.expect("there is a request"))
}

fn is_unfit(error: &Error) -> bool {
    matches!(error, Error::Unfit { .. }) || error.is_about_options()
}

/// Returns the better of two reports on the same suspect without a match: a mark of the key before
/// others. Of these an inconclusive one is the answer, as it cannot rule out its mark.
fn better(first: Report, second: Report) -> Report {
    let rank = |report: &Report| (report.shows_key(), report.verdict == Verdict::Inconclusive);
    if rank(&second) > rank(&first) { second } else { first }
}

fn verify_mark(request: &Request, references: &[PathBuf], progress: &mut Progress) -> Result<Report> {
    let (request, reference) = read_own_reference(request, references, progress)?;
    let bases = read_bases(&request, references)?;
    let seen = examine(&request, (&reference, &bases), progress)?.or_fail()?;
    if matches!(request.sought, Sought::Fingerprint { .. }) {
        return Ok(conclude_fingerprint(&request, &seen, 0, progress.finish()));
    }
    let (subject, decision) = decide_subjects(&request, &seen);
    let request = Request { subject, ..request };
    Ok(conclude(&request, &seen, decision, progress.finish()))
}

/// Decides on every subject that the mark may have; returns the best one and its decision.
fn decide_subjects(request: &Request, seen: &Examination) -> (Option<Subject>, Decision) {
    if let Err(reason) = &seen.found {
        return (request.subject.clone(), Decision::inconclusive(reason.clone()));
    }
    let subjects = request.subjects();
    let tried = subjects.len() + request.tried - 1;
    let decide = |subject: Subject| {
        let expected = Expected::new(&subject, &request.key);
        (Some(subject), seen.decide(&expected, tried, request.significance))
    };
    let p = |decision: &Decision| decision.p_value_log10().unwrap_or(f64::INFINITY);
    let decisions = subjects.into_iter().map(decide);
    let best = decisions.min_by(|(_, a), (_, b)| p(a).total_cmp(&p(b)));
    best.unwrap_or_else(|| (None, Decision::without_message()))
}
