//! GDAL datasets as vertices, and marked maps as files. Only this crate walks layers and
//! geometries, so that the driver and the verifier see the same map; it also holds what both need
//! to write one: formats, reading back, publication.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod assumption;
mod bases;
mod chains;
mod crs;
mod crs_wkt;
mod damage;
pub mod decimals;
mod error;
mod extent;
mod features;
mod file_digest;
mod file_id;
pub mod formats;
pub mod geojson_text;
mod geometries;
pub mod geopackage;
mod key_file;
mod labels;
mod left_out;
pub mod marked_view;
pub mod marking;
mod polylines;
pub mod publication;
pub mod quality;
pub mod read_back;
mod selection;
mod survey;
mod threads;
pub mod traces;
mod turns;
pub mod wkb;
pub mod workplace;

pub use assumption::{likely_assumptions, overlaps};
pub use bases::{Bases, ReadBase};
pub use crs::{Assumption, CoordinateSystem, parse_srs};
pub use damage::damage_warning;
pub use error::{Action, Error, Result, file_error};
pub use features::{FeatureGeometry, features};
pub use file_digest::{digest_of_only_file, file_digest};
pub use file_id::{FileId, same_file};
pub use geometries::{Geometries, Outline};
pub use key_file::exposure;
pub use left_out::LeftOut;
pub use selection::{LabelFields, MOST_VERTICES, Selection};
pub use survey::{Numbers, Survey, numbers, survey};
pub use threads::{ThreadPool, threads};
