//! The reasons why a time stamp is refused.

/// The reason why a response is not a time stamp of a file.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages are the documentation
pub enum StampFault {
    #[error(
        "is no response of a time-stamping authority ({0}): send the request again, and keep what comes back unchanged"
    )]
    Malformed(String),
    #[error(
        "is a refusal of the authority (status {status}{reason}): send the request again, or to another authority"
    )]
    Refused { status: u32, reason: String },
    #[error("stamps another file: give the deposit that it was made for, or its own time stamp")]
    OtherFile,
    #[error(
        "stamps a digest by an algorithm ({0}) that is not SHA-256, SHA-384 or SHA-512: have the deposit stamped with one of these"
    )]
    OtherAlgorithm(String),
    #[error(
        "answers another request, as its nonce is another: give the request that it answers, or send that request again"
    )]
    OtherRequest,
    #[error("has no certificate of its signer: make the request with `meshmark deposit`, which asks for it")]
    NoCertificate,
    #[error("has a signature that is wrong: it was changed, or its authority did not make it")]
    Signature,
    #[error(
        "is signed with a certificate that is not for time stamps ({0}): have the deposit stamped by a time-stamping authority"
    )]
    OtherPurpose(&'static str),
    #[error(
        "is signed with a certificate that was not valid at {0}, the time that it states: do not rely on it"
    )]
    Expired(String),
    #[error(
        "is signed by {0}, which no certificate of --authorities vouches for: give the root certificate of that authority if you trust it"
    )]
    OtherAuthority(String),
    #[error("has a chain of certificates that does not hold ({0}): do not rely on it")]
    Chain(String),
}

impl StampFault {
    /// Returns whether the file is no time stamp at all.
    pub fn is_malformed(&self) -> bool {
        matches!(self, StampFault::Malformed(_))
    }
}
