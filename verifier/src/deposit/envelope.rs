//! The file of a deposit: a DSSE envelope around the statement, signed with Ed25519.

use super::{
    DepositFault,
    signing_key::{PublicKey, SigningKey},
    statement::Statement,
};
use crate::{Error, Result, inputs::texts};
use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use meshmark_core::{hex, key::SecretKey};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::Path;

const PAYLOAD: &str = "application/vnd.in-toto+json";

/// A deposit whose signature is right.
#[derive(Debug, Clone, PartialEq)]
pub struct Deposit {
    statement: Statement,
    signer: PublicKey,
    bytes: Vec<u8>,
}

#[derive(Serialize, Deserialize)]
struct Envelope {
    #[serde(rename = "payloadType")]
    payload_type: String,
    payload: String,
    signatures: Vec<EnvelopeSignature>,
}

#[derive(Serialize, Deserialize)]
struct EnvelopeSignature {
    keyid: String,
    sig: String,
}

/// Returns the text that is signed: the pre-authentication encoding of DSSE, which binds the type of
/// the statement.
fn signed_text(payload: &[u8]) -> Vec<u8> {
    let head = format!("DSSEv1 {} {PAYLOAD} {} ", PAYLOAD.len(), payload.len());
    [head.as_bytes(), payload].concat()
}

impl Deposit {
    /// Signs a statement; returns the bytes of the file.
    pub fn sign(statement: &Statement, key: &SigningKey) -> Vec<u8> {
        let payload = statement.to_bytes();
        let signature = EnvelopeSignature {
            keyid: key.public().to_hex(),
            sig: BASE64.encode(key.sign(&signed_text(&payload))),
        };
        let envelope = Envelope {
            payload_type: PAYLOAD.into(),
            payload: BASE64.encode(payload),
            signatures: vec![signature],
        };
        let mut bytes = serde_json::to_vec_pretty(&envelope).expect("strings are JSON");
        bytes.push(b'\n');
        bytes
    }

    /// Reads a deposit, checks its signature, and whether `expected` signed it if that is known.
    ///
    /// # Errors
    /// Fails on an unreadable file, and with [`Error::Deposit`].
    pub fn read(path: &Path, expected: Option<&PublicKey>) -> Result<Self> {
        let bytes = texts::bytes("deposit", path)?;
        Self::from_bytes(bytes, expected).map_err(|source| Error::Deposit { path: path.into(), source })
    }

    fn from_bytes(bytes: Vec<u8>, expected: Option<&PublicKey>) -> std::result::Result<Self, DepositFault> {
        let malformed = |reason: &str| DepositFault::Malformed(reason.into());
        let envelope: Envelope =
            serde_json::from_slice(&bytes).map_err(|error| malformed(&error.to_string()))?;
        if envelope.payload_type != PAYLOAD {
            return Err(malformed(&format!("its payload is {}", envelope.payload_type)));
        }
        let payload = BASE64.decode(&envelope.payload).map_err(|error| malformed(&error.to_string()))?;
        let [EnvelopeSignature { sig, .. }] = envelope.signatures.as_slice() else {
            return Err(malformed(&format!("it has {} signatures", envelope.signatures.len())));
        };
        let signature = BASE64.decode(sig).map_err(|_| DepositFault::Signature)?;
        let statement = Statement::from_bytes(&payload)?;
        let named = &statement.predicate.public_key;
        let signer = PublicKey::from_hex(named).ok_or(DepositFault::Signature)?;
        if !signer.has_signed(&signed_text(&payload), &signature) {
            return Err(DepositFault::Signature);
        }
        match expected {
            Some(expected) if *expected != signer => {
                Err(DepositFault::OtherSigner { found: named.clone(), expected: expected.to_hex() })
            }
            _ => Ok(Deposit { statement, signer, bytes }),
        }
    }

    /// Returns the statement.
    pub fn statement(&self) -> &Statement {
        &self.statement
    }

    /// Returns the key that signed it.
    pub fn signer(&self) -> &PublicKey {
        &self.signer
    }

    /// Returns the bytes of the file, of which a time stamp is made.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the SHA-256 of the file.
    pub fn sha256(&self) -> String {
        hex::encode(&Sha256::digest(&self.bytes))
    }

    /// Returns whether it commits to a key.
    pub fn holds_key(&self, key: &SecretKey) -> bool {
        self.statement.predicate.key_commitment == key.commitment()
    }

    /// Returns whether it holds vertices with this digest.
    pub fn holds_vertices(&self, sha256: &str) -> bool {
        self.statement.predicate.references.iter().any(|reference| reference.vertices_sha256 == sha256)
    }

    /// Returns whether a reference has a file with this digest.
    pub fn holds_file(&self, sha256: &str) -> bool {
        let digests = |subject: &super::statement::Subject| subject.digest.get("sha256").cloned();
        self.statement.subject.iter().filter_map(digests).any(|held| held == sha256)
    }

    /// Returns whether it holds a record whose file has this digest.
    pub fn holds_record(&self, sha256: &str) -> bool {
        self.statement.predicate.records.holds(sha256)
    }

    /// Returns whether it holds a recipient.
    pub fn holds_recipient(&self, key: &SecretKey, recipient: &str) -> bool {
        self.statement.predicate.recipients.holds(&key.blinded(recipient))
    }
}
