//! Outputs: files that are checked before the work starts, and appear completely or not at all.

mod evidence_map_file;
mod report_file;

pub use evidence_map_file::{EvidenceMapFile, write_evidence_map};
pub use report_file::{Format, ReportFile};
