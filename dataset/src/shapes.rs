//! Shapes: rings and lines by which a verifier recognises features that have no usable attributes.

use geo::{Geometry, LineString};

/// A ring or a line must have so many vertices to be told from others under an affine map.
pub const LEAST_VERTICES: usize = 5;

/// The outer ring of a polygon, or a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Vertices in order, CRS units; the first one is not repeated at the end of a ring.
    pub vertices: Vec<[f64; 2]>,
    /// Whether it is a ring.
    pub closed: bool,
}

/// The shapes of one geometry.
pub(crate) fn of_geometry(geometry: &Geometry, shapes: &mut Vec<Shape>) {
    match geometry {
        Geometry::LineString(line) => push(line, shapes),
        Geometry::Polygon(polygon) => push(polygon.exterior(), shapes),
        Geometry::MultiLineString(lines) => lines.iter().for_each(|line| push(line, shapes)),
        Geometry::MultiPolygon(parts) => parts.iter().for_each(|part| push(part.exterior(), shapes)),
        Geometry::GeometryCollection(parts) => parts.iter().for_each(|part| of_geometry(part, shapes)),
        _ => {}
    }
}

fn push(line: &LineString, shapes: &mut Vec<Shape>) {
    let mut vertices: Vec<[f64; 2]> = line.0.iter().map(|c| [c.x, c.y]).collect();
    vertices.dedup();
    let closed = vertices.len() > 1 && vertices.first() == vertices.last();
    if closed {
        vertices.pop();
    }
    if vertices.len() >= LEAST_VERTICES {
        shapes.push(Shape { vertices, closed });
    }
}
