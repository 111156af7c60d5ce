//! The warning about a mark that damages the shape of a map.

use meshmark_core::{
    distortion::{AngleChange, Areas},
    options::{Parameters, Rigidity, Spelling},
};

/// At least this share of the right angles stays within a degree.
const LEAST_RIGHT_ANGLES_KEPT: f64 = 0.95;
/// 99 % of the areas change by at most this share.
const MOST_AREA_CHANGE: f64 = 0.02;

/// Returns a warning about a mark that bends right angles or changes areas, with the option that
/// helps. All copies of a map have the same text. `areas` are those of a record, where there is one.
pub fn damage_warning(
    parameters: &Parameters,
    angles: &AngleChange,
    areas: Option<&Areas>,
    spelling: Spelling,
) -> Option<String> {
    let bends = angles.right_angles > 0 && angles.right_angles_kept < LEAST_RIGHT_ANGLES_KEPT;
    let swells = areas.is_some_and(|areas| areas.p99_change > MOST_AREA_CHANGE);
    let remedy = match parameters.shape {
        Rigidity::Stiff => format!("lower {}", spelling.name("AMPLITUDE")),
        Rigidity::Free | Rigidity::Rigid => {
            format!("use {}", spelling.value("SHAPE", Rigidity::Stiff.name()))
        }
    };
    (bends || swells).then(|| {
        format!(
            "the mark changes more than 5 % of the right angles by over a degree, or 1 % of the areas by over 2 %: \
             {remedy} to keep them"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warning(kept: f64, change: f64, shape: Rigidity) -> Option<String> {
        let angles = AngleChange {
            count: 100,
            mean_change_deg: 0.1,
            p99_change_deg: 0.5,
            right_angles: 50,
            right_angles_kept: kept,
        };
        let areas = Areas { polygons: 9, mean_change: 0.001, p99_change: change, max_change: 0.1 };
        let parameters = Parameters { shape, ..Parameters::default() };
        damage_warning(&parameters, &angles, Some(&areas), Spelling::OpenOption)
    }

    #[test]
    fn damage_to_angles_or_areas_is_reported_with_the_option_that_helps() {
        assert_eq!(warning(0.96, 0.019, Rigidity::Free), None);
        for (kept, change) in [(0.94, 0.0), (1.0, 0.021)] {
            let text = warning(kept, change, Rigidity::Rigid).unwrap();
            assert!(text.contains("use SHAPE=STIFF to keep them"), "{text}");
            let text = warning(kept, change, Rigidity::Stiff).unwrap();
            assert!(text.contains("lower AMPLITUDE to keep them"), "{text}");
        }
    }
}
