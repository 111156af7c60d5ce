//! An examination as a sequence of values: a [`crate::Reference`] and a registered suspect form a
//! [`Matched`] pair, which becomes [`Demodulated`] evidence; module [`crate::decision`] decides on
//! it.

use crate::{
    decision::Decoys,
    matched::Matched,
    matching::{Matches, Radius},
    observations::{self, Chosen},
    observed_on::Observations,
    progress::{Listener, Progress},
    tracking::{Followed, Tracking},
};
use meshmark_core::{
    Result,
    carrier::Carrier,
    deformation::{Deformation, Prediction},
    demodulation::{self, Demodulation},
    derived::Observables,
    key::SecretKey,
    options::Parameters,
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

impl Matched<'_> {
    /// Returns whether no more vertices match than by chance, and, for the joint demodulator, nothing
    /// else is observed more often than by chance and no deformation can be followed; demodulation is
    /// impossible then.
    pub fn is_chance(&self, demodulator: Demodulator) -> bool {
        let is_read_otherwise = || observations::show(self) || self.grown().is_some();
        self.is_chance_of_vertices() && !(demodulator == Demodulator::Joint && is_read_otherwise())
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
            let matches = (self.radius, self.matches.clone());
            return Ok(self.demodulated(found, matches, None, weights, Observations::Vertices));
        }
        let Chosen { derived, followed, observations } = self.observe(given, parameters, listener)?;
        let Followed { radius, matches, observed, disturbance } = followed;
        listener(Progress::Stage { stage, steps });
        let of = derived.as_ref().map_or(Observables::Vertices(patches), Observables::Derived);
        let found = demodulation::joint(of, &carrier, &observed, bits, parameters, &disturbance, &step)?;
        let Prediction { deformation, weights, .. } = disturbance;
        // Points of features have no weight of a vertex.
        let weights = if derived.is_some() { vec![1.0; patches.vertex_count()] } else { weights };
        Ok(self.demodulated(found, (radius, matches), Some(deformation), weights, observations))
    }

    /// Follows the deformation of the suspect on `given` observations, or on those with more
    /// information.
    pub(crate) fn observe(
        &self,
        given: Option<Observations>,
        parameters: &Parameters,
        listener: Listener,
    ) -> Result<Chosen<'_>> {
        listener(Progress::Stage { stage: "deformation", steps: 0 });
        let carriers = self.reference.carriers;
        let followed = Tracking::new(self).follow(carriers, parameters)?;
        observations::choose(self, followed, carriers, parameters, given)
    }

    fn demodulated(
        &self,
        found: Demodulation,
        (radius, matches): (Radius, Matches),
        deformation: Option<Deformation>,
        weights: Vec<f64>,
        observations: Observations,
    ) -> Demodulated {
        let decoys = Decoys::new(&found, &self.suspect.vertices, &self.reference.data.vertices);
        Demodulated { found, radius, matches, deformation, weights, observations, decoys }
    }
}

/// The evidence of a suspect under one key.
pub struct Demodulated {
    /// The evidence.
    pub found: Demodulation,
    /// The matching radius after tracking of the deformation.
    pub radius: Radius,
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
