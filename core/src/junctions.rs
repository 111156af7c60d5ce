//! T-junctions: a vertex inside a segment hangs on it and moves with it.
//!
//! The constraint is linear, Δ_v = (1 − s) Δ_a + s Δ_b at the foot s of vertex v on segment ab, and
//! depends on the reference alone: the verifier repeats it, and no part of the mark is lost. (The
//! finite element method calls such a vertex a hanging node.)

use crate::{
    map::Map,
    nearness::{VertexTree, metres, nearest},
};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A vertex within this distance of a segment lies on it, metres on the ground: rounded coordinates
/// do not meet the segment exactly.
pub const JUNCTION_M: f64 = 0.02;

/// A hanging vertex keeps at most this share of its own movement; with more it hangs only on
/// itself.
const OWN_SHARE: f64 = 1.0 - 1e-6;

/// A vertex that moves as the weighted mean of others.
#[derive(Debug, Clone, PartialEq)]
pub struct Hanging {
    /// Its canonical index.
    pub vertex: u32,
    /// The free vertices it hangs on, ascending, with positive weights that add up to 1.
    pub anchors: Vec<(u32, f64)>,
}

/// All T-junctions of a map, in canonical order of the hanging vertices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Junctions {
    hanging: Vec<Hanging>,
}

impl Junctions {
    /// Hangs vertices on segments. A vertex on several segments hangs on the nearest one (the first
    /// of equally near ones); its displacement is resolved to free vertices.
    pub(crate) fn new(mut touches: Vec<Touch>) -> Self {
        touches.par_sort_unstable_by(Touch::order);
        touches.dedup_by_key(|touch| touch.vertex);
        Junctions { hanging: resolve(touches) }
    }

    /// Returns the hanging vertices, ascending.
    pub fn hanging(&self) -> &[Hanging] {
        &self.hanging
    }

    /// Returns what a vertex hangs on, if it hangs.
    pub fn hanging_at(&self, vertex: u32) -> Option<&Hanging> {
        self.hanging.binary_search_by_key(&vertex, |h| h.vertex).ok().map(|i| &self.hanging[i])
    }

    /// Moves the hanging vertices along with their anchors; `displacements` are those of all
    /// vertices, CRS units.
    pub fn follow(&self, displacements: &mut [[f64; 2]]) {
        for Hanging { vertex, anchors } in &self.hanging {
            displacements[*vertex as usize] = anchors.iter().fold([0.0; 2], |sum, &(anchor, weight)| {
                let moved = displacements[anchor as usize];
                [sum[0] + weight * moved[0], sum[1] + weight * moved[1]]
            });
        }
    }
}

/// A vertex on a segment.
pub(crate) struct Touch {
    pub vertex: u32,
    distance2: f64,
    pub segment: [u32; 2],
    share: f64,
}

impl Touch {
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let by_distance = self.distance2.total_cmp(&other.distance2);
        self.vertex.cmp(&other.vertex).then(by_distance).then(self.segment.cmp(&other.segment))
    }
}

/// Finds all vertices on segments; `tree` holds all vertices.
pub(crate) fn touches(map: &Map, tree: &VertexTree) -> Vec<Touch> {
    map.segments.par_iter().flat_map_iter(|&segment| touches_of(map, tree, segment)).collect()
}

fn touches_of(map: &Map, tree: &VertexTree, segment: [u32; 2]) -> Vec<Touch> {
    let [a, b] = segment.map(|end| map.at(end));
    let reach = reach(map, a, b);
    let touch = |vertex: u32| {
        let at = map.at(vertex);
        let scale = map.ground.metres_per_unit(at);
        let (distance2, share) = nearest(metres(a, at, scale), metres(a, b, scale));
        (distance2 <= JUNCTION_M * JUNCTION_M).then_some(Touch { vertex, distance2, segment, share })
    };
    tree.around(segment, reach).filter_map(touch).collect()
}

/// Returns [`JUNCTION_M`] in CRS units, at least as much as at any vertex near the segment.
fn reach(map: &Map, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let (p, q) = (map.ground.metres_per_unit(a), map.ground.metres_per_unit(b));
    [0, 1].map(|axis| 1.01 * JUNCTION_M / p[axis].min(q[axis]).max(1e-3))
}

type Row = BTreeMap<u32, f64>;

