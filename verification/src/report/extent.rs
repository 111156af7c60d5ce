//! The extent of a map.

use serde::Serialize;

/// The bounding rectangle of a map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Extent {
    /// Lower left corner, CRS units.
    pub lower: [f64; 2],
    /// Upper right corner, CRS units.
    pub upper: [f64; 2],
    /// Metres on the ground per CRS unit in the middle of the rectangle, along x and y.
    pub metres_per_unit: [f64; 2],
}

impl Extent {
    /// Returns width and height on the ground, metres.
    pub(crate) fn size_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.upper[axis] - self.lower[axis]) * self.metres_per_unit[axis])
    }
}
