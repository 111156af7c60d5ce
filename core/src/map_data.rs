//! The data of a map as numbers, which reading creates and which marking and detection use.

pub use crate::areas::ChainKind;

use crate::{
    Error, Result, areas::Areas, disjoint_sets::DisjointSets, ground::Ground, map::Map, vertices::VertexTable,
};

/// A map without its file.
#[derive(Debug, Clone)]
pub struct MapData {
    /// The distinct vertices.
    pub vertices: VertexTable,
    /// The vertices that rings and lines join, as canonical indices [a, b] with a < b, sorted, each
    /// pair once.
    pub segments: Vec<[u32; 2]>,
    /// For every vertex the first vertex of its polygon group, which shared vertices join; the
    /// vertex itself when it is in no group.
    pub polygon_roots: Vec<u32>,
    /// The polygons by feature, for a reference.
    pub areas: Areas,
    /// Attribute texts with their places.
    pub labels: Vec<Label>,
    /// Rings and lines with enough vertices to be distinctive.
    pub polylines: Vec<Polyline>,
}

/// An attribute value of a feature with its place: a landmark, where another map has an equal
/// value.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// The value: a string, or an integer in decimal.
    pub value: String,
    /// The place, CRS units.
    pub point: [f64; 2],
    /// The kind of place.
    pub dimension: Dimension,
}

/// The kind of place of a label. Lines are the least certain, as edits cut and merge them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// The point itself.
    Point,
    /// The centroid by length.
    Line,
    /// The centroid by area.
    Area,
}

/// The outer ring of a polygon, or a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    /// Vertices in order, CRS units; the first one is not repeated at the end of a ring.
    pub vertices: Vec<[f64; 2]>,
    /// Whether it is a ring.
    pub closed: bool,
}

impl Polyline {
    /// The least number of vertices that makes a ring or line distinctive under an affine map.
    pub const LEAST_VERTICES: usize = 5;
}

impl MapData {
    /// Creates a map without areas, labels and polylines from coordinates, CRS units, chain after chain.
    /// `starts` holds the ascending index in `coords` of the start of each chain, and the kinds
    /// describe the chains. Also returns the canonical index of the vertex of every coordinate.
    ///
    /// # Errors
    /// Fails on coordinates that are not finite, and on too many coordinates.
    pub fn from_chains(
        coords: Vec<[f64; 2]>,
        starts: &[u32],
        kinds: impl IntoIterator<Item = ChainKind>,
    ) -> Result<(Self, Vec<u32>)> {
        let (vertices, indices) = VertexTable::indexed(coords)?;
        let polygon_roots = polygon_roots(&indices, starts, kinds, vertices.len());
        let segments = segments(&indices, starts);
        Ok((MapData { segments, polygon_roots, ..Self::of_points(vertices) }, indices))
    }

    /// Creates a map of points alone.
    pub fn of_points(vertices: VertexTable) -> Self {
        let polygon_roots = (0..vertices.len() as u32).collect();
        MapData {
            vertices,
            segments: Vec::new(),
            polygon_roots,
            areas: Areas::default(),
            labels: Vec::new(),
            polylines: Vec::new(),
        }
    }

    /// Returns the same map with all coordinates transformed by `place`, for example into another
    /// CRS. Coincident vertices become one.
    ///
    /// # Errors
    /// Returns the errors of `place` and of [`MapData::from_chains`].
    pub fn moved<E: From<Error>>(
        &self,
        place: impl Fn(Vec<[f64; 2]>) -> std::result::Result<Vec<[f64; 2]>, E>,
    ) -> std::result::Result<Self, E> {
        let (vertices, indices) = VertexTable::indexed(place(self.vertices.coords().to_vec())?)?;
        let moved = self.segments.iter().map(|segment| segment.map(|v| indices[v as usize]));
        let segments = distinct(moved);
        let mut joined = DisjointSets::new(vertices.len());
        indices
            .iter()
            .zip(&self.polygon_roots)
            .for_each(|(&v, &first)| joined.join(v, indices[first as usize]));
        let (mut labels, mut polylines) = (self.labels.clone(), self.polylines.clone());
        let of_labels = place(labels.iter().map(|label| label.point).collect())?;
        labels.iter_mut().zip(of_labels).for_each(|(label, point)| label.point = point);
        let of_polylines = polylines.iter().flat_map(|polyline| polyline.vertices.iter().copied()).collect();
        let in_polylines = polylines.iter_mut().flat_map(|polyline| &mut polyline.vertices);
        in_polylines.zip(place(of_polylines)?).for_each(|(vertex, point)| *vertex = point);
        let areas = self.areas.clone().on(&indices);
        Ok(MapData { vertices, segments, polygon_roots: joined.roots(), areas, labels, polylines })
    }

    /// Returns the map with the vertices of earlier editions besides its own, and with the segments
    /// and polygon groups of those that it lacks.
    ///
    /// # Errors
    /// [`Error::TooWide`].
    pub fn with_earlier(&self, earlier: &[&MapData]) -> Result<Self> {
        let all = std::iter::once(self).chain(earlier.iter().copied());
        let coords = all.clone().flat_map(|map| map.vertices.coords().iter().copied()).collect();
        let (vertices, indices) = VertexTable::indexed(coords)?;
        let own = &indices[..self.vertices.len()];
        let mut is_own = vec![false; vertices.len()];
        own.iter().for_each(|&v| is_own[v as usize] = true);
        let (mut segments, mut joined) = (Vec::new(), DisjointSets::new(vertices.len()));
        let mut first = 0;
        for (number, map) in all.enumerate() {
            let on_all = &indices[first..first + map.vertices.len()];
            first += on_all.len();
            let counts = |v: u32| number == 0 || !is_own[v as usize];
            let placed = map.segments.iter().map(|segment| segment.map(|v| on_all[v as usize]));
            segments.extend(placed.filter(|&[a, b]| counts(a) || counts(b)));
            // A group of which the map has vertices may be another one there.
            let mut firsts = vec![None; on_all.len()];
            for (&v, &root) in on_all.iter().zip(&map.polygon_roots).filter(|(v, _)| counts(**v)) {
                joined.join(v, *firsts[root as usize].get_or_insert(v));
            }
        }
        let areas = self.areas.clone().on(own);
        let (labels, polylines) = (self.labels.clone(), self.polylines.clone());
        let segments = distinct(segments.into_iter());
        Ok(MapData { vertices, segments, polygon_roots: joined.roots(), areas, labels, polylines })
    }

