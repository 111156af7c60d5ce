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
    mosaic,
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
/// Bets are repeated on what the named recipients left, so often at most.
const MOST_ROUNDS: usize = 4;
/// So many pairs of a recipient and a patch are bet on in a round at most.
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
            forget(&mut observed, &copies_m, |vertex| seen.disturbance.displacement_m[vertex]);
            let estimates =
                self.estimates(self.vertices(), &observed, &seen.disturbance, parameters, &|_| ())?;
            Ok(Evidence::of_recipients(&estimates).without(&named))
        })
    }

    /// Bets on the signs of candidates that are not named, where a share of the coordinates may be
    /// theirs: those with the best scores, up to [`MOST_BETS`]. The suspect is seen as it
    /// stands and as it is registered: the least values of many copies shift a map as a whole,
    /// which the registration undoes. No deformation is taken out, as that of polygon groups has
    /// much of what the owners of single features put there. Vertices of recipients that are named
    /// count as not found in the next round.
    ///
    /// # Errors
    /// Fails when a patch cannot be solved.
    pub fn bet_on_shares(
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
        let mut views = [suspect, &self.moved]
            .map(|places| seen.matches.displacements_m(reference, places, &self.reference.ground));
        self.score_without_pilots(&views[0], candidates, pilots, parameters, tried, standings)?;
        let (patches, coefficients) = (&self.reference.patches, self.reference.carriers);
        for round in 1..=MOST_ROUNDS {
            let chosen = self.chosen(standings);
            let signs: Vec<Sequence> = chosen.iter().map(|&k| candidates[k].own.clone()).collect();
            let of_views = views.each_ref().map(Vec::as_slice);
            let wealth = mosaic::wealth_log10(patches, &of_views, coefficients, parameters, pilots, &signs)?;
            chosen.iter().zip(wealth).for_each(|(&k, wealth)| standings[k].bet(wealth, round, tried));
            let new = chosen.iter().filter(|&&k| standings[k].is_named).map(|&k| candidates[k].clone());
            let new: Vec<Fingerprint> = new.collect();
            if new.is_empty() || round == MOST_ROUNDS || standings.iter().all(|standing| standing.is_named) {
                break;
            }
            let copies_m = displacements_m(patches, &new, coefficients, parameters)?;
            views.iter_mut().for_each(|view| forget(view, &copies_m, |_| [0.0; 2]));
        }
        Ok(())
    }

    /// Scores all candidates without the pilots, for each noise that mixtures may have. An
    /// average of many copies has the pilots of one copy and a mark of a few millimetres for each
    /// member; as shapes that keep their angles have less freedom than there are signs, the pilots
    /// disturb the estimates of all other signs.
    fn score_without_pilots(
        &self,
        observed: &[Option<[f64; 2]>],
        candidates: &[Fingerprint],
        pilots: &Sequence,
        parameters: &Parameters,
        (tried, significance): (usize, f64),
        standings: &mut [Standing],
    ) -> Result<()> {
        let (patches, coefficients) = (&self.reference.patches, self.reference.carriers);
        let of_pilots = displacements_m(patches, &[PilotsAlone(pilots.clone())], coefficients, parameters)?;
        let without =
            |(o, pilot): (&Option<[f64; 2]>, &[f64; 2])| o.map(|o| [0, 1].map(|axis| o[axis] - pilot[axis]));
        let observed: Vec<_> = observed.iter().zip(&of_pilots[0]).map(without).collect();
        let signs: Vec<Sequence> = candidates.iter().map(|candidate| candidate.own.clone()).collect();
        let level = significance / 10f64.powf(recipients::FURTHER_TESTS_LOG10);
        for noise_m in MIXED_NOISES_M {
            let noise = Prediction::of_noise(noise_m, observed.len());
            let estimates = self.estimates(self.vertices(), &observed, &noise, parameters, &|_| ())?;
            let evidence = Evidence::of_recipients(&estimates);
            let rest = |named: &[usize], _: &[usize]| {
                Ok(evidence.without(&named.iter().map(|&k| signs[k].clone()).collect::<Vec<_>>()))
            };
            let again = recipients::name_in_rounds(&evidence, &signs, (tried, level), rest)?;
            standings.iter_mut().zip(again).for_each(|(standing, again)| standing.take(again, significance));
        }
        Ok(())
    }

    /// Returns the candidates on whose signs bets are made, by their scores.
    fn chosen(&self, standings: &[Standing]) -> Vec<usize> {
        let mut chosen: Vec<usize> = (0..standings.len()).filter(|&k| !standings[k].is_named).collect();
        chosen.sort_by(|&a, &b| standings[b].score.total_cmp(&standings[a].score).then(a.cmp(&b)));
        chosen.truncate((MOST_BETS / self.reference.patches.as_slice().len()).max(1));
        chosen
    }
}

/// Forgets the vertices that lie where copies have them, which are displaced so far by their marks,
/// and by `other_m` besides, metres.
fn forget(
    observed: &mut [Option<[f64; 2]>],
    copies_m: &[Vec<[f64; 2]>],
    other_m: impl Fn(usize) -> [f64; 2],
) {
    let found = observed.iter().flatten().count() as f64;
    for copy_m in copies_m {
        let is_own = |vertex: &usize| {
            let other_m = other_m(*vertex);
            let gap = |o: [f64; 2]| [0, 1].map(|axis| o[axis] - other_m[axis] - copy_m[*vertex][axis]);
            observed[*vertex].map(gap).is_some_and(|[x, y]| x.hypot(y) <= SAME_M)
        };
        let own: Vec<usize> = (0..observed.len()).filter(is_own).collect();
        if own.len() as f64 > LEAST_OWN * found {
            own.into_iter().for_each(|vertex| observed[vertex] = None);
        }
    }
}
