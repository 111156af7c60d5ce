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

mod bases;
mod chains;
mod checks;
mod content;
mod crs;
mod damage;
mod error;
mod extent;
mod geometries;
#[cfg(unix)]
mod key_file;
mod known_crs;
mod labels;
pub mod left_out;
mod moves;
mod polylines;
pub mod quality;
mod records;
mod survey;
mod thread_pool;
mod transformation;
pub mod wkb;

pub use bases::{Bases, ReadBase};
pub use chains::Chains;
pub use checks::{check_extent, check_scale, signless_warning, spelling_warning, warnings};
pub use content::{Content, Numbers};
pub use crs::{Crs, CrsKind, Metric, ground};
pub use damage::damage_warning;
pub use error::{Error, Fault, Result};
pub use extent::Extent;
pub use geometries::{FeatureGeometry, Geometries, Outline};
#[cfg(unix)]
pub use key_file::exposure;
pub use known_crs::{CrsSource, KnownCrs};
pub use left_out::{Faults, LeftOut};
pub use moves::{Moves, NotMoved};
pub use records::{Lineage, Unmarked, fingerprint_record, recorded, reference};
pub use survey::Survey;
pub use thread_pool::ThreadPool;
pub use transformation::{TransformableCrs, degrees, reproject};
