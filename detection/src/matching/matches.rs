//! Which suspect vertex is which reference vertex.

use meshmark_core::ground::Ground;

/// The suspect vertex of every reference vertex, and how many have one.
#[derive(Debug, Clone, PartialEq)]
pub struct Matches {
    /// For every reference vertex the index of its suspect vertex.
    pub suspect_of: Vec<Option<u32>>,
    /// How many reference vertices have one.
    pub count: usize,
}

impl Matches {
    /// The displacement of every reference vertex, metres; `None` where no suspect vertex matches. `moved` are the
    /// suspect's vertices in reference coordinates.
    pub fn displacements_m(
        &self,
        reference: &[[f64; 2]],
        moved: &[[f64; 2]],
        ground: &Ground,
    ) -> Vec<Option<[f64; 2]>> {
        let pairs = reference.iter().zip(&self.suspect_of);
        pairs.map(|(r, s)| s.map(|s| ground.metres_between(*r, moved[s as usize]))).collect()
    }

    /// Drops the matches of other reference vertices.
    pub fn keep(&mut self, wanted: impl Fn(usize) -> bool) {
        for (vertex, suspect) in self.suspect_of.iter_mut().enumerate() {
            *suspect = suspect.filter(|_| wanted(vertex));
        }
        self.count = self.suspect_of.iter().flatten().count();
    }
}
