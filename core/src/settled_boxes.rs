//! A map in boxes after marking, put together box by box.

use crate::{
    boxes::{BoxMap, Boxes},
    series::Census,
    topology::Settled,
};

/// The vertices of all boxes after marking, and what is known of the boxes then.
#[derive(Clone)]
pub(crate) struct SettledBoxes {
    /// The new place of every vertex of the map, CRS units.
    coords: Vec<[f64; 2]>,
    attenuated: usize,
    /// The sum over all vertices of the squared deviation from what was wanted, square metres.
    deviation_m2: f64,
    /// Vertices that hang on a segment.
    pub hanging: usize,
    /// How the vertices are divided.
    pub census: Census,
    /// The number of patches of every box so far.
    pub patches: Vec<usize>,
    /// The score of the fingerprint on the first patches of every box.
    pub score: Score,
}

/// A box after marking.
pub(crate) struct SettledBox {
    /// All vertices of the box and of segments that pass through it.
    pub settled: Settled,
    pub hanging: usize,
    /// How they are divided.
    pub census: Census,
    pub patches: usize,
    pub score: Score,
}

impl SettledBoxes {
    /// Creates the result of no box yet.
    pub fn new(boxes: &Boxes) -> Self {
        SettledBoxes {
            coords: boxes.map().vertices.coords().to_vec(),
            attenuated: 0,
            deviation_m2: 0.0,
            hanging: 0,
            census: Census { standing: 0, anchored: 0, attached: 0, free: 0 },
            patches: Vec::with_capacity(boxes.len()),
            score: Score::default(),
        }
    }

    /// Adds the next box.
    pub fn add(&mut self, cut: &BoxMap, of_box: SettledBox) {
        let SettledBox { settled, hanging, census, patches, score } = of_box;
        let own = cut.submap.indices.iter().zip(&cut.is_own).zip(&settled.coords);
        for ((&v, _), to) in own.filter(|((_, is_own), _)| **is_own) {
            self.coords[v as usize] = *to;
        }
        self.attenuated += settled.attenuated;
        self.deviation_m2 += settled.deviation_m.powi(2) * settled.coords.len() as f64;
        self.hanging += hanging;
        // Those of other boxes are anchors.
        self.census.anchored += census.anchored - cut.is_own.iter().filter(|is_own| !**is_own).count();
        self.census.attached += census.attached;
        self.census.free += census.free;
        self.patches.push(patches);
        self.score = self.score.and(score);
    }

    /// Returns the marked map.
    pub fn settled(self) -> Settled {
        let deviation_m = (self.deviation_m2 / self.coords.len() as f64).sqrt();
        Settled { attenuated: self.attenuated, deviation_m, coords: self.coords }
    }
}

/// The score of a fingerprint on parts, of which evidence adds up.
#[derive(Clone, Copy, Default)]
pub(crate) struct Score {
    sum: f64,
    energy: f64,
}

impl Score {
    /// Creates the score of a part from the energy of its evidence, and from standard deviations.
    pub fn new(energy: f64, deviations: f64) -> Self {
        let weight = energy.sqrt();
        Score { sum: weight * deviations, energy: weight * weight }
    }

    /// Returns the score on these parts and others.
    pub fn and(self, other: Self) -> Self {
        Score { sum: self.sum + other.sum, energy: self.energy + other.energy }
    }

    /// Returns it in standard deviations of the scores of others.
    pub fn deviations(self) -> f64 {
        if self.energy > 0.0 { self.sum / self.energy.sqrt() } else { 0.0 }
    }
}
