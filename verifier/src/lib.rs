//! The command `meshmark`: files in, verdicts, copies and deposits out.
//!
//! The data of a verification flow one way: [`inputs`] → `meshmark-verification`, which decides whether
//! a suspect is a copy of a marked map → [`outputs`]. [`compare`] measures the effect of marking on a
//! map, [`distribute`] marks a map for many recipients, [`sheets`] plans sheets that are marked apart,
//! [`copies_index`] lists who received which copy, [`deposit`] fixes evidence before copies are handed
//! out and [`time_stamp`] dates it, [`bundle`] packs a case. [`confinement`] has the process that
//! examines a suspect.
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
