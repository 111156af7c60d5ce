//! Cropping: a part of the map is cut out, with new vertices where the border cuts lines and areas.

use super::Map;
use crate::Result;
use gdal::{
    cpl::CslStringList,
    vector::{self, ToGdal},
};
use geo::{BoundingRect, Geometry, HasDimensions, Rect};

/// A window in the map's bounding box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Window {
    /// The western half.
    LeftHalf,
    /// The northern half.
    TopHalf,
    /// One of four quarters; column 0 is west, row 0 is south.
    Quarter { column: usize, row: usize },
    /// The middle, with the map's proportions and this share of its area.
    Centre { area_share: f64 },
}

impl Window {
    /// Returns the share of the map's area.
    pub fn area_share(self) -> f64 {
        match self {
            Window::LeftHalf | Window::TopHalf => 0.5,
            Window::Quarter { .. } => 0.25,
            Window::Centre { area_share } => area_share,
        }
    }

    fn within(self, min: [f64; 2], max: [f64; 2]) -> Rect {
        let (low, high) = match self {
            Window::LeftHalf => ([0.0, 0.0], [0.5, 1.0]),
            Window::TopHalf => ([0.0, 0.5], [1.0, 1.0]),
            Window::Quarter { column, row } => {
                let low = [column, row].map(|i| i as f64 / 2.0);
                (low, low.map(|l| l + 0.5))
            }
            Window::Centre { area_share } => {
                let half = area_share.sqrt() / 2.0;
                ([0.5 - half; 2], [0.5 + half; 2])
            }
        };
        let at = |share: [f64; 2]| [0, 1].map(|axis| min[axis] + share[axis] * (max[axis] - min[axis]));
        Rect::new(at(low), at(high))
    }
}

/// Cuts a window out of a map.
///
/// # Errors
/// Fails on coordinates that are not finite, and on geometries that GEOS cannot cut even after a
/// repair.
pub fn crop(map: &Map, window: Window) -> Result<Map> {
    let (min, max) = map.vertices()?.bounds();
    let window = window.within(min, max);
    let mask = vector::Geometry::bbox(window.min().x, window.min().y, window.max().x, window.max().y)?;
    let cropped = map.try_map_geometries(|geometry| clip(geometry, window, &mask))?;
    Ok(cropped.of_any_type()) // a polygon may have become several
}

fn clip(geometry: &Geometry, window: Rect, mask: &vector::Geometry) -> Result<Option<Geometry>> {
    let Some(bounds) = geometry.bounding_rect() else { return Ok(None) };
    let inside = |axis: fn(geo::Coord) -> f64| {
        axis(bounds.min()) >= axis(window.min()) && axis(bounds.max()) <= axis(window.max())
    };
    if inside(|c| c.x) && inside(|c| c.y) {
        return Ok(Some(geometry.clone())); // untouched, down to the order of its vertices
    }
    let apart = |axis: fn(geo::Coord) -> f64| {
        axis(bounds.max()) < axis(window.min()) || axis(bounds.min()) > axis(window.max())
    };
    if apart(|c| c.x) || apart(|c| c.y) {
        return Ok(None);
    }
    // A marked polygon may cross itself where it was very narrow.
    let mut subject = geometry.to_gdal()?;
    if !subject.is_valid() {
        subject = subject.make_valid(&CslStringList::new())?;
    }
    let piece = subject.intersection(mask).ok_or("GEOS could not cut a geometry")?;
    if piece.is_empty() {
        return Ok(None);
    }
    Ok(same_dimension(piece.to_geo()?, geometry))
}

/// Returns a piece of the dimension of the original. Where a polygon only touches the border, GEOS
/// leaves a line or a point, which no clipping tool keeps.
fn same_dimension(piece: Geometry, original: &Geometry) -> Option<Geometry> {
    if piece.dimensions() != original.dimensions() {
        return None;
    }
    let Geometry::GeometryCollection(collection) = piece else { return Some(piece) };
    let kept = collection.0.into_iter().filter(|part| part.dimensions() == original.dimensions());
    Some(Geometry::GeometryCollection(kept.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory, wkt};

    const FRAME: &str = "MULTIPOINT ((0 0),(8 8))";

    fn cropped(window: Window, shape: &str) -> Vec<String> {
        wkt(&crop(&in_memory(&[FRAME, shape]), window).unwrap())[1..].to_vec()
    }

    #[test]
    fn the_border_cuts_new_vertices() {
        assert_eq!(cropped(Window::LeftHalf, "LINESTRING (1 1,7 7)"), ["LINESTRING (1 1,4 4)"]);
        assert_eq!(cropped(Window::TopHalf, "LINESTRING (1 1,7 7)"), ["LINESTRING (4 4,7 7)"]);
        let quarter = Window::Quarter { column: 0, row: 0 };
        let cut = cropped(quarter, "POLYGON ((3 1,5 1,5 2,3 2,3 1))");
        assert_eq!(cut.len(), 1);
        for corner in ["3 1", "4 1", "4 2", "3 2"] {
            assert!(cut[0].contains(corner), "{cut:?}");
        }
    }

    #[test]
    fn what_lies_outside_or_only_touches_is_gone() {
        let west = Window::LeftHalf;
        assert!(cropped(west, "POINT (5 5)").is_empty());
        assert!(cropped(west, "POLYGON ((4 1,5 1,5 2,4 2,4 1))").is_empty());
        assert!(cropped(Window::Quarter { column: 1, row: 1 }, "LINESTRING (1 1,2 2)").is_empty());
    }

    #[test]
    fn a_polygon_that_crosses_itself_is_cut_too() {
        let bow_tie = "POLYGON ((2 1,6 3,6 1,2 3,2 1))";
        assert_eq!(cropped(Window::LeftHalf, bow_tie), ["POLYGON ((4 2,2 1,2 3,4 2))"]);
    }

    #[test]
    fn the_centre_has_the_share_of_the_area_and_its_inner_vertices_are_the_map_s() {
        let map = fixture("kotka.gpkg");
        let share = 1.0 / 16.0;
        let part = crop(&map, Window::Centre { area_share: share }).unwrap();
        let (all, left) = (map.vertices().unwrap(), part.vertices().unwrap());
        let area = |(min, max): ([f64; 2], [f64; 2])| (max[0] - min[0]) * (max[1] - min[1]);
        assert!((area(left.bounds()) / area(all.bounds()) - share).abs() < 0.01);
        let known = left.coords().iter().filter(|p| all.index_of(**p).is_some()).count();
        assert!(known * 10 > left.len() * 8, "{known} of {}", left.len());
        assert!(part.layers.iter().all(|l| l.features.iter().all(|f| f.values.len() == l.fields.len())));
    }
}
