//! GDAL datasets ↔ vertices: the one place that walks layers and geometries, so that the driver
//! and the verifier see the same map.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod assumption;
mod crs;
mod error;
mod features;
mod labels;
mod shapes;
mod survey;
pub mod wkb;

pub use assumption::{Assumption, likely_assumptions, overlaps};
pub use crs::{CoordinateSystem, parse_srs};
pub use error::{Error, Result};
pub use features::{FeatureGeometry, features};
pub use labels::{Dimension, Label};
pub use shapes::Shape;
/// The most vertices a map may have: their numbers are 32 bits wide.
pub const MOST_VERTICES: usize = u32::MAX as usize;

pub use survey::{LabelFields, Selection, Survey, Target, survey};
