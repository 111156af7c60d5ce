//! The verifier: is this suspect a copy of that marked map?
//!
//! The data flows one way: [`inputs`] → [`verify`](mod@verify), which hands numbers to `meshmark-detection` → [`report`] → [`html`].
//! [`compare`] is about what marking did to a map, [`distribute`] marks one for many recipients.
#![forbid(unsafe_code)]

pub mod compare;
pub mod distribute;
mod error;
mod exit_code;
pub mod html;
pub mod inputs;
pub mod progress;
pub mod report;
pub mod verify;
pub mod words;

pub use error::{Error, Result};
pub use exit_code::ExitCode;
pub use verify::{Request, verify, verify_records};
