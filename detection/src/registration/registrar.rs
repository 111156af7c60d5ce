//! Brings suspects onto one reference.

use crate::matching::Matcher;
use meshmark_core::{ground::Ground, map_data::MapData};

/// Reference vertices used while refining; more would not make it better.
const SAMPLE: usize = 20_000;

/// A reference that suspects are brought onto.
pub struct Registrar<'a> {
    pub(super) matcher: Matcher<'a>,
    pub(super) reference: &'a MapData,
    pub(super) ground: &'a Ground,
    pub(super) radius_m: f64,
}

impl<'a> Registrar<'a> {
    /// `radius_m` is the matching radius t.
    pub fn new(reference: &'a MapData, ground: &'a Ground, radius_m: f64) -> Self {
        let vertices = &reference.vertices;
        let matcher = Matcher::new(vertices.coords(), ground, vertices.centre());
        Registrar { matcher, reference, ground, radius_m }
    }

    /// Metres per CRS unit in the middle of the reference.
    pub(super) fn unit(&self) -> [f64; 2] {
        self.ground.metres_per_unit(self.reference.vertices.centre())
    }

    /// A centimetre in CRS units.
    pub(super) fn centimetre(&self) -> f64 {
        0.01 / self.unit()[0].max(self.unit()[1])
    }

    /// Every how many-th reference vertex is used while refining.
    pub(super) fn step(&self) -> usize {
        self.reference.vertices.len().div_ceil(SAMPLE).max(1)
    }
}
