//! Tracking: follows a deformation that moved vertices out of the matching radius.

use crate::matching::{Graph, Matcher, Matches};
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
    /// carry the mark.
    ///
    /// # Errors
    /// Returns the errors of the estimation.
    pub fn follow(&self, carriers: usize, parameters: &Parameters, radius_m: f64) -> Result<Followed> {
        let coords = self.reference.vertices.coords();
        let mut matches = self.match_joined(coords, radius_m);
        let mut observed = self.displacements(&matches);
        let amplitude_m = parameters.amplitude_m;
        let mark_m = mark_deviation_m(self.patches, carriers, amplitude_m);
        let fit = |observed: &Observed| -> Result<Prediction> {
            let deformation = Deformation::estimate(self.patches, observed, carriers, parameters)?;
            Ok(deformation.predict(self.patches, observed, carriers, amplitude_m))
        };
        let mut round = 1;
        loop {
            let mut prediction = fit(&observed)?;
            if prediction.deformation.deviation_m == 0.0 || round == ROUNDS {
                let kept = prediction.without_outliers(&observed, mark_m);
                if kept != observed {
                    prediction = fit(&kept)?;
                    matches.keep(|vertex| kept[vertex].is_some());
                    observed = kept;
                }
                let (shaped, prediction) =
                    prediction.shape_noise(self.patches, &observed, carriers, amplitude_m);
                return Ok(Followed { matches, observed: shaped, disturbance: prediction });
            }
            matches = self.match_around(&prediction, radius_m);
            observed = self.displacements(&matches);
            round += 1;
        }
    }

    fn match_around(&self, prediction: &Prediction, radius_m: f64) -> Matches {
        let shifted = |(p, d): (&[f64; 2], &[f64; 2])| {
            let unit = self.ground.metres_per_unit(*p);
            [p[0] + d[0] / unit[0], p[1] + d[1] / unit[1]]
        };
        let coords = self.reference.vertices.coords().iter();
        let expected: Vec<[f64; 2]> = coords.zip(&prediction.displacement_m).map(shifted).collect();
        self.match_joined(&expected, radius_m)
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
