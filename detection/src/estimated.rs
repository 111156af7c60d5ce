//! The evidence of a suspect about fingerprints: estimates of all signs, without a key.

use crate::{
    matched::Matched,
    matching::{Matches, Radius},
    observations::Observations,
    progress::{Listener, Progress},
    tracking::Followed,
};
use meshmark_core::{
    Result,
    agreement::{Agreement, Evidence},
    deformation::{Deformation, Prediction},
    estimation::Estimates,
    options::Parameters,
    signs::Sequence,
};

/// The evidence of a suspect about the fingerprints of all keys and recipients.
pub struct Estimated {
    /// The estimated signs.
    pub estimates: Estimates,
    /// The matching radius after tracking of the deformation.
    pub radius: Radius,
    /// The matches of the vertices after tracking of the deformation.
    pub matches: Matches,
    /// The estimated deformation.
    pub deformation: Deformation,
    /// The weight of every reference vertex: 1, or less where its displacement disagrees with the
    /// others.
    pub weights: Vec<f64>,
    /// What the displacements were observed on.
    pub observations: Observations,
}

impl Matched<'_> {
    /// Estimates the signs of a fingerprint, following a deformation first. The reference is one
    /// for fingerprints.
    ///
    /// # Errors
    /// Returns the errors of the estimation.
    pub fn estimate(&self, parameters: &Parameters, listener: Listener) -> Result<Estimated> {
        self.estimate_on(None, parameters, listener)
    }

    /// Estimates on `given` observations, or on those with more information.
    pub(crate) fn estimate_on(
        &self,
        given: Option<Observations>,
        parameters: &Parameters,
        listener: Listener,
    ) -> Result<Estimated> {
        let (followed, observations) = self.observe(given, parameters, listener)?;
        let Followed { radius, matches, observed, disturbance } = followed;
        let (patches, coefficients) = (&self.reference.patches, self.reference.carriers);
        listener(Progress::Stage { stage: "estimation", steps: patches.as_slice().len() as u64 });
        let step = |steps| listener(Progress::Steps(steps));
        let estimates = Estimates::new(patches, &observed, coefficients, parameters, &disturbance, &step)?;
        let Prediction { deformation, weights, .. } = disturbance;
        Ok(Estimated { estimates, radius, matches, deformation, weights, observations })
    }
}

impl Estimated {
    /// Returns the agreement of the pilots of a key, whoever received the copy.
    pub fn key_agreement(&self, pilots: &Sequence) -> Agreement {
        Evidence::of_pilots(&self.estimates).agreement(pilots)
    }
}
