//! The deposit, as part of the report.

use crate::words::clipped;
use serde::Serialize;

/// What a deposit fixes of the things that were compared with it.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Standing {
    /// What the deposit holds.
    pub fixed: Vec<String>,
    /// What it does not hold, so that it may have been chosen or changed afterwards.
    pub not_fixed: Vec<String>,
}

/// What a deposit says about the things that were compared.
#[derive(Debug, Clone, Serialize)]
pub struct DepositEntry {
    /// SHA-256 of its file.
    pub sha256: String,
    /// The public key that it is signed with, Ed25519, hexadecimal.
    pub public_key: String,
    /// Whether that key was given, and not only named by the deposit itself.
    pub public_key_given: bool,
    /// Since when the deposit exists, in UTC; null without a time stamp.
    pub since: Option<String>,
    /// Who says so; null without a time stamp.
    pub authority: Option<String>,
    /// What the deposit holds, and what it does not hold.
    #[serde(flatten)]
    pub standing: Standing,
}

impl DepositEntry {
    /// Says since when the deposit exists.
    pub(crate) fn since(&self) -> String {
        match (&self.since, &self.authority) {
            (Some(time), Some(authority)) => format!("since {time}, as {} states", clipped(authority)),
            _ => "at a time that nobody vouches for, as no time stamp is given".into(),
        }
    }

    /// Says who signed it.
    pub(crate) fn signer(&self) -> String {
        let known = if self.public_key_given {
            "the public key that was given"
        } else {
            "a public key that nothing here vouches for"
        };
        format!("{known}, {}", self.public_key)
    }

    /// Returns lines of text.
    pub(crate) fn to_lines(&self) -> Vec<String> {
        let mut lines = vec![
            format!("deposit:      signed with {}", self.signer()),
            format!("fixed:        {}, {}", self.standing.fixed.join(", "), self.since()),
        ];
        lines.extend(self.standing.not_fixed.iter().map(|what| format!("not fixed:    {what}")));
        lines
    }
}
