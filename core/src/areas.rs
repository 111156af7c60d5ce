//! The polygons of a map, feature by feature, as references to its vertices: a few bytes for every
//! vertex of a ring.

/// The kind of a chain of coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChainKind {
    /// A line, or a point.
    Line,
    /// The outer ring of a polygon; its first vertex is repeated at the end.
    Shell,
    /// An inner ring of the preceding polygon; its first vertex is repeated at the end.
    Hole,
}

/// The polygons of every feature that has one.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Areas {
    /// The vertices of all rings; the first one of a ring is not repeated at its end.
    vertices: Vec<u32>,
    /// The index in `vertices` where each ring ends, ascending.
    ends: Vec<u32>,
    /// Whether each ring is a hole.
    holes: Vec<bool>,
    /// The number of the ring after the last one of each feature, ascending.
    features: Vec<u32>,
}

/// A ring of a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring<'a> {
    /// Its vertices in order, as canonical indices.
    pub vertices: &'a [u32],
    /// Whether it is a hole.
    pub is_hole: bool,
}

impl Areas {
    /// Collects the polygons of features. `indices` holds the vertex of every coordinate, `starts`
    /// the index of the start of each chain, and `firsts` the number of the first chain of each
    /// feature, all ascending.
    pub fn new(
        indices: &[u32],
        starts: &[u32],
        kinds: impl IntoIterator<Item = ChainKind>,
        firsts: &[u32],
    ) -> Self {
        let mut areas = Areas::default();
        let mut firsts = firsts.iter().copied().peekable();
        for (number, (&start, kind)) in starts.iter().zip(kinds).enumerate() {
            while firsts.next_if(|&first| first as usize <= number).is_some() {
                areas.end_feature();
            }
            let end = starts.get(number + 1).map_or(indices.len(), |&next| next as usize);
            if kind != ChainKind::Line {
                let closing = end.saturating_sub(1).max(start as usize);
                areas.vertices.extend(&indices[start as usize..closing]);
                areas.ends.push(areas.vertices.len() as u32);
                areas.holes.push(kind == ChainKind::Hole);
            }
        }
        areas.end_feature();
        areas
    }

    /// Returns the rings of every feature.
    pub fn features(&self) -> impl Iterator<Item = impl Iterator<Item = Ring<'_>>> {
        let first = |feature: usize| feature.checked_sub(1).map_or(0, |before| self.features[before]);
        (0..self.features.len())
            .map(move |feature| (first(feature)..self.features[feature]).map(|ring| self.ring(ring as usize)))
    }

    fn ring(&self, ring: usize) -> Ring<'_> {
        let start = ring.checked_sub(1).map_or(0, |before| self.ends[before]);
        let vertices = &self.vertices[start as usize..self.ends[ring] as usize];
        Ring { vertices, is_hole: self.holes[ring] }
    }

    fn end_feature(&mut self) {
        let rings = self.ends.len() as u32;
        if self.features.last().copied().unwrap_or(0) < rings {
            self.features.push(rings);
        }
    }

    /// Returns the same polygons on other vertices: `indices` holds the new one of every vertex.
    pub(crate) fn on(mut self, indices: &[u32]) -> Self {
        self.vertices.iter_mut().for_each(|vertex| *vertex = indices[*vertex as usize]);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_are_kept_by_feature_and_lines_are_not() {
        use ChainKind::{Hole, Line, Shell};
        // Features: a line; a triangle with a hole and a second triangle; nothing; a point; a triangle.
        let indices = [8, 9, 3, 4, 5, 3, 0, 1, 2, 0, 5, 6, 7, 5, 9, 9, 10, 11, 9];
        let kinds = [Line, Shell, Hole, Shell, Line, Shell];
        let areas = Areas::new(&indices, &[0, 2, 6, 10, 14, 15], kinds, &[0, 1, 4, 4, 5]);
        let ring = |vertices, is_hole| Ring { vertices, is_hole };
        let features: Vec<Vec<Ring>> = areas.features().map(Iterator::collect).collect();
        assert_eq!(
            features,
            [
                vec![ring(&[3, 4, 5], false), ring(&[0, 1, 2], true), ring(&[5, 6, 7], false)],
                vec![ring(&[9, 10, 11], false)]
            ]
        );
        assert_eq!(Areas::new(&[], &[], [], &[]), Areas::default());
    }
}
