//! The verifier: is this suspect a copy of that marked map?
//!
//! The data flows one way: [`reading`] → [`registration`] (with [`matching`]) → core's demodulation →
//! [`decision`] → [`report`]. [`verify()`] is the whole of it. [`distribute`] marks a map for many recipients.
#![forbid(unsafe_code)]

pub mod affine;
pub mod candidates;
pub mod compare;
mod consensus;
mod crs_search;
pub mod cubic;
pub mod decision;
pub mod decoys;
pub mod distribute;
mod error;
pub mod evidence;
pub mod evidence_map;
pub mod explain;
mod histogram;
pub mod html;
pub mod inputs;
mod joined;
mod landmarks;
pub mod matching;
pub mod progress;
pub mod reading;
pub mod registration;
pub mod report;
pub mod report_file;
mod rivals;
mod search;
mod shapes;
pub mod sketch;
pub mod survival;
pub mod verify;
mod windows;

pub use error::{Error, ExitCode, Result};
pub use verify::{Demodulator, Request, verify};
