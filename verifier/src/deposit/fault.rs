//! The reasons why a deposit is refused.

/// The reason why a file is no deposit, or not the one that was signed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages are the documentation
pub enum DepositFault {
    #[error("is no deposit ({0}): give the file that `meshmark deposit` wrote")]
    Malformed(String),
    #[error(
        "was changed after it was signed, or signed with another key than it names: get the deposit again from where it \
         was kept"
    )]
    Signature,
    #[error(
        "contradicts itself, as {0}: whoever signed it did not make it with `meshmark deposit`, so do not rely on it"
    )]
    Contradiction(String),
    #[error(
        "was signed with key {found}, and the public key is {expected}: give the deposit or the public key that belongs to it"
    )]
    OtherSigner { found: String, expected: String },
}

impl DepositFault {
    /// Returns whether the file is no deposit at all.
    pub fn is_malformed(&self) -> bool {
        matches!(self, DepositFault::Malformed(_))
    }
}
