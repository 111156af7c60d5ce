//! Rows in which other geometries replace polygons and lines.

use super::row::Row;
use crate::attacks::Attack;
use crate::attacks::{
    buffers::{Buffering, Join},
    outlines::Outline,
};

/// Returns the rows: outlines, buffers, joined areas, cut lines.
pub fn rows() -> Vec<Row> {
    let outlines = [
        ("centroids", "centroids of the polygons alone", Outline::Centroid),
        ("boxes", "bounding boxes of the polygons alone", Outline::BoundingBox),
        ("rectangles", "minimum rectangles of the polygons alone", Outline::MinimumRectangle),
    ]
    .map(|(id, title, outline)| Row::new(id, title, Attack::Outline(outline)));
    let out_and_in = |join| Buffering::OutAndIn { distance: 1.0, join };
    let buffers = [
        ("outinround", "polygons alone, buffered by 1 m and back, round", out_and_in(Join::Round)),
        ("outinmitre", "polygons alone, buffered by 1 m and back, mitred", out_and_in(Join::Mitre)),
        ("eroded", "polygons alone, walls eroded by 0.3 m", Buffering::Erode { distance: 0.3 }),
        ("roads", "lines alone, as areas of ±2 m", Buffering::AroundLines { distance: 2.0 }),
    ]
    .map(|(id, title, buffering)| Row::new(id, title, Attack::Buffer(buffering)));
    let joined = [
        Row::new("dissolved", "polygons dissolved, attributes dropped", Attack::Dissolve),
        Row::new("planar", "lines and outlines planarised, attributes dropped", Attack::Planarise),
    ];
    [&outlines[..], &buffers, &joined].concat()
}
