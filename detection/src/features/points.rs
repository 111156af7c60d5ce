//! Points of features as linear functions of vertices.

use crate::linework::Plane;
use meshmark_core::map_data::MapData;

/// A point of a feature of the reference.
pub struct FeaturePoint {
    /// Its place in the plane, metres.
    pub at_m: [f64; 2],
    /// The shares of the vertices in its displacement.
    pub shares: Vec<(u32, [[f64; 2]; 2])>,
    /// The variance of its displacement that is no linear function, per axis.
    pub variance_m2: f64,
}

/// Returns the places of the vertices of a ring in the plane, metres.
pub fn places(reference: &MapData, plane: &Plane, vertices: &[u32]) -> Vec<[f64; 2]> {
    vertices.iter().map(|&vertex| plane.at(reference.vertices.coords()[vertex as usize])).collect()
}
