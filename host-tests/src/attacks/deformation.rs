//! Local deformation: the cells of a grid turn slightly, neighbours to opposite sides.

use super::Map;
use crate::Result;

/// The size of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell {
    /// Width and height, units of the CRS.
    Size([f64; 2]),
    /// This number of columns and rows over the map's bounding box.
    Share(usize),
}

/// The rule by which a vertex turns to one side or the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Side {
    /// Its cell's column + row: a checkerboard of turned cells.
    Cell,
    /// Its own x + y in multiples of this unit: neighbouring vertices part.
    Vertex { unit: f64 },
}

/// Turns every vertex about the centre of its cell, to one side when the column and row (or the
/// vertex's own coordinates) have an even sum, to the other when it is odd.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn deform(map: &Map, cell: Cell, degrees: f64, side: Side) -> Result<Map> {
    let (min, max) = map.vertices()?.bounds();
    let size = match cell {
        Cell::Size(size) => size,
        Cell::Share(count) => [0, 1].map(|axis| (max[axis] - min[axis]) / count as f64),
    };
    let (sin, cos) = degrees.to_radians().sin_cos();
    Ok(map.map_coords(|vertex| {
        let index =
            [0, 1].map(|axis| cell_index(vertex[axis] - min[axis], size[axis], max[axis] - min[axis]));
        let centre = [0, 1].map(|axis| min[axis] + (index[axis] as f64 + 0.5) * size[axis]);
        let even = match side {
            Side::Cell => (index[0] + index[1]) % 2 == 0,
            Side::Vertex { unit } => vertex.map(|v| (v / unit).round() as i64).iter().sum::<i64>() % 2 == 0,
        };
        let sin = if even { sin } else { -sin };
        let [dx, dy] = [vertex[0] - centre[0], vertex[1] - centre[1]];
        [centre[0] + cos * dx - sin * dy, centre[1] + sin * dx + cos * dy]
    }))
}

/// Returns the index of a cell. The last cell includes the far edge of the map, if that is the edge
/// of a cell.
fn cell_index(offset: f64, size: f64, extent: f64) -> i64 {
    let last = ((extent / size).ceil() as i64 - 1).max(0);
    ((offset / size).floor() as i64).min(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{assert_shared_vertices_stay_shared, fixture, in_memory, pairs};

    #[test]
    fn neighbouring_cells_turn_to_opposite_sides_about_their_centres() {
        // Two cells of 10 × 10; a vertex 2 units above each centre, and the corners of the map.
        let map = in_memory(&["LINESTRING (0 0,5 7,15 7,20 10)"]);
        let turned: Vec<[f64; 2]> =
            deform(&map, Cell::Size([10.0, 10.0]), 1.0, Side::Cell).unwrap().coords().collect();
        let shift = 2.0 * 1f64.to_radians().sin();
        assert!((turned[1][0] - (5.0 - shift)).abs() < 1e-12, "anticlockwise: {turned:?}");
        assert!((turned[2][0] - (15.0 + shift)).abs() < 1e-12, "clockwise: {turned:?}");
        let share = deform(&map, Cell::Share(2), 1.0, Side::Cell).unwrap();
        assert_ne!(share.coords().collect::<Vec<_>>(), turned, "cells of 10 × 5");
    }

    #[test]
    fn no_vertex_moves_further_than_its_distance_to_the_centre_allows() {
        let map = fixture("kotka.gpkg");
        let most_m = 75f64.hypot(50.0) / 2.0 * 2.0 * (0.5f64.to_radians().sin());
        for side in [Side::Cell, Side::Vertex { unit: 0.1 }] {
            let turned = deform(&map, Cell::Size([75.0, 50.0]), 1.0, side).unwrap();
            let far = pairs(&map, &turned).map(|(a, b)| (b[0] - a[0]).hypot(b[1] - a[1]));
            let farthest = far.fold(0f64, f64::max);
            assert!(farthest <= most_m + 1e-6 && farthest > 0.9 * most_m, "{farthest} of {most_m}");
            assert_shared_vertices_stay_shared(&map, &turned);
        }
    }

    #[test]
    fn vertex_parity_parts_neighbours() {
        let map = in_memory(&["LINESTRING (1 7,1.1 7,100 100)"]);
        let turned: Vec<[f64; 2]> = deform(&map, Cell::Size([10.0, 10.0]), 1.0, Side::Vertex { unit: 0.1 })
            .unwrap()
            .coords()
            .collect();
        let down = |i: usize, y: f64| turned[i][1] < y;
        assert!(down(0, 7.0) != down(1, 7.0), "{turned:?}");
    }
}
