//! The correspondence of suspect vertices and reference vertices.

use meshmark_core::ground::Ground;

/// The suspect vertex of every reference vertex, and the number of matches.
#[derive(Debug, Clone, PartialEq)]
pub struct Matches {
    /// The index of the suspect vertex of every reference vertex.
    pub suspect_of: Vec<Option<u32>>,
    /// Number of reference vertices with a match.
    pub count: usize,
}

impl Matches {
    /// Returns the displacement of every reference vertex, metres; `None` where no suspect vertex
    /// matches. `moved` are the vertices of the suspect in reference coordinates.
    pub fn displacements_m(
        &self,
        reference: &[[f64; 2]],
        moved: &[[f64; 2]],
        ground: &Ground,
    ) -> Vec<Option<[f64; 2]>> {
        let pairs = reference.iter().zip(&self.suspect_of);
        pairs.map(|(r, s)| s.map(|s| ground.metres_between(*r, moved[s as usize]))).collect()
    }

    /// Drops the matches of all reference vertices that `wanted` rejects.
    pub(crate) fn keep(&mut self, wanted: impl Fn(usize) -> bool) {
        for (vertex, suspect) in self.suspect_of.iter_mut().enumerate() {
            *suspect = suspect.filter(|_| wanted(vertex));
        }
        self.count = self.suspect_of.iter().flatten().count();
    }
}
