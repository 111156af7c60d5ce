//! What the command prints: answers to stdout, warnings to stderr.

use meshmark_verifier::{Error, Result, words::printable};
use std::io::{ErrorKind, Write};

/// The beginning of every warning.
pub(super) const WARNING: &str = "meshmark: ";

/// Prints a warning on one line. Names in files must not control the terminal.
pub(super) fn warn(text: &str) {
    eprintln!("{WARNING}{}", printable(text));
}

/// Prints an answer. A reader may close the pipe before the end.
pub(super) fn print(text: &str) -> Result<()> {
    let mut output = std::io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::Unprinted { source: error }),
        _ => Ok(()),
    }
}
