//! The map that the algorithm works on.

use crate::{
    ground::Ground,
    scale::{Measure, ScaleLattice},
    vertices::VertexTable,
};

/// Vertices, the segments and polygons that join them, and the size of a unit.
#[derive(Debug, Clone, Copy)]
pub struct Map<'a> {
    /// The distinct vertices.
    pub vertices: &'a VertexTable,
    /// The segments of rings and lines: canonical indices [a, b] with a < b, sorted, each pair
    /// once. Points have none.
    pub segments: &'a [[u32; 2]],
    /// For every vertex the first vertex of its polygon group (polygons joined by shared vertices);
    /// the vertex itself when it is in none.
    pub polygon_roots: &'a [u32],
    /// Metres on the ground by the one scale of the mark.
    pub ground: Ground,
    /// Metres on the ground at each vertex, where that scale is not exact.
    pub lattice: Option<&'a ScaleLattice>,
}

impl<'a> Map<'a> {
    /// Creates a map of points alone.
    pub fn of_points(vertices: &'a VertexTable, ground: Ground) -> Self {
        Map { vertices, segments: &[], polygon_roots: &[], ground, lattice: None }
    }

    /// Returns the measure of metres at each vertex.
    pub fn measure(&self) -> Measure<'a> {
        Measure { ground: self.ground, lattice: self.lattice }
    }

    /// Returns the coordinates of a vertex, CRS units.
    pub(crate) fn at(&self, vertex: u32) -> [f64; 2] {
        self.vertices.coords()[vertex as usize]
    }
}
