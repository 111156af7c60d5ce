//! What a map is as numbers: what reading fills, and marking and detection use.

use crate::{
    Error, Result, disjoint_sets::DisjointSets, ground::Ground, map::Map, scale::ScaleLattice,
    vertices::VertexTable,
};

/// A map without its file.
#[derive(Debug, Clone)]
pub struct MapData {
    /// Its distinct vertices.
    pub vertices: VertexTable,
    /// The vertices that rings and lines join, as canonical indices [a, b] with a < b, sorted, each pair once.
    pub segments: Vec<[u32; 2]>,
    /// Of every vertex the first vertex of its polygon group, the polygons that shared vertices join; itself when it is in
    /// none.
    pub polygon_roots: Vec<u32>,
    /// Attribute texts and their places.
    pub labels: Vec<Label>,
    /// Rings and lines that have a form of their own.
    pub polylines: Vec<Polyline>,
}

/// What a chain of coordinates is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChainKind {
    /// A line, or a point.
    Line,
    /// The outer ring of a polygon; its first vertex is repeated at the end.
    Shell,
    /// An inner ring of the polygon before; its first vertex is repeated at the end.
    Hole,
}

/// An attribute value of a feature and the feature's place: a landmark, where another map has the same value.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// A string, or an integer in decimal.
    pub value: String,
    /// CRS units.
    pub point: [f64; 2],
    /// What the point is of.
    pub dimension: Dimension,
}

/// What kind of place a label has. Lines are the least certain: they are cut and merged by others.
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
    /// A ring or a line of fewer vertices cannot be told from others under an affine map.
    pub const LEAST_VERTICES: usize = 5;
}

impl MapData {
    /// A map without labels and polylines from its coordinates, CRS units, chain after chain: where each chain starts in
    /// `coords`, ascending, and what it is. Also the canonical index of the vertex of every coordinate.
    ///
    /// # Errors
    /// Coordinates that are not finite, or too many.
    pub fn from_chains(
        coords: Vec<[f64; 2]>,
        starts: &[u32],
        kinds: impl IntoIterator<Item = ChainKind>,
    ) -> Result<(Self, Vec<u32>)> {
        let (vertices, indices) = VertexTable::indexed(coords)?;
        let segments = segments(&indices, starts);
        let polygon_roots = polygon_roots(&indices, starts, kinds, vertices.len());
        let (labels, polylines) = (Vec::new(), Vec::new());
        Ok((MapData { vertices, segments, polygon_roots, labels, polylines }, indices))
    }

    /// A map of points alone.
    pub fn of_points(vertices: VertexTable) -> Self {
        let polygon_roots = (0..vertices.len() as u32).collect();
        MapData { vertices, segments: Vec::new(), polygon_roots, labels: Vec::new(), polylines: Vec::new() }
    }

    /// The same map with all its coordinates taken elsewhere, for example into another CRS, by `place`. Vertices that fall
    /// together become one.
    ///
    /// # Errors
    /// Those of `place` and of [`MapData::from_chains`].
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
        Ok(MapData { vertices, segments, polygon_roots: joined.roots(), labels, polylines })
    }

    /// The map as the algorithm sees it.
    pub fn on<'a>(&'a self, ground: Ground, lattice: Option<&'a ScaleLattice>) -> Map<'a> {
        let MapData { vertices, segments, polygon_roots, .. } = self;
        Map { vertices, segments, polygon_roots, ground, lattice }
    }
}

/// Where each chain of coordinates begins and ends, by its index.
fn chains<'a>(indices: &'a [u32], starts: &'a [u32]) -> impl Iterator<Item = &'a [u32]> {
    let ends = starts.iter().skip(1).map(|&start| start as usize).chain([indices.len()]);
    starts.iter().zip(ends).map(|(&start, end)| &indices[start as usize..end])
}

fn segments(indices: &[u32], starts: &[u32]) -> Vec<[u32; 2]> {
    distinct(chains(indices, starts).flat_map(|chain| chain.windows(2)).map(|pair| [pair[0], pair[1]]))
}

/// Segments of two vertices in canonical order, each once.
fn distinct(segments: impl Iterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
    let segments = segments.filter(|[a, b]| a != b).map(|[a, b]| [a.min(b), a.max(b)]);
    let mut segments: Vec<[u32; 2]> = segments.collect();
    segments.sort_unstable();
    segments.dedup();
    segments.shrink_to_fit();
    segments
}

/// Joins the vertices of every polygon, holes and all: of each of `vertices` vertices the first one it is joined to.
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
        // A triangle 0 1 2 0, a line 2 1 1 3 along one of its sides, a point 4.
        let indices = [0, 1, 2, 0, 2, 1, 1, 3, 4];
        assert_eq!(segments(&indices, &[0, 4, 8]), [[0, 1], [0, 2], [1, 2], [1, 3]]);
        assert_eq!(segments(&[], &[]), Vec::<[u32; 2]>::new());
    }

    #[test]
    fn polygons_are_joined_by_shared_vertices_and_to_their_holes_but_not_by_lines() {
        use ChainKind::{Hole, Line, Shell};
        // A polygon 3 4 5 with the hole 0 1 2, its neighbour 5 6 7, a line from 7 to 8, a polygon 9 10 11.
        let indices = [3, 4, 5, 3, 0, 1, 2, 0, 5, 6, 7, 5, 7, 8, 9, 10, 11, 9];
        let kinds = [Shell, Hole, Shell, Line, Shell];
        assert_eq!(
            polygon_roots(&indices, &[0, 4, 8, 12, 14], kinds, 12),
            [0, 0, 0, 0, 0, 0, 0, 0, 8, 9, 9, 9]
        );
    }

    #[test]
    fn vertices_that_fall_together_become_one() {
        let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let (map, _) = MapData::from_chains(square, &[0], [ChainKind::Shell]).unwrap();
        let flat = map.moved::<Error>(|places| Ok(places.iter().map(|p| [p[0], 0.0]).collect())).unwrap();
        assert_eq!((flat.vertices.len(), flat.segments, flat.polygon_roots), (2, vec![[0, 1]], vec![0, 0]));
    }
}
