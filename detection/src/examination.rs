//! An examination as a sequence of values: a [`Reference`] and a registered suspect form a
//! [`Matched`] pair, which becomes [`Demodulated`] evidence; module [`crate::decision`] decides on
//! it.

use crate::{
    decision::Decoys,
    matching::{Matcher, Matches, Radius, RadiusChoice, is_chance, out_of_place},
    observations::{self, Observations},
    progress::{Listener, Progress},
    registration::Registration,
    tracking::{Followed, Tracking},
};
use meshmark_core::{
    Result,
    carrier::Carrier,
    deformation::{Deformation, Prediction},
    demodulation::{self, Demodulation},
    ground::Ground,
    key::SecretKey,
    map::Map,
    map_data::MapData,
    options::Parameters,
    patches::Patches,
};

/// The choice of a demodulator of `meshmark-core`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Demodulator {
    /// The detector of Ohbuchi, Ueda and Endoh.
    Paper,
    /// Least squares over the matched vertices.
    Joint,
}

/// The properties of the tested mark without its message.
#[derive(Clone, Copy)]
pub struct Mark<'a> {
    /// The secret key.
    pub key: &'a SecretKey,
    /// Length of the message, bits.
    pub bits: usize,
    /// The numbers that shape the mark.
    pub parameters: &'a Parameters,
}

/// The map before marking.
pub struct Reference<'a> {
    /// The data of the map.
    pub data: &'a MapData,
    /// The ground metric of the mark, metres per CRS unit.
    pub ground: Ground,
    /// The patches of its mesh.
    pub patches: Patches,
    /// Number of coefficients of a patch and axis that carry the message.
    carriers: usize,
}

impl<'a> Reference<'a> {
    /// Meshes a map and cuts it into patches; `map` is `data` on the ground.
    ///
    /// # Errors
    /// Fails when a mark with these parameters does not fit the map.
    pub fn new(data: &'a MapData, map: &Map, bits: usize, parameters: &Parameters) -> Result<Self> {
        let patches = Patches::new(map, parameters)?;
        let carriers = patches.carriers(bits, parameters)?;
        Ok(Reference { data, ground: map.ground, patches, carriers })
    }
}

/// A suspect whose vertices are matched with those of its reference.
pub struct Matched<'a> {
    /// The reference.
    pub reference: &'a Reference<'a>,
    /// The suspect, in the CRS of the reference.
    pub suspect: &'a MapData,
    /// Vertices of the suspect after registration, CRS units of the reference.
    pub moved: Vec<[f64; 2]>,
    /// The matching radius.
    pub radius: Radius,
    /// The matches of the vertices.
    pub matches: Matches,
    /// Number of vertices that match after the suspect is shifted out of place.
    pub by_chance: usize,
}

impl<'a> Matched<'a> {
    /// Matches the vertices of a registered suspect.
    pub fn new(
        reference: &'a Reference<'a>,
        suspect: &'a MapData,
        registration: &Registration,
        radius: RadiusChoice,
    ) -> Self {
        Self::of_moved(reference, suspect, registration.apply(suspect.vertices.coords()), radius)
    }

    /// Matches the vertices of a suspect at these places, CRS units of the reference.
    pub(crate) fn of_moved(
        reference: &'a Reference<'a>,
        suspect: &'a MapData,
        moved: Vec<[f64; 2]>,
        radius: RadiusChoice,
    ) -> Self {
        let (ground, vertices) = (&reference.ground, &reference.data.vertices);
        let unit_m = ground.metres_per_unit(vertices.centre());
        let matcher = Matcher::new(vertices.coords(), ground, vertices.centre());
        let radius = radius.choose(&matcher, &moved, unit_m);
        let matches = matcher.all(&moved, radius.metres);
        let [x, y] = out_of_place(unit_m, radius.metres);
        let shifted: Vec<[f64; 2]> = moved.iter().map(|p| [p[0] + x, p[1] + y]).collect();
        let by_chance = matcher.all(&shifted, radius.metres).count;
        Matched { reference, suspect, moved, radius, matches, by_chance }
    }

