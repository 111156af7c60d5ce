//! How often findings are wrong, as the studies of docs/validation.md and docs/evaluation.md counted it.

use super::{MarkParameters, Report};

/// Returns sentences with the rates of both kinds of errors, and the sizes of the samples.
pub(crate) fn error_rates(report: &Report) -> Vec<String> {
    let innocent = match &report.parameters.mark {
        MarkParameters::Message(_) => {
            "Of 19 800 keys and 19 800 recipients who had no part in marked, attacked and unmarked copies of nine maps, none \
             had a probability by chance below one in a million (study of false alarms)."
        }
        MarkParameters::Fingerprint(_) => {
            "Of CALIBRATION had a likelihood ratio of 1 000 000 (study of calibration)."
        }
    };
    let guilty = "Of 90 copies of three maps that carry a mark and were damaged in random ways, 55 were a match, 35 \
                  inconclusive, and none was wrongly excluded (study of misses).";
    let bound = "With no error among n cases, the rate of errors is below 3/n with a confidence of 95 %.";
    [innocent, guilty, bound].map(String::from).to_vec()
}
