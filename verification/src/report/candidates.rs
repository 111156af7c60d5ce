//! The records that were tried, as part of the report.

use crate::words::{power_of_ten, printable};
use meshmark_core::counted;
use serde::Serialize;

/// The records that were tried, as part of the report.
#[derive(Debug, Clone, Serialize)]
pub struct Candidates {
    /// Number of tried records; every p-value of the list is multiplied by it.
    pub tried: usize,
    /// Number of files that are not records of this key and reference.
    pub skipped: usize,
    /// The best records, the most significant first.
    pub list: Vec<Entry>,
    /// log₁₀ of the p-value of the best record that is not listed; null when there is none.
    pub next_p_value_log10: Option<f64>,
    /// Number of records that match.
    #[serde(skip)]
    pub matches: usize,
}

/// A record that was tried.
#[derive(Debug, Clone, Serialize)]
pub struct Entry {
    /// Name of the file.
    pub record: String,
    /// Recipient; null when the message was given as bits.
    pub recipient: Option<String>,
    /// log₁₀ of the p-value times the number of candidates; null when nothing was decoded.
    pub p_value_log10: Option<f64>,
    /// Number of decoded bits that differ from the message of a record that matches; null otherwise.
    pub bit_errors: Option<usize>,
    /// SHA-256 of the file, as it was read.
    #[serde(skip)]
    pub sha256: String,
}

impl Candidates {
    /// Returns the best one, which may be hidden from the list.
    pub fn best(&self) -> Option<&Entry> {
        self.list.first()
    }

    /// Takes all that do not match from the list: their names are those of other customers.
    pub(crate) fn hide_others(&mut self) {
        let others = self.list.split_off(self.matches.min(self.list.len()));
        self.next_p_value_log10 = others.first().map_or(self.next_p_value_log10, |next| next.p_value_log10);
    }

    /// Returns lines of text.
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
            0 => lines.push(match (self.list.first(), self.next_p_value_log10) {
                (Some(nearest), _) => line("nearest:", nearest),
                (None, Some(p)) => {
                    format!("nearest:      p-value {}; --show-recipients names it", power_of_ten(p))
                }
                (None, None) => return lines,
            }),
            matches => lines.extend(self.list[..matches].iter().map(|entry| line("match:", entry))),
        }
        lines
    }
}

impl Entry {
    pub(crate) fn name(&self) -> String {
        let record = printable(&self.record);
        match &self.recipient {
            Some(recipient) => format!("{} ({record})", printable(recipient)),
            None => record,
        }
    }
}
