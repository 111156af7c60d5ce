//! Attacks that grow and shrink shapes: buffers of walls and of the lines of roads.

use super::{Map, parts::is_polygonal};
use geo::{
    Buffer, Geometry, MultiPolygon, Simplify,
    algorithm::buffer::{BufferStyle, LineJoin},
};

/// A corner sharper than this, in radians, is not drawn out to a mitre; GIS stop at five times the
/// distance.
const SHARPEST_MITRE: f64 = 0.4;
/// A tolerance, units of the CRS, that removes the splinters of edges that an offset leaves at
/// blunt corners.
const SPLINTERS: f64 = 0.01;

/// The shape of a buffer at a convex corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Join {
    /// An arc.
    Round,
    /// A corner.
    Mitre,
}

/// Geometries that grow or shrink by a distance, units of the CRS. The rest of the map is dropped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Buffering {
    /// Polygons out and in again.
    OutAndIn { distance: f64, join: Join },
    /// Polygons in, corners kept.
    Erode { distance: f64 },
    /// Lines to areas, as roads are drawn.
    AroundLines { distance: f64 },
}

impl Buffering {
    /// Returns the rest of a map.
    pub fn apply(self, map: &Map) -> Map {
        map.map_geometries(|geometry| self.of_geometry(geometry)).of_any_type()
    }

    fn of_geometry(self, geometry: &Geometry) -> Option<Geometry> {
        let is_line = matches!(geometry, Geometry::LineString(_) | Geometry::MultiLineString(_));
        let grown = match self {
            Buffering::OutAndIn { distance, join } if is_polygonal(geometry) => {
                geometry.buffer_with_style(style(distance, join)).buffer_with_style(style(-distance, join))
            }
            Buffering::Erode { distance } if is_polygonal(geometry) => {
                geometry.buffer_with_style(style(-distance, Join::Mitre))
            }
            Buffering::AroundLines { distance } if is_line => {
                geometry.buffer_with_style(style(distance, Join::Round))
            }
            _ => return None,
        };
        one_or_many(grown.simplify(SPLINTERS))
    }
}

fn style(distance: f64, join: Join) -> BufferStyle<f64> {
    match join {
        Join::Round => BufferStyle::new(distance),
        Join::Mitre => BufferStyle::new(distance).line_join(LineJoin::Miter(SHARPEST_MITRE)),
    }
}

/// Returns one polygon, several, or nothing.
pub(super) fn one_or_many(mut polygons: MultiPolygon) -> Option<Geometry> {
    match polygons.0.len() {
        0 => None,
        1 => polygons.0.pop().map(Geometry::Polygon),
        _ => Some(polygons.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory};
    use geo::Area;

    /// Six metres by five, a line of ten, a point.
    const SHAPES: [&str; 3] = ["POLYGON ((0 0,6 0,6 5,0 5,0 0))", "LINESTRING (20 0,30 0)", "POINT (1 1)"];

    fn areas(buffering: Buffering) -> Vec<f64> {
        buffering.apply(&in_memory(&SHAPES)).geometries().map(Area::unsigned_area).collect()
    }

    fn is_close(areas: &[f64], wanted: f64) -> bool {
        areas.len() == 1 && (areas[0] - wanted).abs() < 0.01 * wanted
    }

    #[test]
    fn shapes_grow_and_shrink_by_the_distance() {
        assert!(is_close(&areas(Buffering::Erode { distance: 0.5 }), 5.0 * 4.0));
        assert!(areas(Buffering::Erode { distance: 3.0 }).is_empty(), "nothing is left of a small house");
        let road = areas(Buffering::AroundLines { distance: 2.0 });
        assert!(is_close(&road, 10.0 * 4.0 + 4.0 * std::f64::consts::PI), "{road:?}");
        for join in [Join::Round, Join::Mitre] {
            assert!(is_close(&areas(Buffering::OutAndIn { distance: 1.0, join }), 30.0), "{join:?}");
        }
    }

    #[test]
    fn out_and_in_fills_notches_and_brings_corners_back() {
        let notched = in_memory(&["POLYGON ((0 0,9 0,9 5,5 5,5 3,4 3,4 5,0 5,0 0))"]);
        for (join, most) in [(Join::Mitre, 8), (Join::Round, 16)] {
            let filled = Buffering::OutAndIn { distance: 1.0, join }.apply(&notched);
            let area: f64 = filled.geometries().map(Area::unsigned_area).sum();
            assert!((area - 45.0).abs() < 0.3, "{join:?}: {area}");
            let count = filled.vertices().unwrap().len();
            assert!((4..=most).contains(&count), "{join:?}: {count}");
        }
    }

    #[test]
    fn most_buildings_of_a_real_map_survive_the_erosion() {
        let map = fixture("kotka.gpkg");
        let polygons = map.geometries().filter(|geometry| is_polygonal(geometry)).count();
        let eroded = Buffering::Erode { distance: 0.3 }.apply(&map);
        assert!(eroded.features().count() * 100 > polygons * 99);
        let area = |map: &Map| -> f64 { map.geometries().map(Area::unsigned_area).sum() };
        assert!(area(&eroded) < area(&map));
    }
}
