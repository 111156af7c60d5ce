//! Rows that keep the course of lines and rings, but not their vertices.

use super::row::Row;
use crate::attacks::Attack;
use crate::attacks::{
    curves::Redrawing,
    similarity::{About, rotation},
};

/// New vertices along traced lines, metres.
const TRACED: f64 = 2.0;

/// Returns the rows: lines and rings drawn anew, in place, and elsewhere without attributes.
pub fn rows() -> Vec<Row> {
    let resampled = [1.0, 2.0, 5.0].map(|spacing| {
        let title = format!("resampled every {spacing} m, without the original vertices");
        drawn(&format!("resampled{spacing}"), &title, Redrawing::Resample { spacing })
    });
    let smoothed = [(1, "once"), (3, "three times")].map(|(rounds, times)| {
        let title = format!("corners cut (Chaikin) {times}");
        drawn(&format!("chaikin{rounds}"), &title, Redrawing::Chaikin { rounds })
    });
    let traced = [0.1, 0.2, 0.4].map(|deviation| {
        let title = format!("traced anew with errors of {deviation} m");
        drawn(&format!("traced{deviation}"), &title, Redrawing::Trace { spacing: TRACED, deviation })
    });
    let rasters = [0.25, 0.5, 1.0].map(|pixel| {
        let title = format!("polygons alone, rasterised at {pixel} m and vectorised");
        Row::new(&format!("raster{pixel}"), &title, Attack::Vectorise { pixel })
    });
    let in_place = [&resampled[..], &smoothed, &traced, &rasters].concat();
    let moved: Vec<Row> = in_place.iter().map(moved).collect();
    [in_place, moved].concat()
}

fn drawn(id: &str, title: &str, redrawing: Redrawing) -> Row {
    Row::new(id, title, Attack::DrawAnew(redrawing))
}

/// Returns a row whose suspect is also moved and rotated, and has no attributes.
fn moved(row: &Row) -> Row {
    let attacks = vec![
        row.attack.clone(),
        Attack::DropAttributes,
        Attack::Linear(rotation(30.0), About::Centre),
        Attack::Translate([50.0, 30.0]),
    ];
    let title = format!("{}; moved, turned by 30°, attributes dropped", row.title);
    Row::new(&format!("{}moved", row.id), &title, Attack::Sequence(attacks))
}
