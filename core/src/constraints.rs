//! What keeps vertices from moving freely: T-junctions and, with SHAPE=rigid, bodies. All of it is linear in the
//! displacements and follows from the reference alone, so that the verifier repeats it.

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
    /// T-junctions, but for vertices of bodies: those never hang.
    pub junctions: Junctions,
    /// Polygons that move as one.
    pub bodies: Bodies,
    /// All vertices that lie on segments, and those.
    pub(crate) touching: Vec<Touching>,
}

impl Constraints {
    /// Finds them; `tree` holds all vertices.
    pub(crate) fn find(map: &Map, tree: &VertexTree, shape: Rigidity) -> Self {
        let mut touches = touches(map, tree);
        let bodies = match shape {
            Rigidity::Rigid if !map.polygon_roots.is_empty() => {
                Bodies::find(map, touches.iter().map(|touch| (touch.vertex, touch.segment)))
            }
            _ => Bodies::default(),
        };
        let touching = touches.iter().map(|touch| (touch.vertex, touch.segment)).collect();
        touches.retain(|touch| bodies.number_at(touch.vertex).is_none());
        Constraints { junctions: Junctions::new(touches), bodies, touching }
    }
}