    /// Returns whether no more vertices match than by chance, and, for the joint demodulator, lines show no more
    /// corners than by chance; demodulation is impossible then.
    pub fn is_chance(&self, demodulator: Demodulator) -> bool {
        let is_read_by_corners = || demodulator == Demodulator::Joint && observations::corners_show(self);
        self.is_chance_of_vertices() && !is_read_by_corners()
    }

    /// Returns whether no more vertices match than by chance.
    pub(crate) fn is_chance_of_vertices(&self) -> bool {
        is_chance(self.matches.count, self.by_chance)
    }

    /// Demodulates with a key. The paper's demodulator uses the matches unchanged; the joint one
    /// follows a deformation first, which changes them.
    ///
    /// # Errors
    /// Returns the errors of the demodulation.
    pub fn demodulate(
        &self,
        mark: Mark,
        demodulator: Demodulator,
        listener: Listener,
    ) -> Result<Demodulated> {
        self.demodulate_on(None, mark, demodulator, listener)
    }

    /// Demodulates on `given` observations, or on those with more information.
    pub(crate) fn demodulate_on(
        &self,
        given: Option<Observations>,
        mark: Mark,
        demodulator: Demodulator,
        listener: Listener,
    ) -> Result<Demodulated> {
        let Mark { key, bits, parameters } = mark;
        let (patches, carrier) = (&self.reference.patches, Carrier::new(key));
        let (stage, steps) = ("demodulation", patches.as_slice().len() as u64);
        let step = |steps| listener(Progress::Steps(steps));
        if demodulator == Demodulator::Paper {
            listener(Progress::Stage { stage, steps });
            let (coords, ground) = (self.reference.data.vertices.coords(), &self.reference.ground);
            let observed = self.matches.displacements_m(coords, &self.moved, ground);
            let found = demodulation::paper(patches, &carrier, &observed, bits, parameters, &step)?;
            let weights = vec![1.0; observed.len()];
            return Ok(self.demodulated(found, self.matches.clone(), None, weights, Observations::Vertices));
        }
        listener(Progress::Stage { stage: "deformation", steps: 0 });
        let maps = (self.reference.data, self.suspect);
        let tracking = Tracking::new(maps, &self.moved, &self.reference.ground, patches);
        let carriers = self.reference.carriers;
        let followed = tracking.follow(carriers, parameters, self.radius.metres)?;
        let (followed, observations) = observations::choose(self, followed, carriers, parameters, given)?;
        let Followed { matches, observed, disturbance } = followed;
        listener(Progress::Stage { stage, steps });
        let found = demodulation::joint(patches, &carrier, &observed, bits, parameters, &disturbance, &step)?;
        let Prediction { deformation, weights, .. } = disturbance;
        Ok(self.demodulated(found, matches, Some(deformation), weights, observations))
    }

    fn demodulated(
        &self,
        found: Demodulation,
        matches: Matches,
        deformation: Option<Deformation>,
        weights: Vec<f64>,
        observations: Observations,
    ) -> Demodulated {
        let decoys = Decoys::new(&found, &self.suspect.vertices, &self.reference.data.vertices);
        Demodulated { found, matches, deformation, weights, observations, decoys }
    }
}

/// The evidence of a suspect under one key.
pub struct Demodulated {
    /// The evidence.
    pub found: Demodulation,
    /// The matches of the vertices after tracking of the deformation.
    pub matches: Matches,
    /// The estimated deformation; none with the demodulator of the paper.
    pub deformation: Option<Deformation>,
    /// The weight of every reference vertex: 1, or less where its displacement disagrees with the
    /// others.
    pub weights: Vec<f64>,
    /// What the displacements were observed on.
    pub observations: Observations,
    /// Scores of decoy keys; none where no vertex moved.
    pub decoys: Option<Decoys>,
}
