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
    Result,
    agreement::Evidence,
    deformation::Prediction,
    fingerprint::{Fingerprint, PilotsAlone},
    modulation::displacements_m,
    mosaic::{self, View},
    options::Parameters,
    signs::Sequence,
};

/// A vertex this near to its place in a copy is that of the copy, metres. Those of other copies are
/// as near once in two hundred times.
const SAME_M: f64 = 0.01;
/// A recipient with no more than this share of the vertices gave none as they are.
const LEAST_OWN: f64 = 0.01;
/// Where the noise is larger, no vertex shows whose it is, metres.
const MOST_NOISE_M: f64 = 0.1;
/// The noise of copies that were mixed and not changed further, metres: averages have nearly none,
/// medians and extremes that of their choice.
const MIXED_NOISES_M: [f64; 3] = [0.001, 0.02, 0.1];
/// So many pairs of a recipient and a patch are bet on at most.
const MOST_BETS: usize = 8000;
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
        let signs: Vec<Sequence> = candidates.iter().map(|candidate| candidate.own.clone()).collect();
        let mut observed = seen.observed.clone();
        let shows_vertices =
            seen.disturbance.deformation.noise_m <= MOST_NOISE_M && !seen.observations.is_of_features();
        recipients::name_in_rounds(&evidence, &signs, (tried, significance), |named, new| {
            let named: Vec<Sequence> = named.iter().map(|&k| signs[k].clone()).collect();
            let rest = evidence.without(&named);
            if !shows_vertices || rest.energy() < LEAST_REST * evidence.energy() {
                return Ok(rest);
            }
            let new: Vec<Fingerprint> = new.iter().map(|&k| candidates[k].clone()).collect();
            let (patches, coefficients) = (&self.reference.patches, self.reference.carriers);
            let copies_m = displacements_m(patches, &new, coefficients, parameters)?;
            forget(&mut observed, &copies_m, &seen.disturbance.displacement_m);
            let estimates =
                self.estimates(self.vertices(), &observed, &seen.disturbance, parameters, &|_| ())?;
            Ok(Evidence::of_recipients(&estimates).without(&named))
        })
    }

    /// Looks for candidates that the scores do not name: by scores without the pilots and beside the
    /// others, and by bets on the signs of those with the best scores, up to [`MOST_BETS`], since a
    /// share of the coordinates may be theirs. The suspect is seen as it stands and as it is
    /// registered: the least values of many copies shift a map as a whole, which the registration
    /// undoes. No deformation is taken out, as that of polygon groups has much of what the owners of
    /// single features put there.
    ///
    /// # Errors
    /// Fails when a patch cannot be solved.
    pub fn look_for_shares(
        &self,
        seen: &Estimated,
        candidates: &[Fingerprint],
        pilots: &Sequence,
        parameters: &Parameters,
        tried: (usize, f64),
        standings: &mut [Standing],
    ) -> Result<()> {
        if seen.observations.is_of_features() {
            return Ok(());
        }
        let (reference, suspect) = (self.reference.data.vertices.coords(), self.suspect.vertices.coords());
        let views = [suspect, &self.moved]
            .map(|places| seen.matches.displacements_m(reference, places, &self.reference.ground));
        let (patches, coefficients) = (&self.reference.patches, self.reference.carriers);
        let pilots_m =
            displacements_m(patches, &[PilotsAlone(pilots.clone())], coefficients, parameters)?.remove(0);
        self.score_without_pilots(&views[0], &pilots_m, candidates, parameters, tried, standings)?;
        let chosen = self.chosen(standings);
        let of_chosen: Vec<Fingerprint> = chosen.iter().map(|&k| candidates[k].clone()).collect();
        let signs: Vec<Sequence> = of_chosen.iter().map(|candidate| candidate.own.clone()).collect();
        let copies_m = displacements_m(patches, &of_chosen, coefficients, parameters)?;
        let views = views.each_ref().map(|view| View::new(view, &copies_m, &pilots_m));
        let wealth =
            mosaic::wealth_log10(patches, &views, (coefficients, parameters), pilots, (&signs, &copies_m))?;
        chosen.iter().zip(wealth).for_each(|(&k, wealth)| standings[k].bet(wealth, tried));
        Ok(())
    }

    /// Scores all candidates without the pilots and beside the others, for each noise that mixtures
    /// may have. An average of many copies has the pilots of one copy and a mark of a few millimetres
    /// for each member; as shapes that keep their angles have less freedom than there are signs, the
    /// pilots disturb the estimates of all other signs.
    fn score_without_pilots(
        &self,
        observed: &[Option<[f64; 2]>],
        pilots_m: &[[f64; 2]],
        candidates: &[Fingerprint],
        parameters: &Parameters,
        tried: (usize, f64),
        standings: &mut [Standing],
    ) -> Result<()> {
        let without =
            |(o, pilot): (&Option<[f64; 2]>, &[f64; 2])| o.map(|o| [0, 1].map(|axis| o[axis] - pilot[axis]));
        let observed: Vec<_> = observed.iter().zip(pilots_m).map(without).collect();
        let signs: Vec<Sequence> = candidates.iter().map(|candidate| candidate.own.clone()).collect();
        let least_score = recipients::suspected_score(tried.0);
        for noise_m in MIXED_NOISES_M {
            let noise = Prediction::of_noise(noise_m, observed.len());
            let estimates = self.estimates(self.vertices(), &observed, &noise, parameters, &|_| ())?;
            let scores = Evidence::of_recipients(&estimates).scores_beside_others(&signs, least_score);
            standings.iter_mut().zip(scores).for_each(|(standing, score)| standing.take(score, tried));
        }
        Ok(())
    }

    /// Returns the candidates on whose signs bets are made, those with the best scores first.
    fn chosen(&self, standings: &[Standing]) -> Vec<usize> {
        let mut chosen: Vec<usize> = (0..standings.len()).collect();
        chosen.sort_by(|&a, &b| standings[b].score.total_cmp(&standings[a].score).then(a.cmp(&b)));
        chosen.truncate((MOST_BETS / self.reference.patches.as_slice().len()).max(1));
        chosen
    }
}

/// Forgets the vertices that lie where copies have them, which are displaced so far by their marks,
/// and by `other_m` besides, metres.
fn forget(observed: &mut [Option<[f64; 2]>], copies_m: &[Vec<[f64; 2]>], other_m: &[[f64; 2]]) {
    let found = observed.iter().flatten().count() as f64;
    for copy_m in copies_m {
        let is_own = |vertex: &usize| {
            let other_m = other_m[*vertex];
            let gap = |o: [f64; 2]| [0, 1].map(|axis| o[axis] - other_m[axis] - copy_m[*vertex][axis]);
            observed[*vertex].map(gap).is_some_and(|[x, y]| x.hypot(y) <= SAME_M)
        };
        let own: Vec<usize> = (0..observed.len()).filter(is_own).collect();
        if own.len() as f64 > LEAST_OWN * found {
            own.into_iter().for_each(|vertex| observed[vertex] = None);
        }
    }
}
