//! The evidence of a suspect about fingerprints: estimates of all signs, without a key.

use crate::{
    matched::Matched,
    matching::{Matches, Radius},
    observations::Chosen,
    observed_on::Observations,
    progress::{Listener, Progress},
    tracking::Followed,
};
use meshmark_core::{
    Result,
    agreement::{Agreement, Evidence},
    deformation::{Observed, Prediction},
    derived::Observables,
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
    /// The displacements that were observed, with shaped noise, metres.
    pub observed: Vec<Option<[f64; 2]>>,
    /// The estimated deformation and noise besides the mark.
    pub disturbance: Prediction,
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
        let Chosen { derived, followed, observations } = self.observe(given, parameters, listener)?;
        let Followed { radius, matches, observed, disturbance } = followed;
        let steps = self.reference.patches.as_slice().len() as u64;
        listener(Progress::Stage { stage: "estimation", steps });
        let step = |steps| listener(Progress::Steps(steps));
        let estimates = {
            let of = derived.as_ref().map_or(self.vertices(), Observables::Derived);
            self.estimates(of, &observed, &disturbance, parameters, &step)?
        };
        Ok(Estimated { estimates, radius, matches, observed, disturbance, observations })
    }

    /// Returns the vertices of the reference as what is observed.
    pub(crate) fn vertices(&self) -> Observables<'_> {
        Observables::Vertices(&self.reference.patches)
    }

    /// Estimates the signs from these observations.
    pub(crate) fn estimates(
        &self,
        of: Observables,
        observed: &Observed,
        disturbance: &Prediction,
        parameters: &Parameters,
        step: &(dyn Fn(usize) + Sync),
    ) -> Result<Estimates> {
        Estimates::new(of, observed, self.reference.carriers, parameters, disturbance, step)
    }
}

impl Estimated {
    /// Returns the agreement of the pilots of a key, whoever received the copy.
    pub fn key_agreement(&self, pilots: &Sequence) -> Agreement {
        Evidence::of_pilots(&self.estimates).agreement(pilots)
    }
}
