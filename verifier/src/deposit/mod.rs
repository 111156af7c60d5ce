//! Deposits: a signed statement that fixes key, references, records and recipients before copies are
//! handed out, so that none of them can be chosen afterwards.
//!
//! ```text
//! key, references, records ─► statement (in-toto) ─► envelope (DSSE, Ed25519) ─► file ─► time stamp
//!                                    │ trees of records and recipients
//!                                    ▼
//! verification ─────────────► what of it is fixed, and what is not
//! ```
//!
//! Nobody learns the key, a record or a recipient from a deposit.

mod checking;
mod envelope;
mod fault;
mod making;
mod opened;
mod signing_key;
mod statement;
mod tree;
mod verified;

pub use checking::check;
pub use envelope::Deposit;
pub use fault::DepositFault;
pub use making::{Deposited, make};
pub use opened::{DepositFiles, Opened};
pub use signing_key::{PublicKey, SigningKey, public_key_file, signing_key_file};
pub use statement::{Predicate, Statement};
pub use verified::Expected;
