//! Detection: two maps as numbers in, a verdict out. No files, no GDAL.
//!
//! ```text
//! reference ─► patches ────────────────────────────┐
//!                                                  ▼
//! suspect ─► registration ─► matching ─► tracking, demodulation ─► decision
//!                   no key                   the key                 the message
//! ```
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod decision;
mod examination;
mod histogram;
pub mod matching;
mod progress;
pub mod registration;
mod tracking;

pub use examination::{Demodulated, Demodulator, Mark, Matched, Reference};
pub use histogram::{Histogram, round_up};
pub use progress::{Listener, Progress};
