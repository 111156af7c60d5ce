//! The coordinates of geometries as chains: rings, lines and points, one after the other.

use crate::wkb::Step;
use meshmark_core::disjoint_sets::DisjointSets;
use std::{collections::BTreeMap, ops::Range};

/// Coordinates of rings, lines and points, one after the other.
#[derive(Clone, Default)]
pub(crate) struct Chains {
    pub(crate) coords: Vec<[f64; 2]>,
    /// The index in `coords` where each of them starts, ascending.
    pub(crate) starts: Vec<u32>,
    /// The kind of each of them.
    pub(crate) kinds: Vec<Step>,
    /// The number of the first of them in each geometry, ascending.
    pub(crate) firsts: Vec<u32>,
    /// The geometries that their chains do not describe completely, by their numbers.
    pub(crate) others: BTreeMap<u32, Vec<u8>>,
}

impl Chains {
    pub(crate) fn begin_geometry(&mut self) {
        self.firsts.push(self.starts.len() as u32);
    }

    pub(crate) fn push(&mut self, step: Step, point: [f64; 2]) {
        if step != Step::Next {
            self.starts.push(self.coords.len() as u32);
            self.kinds.push(step);
        }
        self.coords.push(point);
    }

    pub(crate) fn append(&mut self, other: &mut Chains) {
        let (of_starts, offset) = (self.starts.len() as u32, self.coords.len() as u32);
        let geometries = self.firsts.len() as u32;
        let others = std::mem::take(&mut other.others);
        self.others.extend(others.into_iter().map(|(number, wkb)| (number + geometries, wkb)));
        self.firsts.extend(other.firsts.drain(..).map(|first| first + of_starts));
        self.starts.extend(other.starts.drain(..).map(|start| start + offset));
        self.coords.append(&mut other.coords);
        self.kinds.append(&mut other.kinds);
    }

    /// Returns the range of each chain in `coords`.
    fn ranges(&self, coords: usize) -> impl Iterator<Item = Range<usize>> {
        let ends = self.starts.iter().skip(1).map(|&start| start as usize).chain([coords]);
        self.starts.iter().zip(ends).map(|(&start, end)| start as usize..end)
    }

    /// Returns the pairs of consecutive vertices; `indices` holds the vertex of every coordinate.
    pub(crate) fn segments(&self, indices: &[u32]) -> Vec<[u32; 2]> {
        let mut segments: Vec<[u32; 2]> = self
            .ranges(indices.len())
            .flat_map(|chain| indices[chain].windows(2))
            .filter(|pair| pair[0] != pair[1])
            .map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])])
            .collect();
        segments.sort_unstable();
        segments.dedup();
        segments.shrink_to_fit();
        segments
    }

    /// Joins the vertices of every polygon, with its holes, and returns, for each of `vertices` vertices, the
    /// first one of its polygon group.
    pub(crate) fn polygon_roots(&self, indices: &[u32], vertices: usize) -> Vec<u32> {
        let mut joined = DisjointSets::new(vertices);
        let mut shell = 0;
        for (chain, kind) in self.ranges(indices.len()).zip(&self.kinds) {
            match kind {
                Step::Shell => shell = indices[chain.start],
                Step::Hole => {}
                Step::First | Step::Next => continue,
            }
            indices[chain].iter().for_each(|&v| joined.join(v, shell));
        }
        joined.roots()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_join_neighbours_of_a_chain_once_and_no_vertex_with_itself() {
        // A triangle 0 1 2 0, a line 2 1 1 3 along one of its sides, a point 4.
        let indices = [0, 1, 2, 0, 2, 1, 1, 3, 4];
        let chains = Chains { starts: vec![0, 4, 8], ..Chains::default() };
        assert_eq!(chains.segments(&indices), [[0, 1], [0, 2], [1, 2], [1, 3]]);
        assert_eq!(Chains::default().segments(&[]), Vec::<[u32; 2]>::new());
    }

    #[test]
    fn polygons_are_joined_by_shared_vertices_and_to_their_holes_but_not_by_lines() {
        // A polygon 3 4 5 with the hole 0 1 2, its neighbour 5 6 7, a line from 7 to 8, a polygon 9 10 11.
        let indices = [3, 4, 5, 3, 0, 1, 2, 0, 5, 6, 7, 5, 7, 8, 9, 10, 11, 9];
        let kinds = vec![Step::Shell, Step::Hole, Step::Shell, Step::First, Step::Shell];
        let chains = Chains { starts: vec![0, 4, 8, 12, 14], kinds, ..Chains::default() };
        assert_eq!(chains.polygon_roots(&indices, 12), [0, 0, 0, 0, 0, 0, 0, 0, 8, 9, 9, 9]);
    }
}
