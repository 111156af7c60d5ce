//! A grid that keeps one point for every cell, so that a page can show a map of a million vertices.

use crate::report::Extent;
use std::collections::BTreeSet;

/// Selects the first point of every cell.
pub struct PointGrid {
    lower: [f64; 2],
    upper: [f64; 2],
    /// Width and height of a cell, CRS units.
    cell: [f64; 2],
    taken: BTreeSet<[u32; 2]>,
}

impl PointGrid {
    /// Creates a grid of `cells` cells along the longer side, which are squares on the ground.
    pub fn new(extent: &Extent, cells: usize) -> Self {
        let [width, height] = extent.size_m();
        let side_m = (width.max(height) / cells as f64).max(f64::MIN_POSITIVE);
        let cell = extent.metres_per_unit.map(|metres| side_m / metres);
        PointGrid { lower: extent.lower, upper: extent.upper, cell, taken: BTreeSet::new() }
    }

    /// Returns whether the point is the first of its cell. Points outside the extent never are.
    pub fn takes(&mut self, point: [f64; 2]) -> bool {
        let inside = |axis: usize| (self.lower[axis]..=self.upper[axis]).contains(&point[axis]);
        inside(0) && inside(1) && self.taken.insert(self.cell_of(point))
    }

    /// Returns the cell of a point inside the extent.
    pub fn cell_of(&self, point: [f64; 2]) -> [u32; 2] {
        [0, 1].map(|axis| ((point[axis] - self.lower[axis]) / self.cell[axis]) as u32)
    }

    /// Returns the middle of a cell, CRS units.
    pub fn middle_of(&self, cell: [u32; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.lower[axis] + (f64::from(cell[axis]) + 0.5) * self.cell[axis])
    }

    /// Returns width and height of a cell, CRS units.
    pub fn cell(&self) -> [f64; 2] {
        self.cell
    }
}
