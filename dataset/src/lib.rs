//! GDAL datasets as vertices, and marked maps as files. Only this crate walks the layers of GDAL's
//! datasets (their geometries are walked by `meshmark-marking`), so that the driver and the verifier
//! see the same map; it also holds what both need to write one: formats, reading back, publication.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod bases;
mod crs;
mod crs_wkt;
pub mod decimals;
mod error;
mod features;
mod file_digest;
mod file_id;
pub mod formats;
pub mod geojson_text;
mod geometry_fault;
pub mod geopackage;
mod geos;
pub mod marked_view;
pub mod publication;
pub mod read_back;
mod read_geometry;
mod scratch;
mod selection;
mod sheets;
mod survey;
mod threads;
pub mod traces;
mod turns;
pub mod workplace;

pub use bases::read_bases;
pub use crs::{CoordinateSystem, parse_srs};
pub use error::{Action, Error, Result, file_error};
pub use features::features;
pub use file_digest::{digest_of_only_file, file_digest};
pub use file_id::{FileId, same_file};
pub use geos::GeosOfGdal;
pub use scratch::ScratchFiles;
pub use selection::{LabelFields, MOST_VERTICES, OPEN_OPTIONS, Selection};
pub use survey::{Numbers, Survey, numbers, survey};
pub use threads::threads;
