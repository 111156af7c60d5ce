//! The lines of a map as segments in a plane of metres.

use meshmark_core::ground::Ground;
use rstar::{
    RTree,
    primitives::{GeomWithData, Line},
};

/// A segment in the plane with the indices of its two vertices.
pub type Edge = GeomWithData<Line<[f64; 2]>, [u32; 2]>;

/// A plane of metres, whose origin is the middle of a map.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// The middle, CRS units.
    pub centre: [f64; 2],
    /// Metres per CRS unit at the centre.
    pub unit_m: [f64; 2],
}

impl Plane {
    /// Returns the plane around a place, CRS units.
    pub fn new(ground: &Ground, centre: [f64; 2]) -> Self {
        Plane { centre, unit_m: ground.metres_per_unit(centre) }
    }

    /// Returns where a place, CRS units, lies in the plane.
    pub fn at(&self, place: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (place[axis] - self.centre[axis]) * self.unit_m[axis])
    }

    /// Returns the place, CRS units, of a point of the plane.
    pub fn place(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.centre[axis] + at[axis] / self.unit_m[axis])
    }

    /// Indexes segments between vertices at these places, CRS units.
    pub fn tree(&self, coords: &[[f64; 2]], segments: impl Iterator<Item = [u32; 2]>) -> RTree<Edge> {
        let edge = |ends: [u32; 2]| {
            let [a, b] = ends.map(|vertex| self.at(coords[vertex as usize]));
            GeomWithData::new(Line::new(a, b), ends)
        };
        RTree::bulk_load(segments.map(edge).collect())
    }
}

/// Returns which of `vertices` vertices are in no segment.
pub fn is_alone(vertices: usize, segments: &[[u32; 2]]) -> Vec<bool> {
    let mut alone = vec![true; vertices];
    segments.as_flattened().iter().for_each(|&vertex| alone[vertex as usize] = false);
    alone
}
