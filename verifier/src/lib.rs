//! The verifier decides whether a suspect is a copy of a given marked map.
//!
//! The data flows one way: [`inputs`] → [`verify`](mod@verify), which passes numbers to
//! `meshmark-detection` → [`report`] → [`html`] → [`outputs`]. [`compare`] measures the effect of marking on a
//! map, [`distribute`] marks a map for many recipients,
//! [`copies_index`] lists who received which copy. [`confinement`] has the process that examines a
//! suspect.
#![forbid(unsafe_code)]

pub mod compare;
pub mod confinement;
pub mod copies_index;
pub mod deposit;
pub mod distribute;
mod error;
mod exit_code;
pub mod html;
pub mod inputs;
pub mod outputs;
pub mod progress;
pub mod report;
mod thinning;
pub mod time_stamp;
pub mod verify;
pub mod words;

pub use error::{Cause, Error, Result};
pub use exit_code::ExitCode;
pub use verify::{Request, verify, verify_records};
