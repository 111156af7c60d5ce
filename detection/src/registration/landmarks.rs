//! Landmarks: features of two maps that have equal attribute values.

use meshmark_core::map_data::{Dimension, Label};
use std::collections::HashMap;

/// With fewer landmarks than this, those of lines are used too.
const FEW_LANDMARKS: usize = 8;

/// Returns pairs of places (suspect, reference) of features that share an attribute value which
/// occurs once in either map.
pub fn pairs(reference: &[Label], suspect: &[Label]) -> Vec<[[f64; 2]; 2]> {
    let (reference, suspect) = (unique(reference), unique(suspect));
    let mut both: Vec<(&Label, &Label)> =
        reference.into_iter().filter_map(|(value, r)| Some((*suspect.get(value)?, r))).collect();
    both.sort_by(|a, b| a.1.value.cmp(&b.1.value));
    let is_line = |l: &Label| l.dimension == Dimension::Line;
    let certain = both.iter().filter(|(s, r)| !is_line(s) && !is_line(r)).count();
    let mut pairs: Vec<[[f64; 2]; 2]> = both
        .iter()
        .filter(|(s, r)| certain < FEW_LANDMARKS || (!is_line(s) && !is_line(r)))
        .map(|(s, r)| [s.point, r.point])
        .collect();
    // A feature with two unique values is one landmark.
    pairs.sort_by(|a, b| a.as_flattened().partial_cmp(b.as_flattened()).expect("finite"));
    pairs.dedup();
    pairs
}

fn unique(labels: &[Label]) -> HashMap<&str, &Label> {
    let mut seen: HashMap<&str, Option<&Label>> = HashMap::new();
    for label in labels {
        let entry = seen.entry(&label.value).or_insert(Some(label));
        // An equal value in two fields of one feature is still unique.
        if entry.is_some_and(|first| first.point != label.point) {
            *entry = None;
        }
    }
    seen.into_iter().filter_map(|(value, label)| Some((value, label?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn label(value: &str, point: [f64; 2]) -> Label {
        Label { value: value.into(), point, dimension: Dimension::Area }
    }

    #[test]
    fn only_values_that_occur_once_in_either_map_make_a_pair() {
        let reference = [label("a", [0.0, 0.0]), label("b", [1.0, 0.0]), label("b", [2.0, 0.0])];
        let suspect = [label("a", [5.0, 5.0]), label("b", [6.0, 5.0]), label("c", [7.0, 5.0])];
        assert_eq!(pairs(&reference, &suspect), [[[5.0, 5.0], [0.0, 0.0]]]);
    }
}
