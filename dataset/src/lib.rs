//! GDAL datasets ↔ vertices: the one place that walks layers and geometries, so that the driver
//! and the verifier see the same map.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod crs;
mod error;
mod labels;
mod survey;
pub mod wkb;

pub use crs::{CoordinateSystem, parse_srs};
pub use error::{Error, Result};
pub use labels::{Dimension, Label};
pub use survey::{LabelFields, Selection, Survey, survey};
