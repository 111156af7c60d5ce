//! The report as a page: one HTML file without scripts that needs nothing else. It shows what the JSON report
//! says, and works nothing out that is not in it.

mod chart;
mod compared;
mod comparison;
mod frame;
mod limits;
mod map;
mod message;
mod page;
mod registration;
mod verdict;
mod words;

pub use comparison::comparison;

use crate::report::Report;
use maud::html;
use page::page;

/// The report of a verification. What it does not hold (see [`Report::evidence`]) is left out.
pub fn verification(report: &Report) -> String {
    let body = html! {
        (verdict::verdict(report))
        (compared::compared(report))
        (map::evidence(report))
        (message::message(report))
        (chart::decoys(report))
        (registration::registration(report))
        (compared::settings(report))
        (limits::limits(report))
    };
    page("Verification of a watermark", &report.parameters.software, &body)
}