/// Resolves hanging vertices that hang on hanging vertices, or on each other (on a wall that two
/// houses share with different vertices on either side). Gaussian elimination in canonical order
/// leaves only free vertices.
fn resolve(touches: Vec<Touch>) -> Vec<Hanging> {
    // Each row is in terms of later hanging vertices and of free ones.
    let mut rows: BTreeMap<u32, Row> = BTreeMap::new();
    for Touch { vertex, segment: [a, b], share, .. } in touches {
        let mut row = Row::new();
        let ends = [(a, 1.0 - share), (b, share)];
        ends.into_iter()
            .filter(|(_, weight)| *weight > 0.0)
            .for_each(|(end, weight)| add(&mut row, end, weight));
        rows.insert(vertex, row);
    }
    let order: Vec<u32> = rows.keys().copied().collect();
    for &vertex in &order {
        let mut row = rows.remove(&vertex).expect("a row for every hanging vertex");
        substitute(&mut row, |other| rows.get(&other).filter(|_| other < vertex));
        let own = row.remove(&vertex).unwrap_or(0.0);
        if own < OWN_SHARE {
            row.values_mut().for_each(|weight| *weight /= 1.0 - own);
            rows.insert(vertex, row);
        }
    }
    for &vertex in order.iter().rev() {
        let Some(mut row) = rows.remove(&vertex) else { continue };
        substitute(&mut row, |other| rows.get(&other).filter(|_| other > vertex));
        rows.insert(vertex, row);
    }
    let hanging = |(vertex, row): (u32, Row)| Hanging { vertex, anchors: row.into_iter().collect() };
    rows.into_iter().map(hanging).collect()
}

fn add(row: &mut Row, vertex: u32, weight: f64) {
    *row.entry(vertex).or_insert(0.0) += weight;
}

/// Replaces the vertices for which `row_of` has a row, and those that these rows bring in.
fn substitute<'a>(row: &mut Row, row_of: impl Fn(u32) -> Option<&'a Row>) {
    while let Some((vertex, known)) = row.keys().find_map(|&vertex| Some((vertex, row_of(vertex)?))) {
        let weight = row.remove(&vertex).expect("it is a key");
        known.iter().for_each(|(&other, share)| add(row, other, weight * share));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ground::Ground, vertices::VertexTable};

    /// Returns the junctions of segments between points, whose canonical indices must be their
    /// places.
    fn junctions(points: &[[f64; 2]], segments: &[[u32; 2]]) -> Vec<Hanging> {
        let vertices = VertexTable::new(points.to_vec()).unwrap();
        assert_eq!(vertices.coords(), points);
        let ground = Ground::METRES;
        let map = Map { segments, ..Map::of_points(&vertices, &ground) };
        Junctions::new(touches(&map, &VertexTree::of_all(&map))).hanging
    }

    fn hanging(vertex: u32, anchors: &[(u32, f64)]) -> Hanging {
        Hanging { vertex, anchors: anchors.to_vec() }
    }

    #[test]
    fn a_vertex_on_a_segment_hangs_there_and_one_beside_it_does_not() {
        let points = [[0.0, 0.0], [1.0, 0.01], [2.0, 0.5], [4.0, 0.0], [5.0, 0.0]];
        assert_eq!(junctions(&points, &[[0, 3]]), [hanging(1, &[(0, 0.75), (3, 0.25)])]);
    }

    #[test]
    fn vertices_of_a_wall_that_hang_on_each_other_hang_on_its_ends() {
        // 0–2 and 1–3 overlap: 2 is on 1–3, and 1 is on 0–2.
        let points = [[0.0, 0.0], [4.0, 0.0], [6.0, 0.0], [8.0, 0.0]];
        let found = junctions(&points, &[[0, 2], [1, 3]]);
        let expected = [hanging(1, &[(0, 0.5), (3, 0.5)]), hanging(2, &[(0, 0.25), (3, 0.75)])];
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found.vertex, expected.vertex);
            for (a, b) in found.anchors.iter().zip(&expected.anchors) {
                assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-12, "{found:?}");
            }
        }
        assert_eq!(found.len(), 2);
    }

    #[test]
    fn two_vertices_that_nearly_coincide_move_together() {
        let points = [[0.0, 0.0], [5.0, 0.0], [5.01, 0.0], [9.0, 3.0]];
        assert_eq!(junctions(&points, &[[0, 1], [2, 3]]), [hanging(1, &[(2, 1.0)])]);
    }
}
