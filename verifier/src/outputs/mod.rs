//! Outputs: files that are checked before the work starts, and appear completely or not at all.

mod evidence_map_file;
mod new_file;
mod report_file;

pub use evidence_map_file::{EvidenceMapFile, write_evidence_map};
pub use new_file::NewFile;
pub use report_file::{Format, ReportFile};
