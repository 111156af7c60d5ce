//! Affine attacks on a whole map: translation, scaling, rotation, shear, mirroring.

use super::Map;
use crate::Result;

/// The fixed point of an affine map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum About {
    /// The lower left corner of the map's bounding box.
    Corner,
    /// The middle of the map's bounding box.
    Centre,
}

/// Rows of a 2 × 2 matrix.
pub type Matrix = [[f64; 2]; 2];

/// Multiplies coordinates, relative to a place of the map, by a matrix.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn linear(map: &Map, [row_x, row_y]: Matrix, about: About) -> Result<Map> {
    let vertices = map.vertices()?;
    let [x0, y0] = match about {
        About::Corner => vertices.bounds().0,
        About::Centre => vertices.centre(),
    };
    Ok(map.map_coords(|[x, y]| {
        let (dx, dy) = (x - x0, y - y0);
        [x0 + row_x[0] * dx + row_x[1] * dy, y0 + row_y[0] * dx + row_y[1] * dy]
    }))
}

/// Shifts a map, units of its CRS.
pub fn translate(map: &Map, by: [f64; 2]) -> Map {
    map.map_coords(|[x, y]| [x + by[0], y + by[1]])
}

/// Returns the matrix with different factors for x and y.
pub fn scaling(x: f64, y: f64) -> Matrix {
    [[x, 0.0], [0.0, y]]
}

/// Returns an anticlockwise rotation.
pub fn rotation(degrees: f64) -> Matrix {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [[cos, -sin], [sin, cos]]
}

/// Returns the shear in which x grows by `share` of y.
pub fn shear(share: f64) -> Matrix {
    [[1.0, share], [0.0, 1.0]]
}

/// Returns the matrix by which east becomes west.
pub fn mirror() -> Matrix {
    scaling(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory, pairs, wkt};

    const SQUARE: &str = "POLYGON ((10 20,14 20,14 24,10 24,10 20))";

    fn applied(matrix: Matrix, about: About) -> Vec<String> {
        wkt(&linear(&in_memory(&[SQUARE]), matrix, about).unwrap())
    }

    #[test]
    fn every_matrix_does_to_a_square_what_its_name_says() {
        use About::{Centre, Corner};
        assert_eq!(applied(scaling(2.0, 0.5), Corner), ["POLYGON ((10 20,18 20,18 22,10 22,10 20))"]);
        assert_eq!(applied(shear(0.5), Corner), ["POLYGON ((10 20,14 20,16 24,12 24,10 20))"]);
        assert_eq!(applied(mirror(), Centre), ["POLYGON ((14 20,10 20,10 24,14 24,14 20))"]);
        assert_eq!(
            wkt(&translate(&in_memory(&[SQUARE]), [1.0, -5.0])),
            ["POLYGON ((11 15,15 15,15 19,11 19,11 15))"]
        );
    }

    #[test]
    fn a_rotation_keeps_distances_and_its_centre() {
        let map = fixture("kotka.gpkg");
        let turned = linear(&map, rotation(45.0), About::Centre).unwrap();
        let centre = map.vertices().unwrap().centre();
        for (a, b) in pairs(&map, &turned) {
            let radius = |p: [f64; 2]| (p[0] - centre[0]).hypot(p[1] - centre[1]);
            assert!((radius(a) - radius(b)).abs() < 1e-6);
            // 45° anticlockwise: the cross product of before and after is positive.
            let cross = (a[0] - centre[0]) * (b[1] - centre[1]) - (a[1] - centre[1]) * (b[0] - centre[0]);
            assert!(cross >= 0.0);
        }
        assert_eq!(map.vertices().unwrap().len(), turned.vertices().unwrap().len());
    }
}
