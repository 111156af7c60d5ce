//! Two maps that were read become a report: whether one is a copy of the other that carries a mark, and
//! whose; or how far marking changed it. This crate holds what every front end that verifies has in
//! common, and opens no files and uses no GDAL: a front end brings its maps and its CRS ([`Maps`]) and its
//! GEOS ([`meshmark_marking::quality::Geos`]).
//!
//! The data flows one way: [`verify`](mod@verify), which passes numbers to `meshmark-detection` →
//! [`report`] → [`html`]; and [`compare`] → [`html`].
#![forbid(unsafe_code)]

pub mod compare;
mod error;
pub mod html;
mod maps;
pub mod report;
mod stages;
mod thinning;
pub mod verify;
pub mod words;

pub use error::{Error, Result};
pub use maps::{IfSuited, Maps, StatedCrs, Suited, Suspect};
pub use stages::Stages;
