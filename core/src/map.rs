//! A map as the algorithm sees it.

use crate::{
    ground::Ground,
    scale::{Measure, ScaleLattice},
    vertices::VertexTable,
};

/// Vertices, what joins them, and how long a unit is.
#[derive(Debug, Clone, Copy)]
pub struct Map<'a> {
    /// The distinct vertices.
    pub vertices: &'a VertexTable,
    /// The segments of rings and lines: canonical indices [a, b] with a < b, sorted, each pair once. Points
    /// have none.
    pub segments: &'a [[u32; 2]],
    /// Of every vertex the first vertex of its polygon group, the polygons that shared vertices join; itself when it is in
    /// none.
    pub polygon_roots: &'a [u32],
    /// Metres on the ground, as the mark has them.
    pub ground: Ground,
    /// Metres on the ground where a vertex is, when they are others.
    pub lattice: Option<&'a ScaleLattice>,
}

impl<'a> Map<'a> {
    /// A map of points alone.
    pub fn of_points(vertices: &'a VertexTable, ground: Ground) -> Self {
        Map { vertices, segments: &[], polygon_roots: &[], ground, lattice: None }
    }

    /// Metres where a vertex is.
    pub fn measure(&self) -> Measure<'a> {
        Measure { ground: self.ground, lattice: self.lattice }
    }

    /// The coordinates of a vertex, CRS units.
    pub(crate) fn at(&self, vertex: u32) -> [f64; 2] {
        self.vertices.coords()[vertex as usize]
    }
}
