//! Power: whether a mark would show on this suspect.
//!
//! A trial mark under a derived key is applied to the suspect as if the suspect were made from
//! a map with that mark: every vertex of the suspect moves as the nearest place on the linework of
//! the reference does, or the nearest feature, where features are observed. Matching, tracking and demodulation are then repeated. The score of the
//! trial mark thus includes what the suspect lost: displacements beyond the matching radius,
//! vertices that are new on old lines, noise. It needs no model of what happened to the suspect,
//! and neither the tested key nor a message.

use crate::{
    decision::{p_any_message_log10, recipients, shows_key},
    estimated::Estimated,
    examination::{Demodulated, Demodulator, Mark},
    features,
    linework::{Edge, Plane, is_alone},
    matched::{Matched, Reference},
    observed_on::Observations,
    progress::Listener,
};
use meshmark_core::{
    Result,
    agreement::Evidence,
    carrier::Carrier,
    fingerprint::recipient_signs,
    ground::Ground,
    key::SecretKey,
    map_data::MapData,
    message::Message,
    modulation::{SpreadMessage, displacements_m},
    options::Parameters,
    signs::Sequence,
};
use rayon::prelude::*;
use rstar::RTree;
use sha2::{Digest, Sha256};

/// A place of the suspect farther than this from the linework of the reference is foreign to it,
/// metres.
const FOREIGN_M: f64 = 20.0;

/// What a present mark would show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Power {
    /// No vertex moved, and a mark would have moved them.
    Unmoved,
    /// A mark of the key is detected, whatever its message: only the message is in question.
    KeyShows,
    /// A trial mark has this score on the suspect, standard deviations of the null hypothesis.
    Trial(f64),
}

impl Power {
    /// Measures the power for a mark on a suspect, of which `seen` is the evidence.
    ///
    /// # Errors
    /// Returns the errors of the demodulation.
    pub fn measure(
        matched: &Matched,
        seen: &Demodulated,
        mark: Mark,
        demodulator: Demodulator,
        listener: Listener,
    ) -> Result<Self> {
        if seen.found.chip_correlations.iter().all(|a| *a == 0.0) {
            return Ok(Power::Unmoved);
        }
        if shows_key(p_any_message_log10(&seen.found, mark.parameters.chip_rate)) {
            return Ok(Power::KeyShows);
        }
        let key = trial_key(matched);
        let message = Message::from_signs(&vec![1.0; mark.bits]);
        let parameters = mark.parameters;
        let Reference { patches, carriers, .. } = matched.reference;
        let carrier = Carrier::new(&key);
        let signs = SpreadMessage::new(&carrier, &message, parameters);
        let displacement_m = displacements_m(patches, &[signs], *carriers, parameters)?;
        let trial = marked(matched, seen.observations, &displacement_m[0]);
        if trial.is_chance(demodulator) {
            return Ok(Power::Trial(0.0));
        }
        let trial = trial.demodulate_on(
            Some(seen.observations),
            Mark { key: &key, ..mark },
            demodulator,
            listener,
        )?;
        Ok(Power::Trial(trial.found.mark_score(&message)))
    }

    /// Measures the power for a fingerprint on a suspect, of which `seen` is the evidence and
    /// `pilots` are the key's.
    ///
    /// # Errors
    /// Returns the errors of the estimation.
    pub fn of_fingerprint(
        matched: &Matched,
        seen: &Estimated,
        pilots: &Sequence,
        parameters: &Parameters,
        listener: Listener,
    ) -> Result<Self> {
        if seen.estimates.values.iter().all(|value| *value == 0.0) {
            return Ok(Power::Unmoved);
        }
        if recipients::shows_key(seen.key_agreement(pilots).score) {
            return Ok(Power::KeyShows);
        }
        let Reference { patches, carriers, parts, .. } = matched.reference;
        let signs = recipient_signs(&trial_key(matched), parts, "trial mark");
        let displacement_m = displacements_m(patches, std::slice::from_ref(&signs), *carriers, parameters)?;
        let trial = marked(matched, seen.observations, &displacement_m[0]);
        if trial.is_chance(Demodulator::Joint) {
            return Ok(Power::Trial(0.0));
        }
        let trial = trial.estimate_on(Some(seen.observations), parameters, listener)?;
        Ok(Power::Trial(Evidence::of_recipients(&trial.estimates).agreement(&signs).score))
    }
}

/// Returns the suspect as if it had been made from a map with this mark, metres at every vertex.
fn marked<'a>(matched: &Matched<'a>, observed_on: Observations, displacement_m: &[[f64; 2]]) -> Matched<'a> {
    let moved = moved(matched, observed_on, displacement_m);
    let suspect = (matched.suspect, &matched.registration);
    Matched::of_moved(matched.reference, suspect, moved, |_, _, _| matched.radius)
}

/// Returns a key that follows from the two maps, so that equal maps give equal power, and nobody
/// can choose it.
fn trial_key(matched: &Matched) -> SecretKey {
    let Matched { suspect, reference: Reference { data, .. }, .. } = matched;
    let text = format!("meshmark trial mark {} {}", suspect.vertices.digest(), data.vertices.digest());
    SecretKey::from_bytes(Sha256::digest(text).into())
}

/// Returns where the vertices of the suspect go when the vertices of the reference move, CRS units.
fn moved(matched: &Matched, observed_on: Observations, displacement_m: &[[f64; 2]]) -> Vec<[f64; 2]> {
    if observed_on.is_of_features() {
        return features::moved(matched, observed_on, displacement_m);
    }
    let linework = LineIndex::new(matched.reference.data, &matched.reference.ground);
    matched.moved.par_iter().map(|&place| linework.moved(place, displacement_m)).collect()
}

/// The segments of a reference, and its vertices without a segment, in the plane.
struct LineIndex<'a> {
    ground: &'a Ground,
    plane: Plane,
    tree: RTree<Edge>,
}

impl<'a> LineIndex<'a> {
    fn new(reference: &'a MapData, ground: &'a Ground) -> Self {
        let (coords, centre) = (reference.vertices.coords(), reference.vertices.centre());
        let plane = Plane::new(ground, centre);
        let alone = is_alone(coords.len(), &reference.segments);
        let points = (0..coords.len() as u32).filter(|&vertex| alone[vertex as usize]).map(|v| [v, v]);
        let tree = plane.tree(coords, reference.segments.iter().copied().chain(points));
        LineIndex { ground, plane, tree }
    }

    /// Returns where a place of the suspect goes when the vertices of the reference move, CRS
    /// units.
    fn moved(&self, place: [f64; 2], displacement_m: &[[f64; 2]]) -> [f64; 2] {
        let at = self.plane.at(place);
        let Some(line) = self.tree.nearest_neighbor(&at) else { return place };
        let nearest = line.geom().nearest_point(&at);
        if (nearest[0] - at[0]).hypot(nearest[1] - at[1]) > FOREIGN_M {
            return place;
        }
        let length = line.geom().length_2().sqrt();
        let start = line.geom().from;
        let along = (nearest[0] - start[0]).hypot(nearest[1] - start[1]);
        let share = if length > 0.0 { along / length } else { 0.0 }; // a vertex without a segment has no length
        let [from, to] = line.data.map(|vertex| displacement_m[vertex as usize]);
        let unit_m = self.ground.metres_per_unit(place);
        [0, 1].map(|axis| place[axis] + ((1.0 - share) * from[axis] + share * to[axis]) / unit_m[axis])
    }
}
