//! Time stamps of RFC 3161: a request to write, and a response to verify, both without network.
//!
//! ```text
//! file ─► digest, nonce ─► request ─► (authority) ─► response ─► imprint, nonce
//!                                                        │        signature ─► certificate ─► chain
//!                                                        ▼                                      │
//!                                                      time ◄───────────────────────────────────┘
//! ```
//!
//! `rustls-webpki` verifies signatures and chains; RustCrypto's crates read the messages.

mod authorities;
mod fault;
mod request;
mod response;
mod signer;

pub use authorities::Authorities;
pub use fault::StampFault;
pub use request::request;
pub use response::{TimeStamp, verify};
