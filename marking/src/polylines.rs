//! Rings and lines, from which a verifier recognises features without usable attributes.

use geo::{Geometry, LineString};
use meshmark_core::map_data::Polyline;

/// Appends the polylines of one geometry.
pub(crate) fn append(geometry: &Geometry, polylines: &mut Vec<Polyline>) {
    match geometry {
        Geometry::LineString(line) => push(line, polylines),
        Geometry::Polygon(polygon) => push(polygon.exterior(), polylines),
        Geometry::MultiLineString(lines) => lines.iter().for_each(|line| push(line, polylines)),
        Geometry::MultiPolygon(parts) => parts.iter().for_each(|part| push(part.exterior(), polylines)),
        Geometry::GeometryCollection(parts) => parts.iter().for_each(|part| append(part, polylines)),
        _ => {}
    }
}

fn push(line: &LineString, polylines: &mut Vec<Polyline>) {
    let mut vertices: Vec<[f64; 2]> = line.0.iter().map(|c| [c.x, c.y]).collect();
    vertices.dedup();
    let closed = vertices.len() > 1 && vertices.first() == vertices.last();
    if closed {
        vertices.pop();
    }
    if vertices.len() >= Polyline::LEAST_VERTICES {
        polylines.push(Polyline { vertices, closed });
    }
}
