//! The verifier decides whether a suspect is a copy of a given marked map.
//!
//! The data flows one way: [`inputs`] → `meshmark-verification` → [`outputs`]. [`compare`] measures the effect
//! of marking on a map, [`distribute`] marks a map for many recipients, [`sheets`] plans sheets that are marked apart,
//! [`copies_index`] lists who received which copy. [`confinement`] has the process that examines a
//! suspect.
#![forbid(unsafe_code)]

pub mod bundle;
pub mod compare;
pub mod confinement;
pub mod copies_index;
pub mod deposit;
pub mod distribute;
mod error;
mod exit_code;
pub mod inputs;
pub mod outputs;
pub mod progress;
pub mod sheets;
pub mod time_stamp;
pub mod words;

pub use error::{Cause, Error, Result};
pub use exit_code::ExitCode;
