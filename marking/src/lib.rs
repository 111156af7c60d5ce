//! Features as well-known binary become a map, and the map's vertices move them. This crate holds what
//! every front end that marks has in common, and opens no files and uses no GDAL: a front end brings its
//! CRS ([`Crs`]) and its GEOS ([`quality::Geos`]).
//!
//! ```text
//! well-known binary ─► chains ─► map ─► checks ─► (core marks) ─► moves ─► well-known binary
//!                                                       └───────► records
//! ```
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod chains;
mod checks;
mod crs;
mod damage;
mod error;
mod extent;
mod geometries;
#[cfg(unix)]
mod key_file;
pub mod left_out;
mod moves;
pub mod quality;
mod records;
mod thread_pool;
pub mod wkb;

pub use chains::Chains;
pub use checks::{check_extent, check_scale, warnings};
pub use crs::{Crs, CrsKind, Metric, ground};
pub use damage::damage_warning;
pub use error::{Error, Result};
pub use extent::Extent;
pub use geometries::{Geometries, Outline};
#[cfg(unix)]
pub use key_file::exposure;
pub use left_out::{Faults, LeftOut};
pub use moves::{Moves, NotMoved};
pub use records::{Lineage, Unmarked, fingerprint_record, recorded, reference};
pub use thread_pool::ThreadPool;
