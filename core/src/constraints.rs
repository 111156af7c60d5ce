//! Constraints on the displacements of vertices: T-junctions and, with SHAPE=rigid or stiff,
//! bodies. All are linear in the displacements and follow from the reference alone: the verifier
//! repeats them.

use crate::{
    bodies::{Bodies, Body},
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
        Self::around(map, tree, shape, &[]).0
    }

    /// Finds the constraints on the vertices that do not stand, where others stand, and the bodies
    /// that have some of either.
    pub(crate) fn around(
        map: &Map,
        tree: &VertexTree,
        shape: Rigidity,
        stands: &[bool],
    ) -> (Self, Vec<Body>) {
        let mut touches = touches(map, tree);
        let found = match shape {
            Rigidity::Rigid | Rigidity::Stiff if !map.polygon_roots.is_empty() => {
                Bodies::find(map, touches.iter().map(|touch| (touch.vertex, touch.segment)))
            }
            _ => Bodies::default(),
        };
        let stands = |v: u32| stands.get(v as usize).is_some_and(|stands| *stands);
        touches.retain(|touch| !stands(touch.vertex));
        let touching = touches.iter().map(|touch| (touch.vertex, touch.segment)).collect();
        touches.retain(|touch| found.number_at(touch.vertex).is_none());
        let (bodies, torn) = found.divide(|body| body.members.iter().all(|&v| !stands(v)));
        let torn = torn.into_iter().filter(|body| !body.members.iter().all(|&v| stands(v))).collect();
        (Constraints { junctions: Junctions::new(touches), bodies, touching }, torn)
    }
}
