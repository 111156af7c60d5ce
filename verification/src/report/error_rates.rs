//! How often findings are wrong, as the studies of docs/validation.md and docs/evaluation.md counted it.

use super::{MarkParameters, Report};

/// Returns sentences with the rates of both kinds of errors, and the sizes of the samples.
pub(crate) fn error_rates(report: &Report) -> Vec<String> {
    let of_mark = match &report.parameters.mark {
        MarkParameters::Message(_) => [
            "Of 19 800 keys and 19 800 recipients who had no part in marked, attacked and unmarked copies of nine maps, none \
             had a probability by chance below one in a million (study of false alarms).",
            "Of 90 copies of three maps that carry a mark and were damaged in random ways, 55 were a match, 35 \
             inconclusive, and none was wrongly excluded (study of misses).",
        ],
        MarkParameters::Fingerprint(_) => [
            "Of 720 000 recipients and 76 000 keys that had no part in damaged copies of two maps, 29 had a likelihood ratio \
             of 100 or more, 2 of 1000 or more, and none of 100 000 (study of calibration).",
            "Of 80 copies of two maps that carry a mark and were damaged in random ways, 56 had the largest likelihood \
             ratio that is stated, and 6 one below 1 against another recipient (study of calibration).",
        ],
    };
    let bound = "With no error among n cases, the rate of errors is below 3/n with a confidence of 95 %.";
    of_mark.into_iter().chain([bound]).map(String::from).collect()
}
