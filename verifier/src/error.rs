use meshmark_core::options::Spelling;

/// What ends a command early. Every message names the input and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("{0}")]
    Usage(String),
    #[error("{0}")]
    DoesNotBelong(String),
    #[error("{0}")]
    Unreadable(String),
    #[error("{0}")]
    TooLarge(String),
}

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What the command's exit code says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitCode {
    /// The mark is there.
    Match = 0,
    /// The mark would have shown, and does not.
    NoMatch = 1,
    /// The command line, an option or a key or record file is wrong.
    Usage = 2,
    /// The suspect cannot answer the question.
    Inconclusive = 3,
    /// The record does not belong to this reference or this key.
    DoesNotBelong = 4,
    /// An input cannot be read.
    Unreadable = 5,
    /// An input is too large.
    TooLarge = 6,
}

impl ExitCode {
    /// All of them.
    pub const ALL: [ExitCode; 7] = [
        ExitCode::Match,
        ExitCode::NoMatch,
        ExitCode::Usage,
        ExitCode::Inconclusive,
        ExitCode::DoesNotBelong,
        ExitCode::Unreadable,
        ExitCode::TooLarge,
    ];

    /// What it means to `meshmark verify`.
    pub fn meaning(self) -> &'static str {
        match self {
            ExitCode::Match => "match",
            ExitCode::NoMatch => "no match",
            ExitCode::Usage => "usage",
            ExitCode::Inconclusive => "inconclusive",
            ExitCode::DoesNotBelong => "the record does not belong to this reference or key",
            ExitCode::Unreadable => "unreadable input",
            ExitCode::TooLarge => "too large",
        }
    }
}

impl Error {
    /// The exit code of this error.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Error::Usage(_) => ExitCode::Usage,
            Error::DoesNotBelong(_) => ExitCode::DoesNotBelong,
            Error::Unreadable(_) => ExitCode::Unreadable,
            Error::TooLarge(_) => ExitCode::TooLarge,
        }
    }
}

impl Error {
    /// The same with a recipient before it.
    pub(crate) fn of(self, recipient: &str) -> Self {
        self.rephrased(|text| format!("\"{recipient}\": {text}"))
    }

    /// The same with more after it.
    pub(crate) fn with(self, more: &str) -> Self {
        self.rephrased(|text| text + more)
    }

    fn rephrased(self, f: impl FnOnce(String) -> String) -> Self {
        match self {
            Error::Usage(text) => Error::Usage(f(text)),
            Error::DoesNotBelong(text) => Error::DoesNotBelong(f(text)),
            Error::Unreadable(text) => Error::Unreadable(f(text)),
            Error::TooLarge(text) => Error::TooLarge(f(text)),
        }
    }
}

/// An error of a map that is written: of its format, or of a place.
impl From<meshmark_dataset::Error> for Error {
    fn from(error: meshmark_dataset::Error) -> Self {
        Error::Usage(error.text(Spelling::Flag))
    }
}

/// An error of the algorithm is one of its parameters, which are flags here.
impl From<meshmark_core::Error> for Error {
    fn from(error: meshmark_core::Error) -> Self {
        Error::Usage(error.text(Spelling::Flag))
    }
}
