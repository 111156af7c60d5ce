//! Tracking: follows a deformation that moved vertices out of the matching radius.

use crate::{
    groups,
    matched::Matched,
    matching::{Graph, LEAST_MATCHED, Matcher, Matches, Near, Radius, RadiusChoice, RadiusReason},
};
use meshmark_core::{
    Result,
    deformation::{Deformation, Observed, Prediction, mark_deviation_m},
    ground::Ground,
    map_data::MapData,
    options::Parameters,
};

/// Polygon groups are looked for as a whole within this distance, metres.
const GROUPS_M: f64 = 7.0;
/// A radius of so many metres matches many wrong vertices, which may hide a strong deformation.
const FAR_M: f64 = 4.0;
/// A strong deformation is taken where it keeps this many times the segments.
const KEEPS_MORE: f64 = 1.1;
/// Number of rounds in which vertices are matched around the predicted deformation.
const ROUNDS: usize = 3;

/// Groups are taken to have moved as a whole where that gives this many times the information.
const CLEARLY_MORE: f64 = 1.5;

/// Follows a deformation that moved vertices out of the matching radius: matches give a
/// deformation, and the deformation predicts the places of more matches. The key is not involved,
/// so decoys have the same input.
pub struct Tracking<'a> {
    matched: &'a Matched<'a>,
    /// Graphs of the reference and of the suspect.
    graphs: [Graph; 2],
}

/// The result of tracking.
pub struct Followed {
    /// The matching radius.
    pub radius: Radius,
    /// The matches of the vertices.
    pub matches: Matches,
    /// The displacements to demodulate, with shaped noise, metres.
    pub observed: Vec<Option<[f64; 2]>>,
    /// The predicted deformation and noise besides the mark.
    pub disturbance: Prediction,
}

impl<'a> Tracking<'a> {
    /// Prepares a reference and its suspect.
    pub fn new(matched: &'a Matched<'a>) -> Self {
        let graph = |map: &MapData| Graph::new(map.vertices.len(), &map.segments);
        Tracking { matched, graphs: [graph(matched.reference.data), graph(matched.suspect)] }
    }

    /// Matches until the deformation is found, where `carriers` coefficients of a patch and axis
    /// carry the mark. Where noise moved vertices beyond the least radius, polygon groups may have
    /// moved as a whole, and where few are found a strong deformation may have moved them; the
    /// start that gives most information about a mark is taken.
    ///
    /// # Errors
    /// Returns the errors of the estimation.
    pub fn follow(&self, carriers: usize, parameters: &Parameters) -> Result<Followed> {
        let (follower, radius) = (Follower { tracking: self, carriers, parameters }, self.matched.radius);
        let mut best = follower.follow(self.reference().vertices.coords(), radius)?;
        if radius.reason == RadiusReason::Noise
            && let Some(expected) = self.shifted_groups()
        {
            let next = follower.follow(&expected, self.radius_around(&expected, RadiusReason::Groups))?;
            if next.information() > CLEARLY_MORE * best.information() {
                best = next;
            }
        }
        let is_far = radius.metres >= FAR_M || !self.matched.is_mostly_found(best.matches.count);
        if radius.reason != RadiusReason::Given
            && is_far
            && let Some(expected) = self.matched.grown()
        {
            let next = follower.follow(expected, self.radius_around(expected, RadiusReason::Deformation))?;
            if self.kept_segments(&next) > KEEPS_MORE * self.kept_segments(&best) {
                best = next;
            }
        }
        Ok(best)
    }

    /// Returns the number of segments of the reference whose ends match ends of a segment of the
    /// suspect. Wrong matches keep few, however well a deformation explains them.
    fn kept_segments(&self, followed: &Followed) -> f64 {
        let [_, suspect] = &self.graphs;
        let matches = &followed.matches.suspect_of;
        let is_kept = |segment: &&[u32; 2]| {
            let [a, b] = segment.map(|vertex| matches[vertex as usize]);
            a.zip(b).is_some_and(|(a, b)| suspect.is_joined(a, b))
        };
        self.reference().segments.iter().filter(is_kept).count() as f64
    }

    fn reference(&self) -> &MapData {
        self.matched.reference.data
    }

