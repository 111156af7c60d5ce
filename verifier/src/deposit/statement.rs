//! The statement of a deposit: an in-toto statement whose subjects are the files of the references.
//! It has one spelling, so that equal inputs make equal bytes, and no time.

use super::{DepositFault, tree::Tree};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

const STATEMENT: &str = "https://in-toto.io/Statement/v1";
const PREDICATE: &str = "urn:meshmark:deposit:1";

/// What is signed. docs/deposit.schema.json describes its JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Statement {
    /// The format of the statement.
    #[serde(rename = "_type")]
    kind: String,
    /// The files of the references.
    pub subject: Vec<Subject>,
    /// The format of the predicate.
    #[serde(rename = "predicateType")]
    predicate_type: String,
    /// What is fixed beside these files.
    pub predicate: Predicate,
}

/// A file of a reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Subject {
    /// Its name in its folder.
    pub name: String,
    /// Its digests by algorithm: `sha256`.
    pub digest: BTreeMap<String, String>,
}

/// What is fixed beside the files of the references.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Predicate {
    /// The programs that made the deposit, with their versions.
    pub software: Vec<String>,
    /// The public key that the deposit is signed with, Ed25519, hexadecimal.
    pub public_key: String,
    /// 256 bits that commit to the secret key, see
    /// [`SecretKey::commitment`](meshmark_core::key::SecretKey::commitment).
    pub key_commitment: String,
    /// The vertices of the references.
    pub references: Vec<Vertices>,
    /// The parameters of the marks, as the records have them.
    pub marks: Vec<Value>,
    /// SHA-256 of the files of the records.
    pub records: Tree,
    /// Keyed hashes of the recipients, which name them to nobody without the key.
    pub recipients: Tree,
}

/// The vertices of a reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vertices {
    /// Name of the file or folder of the reference.
    pub reference: String,
    /// Layers that were marked; all when null.
    pub layers: Option<Vec<String>>,
    /// CRS given for a reference that had none.
    pub srs: Option<String>,
    /// Number of distinct vertices.
    pub vertices: usize,
    /// Digest of the vertices, see [`meshmark_core::vertices::VertexTable::digest`].
    pub vertices_sha256: String,
}

impl Statement {
    /// Creates a statement.
    pub fn new(subject: Vec<Subject>, predicate: Predicate) -> Self {
        Statement { kind: STATEMENT.into(), subject, predicate_type: PREDICATE.into(), predicate }
    }

    /// Returns the bytes that are signed.
    pub fn to_bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).expect("strings and numbers are JSON")
    }

    /// Reads the bytes that were signed.
    ///
    /// # Errors
    /// Fails on another statement, on a spelling that [`Statement::to_bytes`] does not write, and
    /// on roots that are not those of the digests beside them.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, DepositFault> {
        let malformed = |error: serde_json::Error| DepositFault::Malformed(error.to_string());
        let statement: Statement = serde_json::from_slice(bytes).map_err(malformed)?;
        let formats = [&statement.kind, &statement.predicate_type];
        if formats != [STATEMENT, PREDICATE] {
            return Err(DepositFault::Malformed(format!(
                "its statement is {} of {}",
                statement.predicate_type, statement.kind
            )));
        }
        if statement.to_bytes() != bytes {
            return Err(DepositFault::Malformed("its statement is not spelt as such are".into()));
        }
        let Predicate { records, recipients, .. } = &statement.predicate;
        for (tree, what) in [(records, "records"), (recipients, "recipients")] {
            if !tree.is_consistent() {
                let reason = format!("the Merkle root of its {what} is not that of their digests");
                return Err(DepositFault::Contradiction(reason));
            }
        }
        Ok(statement)
    }
}
