//! The parts of a report file beyond the answer.

use super::sketch::Sketch;
use serde::Serialize;

/// The places of the evidence on the map.
#[derive(Debug, Clone, Serialize)]
pub struct Evidence {
    /// The thinned map.
    #[serde(flatten)]
    pub sketch: Sketch,
    /// For every patch, the number of standard deviations by which its evidence for the message
    /// exceeds that of a random key; null where no displacement was observed. Empty when nothing
    /// was decoded or no message was expected.
    pub patch_scores: Vec<Option<f64>>,
    /// The recipients whose fingerprints are in the suspect: several where copies were mixed.
    pub members: Vec<Member>,
    /// For every patch, the number of the member whose copy it comes from, counted from 0; null
    /// where it is not clear. Empty without members.
    pub patch_members: Vec<Option<usize>>,
}

/// A recipient whose fingerprint is in the suspect.
#[derive(Debug, Clone, Serialize)]
pub struct Member {
    /// The recipient.
    pub recipient: String,
    /// The score of the recipient in each patch alone; null where nothing was observed.
    pub patch_scores: Vec<Option<f64>>,
}

/// The files that were compared.
#[derive(Debug, Clone, Serialize)]
pub struct Inputs {
    /// The key.
    pub key: Digested,
    /// The reference.
    pub reference: Digested,
    /// The other references that were given, such as those of earlier editions.
    pub other_references: Vec<Digested>,
    /// The suspect.
    pub suspect: Digested,
    /// The record, or the best one of many; null without.
    pub record: Option<Digested>,
}

/// A file or folder and its digest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Digested {
    /// The path as given.
    pub path: String,
    /// "SHA-256 …", or the reason why there is none.
    pub digest: String,
}

/// The compared data, and the means to repeat the verification.
#[derive(Debug, Clone, Serialize)]
pub struct Provenance {
    /// The files.
    #[serde(flatten)]
    pub inputs: Inputs,
    /// Digest of the vertices of the reference.
    pub reference_vertices_sha256: String,
    /// CRS of the layers of the suspect.
    pub suspect_crs: Vec<String>,
    /// The command line.
    pub command: String,
    /// Programs and libraries that the result depends on, with their versions.
    pub versions: Vec<String>,
}