    fn ground(&self) -> &Ground {
        &self.matched.reference.ground
    }

    fn matcher<'b>(&'b self, places: &'b [[f64; 2]]) -> Matcher<'b> {
        Matcher::new(places, self.ground(), self.reference().vertices.centre())
    }

    /// Returns the places of the reference vertices, CRS units, after their polygon groups were
    /// shifted; `None` where too few groups are found.
    fn shifted_groups(&self) -> Option<Vec<[f64; 2]>> {
        let coords = self.reference().vertices.coords();
        let matcher = self.matcher(coords);
        let shifts = groups::shifts_m(self.reference(), &Near::new(&matcher, &self.matched.moved), GROUPS_M);
        if shifts.iter().flatten().count() < LEAST_MATCHED {
            return None;
        }
        let shifts: Vec<[f64; 2]> = shifts.into_iter().map(Option::unwrap_or_default).collect();
        Some(self.ground().displaced(coords, &shifts))
    }

    /// Returns the matching radius around expected places of the reference vertices.
    fn radius_around(&self, expected: &[[f64; 2]], reason: RadiusReason) -> Radius {
        let unit_m = self.ground().metres_per_unit(self.reference().vertices.centre());
        let matcher = self.matcher(expected);
        Radius { reason, ..RadiusChoice::FromData.choose(&matcher, &self.matched.moved, unit_m) }
    }

    /// Matches with the expected places of the reference vertices, CRS units.
    fn match_joined(&self, expected: &[[f64; 2]], radius_m: f64) -> Matches {
        self.matcher(expected).joined(&self.matched.moved, radius_m, self.graphs.each_ref())
    }

    /// Returns the displacement of every reference vertex, metres; `None` where no suspect vertex
    /// matches.
    fn displacements(&self, matches: &Matches) -> Vec<Option<[f64; 2]>> {
        matches.displacements_m(self.reference().vertices.coords(), &self.matched.moved, self.ground())
    }
}

/// Follows the disturbance that fits the displacements of matched vertices.
struct Follower<'a> {
    tracking: &'a Tracking<'a>,
    carriers: usize,
    parameters: &'a Parameters,
}

impl Follower<'_> {
    /// Matches around the expected places of the reference vertices, CRS units, and then around
    /// those that the fitted disturbance predicts.
    fn follow(&self, expected: &[[f64; 2]], radius: Radius) -> Result<Followed> {
        let Follower { tracking, carriers, parameters } = *self;
        let (patches, amplitude_m) = (&tracking.matched.reference.patches, parameters.amplitude_m);
        let mut matches = tracking.match_joined(expected, radius.metres);
        let mut observed = tracking.displacements(&matches);
        let mut round = 1;
        loop {
            let mut prediction = self.predict(&observed)?;
            if prediction.deformation.is_still() || round == ROUNDS {
                let mark_m = mark_deviation_m(patches, carriers, amplitude_m);
                let kept = prediction.without_outliers(&observed, mark_m);
                if kept != observed {
                    prediction = self.predict(&kept)?;
                    matches.keep(|vertex| kept[vertex].is_some());
                    observed = kept;
                }
                let (observed, disturbance) =
                    prediction.shape_noise(patches, &observed, carriers, amplitude_m);
                return Ok(Followed { radius, matches, observed, disturbance });
            }
            let coords = tracking.reference().vertices.coords();
            let expected = tracking.ground().displaced(coords, &prediction.displacement_m);
            matches = tracking.match_joined(&expected, radius.metres);
            observed = tracking.displacements(&matches);
            round += 1;
        }
    }

    fn predict(&self, observed: &Observed) -> Result<Prediction> {
        let Follower { tracking, carriers, parameters } = *self;
        let patches = &tracking.matched.reference.patches;
        let deformation = Deformation::estimate(patches, observed, carriers, parameters)?;
        Ok(deformation.predict(patches, observed, carriers, parameters.amplitude_m))
    }
}

impl Followed {
    /// Returns the number of vertices over the variance of their noise, 1/m²: about proportional to
    /// the square of the score that a mark has.
    fn information(&self) -> f64 {
        self.matches.count as f64 / self.disturbance.deformation.noise_m.powi(2)
    }
}
