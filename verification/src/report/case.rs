//! The case that a report is for, in the words of the examiner.

use serde::Serialize;

/// What an examiner writes about a case.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Case {
    /// The number of the case.
    pub number: Option<String>,
    /// Who examined.
    pub examiner: Option<String>,
    /// When.
    pub date: Option<String>,
    /// From whom to whom the suspect went, step by step.
    pub custody: Vec<String>,
}
