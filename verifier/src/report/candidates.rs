//! The records that were tried, as the report has them.

use crate::words::{power_of_ten, printable};
use meshmark_core::counted;
use serde::Serialize;

/// The records that were tried, as the report has them.
#[derive(Debug, Clone, Serialize)]
pub struct Candidates {
    /// How many; every p-value of the list is multiplied by it.
    pub tried: usize,
    /// How many files were no record of this key and reference.
    pub skipped: usize,
    /// The best, the most significant first.
    pub list: Vec<Entry>,
    /// How many of them match.
    #[serde(skip)]
    pub(crate) matches: usize,
}

/// One of them.
#[derive(Debug, Clone, Serialize)]
pub struct Entry {
    /// Name of its file.
    pub record: String,
    /// Its recipient; null when the message was given as bits.
    pub recipient: Option<String>,
    /// Its message, hexadecimal.
    pub message: String,
    /// log₁₀ p, times the number of candidates; null when nothing was decoded.
    pub p_value_log10: Option<f64>,
    /// How many decoded bits differ from its message; null when nothing was decoded.
    pub bit_errors: Option<usize>,
}

impl Candidates {
    /// For a person.
    pub(crate) fn to_lines(&self) -> Vec<String> {
        let skipped = match self.skipped {
            0 => String::new(),
            skipped => format!(", {} skipped", counted(skipped, "file")),
        };
        let mut lines = vec![format!("candidates:   {} tried{skipped}", counted(self.tried, "record"))];
        let line = |label: &str, entry: &Entry| {
            let p = entry.p_value_log10.map_or(String::new(), |p| format!(", p-value {}", power_of_ten(p)));
            format!("{label:<13} {}{p}", entry.name())
        };
        match self.matches {
            0 => lines.extend(self.list.first().map(|nearest| line("nearest:", nearest))),
            matches => lines.extend(self.list[..matches].iter().map(|entry| line("match:", entry))),
        }
        lines
    }
}

impl Entry {
    pub(crate) fn name(&self) -> String {
        let whose = match &self.recipient {
            Some(recipient) => printable(recipient),
            None => format!("message {}", self.message),
        };
        format!("{whose} ({})", printable(&self.record))
    }
}
