//! What the command prints: answers to stdout, warnings to stderr.

use meshmark_verification::words::printable;
use meshmark_verifier::{Error, Result};
use std::io::{ErrorKind, Write};

/// The beginning of every warning.
pub(super) const WARNING: &str = "meshmark: ";

/// Prints a warning on one line. Names in files must not control the terminal.
pub(super) fn warn(text: &str) {
    eprintln!("{WARNING}{}", printable(text));
}

/// Warns of outputs that hold exact displacements, where they are asked for.
pub(super) fn warn_of_displacements(are_asked_for: bool) {
    if are_asked_for {
        warn(
            "with exact displacements and the unmarked map anyone can make the mark of this copy again, and with the \
             messages of other recipients theirs: keep the report and the evidence map as secret as the records",
        );
    }
}

/// Prints an answer. A reader may close the pipe before the end.
pub(super) fn print(text: &str) -> Result<()> {
    let mut output = std::io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::Unprinted { source: error }),
        _ => Ok(()),
    }
}
