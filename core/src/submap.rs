//! Some vertices of a map, as a map of their own.

use crate::{map::Map, vertices::VertexTable};
use std::collections::BTreeMap;

/// Vertices of a map, with segments and polygon groups among them.
pub(crate) struct Submap {
    /// The canonical indices of its vertices on the map, ascending.
    pub indices: Vec<u32>,
    vertices: VertexTable,
    segments: Vec<[u32; 2]>,
    polygon_roots: Vec<u32>,
}

impl Submap {
    /// Cuts the vertices of these indices, which ascend, out of a map, with those of the segments whose
    /// ends are both among them.
    pub fn new(map: &Map, indices: Vec<u32>, segments: impl Iterator<Item = [u32; 2]>) -> Self {
        let position = |v: u32| indices.binary_search(&v).ok().map(|position| position as u32);
        let mut segments: Vec<[u32; 2]> =
            segments.filter_map(|[a, b]| Some([position(a)?, position(b)?])).collect();
        segments.sort_unstable();
        segments.dedup();
        let coords = indices.iter().map(|&v| map.at(v)).collect();
        let vertices = VertexTable::new(coords).expect("they are vertices of a map");
        let mut firsts: BTreeMap<u32, u32> = BTreeMap::new();
        let root = |(own, &v): (u32, &u32)| {
            map.polygon_roots.get(v as usize).map_or(own, |&root| *firsts.entry(root).or_insert(own))
        };
        let polygon_roots = (0..).zip(&indices).map(root).collect();
        Submap { indices, vertices, segments, polygon_roots }
    }

    /// Returns how many vertices there are.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Returns it as a map on the ground of the map that it was cut out of.
    pub fn on<'a>(&'a self, map: &Map<'a>) -> Map<'a> {
        let Submap { vertices, segments, polygon_roots, .. } = self;
        Map { vertices, segments, polygon_roots, ..*map }
    }
}
