//! Rows that keep the course of lines and rings, or less, but not their vertices.

use super::{Attack, Row};
use crate::attacks::{curves::Redrawing, outlines::Outline};

/// Lines and rings drawn anew, polygons replaced.
pub fn rows() -> Vec<Row> {
    let resampled = [1.0, 2.0, 5.0].map(|spacing| {
        let title = format!("resampled every {spacing} m, without the original vertices");
        drawn(&format!("resampled{spacing}"), &title, Redrawing::Resample { spacing })
    });
    let smoothed = [(1, "once"), (3, "three times")].map(|(rounds, times)| {
        let title = format!("corners cut (Chaikin) {times}");
        drawn(&format!("chaikin{rounds}"), &title, Redrawing::Chaikin { rounds })
    });
    let outlines = [
        ("centroids", "centroids of the polygons alone", Outline::Centroid),
        ("boxes", "bounding boxes of the polygons alone", Outline::BoundingBox),
        ("rectangles", "minimum rectangles of the polygons alone", Outline::MinimumRectangle),
    ]
    .map(|(id, title, outline)| Row::new(id, title, Attack::Outline(outline)));
    [&resampled[..], &smoothed, &outlines].concat()
}

fn drawn(id: &str, title: &str, redrawing: Redrawing) -> Row {
    Row::new(id, title, Attack::DrawAnew(redrawing))
}
