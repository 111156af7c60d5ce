//! The report as a page: one self-contained HTML file without scripts. It shows the content of the
//! JSON report and computes nothing beyond it.

mod case;
mod chart;
mod compared;
mod comparison;
mod fingerprint;
mod frame;
mod limits;
mod map;
mod members;
mod message;
mod page;
mod registration;
mod verdict;
mod words;

pub use comparison::comparison;

use crate::report::{MarkParameters, Report};
use maud::html;
use page::page;

/// Renders the report of a verification, without the parts that it lacks (see
/// [`Report::evidence`]).
pub fn verification(report: &Report) -> String {
    let body = html! {
        (verdict::verdict(report))
        (case::case(report))
        (compared::compared(report))
        (map::evidence(report))
        @match report.parameters.mark {
            MarkParameters::Message(_) => (message::message(report)),
            MarkParameters::Fingerprint(_) => (fingerprint::fingerprint(report)),
        }
        (chart::decoys(report))
        (registration::registration(report))
        (compared::settings(report))
        (limits::limits(report))
    };
    page("Verification of a watermark", &report.parameters.software, &case::running_head(report), &body)
}
