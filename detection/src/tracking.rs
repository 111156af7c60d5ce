//! Tracking: follows a deformation that moved vertices out of the matching radius.

use crate::{
    groups,
    matching::{Graph, LEAST_MATCHED, Matcher, Matches, Near, Radius, RadiusChoice, RadiusReason},
};
use meshmark_core::{
    Result,
    deformation::{Deformation, Observed, Prediction, mark_deviation_m},
    ground::Ground,
    map_data::MapData,
    options::Parameters,
    patches::Patches,
};

/// Number of rounds in which vertices are matched around the predicted deformation.
const ROUNDS: usize = 3;

/// Groups are taken to have moved as a whole where that gives this many times the information.
const CLEARLY_MORE: f64 = 1.5;

/// Follows a deformation that moved vertices out of the matching radius: matches give a
/// deformation, and the deformation predicts the places of more matches. The key is not involved,
/// so decoys have the same input.
pub struct Tracking<'a> {
    reference: &'a MapData,
    moved: &'a [[f64; 2]],
    ground: &'a Ground,
    patches: &'a Patches,
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
    /// Prepares a reference and its suspect; `moved` are the vertices of the suspect in reference
    /// coordinates.
    pub fn new(
        (reference, suspect): (&'a MapData, &MapData),
        moved: &'a [[f64; 2]],
        ground: &'a Ground,
        patches: &'a Patches,
    ) -> Self {
        let graphs = [reference, suspect].map(|map| Graph::new(map.vertices.len(), &map.segments));
        Tracking { reference, moved, ground, patches, graphs }
    }

    /// Matches until the deformation is found, where `carriers` coefficients of a patch and axis
    /// carry the mark. Where noise moved vertices beyond the least radius, polygon groups may have
    /// moved as a whole; the start that gives more information about a mark is taken.
    ///
    /// # Errors
    /// Returns the errors of the estimation.
    pub fn follow(&self, carriers: usize, parameters: &Parameters, radius: Radius) -> Result<Followed> {
        let fit = Fit { tracking: self, carriers, parameters };
        let coords = self.reference.vertices.coords();
        let plain = fit.follow(coords, radius)?;
        if radius.reason != RadiusReason::Noise {
            return Ok(plain);
        }
        let matcher = Matcher::new(coords, self.ground, self.reference.vertices.centre());
        let shifts = groups::shifts_m(self.reference, &Near::new(&matcher, self.moved));
        if shifts.iter().flatten().count() < LEAST_MATCHED {
            return Ok(plain);
        }
        let shifts: Vec<[f64; 2]> = shifts.into_iter().map(Option::unwrap_or_default).collect();
        let expected = self.shifted(&shifts);
        let centre = self.reference.vertices.centre();
        let matcher = Matcher::new(&expected, self.ground, centre);
        let unit_m = self.ground.metres_per_unit(centre);
        let radius = RadiusChoice::FromData.choose(&matcher, self.moved, unit_m);
        let grouped = fit.follow(&expected, Radius { reason: RadiusReason::Groups, ..radius })?;
        Ok(if grouped.information() > CLEARLY_MORE * plain.information() { grouped } else { plain })
    }

    /// Returns the places of the reference vertices after these displacements, CRS units.
    fn shifted(&self, displacement_m: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let shifted = |(p, d): (&[f64; 2], &[f64; 2])| {
            let unit = self.ground.metres_per_unit(*p);
            [p[0] + d[0] / unit[0], p[1] + d[1] / unit[1]]
        };
        let coords = self.reference.vertices.coords().iter();
        coords.zip(displacement_m).map(shifted).collect()
    }

    /// Matches with the expected places of the reference vertices, CRS units.
    fn match_joined(&self, expected: &[[f64; 2]], radius_m: f64) -> Matches {
        let matcher = Matcher::new(expected, self.ground, self.reference.vertices.centre());
        matcher.joined(self.moved, radius_m, self.graphs.each_ref())
    }

    /// Returns the displacement of every reference vertex, metres; `None` where no suspect vertex
    /// matches.
    fn displacements(&self, matches: &Matches) -> Vec<Option<[f64; 2]>> {
        matches.displacements_m(self.reference.vertices.coords(), self.moved, self.ground)
    }
}

/// The fit of a disturbance to the displacements of matched vertices.
struct Fit<'a> {
    tracking: &'a Tracking<'a>,
    carriers: usize,
    parameters: &'a Parameters,
}

impl Fit<'_> {
    /// Matches around the expected places of the reference vertices, CRS units, and then around
    /// those that the fitted disturbance predicts.
    fn follow(&self, expected: &[[f64; 2]], radius: Radius) -> Result<Followed> {
        let Fit { tracking, carriers, parameters } = *self;
        let (patches, amplitude_m) = (tracking.patches, parameters.amplitude_m);
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
            matches = tracking.match_joined(&tracking.shifted(&prediction.displacement_m), radius.metres);
            observed = tracking.displacements(&matches);
            round += 1;
        }
    }

    fn predict(&self, observed: &Observed) -> Result<Prediction> {
        let Fit { tracking: &Tracking { patches, .. }, carriers, parameters } = *self;
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
