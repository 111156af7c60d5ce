//! Keys that a passphrase protects: texts in the format of `age`, armoured, from which other programs
//! of that format take the protection off, too.

use crate::{Error, Result};
use age::{
    scrypt::{Identity, Recipient},
    secrecy::SecretString,
};
use meshmark_core::key::{is_protected, read_text};
use std::{
    cell::OnceCell,
    fs::File,
    io::{self, BufRead, Read},
    path::{Path, PathBuf},
};
use zeroize::Zeroizing;

/// A passphrase, which is asked for when the first protected key is read.
pub struct Passphrase {
    source: Source,
    known: OnceCell<SecretString>,
}

enum Source {
    /// The first line of a file.
    File(PathBuf),
    Terminal,
    /// The parent of a process that examines a suspect, which has no terminal.
    Parent,
}

impl Passphrase {
    fn from(source: Source) -> Self {
        Passphrase { source, known: OnceCell::new() }
    }

    /// Creates the passphrase in a file or, without one, that of the user at the terminal.
    pub fn new(file: Option<&Path>) -> Self {
        Self::from(file.map_or(Source::Terminal, |path| Source::File(path.into())))
    }

    /// Creates the same for a child, whose parent has the terminal.
    pub fn of_child(file: Option<&Path>) -> Self {
        Self::from(file.map_or(Source::Parent, |path| Source::File(path.into())))
    }

    /// Asks the user for a new passphrase, twice, or reads it from a file.
    ///
    /// # Errors
    /// Fails without a terminal, and when the passphrase is empty or not the same again.
    pub fn chosen(file: Option<&Path>) -> Result<Self> {
        let passphrase = Self::new(file);
        let text = passphrase.ask("New passphrase: ")?;
        if file.is_none() && *asked("The same again: ")? != *text {
            return Err(Error::OtherPassphrase);
        }
        Ok(Passphrase { known: OnceCell::from(secret(&text)), ..passphrase })
    }

    /// Returns what a child needs to read this key: nothing, unless the user has to be asked.
    ///
    /// # Errors
    /// Fails without a terminal.
    pub fn for_child(&self, key: &Path) -> Result<Option<Zeroizing<String>>> {
        let is_asked_for = matches!(self.source, Source::Terminal) && is_protected_file(key);
        is_asked_for.then(|| self.ask(&question(key))).transpose()
    }

    fn ask(&self, question: &str) -> Result<Zeroizing<String>> {
        let text = match &self.source {
            Source::Terminal => asked(question)?,
            Source::File(path) => {
                let unread = |source| Error::TextUnread { what: "passphrase", path: path.clone(), source };
                first_line(File::open(path).map_err(unread)?).map_err(unread)?
            }
            Source::Parent => first_line(io::stdin()).map_err(|source| Error::NoTerminal { source })?,
        };
        if text.is_empty() { Err(Error::NoPassphrase) } else { Ok(text) }
    }

    /// Returns the text that a protected text holds; any other text as it is.
    pub(super) fn open(&self, path: &Path, text: Zeroizing<String>) -> Result<Zeroizing<String>> {
        if !is_protected(&text) {
            return Ok(text);
        }
        if self.known.get().is_none() {
            let asked = self.ask(&question(path))?;
            self.known.set(secret(&asked)).expect("nobody else sets it");
        }
        let identity = Identity::new(self.known.get().expect("it was asked for").clone());
        let opened = age::decrypt(&identity, text.as_bytes()).map(Zeroizing::new);
        let opened = opened.map_err(|_| Error::WrongPassphrase { path: path.into() })?;
        match std::str::from_utf8(&opened) {
            Ok(text) => Ok(Zeroizing::new(text.into())),
            Err(_) => Err(Error::WrongPassphrase { path: path.into() }),
        }
    }

    /// Returns a text that only the passphrase opens.
    ///
    /// # Errors
    /// Fails when the passphrase cannot be read.
    pub fn protect(&self, text: &str) -> Result<String> {
        let known = self.known.get().expect("a new passphrase was chosen");
        age::encrypt_and_armor(&Recipient::new(known.clone()), text.as_bytes())
            .map_err(|error| Error::Unprotected { reason: error.to_string() })
    }
}

fn secret(text: &str) -> SecretString {
    SecretString::from(text.to_string())
}

fn question(key: &Path) -> String {
    format!("Passphrase of {}: ", key.display())
}

fn asked(question: &str) -> Result<Zeroizing<String>> {
    let answer = rpassword::prompt_password(question).map(Zeroizing::new);
    answer.map_err(|source| Error::NoTerminal { source })
}

fn first_line(source: impl Read) -> io::Result<Zeroizing<String>> {
    let mut line = Zeroizing::new(String::new());
    io::BufReader::new(source.take(LONGEST_PASSPHRASE)).read_line(&mut line)?;
    Ok(Zeroizing::new(line.trim_end_matches(['\n', '\r']).into()))
}

/// A mistaken /dev/zero has no end.
const LONGEST_PASSPHRASE: u64 = 4096;

/// Returns whether a file holds a protected key. A pipe can be read once only, by the child.
pub fn is_protected_file(path: &Path) -> bool {
    path.is_file() && File::open(path).and_then(read_text).is_ok_and(|text| is_protected(&text))
}
