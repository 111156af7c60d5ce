//! The figures: this module combines attacks into lines, and lines into plots.

use super::{
    paper,
    summary::{cell, distinct},
};
use crate::plot::{Axis, Plot, Series};
use meshmark_host_tests::{
    Result,
    experiment::{Outcome, cases::DEMODULATORS},
    product::Profile,
};
use plotters::style::RGBColor;

/// A family of attacks in several strengths.
struct Family {
    file: &'static str,
    title: &'static str,
    x_label: &'static str,
    log_x: bool,
    ids: &'static [&'static str],
}

const FAMILIES: [Family; 5] = [
    Family {
        file: "noise.svg",
        title: "Uniform noise",
        x_label: "noise on either coordinate, ± metres",
        log_x: false,
        ids: &["9a", "9b", "9c", "noise1"],
    },
    Family {
        file: "crop.svg",
        title: "Cropping",
        x_label: "share of the area that is left",
        log_x: true,
        ids: &["10-1", "10-2", "10-3", "10-4", "10-5", "10-6", "10-7", "10-8"],
    },
    Family {
        file: "vertex_deletion.svg",
        title: "Deletion of vertices",
        x_label: "share of the vertices deleted",
        log_x: false,
        ids: &["vertices30", "vertices50", "vertices80"],
    },
    Family {
        file: "feature_deletion.svg",
        title: "Deletion of features",
        x_label: "share of the features deleted",
        log_x: false,
        ids: &["features50", "features80"],
    },
    Family {
        file: "simplification.svg",
        title: "Simplification (Douglas–Peucker)",
        x_label: "tolerance, metres",
        log_x: false,
        ids: &["dp0.25", "dp0.5", "dp1", "dp2"],
    },
];

/// Returns the file names and drawings of those families that were measured.
///
/// # Errors
/// Fails when a plot cannot be drawn.
pub fn all(outcomes: &[Outcome]) -> Result<Vec<(&'static str, String)>> {
    let drawn = FAMILIES.iter().map(|family| (family.file, family.plot(outcomes)));
    let shown = drawn.filter(|(_, plot)| !plot.series.is_empty());
    shown.map(|(file, plot)| Ok((file, plot.to_svg()?))).collect()
}

/// The colours of both demodulators and of the published values: light, dark and middle.
const BLUES: [RGBColor; 3] = [RGBColor(158, 202, 225), RGBColor(8, 81, 156), RGBColor(66, 146, 198)];
const ORANGES: [RGBColor; 3] = [RGBColor(253, 174, 107), RGBColor(166, 54, 3), RGBColor(241, 105, 19)];

impl Family {
    fn plot(&self, outcomes: &[Outcome]) -> Plot {
        let of_family: Vec<&Outcome> = outcomes.iter().filter(|o| of_family(self, o)).collect();
        let mut series = Vec::new();
        for (shade, c) in distinct(of_family.iter().map(|o| o.profile.chip_rate)).into_iter().enumerate() {
            let colours = [BLUES, ORANGES][shade % 2];
            for (demodulator, colour) in DEMODULATORS.into_iter().zip(colours) {
                let points = points(&of_family, |outcomes| {
                    cell(
                        outcomes
                            .iter()
                            .copied()
                            .filter(|o| o.profile.chip_rate == c && o.demodulator == demodulator),
                    )
                    .map(|cell| cell.bit_error_percent)
                });
                series.push(Series { name: format!("c={c}, {demodulator}"), points, colour, thin: false });
            }
            let published = points(&of_family, |outcomes| {
                let ids = distinct(outcomes.iter().map(|o| o.case.as_str()));
                let rates: Vec<f64> = ids.iter().filter_map(|id| paper::bit_error_percent(id, c)).collect();
                (!rates.is_empty()).then(|| rates.iter().sum::<f64>() / rates.len() as f64)
            });
            if !published.is_empty() {
                let name = format!("c={c}, published 2003");
                series.push(Series { name, points: published, colour: colours[2], thin: true });
            }
        }
        let x = Axis { label: self.x_label.into(), log: self.log_x };
        Plot { title: self.title.into(), x, y: Axis::linear("bit errors, %"), series }
    }
}

/// Returns whether an outcome belongs to a family. Only raw bit errors make a line; with a code
/// there are none, or many.
fn of_family(family: &Family, outcome: &Outcome) -> bool {
    family.ids.contains(&outcome.case.as_str()) && outcome.profile != Profile::LDPC
}

/// Returns one point for every strength, with the `rate` of its outcomes.
fn points(outcomes: &[&Outcome], rate: impl Fn(&[&Outcome]) -> Option<f64>) -> Vec<(f64, f64)> {
    let mut strengths = distinct(outcomes.iter().filter_map(|o| o.strength));
    strengths.sort_by(f64::total_cmp);
    let point = |strength: f64| {
        let of: Vec<&Outcome> = outcomes.iter().copied().filter(|o| o.strength == Some(strength)).collect();
        Some((strength, rate(&of)?))
    };
    strengths.into_iter().filter_map(point).collect()
}
