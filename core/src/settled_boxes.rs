//! A map in boxes after marking, put together box by box.

use crate::{
    Result,
    box_plan::BoxPlan,
    boxes::{BoxMap, Boxes},
    columns::{Column, Columns, Reader},
    distortion::{AngleChange, Corner, Displacement, RightAngles},
    map::Map,
    series::Census,
    sorted_runs::SortedRuns,
    topology::Settled,
    vertices::VertexTable,
};
use std::sync::Arc;

/// The vertices of all boxes after marking, and what is known of the boxes then.
pub(crate) struct SettledBoxes {
    places: StoredPlaces,
    /// How far each vertex moved, metres.
    displacements_m: SortedRuns,
    /// How far each angle turned, degrees.
    turns_deg: SortedRuns,
    right_angles: RightAngles,
    pub attenuated: usize,
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

/// The new places of the vertices of a map in boxes.
pub(crate) struct StoredPlaces {
    plan: Arc<BoxPlan>,
    /// x and y of the vertices of one box after the other, in canonical order, CRS units.
    column: Box<dyn Column>,
    /// The index after the last number of each box, ascending.
    ends: Vec<usize>,
}

impl StoredPlaces {
    fn add(&mut self, places: &[[f64; 2]]) -> Result<()> {
        self.column.append(places.as_flattened())?;
        self.ends.push(self.ends.last().copied().unwrap_or(0) + 2 * places.len());
        Ok(())
    }

    /// Returns the place of every vertex of the map, CRS units.
    pub fn load(&self, vertices: &VertexTable) -> Result<Vec<[f64; 2]>> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        let reader = |(start, &end)| Reader::new(&*self.column, start..end, self.ends.len());
        let mut boxes: Vec<Reader> = starts.zip(&self.ends).map(reader).collect();
        let place = |at: &[f64; 2]| {
            let of_box = &mut boxes[self.plan.box_at(*at) as usize];
            let mut next = || of_box.next().map(|number| number.expect("every box is settled"));
            Ok([next()?, next()?])
        };
        vertices.coords().iter().map(place).collect()
    }
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
    /// Creates the result of no box yet, whose numbers are in such columns.
    pub fn new(boxes: &Boxes, columns: &dyn Columns) -> Result<Self> {
        let places = StoredPlaces { plan: boxes.plan(), column: columns.column()?, ends: Vec::new() };
        Ok(SettledBoxes {
            places,
            displacements_m: SortedRuns::new(columns)?,
            turns_deg: SortedRuns::new(columns)?,
            right_angles: RightAngles::default(),
            attenuated: 0,
            deviation_m2: 0.0,
            hanging: 0,
            census: Census { standing: 0, anchored: 0, attached: 0, free: 0 },
            patches: Vec::with_capacity(boxes.len()),
            score: Score::default(),
        })
    }

    /// Adds the next box; `map` is that of all its vertices.
    pub fn add(&mut self, cut: &BoxMap, map: &Map, of_box: SettledBox) -> Result<()> {
        let SettledBox { settled, hanging, census, patches, score } = of_box;
        let pairs = map.vertices.coords().iter().zip(&settled.coords).zip(&cut.is_own);
        let own: Vec<(&[f64; 2], &[f64; 2])> =
            pairs.filter(|(_, is_own)| **is_own).map(|(pair, _)| pair).collect();
        self.places.add(&own.iter().map(|(_, to)| **to).collect::<Vec<_>>())?;
        let distance_m =
            |(from, to): (&[f64; 2], &[f64; 2])| Displacement::of_vertex(*from, *to, map.measure);
        self.displacements_m.add(own.into_iter().map(distance_m).collect())?;
        let corners = Corner::at_some(map, &settled.coords, |v| cut.is_own[v as usize]);
        self.turns_deg.add(corners.iter().map(Corner::change_deg).collect())?;
        self.right_angles = self.right_angles.and(RightAngles::at(&corners));
        self.attenuated += settled.attenuated;
        self.deviation_m2 += settled.deviation_m.powi(2) * settled.coords.len() as f64;
        self.hanging += hanging;
        // Those of other boxes are anchors.
        self.census.anchored += census.anchored - cut.is_own.iter().filter(|is_own| !**is_own).count();
        self.census.attached += census.attached;
        self.census.free += census.free;
        self.patches.push(patches);
        self.score = self.score.and(score);
        Ok(())
    }

    /// Returns the deviation from what was wanted, metres along an axis: root mean square over all
    /// of so many vertices.
    pub fn deviation_m(&self, vertices: usize) -> f64 {
        (self.deviation_m2 / vertices as f64).sqrt()
    }

    /// Returns how far the vertices moved, and how much the angles changed.
    pub fn changes(&self) -> Result<(Displacement, AngleChange)> {
        let turns_deg = self.turns_deg.spread()?;
        let angles = AngleChange::new(self.turns_deg.len(), &turns_deg, self.right_angles);
        Ok((Displacement::new(&self.displacements_m.spread()?), angles))
    }

    /// Returns the new places of the vertices.
    pub fn into_places(self) -> StoredPlaces {
        self.places
    }

    /// Returns the marked map, whose unmarked vertices are given.
    pub fn settled(&self, vertices: &VertexTable) -> Result<Settled> {
        let (attenuated, deviation_m) = (self.attenuated, self.deviation_m(vertices.len()));
        Ok(Settled { attenuated, deviation_m, coords: self.places.load(vertices)? })
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
