//! Figures of many values.

/// Mean, 99th percentile and maximum; zeros for no values.
pub(crate) struct Spread {
    pub mean: f64,
    pub rms: f64,
    pub p99: f64,
    pub max: f64,
}

impl Spread {
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let count = values.len().max(1) as f64;
        let at = |share: usize| values.len().checked_sub(1).map_or(0.0, |last| values[last * share / 100]);
        Spread {
            mean: values.iter().sum::<f64>() / count,
            rms: (values.iter().map(|v| v * v).sum::<f64>() / count).sqrt(),
            p99: at(99),
            max: at(100),
        }
    }
}
