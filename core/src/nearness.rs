//! A spatial index that finds the vertices near a segment.

use crate::map::Map;
use rstar::{AABB, RTree, primitives::GeomWithData};

/// Some vertices of a map in a tree.
pub(crate) struct VertexTree<'a> {
    map: Map<'a>,
    tree: RTree<GeomWithData<[f64; 2], u32>>,
}

impl<'a> VertexTree<'a> {
    /// Creates the tree of all vertices.
    pub fn of_all(map: &Map<'a>) -> Self {
        Self::new(*map, 0..map.vertices.len() as u32)
    }

    pub fn new(map: Map<'a>, vertices: impl Iterator<Item = u32>) -> Self {
        let leaf = |vertex: u32| GeomWithData::new(map.at(vertex), vertex);
        VertexTree { tree: RTree::bulk_load(vertices.map(leaf).collect()), map }
    }

    /// Returns the vertices within `reach` (CRS units along x and y) of the bounding box of a
    /// segment, without its ends.
    pub fn around(&self, [a, b]: [u32; 2], reach: [f64; 2]) -> impl Iterator<Item = u32> {
        let (p, q) = (self.map.at(a), self.map.at(b));
        let lower = [0, 1].map(|axis| p[axis].min(q[axis]) - reach[axis]);
        let upper = [0, 1].map(|axis| p[axis].max(q[axis]) + reach[axis]);
        let found = self.tree.locate_in_envelope(&AABB::from_corners(lower, upper)).map(|leaf| leaf.data);
        found.filter(move |&v| v != a && v != b)
    }
}

/// Returns the squared distance from a point to a segment that starts at the origin, and where the
/// nearest place is, as a share (0 to 1) of the way from its start to its end.
pub(crate) fn nearest(point: [f64; 2], end: [f64; 2]) -> (f64, f64) {
    let length2 = dot(end, end);
    let share = if length2 > 0.0 { (dot(point, end) / length2).clamp(0.0, 1.0) } else { 0.0 };
    let away = [point[0] - share * end[0], point[1] - share * end[1]];
    (dot(away, away), share)
}

pub(crate) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(crate) fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Returns the vector from `a` to `b`, CRS units, in metres.
pub(crate) fn metres(a: [f64; 2], b: [f64; 2], scale: [f64; 2]) -> [f64; 2] {
    [(b[0] - a[0]) * scale[0], (b[1] - a[1]) * scale[1]]
}
