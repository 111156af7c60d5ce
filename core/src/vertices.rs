//! The vertices of a map in canonical order: the one numbering that embedding and detection share.

use crate::{Error, Result, hex};
use sha2::{Digest, Sha256};

/// Distinct vertices, sorted by x and then y, so that nothing depends on the order of features in
/// a file. Exact duplicates are one vertex: shared walls move together (paper, section 3.1).
#[derive(Debug, Clone, PartialEq)]
pub struct VertexTable {
    coords: Vec<[f64; 2]>,
}

/// A map is at most this wide, CRS units.
pub const WIDEST: f64 = 1e30;

impl VertexTable {
    /// Sorts and merges `coords` (any order, duplicates allowed; CRS units). −0.0 counts as 0.0.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for NaN or infinite coordinates, [`Error::TooWide`] past 1e30 units.
    pub fn new(coords: Vec<[f64; 2]>) -> Result<Self> {
        Ok(Self::indexed(coords)?.0)
    }

    /// Does the same as [`Self::new`], and returns the canonical index of the vertex of each of
    /// `coords`.
    ///
    /// # Errors
    /// Returns the errors of [`Self::new`].
    pub fn indexed(coords: Vec<[f64; 2]>) -> Result<(Self, Vec<u32>)> {
        if let Some(index) = coords.iter().position(|p| !p[0].is_finite() || !p[1].is_finite()) {
            let [x, y] = coords[index];
            return Err(Error::NotFinite { index, x, y });
        }
        let mut sorted: Vec<([f64; 2], u32)> = Vec::with_capacity(coords.len());
        let places = (0..coords.len() as u32).rev();
        sorted.extend(FromEnd(coords).map(canonical).zip(places));
        // Hosts may fork between two jobs, and a map is read outside the job's own threads: a parallel
        // sort would start rayon's, which never end and which a child process lacks.
        sorted.sort_unstable_by(|a, b| order(&b.0, &a.0));
        let mut indices = vec![0; sorted.len()];
        let mut coords: Vec<[f64; 2]> = Vec::new();
        for (point, place) in FromEnd(sorted) {
            if coords.last() != Some(&point) {
                coords.push(point);
            }
            indices[place as usize] = coords.len() as u32 - 1;
        }
        coords.shrink_to_fit();
        let table = VertexTable { coords };
        let (min, max) = table.bounds();
        let span = (max[0] - min[0]).max(max[1] - min[1]);
        if span > WIDEST {
            return Err(Error::TooWide { span });
        }
        Ok((table, indices))
    }

    /// Returns the vertices in canonical order, CRS units.
    pub fn coords(&self) -> &[[f64; 2]] {
        &self.coords
    }

    /// Returns how many distinct vertices there are.
    pub fn len(&self) -> usize {
        self.coords.len()
    }

    /// Returns whether the map has no vertex at all.
    pub fn is_empty(&self) -> bool {
        self.coords.is_empty()
    }

    /// Returns the canonical index of the vertex with exactly these coordinates.
    pub fn index_of(&self, point: [f64; 2]) -> Option<usize> {
        self.coords.binary_search_by(|p| order(p, &canonical(point))).ok()
    }

    /// Returns the corners of the bounding box, lower left and upper right; zeros when empty.
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        let Some(&first) = self.coords.first() else { return ([0.0; 2], [0.0; 2]) };
        self.coords.iter().fold((first, first), |(min, max), p| {
            ([min[0].min(p[0]), min[1].min(p[1])], [max[0].max(p[0]), max[1].max(p[1])])
        })
    }

    /// Returns the middle of the bounding box, CRS units.
    pub fn centre(&self) -> [f64; 2] {
        let (min, max) = self.bounds();
        [min[0] + (max[0] - min[0]) / 2.0, min[1] + (max[1] - min[1]) / 2.0]
    }

    /// Returns coordinates relative to the middle of the map, x multiplied by `x_scale`; mesh and
    /// patches are built on them. Without the shift, triangulating EPSG:3857 coordinates loses
    /// vertices.
    pub fn local(&self, x_scale: f64) -> Vec<[f64; 2]> {
        let [x0, y0] = self.centre();
        self.coords.iter().map(|[x, y]| [(x - x0) * x_scale, y - y0]).collect()
    }

    /// Returns the SHA-256 of the canonical vertices (x then y, 64-bit IEEE, little endian) in
    /// hexadecimal, which binds a record to its reference map.
    pub fn digest(&self) -> String {
        hex::encode(&self.sha256())
    }

    /// Returns the bytes of [`Self::digest`].
    pub fn sha256(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        for [x, y] in &self.coords {
            hash.update(x.to_le_bytes());
            hash.update(y.to_le_bytes());
        }
        hash.finalize().into()
    }
}

/// The items of a large vector from the last to the first. Their memory is released on the way, so
/// that what is made of them takes its place.
struct FromEnd<T>(Vec<T>);

impl<T> Iterator for FromEnd<T> {
    type Item = T;
    fn next(&mut self) -> Option<T> {
        const BLOCK: usize = 1 << 20;
        if self.0.len().is_multiple_of(BLOCK) {
            self.0.shrink_to_fit();
        }
        self.0.pop()
    }
}

fn canonical([x, y]: [f64; 2]) -> [f64; 2] {
    [x + 0.0, y + 0.0] // −0.0 + 0.0 is 0.0
}

fn order(a: &[f64; 2], b: &[f64; 2]) -> std::cmp::Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn duplicates_and_negative_zero_are_one_vertex() {
        let table = VertexTable::new(vec![[1.0, 2.0], [0.0, -0.0], [-0.0, 0.0], [1.0, 2.0]]).unwrap();
        assert_eq!(table.coords(), [[0.0, 0.0], [1.0, 2.0]]);
        assert_eq!(table.index_of([-0.0, 0.0]), Some(0));
        assert_eq!(table.index_of([1.0, 2.5]), None);
    }

    #[test]
    fn every_occurrence_knows_its_vertex() {
        let coords = vec![[1.0, 2.0], [0.0, -0.0], [-0.0, 0.0], [1.0, 2.0], [1.0, -3.0]];
        let (table, indices) = VertexTable::indexed(coords.clone()).unwrap();
        assert_eq!(indices, [2, 0, 0, 2, 1]);
        assert!(coords.iter().zip(&indices).all(|(p, &i)| table.index_of(*p) == Some(i as usize)));
    }

    #[test]
    fn nan_is_an_error_that_says_where() {
        let error = VertexTable::new(vec![[0.0, 0.0], [f64::NAN, 1.0]]).unwrap_err();
        assert!(matches!(error, Error::NotFinite { index: 1, .. }));
    }

    #[test]
    fn the_digest_depends_on_every_coordinate_but_not_on_order() {
        let digest = |coords: Vec<[f64; 2]>| VertexTable::new(coords).unwrap().digest();
        assert_eq!(digest(vec![[0.0, 1.0], [2.0, 3.0]]), digest(vec![[2.0, 3.0], [0.0, 1.0]]));
        assert_ne!(digest(vec![[0.0, 1.0], [2.0, 3.0]]), digest(vec![[0.0, 1.0], [2.0, 3.0000000001]]));
    }
}
