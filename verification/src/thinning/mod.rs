//! The thinning of a map to the resolution of a page, for the reports of verifications and
//! comparisons.

mod lines;
mod point_grid;

pub use lines::lines;
pub use point_grid::PointGrid;

use crate::report::Extent;
use meshmark_core::{ground::Ground, vertices::VertexTable};

/// Number of bins of a histogram.
pub const BINS: usize = 40;
/// Number of cells for arrows along the longer side; arrows need more room than points.
pub const ARROWS: usize = 44;

/// Returns the extent of a map.
pub fn extent_of(vertices: &VertexTable, ground: &Ground) -> Extent {
    let (lower, upper) = vertices.bounds();
    Extent { lower, upper, metres_per_unit: ground.metres_per_unit(vertices.centre()) }
}
