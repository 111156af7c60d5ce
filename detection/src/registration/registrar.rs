//! The reference side of a registration.

use crate::matching::Matcher;
use meshmark_core::{ground::Ground, map_data::MapData};

/// Number of reference vertices used for refinement; more do not improve it.
const SAMPLE: usize = 20_000;

/// A reference onto which suspects are registered.
pub struct Registrar<'a> {
    pub(super) matcher: Matcher<'a>,
    pub(super) reference: &'a MapData,
    pub(super) ground: &'a Ground,
    pub(super) radius_m: f64,
}

impl<'a> Registrar<'a> {
    /// Prepares a reference; `radius_m` is the matching radius t, metres.
    pub fn new(reference: &'a MapData, ground: &'a Ground, radius_m: f64) -> Self {
        let vertices = &reference.vertices;
        let matcher = Matcher::new(vertices.coords(), ground, vertices.centre());
        Registrar { matcher, reference, ground, radius_m }
    }

    /// Returns the metres per CRS unit in the middle of the reference.
    pub(super) fn unit(&self) -> [f64; 2] {
        self.ground.metres_per_unit(self.reference.vertices.centre())
    }

    /// Returns a centimetre in CRS units.
    pub(super) fn centimetre(&self) -> f64 {
        0.01 / self.unit()[0].max(self.unit()[1])
    }

    /// Returns the step of the sample: refinement uses every `step`-th reference vertex.
    pub(super) fn step(&self) -> usize {
        self.reference.vertices.len().div_ceil(SAMPLE).max(1)
    }
}
