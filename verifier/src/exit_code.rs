//! The exit codes of the command.

use meshmark_detection::decision::Verdict;

/// An exit code of the command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitCode {
    /// The suspect carries the mark.
    Match = 0,
    /// The suspect does not carry the mark, which would be detectable.
    NoMatch = 1,
    /// The command line, an option or a key or record file is wrong.
    Usage = 2,
    /// The suspect does not allow an answer.
    Inconclusive = 3,
    /// The record or the deposit does not belong to this reference or this key, or a bundle is not made
    /// again.
    DoesNotBelong = 4,
    /// An input cannot be read.
    Unreadable = 5,
    /// An input is too large.
    TooLarge = 6,
    /// An output cannot be written.
    Unwritable = 7,
    /// A limit, or a fault of a library, ended the examination.
    Stopped = 8,
}

impl From<Verdict> for ExitCode {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Match => ExitCode::Match,
            Verdict::NoMatch => ExitCode::NoMatch,
            Verdict::Inconclusive => ExitCode::Inconclusive,
        }
    }
}

impl ExitCode {
    /// All exit codes.
    pub const ALL: [ExitCode; 9] = [
        ExitCode::Match,
        ExitCode::NoMatch,
        ExitCode::Usage,
        ExitCode::Inconclusive,
        ExitCode::DoesNotBelong,
        ExitCode::Unreadable,
        ExitCode::TooLarge,
        ExitCode::Unwritable,
        ExitCode::Stopped,
    ];

    /// Returns the meaning of the code for `meshmark verify`.
    pub fn meaning(self) -> &'static str {
        match self {
            ExitCode::Match => "match",
            ExitCode::NoMatch => "no match",
            ExitCode::Usage => "usage",
            ExitCode::Inconclusive => "inconclusive",
            ExitCode::DoesNotBelong => "the record or the deposit does not belong to this reference or key",
            ExitCode::Unreadable => "unreadable input",
            ExitCode::TooLarge => "too large",
            ExitCode::Unwritable => "an output cannot be written",
            ExitCode::Stopped => "stopped at a limit",
        }
    }
}
