//! The two maps of a drawing.

use meshmark_core::deformation::Deformation;
use meshmark_detection::{Matched, matching::Matches};

/// The two maps after registration.
pub struct Scene<'a> {
    /// The registered suspect and its reference.
    pub matched: &'a Matched<'a>,
    /// The matches after tracking of the deformation.
    pub matches: &'a Matches,
    /// The deformation besides the mark, where it was estimated.
    pub deformation: Option<Deformation>,
    /// The weight of every reference vertex; none where nothing was demodulated.
    pub weights: &'a [f64],
    /// Whether the drawing may hold the exact displacement of a vertex.
    pub exact_displacements: bool,
}

impl Scene<'_> {
    /// Returns the vertices of the reference.
    pub fn coords(&self) -> &[[f64; 2]] {
        self.matched.reference.data.vertices.coords()
    }

    /// Returns the displacements of the matched vertices, metres on the ground.
    pub fn displacements_m(&self) -> Vec<Option<[f64; 2]>> {
        let ground = &self.matched.reference.ground;
        self.matches.displacements_m(self.coords(), &self.matched.moved, ground)
    }

    /// Returns the places of suspect vertices without a match.
    pub fn inserted(&self) -> Vec<[f64; 2]> {
        let moved = &self.matched.moved;
        let mut taken = vec![false; moved.len()];
        self.matches.suspect_of.iter().flatten().for_each(|v| taken[*v as usize] = true);
        moved.iter().zip(taken).filter(|(_, taken)| !taken).map(|(place, _)| *place).collect()
    }
}
