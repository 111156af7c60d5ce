//! Squaring: almost right angles of polygons become right ones, as editors offer for buildings.
//!
//! The method is that of iD, the OpenStreetMap editor: a corner moves along its bisector until it
//! is square, in small steps, all corners at once. Vertices that polygons share move by the mean of
//! the moves of their corners, so walls stay shared.

use super::{
    Map,
    parts::{Part, visit},
};
use crate::Result;
use geo::{Coord, Geometry};
use meshmark_core::vertices::VertexTable;

const STEPS: usize = 300;
/// The share of a correction that a step makes.
const SHARE: f64 = 0.1;

/// A corner: a vertex and its two neighbours on a ring, as vertex numbers.
struct Corner {
    at: usize,
    sides: [usize; 2],
}

/// Squares the corners of all polygons that are within `tolerance_degrees` of a right angle.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn square(map: &Map, tolerance_degrees: f64) -> Result<Map> {
    let table = map.vertices()?;
    let centre = table.centre();
    let mut places: Vec<[f64; 2]> =
        table.coords().iter().map(|p| [p[0] - centre[0], p[1] - centre[1]]).collect();
    let limit = tolerance_degrees.to_radians().sin();
    let is_almost_square = |corner: &Corner| cosine(corner, &places).is_some_and(|c| c.abs() < limit);
    let corners: Vec<Corner> = corners(map, &table).into_iter().filter(is_almost_square).collect();
    for _ in 0..STEPS {
        step(&corners, &mut places);
    }
    let is_moved = {
        let mut moved = vec![false; table.len()];
        corners.iter().for_each(|corner| moved[corner.at] = true);
        moved
    };
    Ok(map.map_coords(|vertex| match table.index_of(vertex) {
        Some(i) if is_moved[i] => [places[i][0] + centre[0], places[i][1] + centre[1]],
        _ => vertex,
    }))
}

fn corners(map: &Map, table: &VertexTable) -> Vec<Corner> {
    let index = |c: Coord| table.index_of([c.x, c.y]).expect("a vertex of the map");
    let mut corners = Vec::new();
    let polygons = map.geometries().filter(|g| matches!(g, Geometry::Polygon(_) | Geometry::MultiPolygon(_)));
    for polygon in polygons {
        visit(polygon, |part, run| {
            if part != Part::Ring {
                return;
            }
            let n = run.len();
            let corner = |i: usize| Corner {
                at: index(run[i]),
                sides: [index(run[(i + n - 1) % n]), index(run[(i + 1) % n])],
            };
            corners.extend((0..n).map(corner));
        });
    }
    corners
}

/// Returns unit vectors along the two sides of a corner, and the shorter length.
fn sides(corner: &Corner, places: &[[f64; 2]]) -> Option<([[f64; 2]; 2], f64)> {
    let at = places[corner.at];
    let vectors = corner.sides.map(|side| [places[side][0] - at[0], places[side][1] - at[1]]);
    let lengths = vectors.map(|v| v[0].hypot(v[1]));
    let shorter = lengths[0].min(lengths[1]);
    let unit = |i: usize| [vectors[i][0] / lengths[i], vectors[i][1] / lengths[i]];
    (shorter > 0.0).then(|| ([unit(0), unit(1)], shorter))
}

fn cosine(corner: &Corner, places: &[[f64; 2]]) -> Option<f64> {
    let ([p, q], _) = sides(corner, places)?;
    Some(p[0] * q[0] + p[1] * q[1])
}

fn step(corners: &[Corner], places: &mut [[f64; 2]]) {
    let mut wishes = vec![([0.0; 2], 0.0); places.len()];
    for corner in corners {
        let Some(([p, q], shorter)) = sides(corner, places) else { continue };
        let cosine = p[0] * q[0] + p[1] * q[1];
        let bisector = [p[0] + q[0], p[1] + q[1]];
        let length = bisector[0].hypot(bisector[1]);
        if length == 0.0 {
            continue;
        }
        let (wish, count) = &mut wishes[corner.at];
        // An acute corner (cosine > 0) opens by moving inwards.
        let distance = SHARE * cosine * 2.0 * shorter;
        wish[0] += distance * bisector[0] / length;
        wish[1] += distance * bisector[1] / length;
        *count += 1.0;
    }
    for (place, (wish, count)) in places.iter_mut().zip(&wishes).filter(|(_, (_, count))| *count > 0.0) {
        *place = [place[0] + wish[0] / count, place[1] + wish[1] / count];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{assert_shared_vertices_stay_shared, fixture, in_memory, pairs};

    fn skews_degrees(map: &Map) -> Vec<f64> {
        let table = map.vertices().unwrap();
        let cosines = corners(map, &table).into_iter().filter_map(|c| cosine(&c, table.coords()));
        cosines.map(|c| c.asin().to_degrees().abs()).collect()
    }

    #[test]
    fn almost_square_houses_become_square_and_stay_joined() {
        let map = in_memory(&[
            "POLYGON ((0 0,8 0.2,8.1 6,0.1 6.1,0 0))",
            "POLYGON ((8.1 6,8 0.2,16.1 0,15.9 6.2,8.1 6))",
        ]);
        let square = square(&map, 10.0).unwrap();
        assert!(skews_degrees(&map).iter().any(|s| *s > 1.0));
        assert!(skews_degrees(&square).iter().all(|s| *s < 0.1), "{:?}", skews_degrees(&square));
        assert_shared_vertices_stay_shared(&map, &square);
        assert!(pairs(&map, &square).all(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) < 0.3));
    }

    #[test]
    fn other_corners_stay_where_they_are() {
        let map = in_memory(&["POLYGON ((0 0,8 0,4 7,0 0))", "LINESTRING (0 0,5 0.1,5 5)"]);
        assert_eq!(square(&map, 10.0).unwrap(), map);
    }

    #[test]
    fn a_noisy_town_is_squarer_afterwards() {
        let noisy =
            crate::attacks::noise::add(&fixture("kotka.gpkg"), 1, |random| random.symmetric(0.2)).unwrap();
        let skew = |map: &Map| {
            let skews: Vec<f64> = skews_degrees(map).into_iter().filter(|s| *s < 10.0).collect();
            skews.iter().sum::<f64>() / skews.len() as f64
        };
        let squared = square(&noisy, 10.0).unwrap();
        assert!(skew(&squared) < skew(&noisy) / 4.0, "{} {}", skew(&squared), skew(&noisy));
    }
}
