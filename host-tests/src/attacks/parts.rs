//! The parts of a geometry: points, lines and rings, each a run of vertices.

use super::Map;
use geo::{
    Coord, Geometry, GeometryCollection, LineString, MultiLineString, MultiPoint, MultiPolygon, Point,
    Polygon,
};

/// The kind of a run of vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// One vertex.
    Point,
    /// At least two.
    Line,
    /// At least three; the last is joined to the first and not repeated.
    Ring,
}

impl Part {
    /// Returns the fewest vertices it can have.
    pub fn least(self) -> usize {
        match self {
            Part::Point => 1,
            Part::Line => 2,
            Part::Ring => 3,
        }
    }

    /// Returns the edges of a run of vertices.
    pub fn edges(self, run: &[Coord]) -> impl Iterator<Item = (Coord, Coord)> {
        let closing = (self == Part::Ring).then(|| (run[run.len() - 1], run[0]));
        run.windows(2).map(|pair| (pair[0], pair[1])).chain(closing)
    }
}

/// A function that returns the vertices in place of a run; with too few for a part, it is dropped.
pub type Rewrite<'a> = &'a mut dyn FnMut(Part, &[Coord]) -> Vec<Coord>;

/// Rewrites every part of a geometry. A polygon is dropped with its outer ring, a geometry with its
/// last part.
pub fn rewrite(geometry: &Geometry, f: Rewrite) -> Option<Geometry> {
    match geometry {
        Geometry::Point(p) => point(p, f).map(Geometry::Point),
        Geometry::LineString(l) => line(l, f).map(Geometry::LineString),
        Geometry::Polygon(p) => polygon(p, f).map(Geometry::Polygon),
        Geometry::MultiPoint(m) => {
            let parts: Vec<_> = m.iter().filter_map(|p| point(p, f)).collect();
            (!parts.is_empty()).then(|| MultiPoint(parts).into())
        }
        Geometry::MultiLineString(m) => {
            let parts: Vec<_> = m.iter().filter_map(|l| line(l, f)).collect();
            (!parts.is_empty()).then(|| MultiLineString(parts).into())
        }
        Geometry::MultiPolygon(m) => {
            let parts: Vec<_> = m.iter().filter_map(|p| polygon(p, f)).collect();
            (!parts.is_empty()).then(|| MultiPolygon(parts).into())
        }
        Geometry::GeometryCollection(c) => {
            let parts: Vec<_> = c.iter().filter_map(|g| rewrite(g, f)).collect();
            (!parts.is_empty()).then_some(Geometry::GeometryCollection(GeometryCollection(parts)))
        }
        Geometry::Line(_) | Geometry::Rect(_) | Geometry::Triangle(_) => {
            unreachable!("GDAL has no such type")
        }
    }
}

/// Calls `f` with every part of a geometry.
pub fn visit(geometry: &Geometry, mut f: impl FnMut(Part, &[Coord])) {
    rewrite(geometry, &mut |part, run| {
        f(part, run);
        run.to_vec()
    });
}

/// Rewrites every part of a whole map like [`rewrite`].
pub fn rewrite_map(map: &Map, f: Rewrite) -> Map {
    map.map_geometries(|geometry| rewrite(geometry, f))
}

/// Returns whether a geometry is a polygon or several.
pub fn is_polygonal(geometry: &Geometry) -> bool {
    matches!(geometry, Geometry::Polygon(_) | Geometry::MultiPolygon(_))
}

fn part(part: Part, run: &[Coord], f: Rewrite) -> Option<Vec<Coord>> {
    let rewritten = f(part, run);
    (rewritten.len() >= part.least()).then_some(rewritten)
}

fn point(p: &Point, f: Rewrite) -> Option<Point> {
    Some(Point(part(Part::Point, &[p.0], f)?[0]))
}

fn line(l: &LineString, f: Rewrite) -> Option<LineString> {
    part(Part::Line, &l.0, f).map(LineString)
}

fn ring(r: &LineString, f: Rewrite) -> Option<LineString> {
    let open = r.0.split_last().map_or(&[][..], |(_, open)| open);
    if open.is_empty() {
        return None;
    }
    let mut closed = part(Part::Ring, open, f)?;
    closed.push(closed[0]);
    Some(LineString(closed))
}

fn polygon(p: &Polygon, f: Rewrite) -> Option<Polygon> {
    let exterior = ring(p.exterior(), f)?;
    let holes = p.interiors().iter().filter_map(|hole| ring(hole, f)).collect();
    Some(Polygon::new(exterior, holes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{in_memory, wkt};

    #[test]
    fn degenerate_parts_go_and_a_polygon_goes_with_its_outer_ring() {
        let map = in_memory(&[
            "MULTILINESTRING ((0 0,1 0),(5 0,6 0,7 0))",
            "POLYGON ((0 0,9 0,9 9,0 9,0 0),(5 1,6 1,6 2,5 1))",
            "POLYGON ((5 5,6 5,6 6,5 5))",
            "POINT (5 5)",
        ]);
        let without_5 = |_: Part, run: &[Coord]| run.iter().copied().filter(|c| c.x != 5.0).collect();
        let map = rewrite_map(&map, &mut { without_5 });
        assert_eq!(wkt(&map), ["MULTILINESTRING ((0 0,1 0),(6 0,7 0))", "POLYGON ((0 0,9 0,9 9,0 9,0 0))"]);
    }

    #[test]
    fn a_ring_has_an_edge_back_to_its_start() {
        let run = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]].map(Coord::from);
        assert_eq!(Part::Ring.edges(&run).count(), 3);
        assert_eq!(Part::Line.edges(&run).count(), 2);
    }
}
