//! The answer of a verification.

use serde::Serialize;

/// The subject of a verdict; a change to any of these makes another mark.
pub(super) const MARK: &str = "a mark with this key, message, options and reference";

/// The answer of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The suspect carries this mark.
    Match,
    /// The suspect does not carry this mark, which would be detectable.
    NoMatch,
    /// The suspect does not allow an answer.
    Inconclusive,
}
