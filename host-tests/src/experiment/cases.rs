//! The cases of the experiment: what happens to a marked map, and for whom it is verified.

use crate::{
    attacks::{OtherMaps, Row, extended_rows, paper_rows},
    product::Profile,
};

/// The demodulators of the command, the paper's first.
pub const DEMODULATORS: [&str; 2] = ["paper", "joint"];
/// Number of innocent recipients for whom a collusion is verified.
pub const INNOCENTS: usize = 4;

/// One row of the experiment.
#[derive(Debug, Clone)]
pub enum Case {
    /// A marked copy is attacked.
    Attacked { row: Row, in_paper: bool },
    /// The suspect is the map before marking.
    Unmarked,
    /// The marked copy is marked again with another key: a pirate's own mark.
    MarkedAgain,
    /// This number of recipients average their copies.
    Collusion { copies: usize },
}

impl Case {
    /// Returns a short name, unique.
    pub fn id(&self) -> String {
        match self {
            Case::Attacked { row, .. } => row.id.clone(),
            Case::Unmarked => "unmarked".into(),
            Case::MarkedAgain => "again".into(),
            Case::Collusion { copies } => format!("average{copies}"),
        }
    }

    /// Returns a description of the case.
    pub fn title(&self) -> String {
        match self {
            Case::Attacked { row, .. } => row.title.clone(),
            Case::Unmarked => "not marked at all".into(),
            Case::MarkedAgain => "marked again with another key".into(),
            Case::Collusion { copies } => format!("average of {copies} copies"),
        }
    }

    /// Returns the strength of the attack, if it has one.
    pub fn strength(&self) -> Option<f64> {
        match self {
            Case::Attacked { row, .. } => row.attack.strength(),
            _ => None,
        }
    }

    /// Returns the number of marked copies that the case needs.
    pub fn copies(&self) -> usize {
        match self {
            Case::Collusion { copies } => *copies,
            _ => 1,
        }
    }

    /// Returns the demodulators of the case. Collusions, which are many, use the default one alone,
    /// and the paper's demodulator has neither code nor fingerprint.
    pub fn demodulators(&self, profile: Profile) -> &'static [&'static str] {
        match self {
            Case::Collusion { .. } => &["joint"],
            _ if [Profile::LDPC, Profile::FINGERPRINT].contains(&profile) => &["joint"],
            _ => &DEMODULATORS,
        }
    }

    /// Returns the table of the report to which the case belongs.
    pub fn table(&self) -> Table {
        match self {
            Case::Attacked { in_paper: true, .. } => Table::Paper,
            Case::Attacked { in_paper: false, .. } => Table::Extended,
            _ => Table::Special,
        }
    }
}

/// The tables of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Table {
    /// Table 2 of the paper.
    Paper,
    /// The attacks that the paper does not have.
    Extended,
    /// Suspects with several questions, or with none whose right answer is yes.
    Special,
}

/// Returns all cases for a map.
pub fn all(others: &OtherMaps) -> Vec<Case> {
    let attacked = |in_paper| move |row| Case::Attacked { row, in_paper };
    let mut cases: Vec<Case> = paper_rows().into_iter().map(attacked(true)).collect();
    cases.extend(extended_rows(others).into_iter().map(attacked(false)));
    cases.extend([Case::Unmarked, Case::MarkedAgain]);
    cases.extend([2, 4, 8].map(|copies| Case::Collusion { copies }));
    cases
}
