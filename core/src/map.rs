//! The map that the algorithm works on.

use crate::{ground::Ground, vertices::VertexTable};

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
    /// Metres of the mark: version 1 has one scale for a projected map.
    pub ground: &'a Ground,
    /// Metres on the ground at each vertex, for limits and figures.
    pub measure: &'a Ground,
}

impl<'a> Map<'a> {
    /// Creates a map of points alone.
    pub fn of_points(vertices: &'a VertexTable, ground: &'a Ground) -> Self {
        Map { vertices, segments: &[], polygon_roots: &[], ground, measure: ground }
    }

    /// Returns the coordinates of a vertex, CRS units.
    pub(crate) fn at(&self, vertex: u32) -> [f64; 2] {
        self.vertices.coords()[vertex as usize]
    }
}
