//! Coalitions: the recipients whose copies were mixed.
//!
//! An average weakens everybody's signs alike; [`recipients::name_in_rounds`] takes the named ones
//! out. A mosaic takes every vertex from one copy. Once a recipient is named, its copy can be
//! computed, and vertices that lie where it has them are its own: they count as not found when the
//! others are scored. Which vertices these are follows from the suspect and the named recipients
//! alone, so the signs of an innocent recipient are independent of what remains.

use crate::{
    decision::recipients::{self, Standing},
    estimated::Estimated,
    matched::Matched,
};
use meshmark_core::{
    Result, agreement::Evidence, fingerprint::Fingerprint, modulation::displacements_m, options::Parameters,
    signs::Sequence,
};

/// A vertex this near to its place in a copy is that of the copy, metres. Those of other copies are
/// as near once in two hundred times.
const SAME_M: f64 = 0.01;
/// A recipient with no more than this share of the vertices gave none as they are.
const LEAST_OWN: f64 = 0.01;
/// Where the noise is larger, no vertex shows whose it is, metres.
const MOST_NOISE_M: f64 = 0.1;
/// Named recipients that leave less than this share of the energy explain the suspect.
const LEAST_REST: f64 = 0.1;

impl Matched<'_> {
    /// Returns the standing of every candidate in the evidence `seen`, in the order given. They are
    /// all or some of those `tried`, whose significance together is this one; see
    /// [`recipients::name_in_rounds`].
    ///
    /// # Errors
    /// Returns the errors of the estimation.
    pub fn name_recipients(
        &self,
        seen: &Estimated,
        candidates: &[Fingerprint],
        parameters: &Parameters,
        (tried, significance): (usize, f64),
    ) -> Result<Vec<Standing>> {
        let evidence = Evidence::of_recipients(&seen.estimates);
        let signs: Vec<Sequence> = candidates.iter().map(|candidate| candidate.own).collect();
        let mut observed = seen.observed.clone();
        let shows_vertices =
            seen.disturbance.deformation.noise_m <= MOST_NOISE_M && !seen.observations.is_of_features();
        recipients::name_in_rounds(&evidence, &signs, (tried, significance), |named, new| {
            let named: Vec<Sequence> = named.iter().map(|&k| signs[k]).collect();
            let rest = evidence.without(&named);
            if !shows_vertices || rest.energy() < LEAST_REST * evidence.energy() {
                return Ok(rest);
            }
            let new: Vec<Fingerprint> = new.iter().map(|&k| candidates[k]).collect();
            self.forget(&mut observed, seen, &new, parameters)?;
            let estimates =
                self.estimates(self.vertices(), &observed, &seen.disturbance, parameters, &|_| ())?;
            Ok(Evidence::of_recipients(&estimates).without(&named))
        })
    }

    /// Forgets the vertices that lie where the copies of some recipients have them.
    fn forget(
        &self,
        observed: &mut [Option<[f64; 2]>],
        seen: &Estimated,
        recipients: &[Fingerprint],
        parameters: &Parameters,
    ) -> Result<()> {
        let (patches, coefficients) = (&self.reference.patches, self.reference.carriers);
        let found = observed.iter().flatten().count() as f64;
        for copy_m in displacements_m(patches, recipients, coefficients, parameters)? {
            let is_own = |vertex: &usize| {
                let other_m = seen.disturbance.displacement_m[*vertex];
                let gap = |o: [f64; 2]| [0, 1].map(|axis| o[axis] - other_m[axis] - copy_m[*vertex][axis]);
                observed[*vertex].map(gap).is_some_and(|[x, y]| x.hypot(y) <= SAME_M)
            };
            let own: Vec<usize> = (0..observed.len()).filter(is_own).collect();
            if own.len() as f64 > LEAST_OWN * found {
                own.into_iter().for_each(|vertex| observed[vertex] = None);
            }
        }
        Ok(())
    }
}
