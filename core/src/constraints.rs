//! Constraints on the displacements of vertices: T-junctions and, with SHAPE=rigid or stiff,
//! bodies. All are linear in the displacements and follow from the reference alone: the verifier
//! repeats them.

use crate::{
    bodies::Bodies,
    junctions::{Junctions, touches},
    map::Map,
    nearness::VertexTree,
    options::Rigidity,
    sides::Touching,
};

/// The constraints of a map.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constraints {
    /// T-junctions without those of vertices of bodies, which never hang.
    pub junctions: Junctions,
    /// Polygons that move as one.
    pub bodies: Bodies,
    /// All vertices that lie on segments, each with its segment.
    pub(crate) touching: Vec<Touching>,
}

impl Constraints {
    /// Finds the constraints of a map; `tree` holds all its vertices.
    pub(crate) fn find(map: &Map, tree: &VertexTree, shape: Rigidity) -> Self {
        let mut touches = touches(map, tree);
        let bodies = match shape {
            Rigidity::Rigid | Rigidity::Stiff if !map.polygon_roots.is_empty() => {
                Bodies::find(map, touches.iter().map(|touch| (touch.vertex, touch.segment)))
            }
            _ => Bodies::default(),
        };
        let touching = touches.iter().map(|touch| (touch.vertex, touch.segment)).collect();
        touches.retain(|touch| bodies.number_at(touch.vertex).is_none());
        Constraints { junctions: Junctions::new(touches), bodies, touching }
    }
}
