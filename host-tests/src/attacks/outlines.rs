//! Attacks that replace every polygon by a simpler geometry, and drop the rest of the map.

use super::{Map, parts::is_polygonal};
use geo::{BoundingRect, Centroid, Geometry, MinimumRotatedRect};

/// The geometry that replaces a polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outline {
    /// Its centroid.
    Centroid,
    /// Its extent along the axes.
    BoundingBox,
    /// The rectangle with the smallest area around it.
    MinimumRectangle,
}

impl Outline {
    /// Returns the features of polygons as their outlines.
    pub fn apply(self, map: &Map) -> Map {
        map.map_geometries(|geometry| self.of_polygon(geometry)).of_any_type()
    }

    fn of_polygon(self, geometry: &Geometry) -> Option<Geometry> {
        if !is_polygonal(geometry) {
            return None;
        }
        match self {
            Outline::Centroid => geometry.centroid().map(Geometry::Point),
            Outline::BoundingBox => geometry.bounding_rect().map(|bounds| bounds.to_polygon().into()),
            Outline::MinimumRectangle => geometry.minimum_rotated_rect().map(Geometry::Polygon),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{in_memory, wkt};
    use geo::Area;

    const DIAMOND: &str = "POLYGON ((0 2,2 0,4 2,2 4,0 2))";

    #[test]
    fn polygons_alone_are_left_as_their_outlines() {
        let map = in_memory(&[DIAMOND, "LINESTRING (0 0,9 9)", "POINT (1 1)"]);
        assert_eq!(wkt(&Outline::Centroid.apply(&map)), ["POINT (2 2)"]);
        assert_eq!(wkt(&Outline::BoundingBox.apply(&map)), ["POLYGON ((4 0,4 4,0 4,0 0,4 0))"]);
        let rectangle = Outline::MinimumRectangle.apply(&map);
        let area: f64 = rectangle.geometries().map(Area::unsigned_area).sum();
        assert!((area - 8.0).abs() < 1e-9, "the diamond is its own rectangle: {area}");
    }
}