    /// Releases segments and polygon groups, which only the marking of a map and the reading of its mark
    /// need.
    pub fn release_mesh(&mut self) {
        self.segments = Vec::new();
        self.polygon_roots = Vec::new();
    }

    /// Returns the map as input of the algorithm; `ground` has the metres of the mark, `measure`
    /// those of limits and figures.
    pub fn on<'a>(&'a self, ground: &'a Ground, measure: &'a Ground) -> Map<'a> {
        let MapData { vertices, segments, polygon_roots, .. } = self;
        Map { vertices, segments, polygon_roots, ground, measure }
    }
}

/// Returns the indices of each chain of coordinates.
fn chains<'a>(indices: &'a [u32], starts: &'a [u32]) -> impl Iterator<Item = &'a [u32]> {
    let ends = starts.iter().skip(1).map(|&start| start as usize).chain([indices.len()]);
    starts.iter().zip(ends).map(|(&start, end)| &indices[start as usize..end])
}

fn segments(indices: &[u32], starts: &[u32]) -> Vec<[u32; 2]> {
    distinct(chains(indices, starts).flat_map(|chain| chain.windows(2)).map(|pair| [pair[0], pair[1]]))
}

/// Returns segments with their two vertices in canonical order, each once.
fn distinct(segments: impl Iterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
    let segments = segments.filter(|[a, b]| a != b).map(|[a, b]| [a.min(b), a.max(b)]);
    let mut segments: Vec<[u32; 2]> = segments.collect();
    segments.sort_unstable();
    segments.dedup();
    segments.shrink_to_fit();
    segments
}

/// Joins the vertices of every polygon, holes included. Returns for each of `vertices` vertices the
/// first one that it is joined to.
fn polygon_roots(
    indices: &[u32],
    starts: &[u32],
    kinds: impl IntoIterator<Item = ChainKind>,
    vertices: usize,
) -> Vec<u32> {
    let mut joined = DisjointSets::new(vertices);
    let mut shell = 0;
    for (chain, kind) in chains(indices, starts).zip(kinds) {
        match kind {
            ChainKind::Shell => shell = chain[0],
            ChainKind::Hole => {}
            ChainKind::Line => continue,
        }
        chain.iter().for_each(|&v| joined.join(v, shell));
    }
    joined.roots()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_join_neighbours_of_a_chain_once_and_no_vertex_with_itself() {
        // The chains are a triangle 0 1 2 0, a line 2 1 1 3 along one of its sides, and a point 4.
        let indices = [0, 1, 2, 0, 2, 1, 1, 3, 4];
        assert_eq!(segments(&indices, &[0, 4, 8]), [[0, 1], [0, 2], [1, 2], [1, 3]]);
        assert_eq!(segments(&[], &[]), Vec::<[u32; 2]>::new());
    }

    #[test]
    fn polygons_are_joined_by_shared_vertices_and_to_their_holes_but_not_by_lines() {
        use ChainKind::{Hole, Line, Shell};
        // The chains are a polygon 3 4 5 with the hole 0 1 2, its neighbour 5 6 7, a line from 7 to
        // 8, and a polygon 9 10 11.
        let indices = [3, 4, 5, 3, 0, 1, 2, 0, 5, 6, 7, 5, 7, 8, 9, 10, 11, 9];
        let kinds = [Shell, Hole, Shell, Line, Shell];
        assert_eq!(
            polygon_roots(&indices, &[0, 4, 8, 12, 14], kinds, 12),
            [0, 0, 0, 0, 0, 0, 0, 0, 8, 9, 9, 9]
        );
    }

    #[test]
    fn earlier_editions_add_the_vertices_that_are_gone_and_their_lines() {
        let ring = |corners: [[f64; 2]; 3]| {
            let [a, b, c] = corners;
            MapData::from_chains(vec![a, b, c, a], &[0], [ChainKind::Shell]).unwrap().0
        };
        let newest = ring([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]);
        let earlier = ring([[0.0, 0.0], [1.0, 0.0], [2.0, 2.0]]);
        let all = newest.with_earlier(&[&earlier]).unwrap();
        assert_eq!(all.vertices.coords(), [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0]]);
        // That from 0 to 3 is in both, and all of the earlier edition are at the vertex that is gone.
        assert_eq!(all.segments, [[0, 1], [0, 2], [0, 3], [1, 3], [2, 3]]);
        assert_eq!(all.polygon_roots, [0, 1, 0, 0]);
        let again = newest.with_earlier(&[]).unwrap();
        assert_eq!((again.vertices, again.segments), (newest.vertices, newest.segments));
    }

    #[test]
    fn vertices_that_fall_together_become_one() {
        let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let (map, _) = MapData::from_chains(square, &[0], [ChainKind::Shell]).unwrap();
        let flat = map.moved::<Error>(|places| Ok(places.iter().map(|p| [p[0], 0.0]).collect())).unwrap();
        assert_eq!((flat.vertices.len(), flat.segments, flat.polygon_roots), (2, vec![[0, 1]], vec![0, 0]));
    }
}
