//! Averages over maps.

use meshmark_host_tests::experiment::{Outcome, bit_error_percent, is_match};

/// An attack, a chip rate and a demodulator over all maps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cell {
    /// Mean bit error rate, per cent; a suspect that was not registered counts 50.
    pub bit_error_percent: f64,
    /// Number of suspects.
    pub count: usize,
    /// Number of suspects that were not registered.
    pub unregistered: usize,
    /// Number of verdicts "match".
    pub matches: usize,
    /// Median of the p-values, log₁₀, of registered suspects.
    pub p_value_log10: Option<f64>,
    /// Mean time of a verification.
    pub seconds: f64,
}

/// Summarises the outcomes for recipients of the suspect's copies; `None` without any.
pub fn cell<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Option<Cell> {
    let outcomes: Vec<&Outcome> = outcomes.into_iter().collect();
    let count = outcomes.len();
    if count == 0 {
        return None;
    }
    let mean = |value: fn(&Outcome) -> f64| outcomes.iter().map(|o| value(o)).sum::<f64>() / count as f64;
    let mut p_values: Vec<f64> = outcomes.iter().filter_map(|o| o.p_value_log10).collect();
    p_values.sort_by(f64::total_cmp);
    Some(Cell {
        bit_error_percent: mean(|o| bit_error_percent(o).unwrap_or(50.0)),
        count,
        unregistered: outcomes.iter().filter(|o| o.bit_errors.is_none()).count(),
        matches: outcomes.iter().filter(|o| is_match(o)).count(),
        p_value_log10: (!p_values.is_empty()).then(|| p_values[p_values.len() / 2]),
        seconds: mean(|o| o.seconds),
    })
}

/// Returns distinct values in the order of their first occurrence.
pub fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut distinct = Vec::new();
    for value in values {
        if !distinct.contains(&value) {
            distinct.push(value);
        }
    }
    distinct
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use meshmark_host_tests::{experiment::cases::Table, product::Profile};

    /// Returns an outcome on a map called "town"; `None` bit errors stand for a suspect that was
    /// not registered.
    pub fn outcome(
        id: &str,
        chip_rate: usize,
        demodulator: &'static str,
        bit_errors: Option<usize>,
    ) -> Outcome {
        let verdict = if bit_errors.is_some_and(|errors| errors < 30) { "match" } else { "inconclusive" };
        Outcome {
            table: Table::Paper,
            map: "town".into(),
            profile: Profile::repetition(chip_rate),
            case: id.into(),
            title: format!("attack {id}"),
            strength: Some(0.5),
            seed: 1,
            demodulator,
            asked: "recipient 1".into(),
            guilty: true,
            verdict: Some(verdict.into()),
            reason: "so it is".into(),
            bits: if bit_errors.is_some() { 128 } else { 0 },
            bit_errors,
            p_value_log10: bit_errors.map(|errors| errors as f64 - 30.0),
            p_mark_log10: None,
            p_recipient_log10: None,
            registration: Some("landmarks".into()),
            landmarks: 20,
            rms_m: Some(0.1),
            vertices_reference: 3000,
            vertices_suspect: 3000,
            vertices_matched: 2900,
            seconds: 1.0,
        }
    }

    #[test]
    fn a_suspect_that_was_not_registered_counts_as_guessing_and_is_counted() {
        let outcomes = [outcome("9c", 2, "joint", Some(0)), outcome("9c", 2, "joint", None)];
        let cell = cell(&outcomes).unwrap();
        assert_eq!((cell.bit_error_percent, cell.count, cell.unregistered, cell.matches), (25.0, 2, 1, 1));
    }

    #[test]
    fn nothing_has_no_average() {
        assert_eq!(cell([]), None);
    }

    #[test]
    fn distinct_values_keep_their_order() {
        assert_eq!(distinct([3, 1, 3, 2, 1].into_iter()), [3, 1, 2]);
    }
}
