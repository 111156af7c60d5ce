//! Centroids of polygons by area, as linear functions of their vertices.

use super::points::{FeaturePoint, places};
use crate::linework::Plane;
use meshmark_core::{areas::Ring, map_data::MapData};

/// Polygons of a smaller area have no certain centroid, square metres.
const LEAST_AREA_M2: f64 = 0.01;

/// Returns the centroid of every feature, holes and all parts included.
pub fn feature_points(reference: &MapData, plane: &Plane) -> Vec<FeaturePoint> {
    let centroid = |rings: Vec<Ring>| {
        let rings: Vec<Outline> = rings.iter().map(|ring| Outline::new(ring, reference, plane)).collect();
        centroid(&rings)
    };
    reference.areas.features().filter_map(|rings| centroid(rings.collect())).collect()
}

/// A ring in the plane.
struct Outline<'a> {
    vertices: &'a [u32],
    places: Vec<[f64; 2]>,
    /// 1, or −1 where the ring is a hole or else turns clockwise; both turn it back.
    sign: f64,
}

impl<'a> Outline<'a> {
    fn new(ring: &Ring<'a>, reference: &MapData, plane: &Plane) -> Self {
        let places = places(reference, plane, ring.vertices);
        let origin = places.first().copied().unwrap_or_default();
        let outline = Outline { vertices: ring.vertices, places, sign: 1.0 };
        let role = if ring.is_hole { -1.0 } else { 1.0 };
        Outline { sign: role * outline.moments(origin).0.signum(), ..outline }
    }

    /// Returns the sides as their two ends relative to `origin`, signed.
    fn sides(&self, origin: [f64; 2]) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let next = self.places.iter().cycle().skip(1);
        self.places.iter().zip(next).map(move |(a, b)| [a, b].map(|p| [p[0] - origin[0], p[1] - origin[1]]))
    }

    /// Returns area and first moments about `origin`, signed.
    fn moments(&self, origin: [f64; 2]) -> (f64, [f64; 2]) {
        let (area, moments) = self.sides(origin).fold((0.0, [0.0; 2]), |(area, moments), [a, b]| {
            let turn = cross(a, b);
            (area + turn / 2.0, [0, 1].map(|axis| moments[axis] + (a[axis] + b[axis]) * turn / 6.0))
        });
        (self.sign * area, moments.map(|moment| self.sign * moment))
    }

    /// Returns the derivatives of the first moments about `origin` by the vertices.
    fn derivatives(&self, origin: [f64; 2]) -> Vec<[[f64; 2]; 2]> {
        let count = self.places.len();
        let mut all = vec![[[0.0; 2]; 2]; count];
        for (i, [a, b]) in self.sides(origin).enumerate() {
            let (turn, sum) = (cross(a, b), [a[0] + b[0], a[1] + b[1]]);
            // The derivatives of the turn by the two ends.
            for (end, by) in [(i, [b[1], -b[0]]), ((i + 1) % count, [-a[1], a[0]])] {
                for axis in 0..2 {
                    for of in 0..2 {
                        let direct = if axis == of { turn } else { 0.0 };
                        all[end][axis][of] += self.sign * (direct + sum[axis] * by[of]) / 6.0;
                    }
                }
            }
        }
        all
    }
}

/// Returns the centroid of the area between rings.
fn centroid(rings: &[Outline]) -> Option<FeaturePoint> {
    let origin = *rings.first()?.places.first()?;
    let each = rings.iter().map(|ring| ring.moments(origin));
    let (area, [x, y]) =
        each.fold((0.0, [0.0; 2]), |(area, [x, y]), (a, [mx, my])| (area + a, [x + mx, y + my]));
    if area < LEAST_AREA_M2 {
        return None;
    }
    let at_m = [origin[0] + x / area, origin[1] + y / area];
    // About the centroid the moments are 0, and its derivative is theirs over the area.
    let shares = rings.iter().flat_map(|ring| {
        let shares = ring.derivatives(at_m).into_iter().map(move |d| d.map(|row| row.map(|s| s / area)));
        ring.vertices.iter().copied().zip(shares)
    });
    Some(FeaturePoint { at_m, shares: shares.collect(), variance_m2: 0.0 })
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshmark_core::{areas::Areas, ground::Ground, map_data::ChainKind, vertices::VertexTable};

    /// A square with a hole, clockwise, and a distant triangle of the same feature, at these places.
    fn point(places: &[[f64; 2]]) -> FeaturePoint {
        use ChainKind::{Hole, Shell};
        let mut map = MapData::of_points(VertexTable::new(places.to_vec()).unwrap());
        let index = |i: u32| {
            let place = places[i as usize];
            map.vertices.coords().iter().position(|other| *other == place).unwrap() as u32
        };
        let chains: Vec<u32> = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4, 8, 9, 10, 8].map(index).to_vec();
        map.areas = Areas::new(&chains, &[0, 5, 10], [Shell, Hole, Shell], &[0]);
        let mut points = feature_points(&map, &Plane::new(&Ground::METRES, [0.0; 2]));
        assert_eq!(points.len(), 1);
        let mut point = points.remove(0);
        // By the number of the place, not of the vertex.
        let number = |vertex: u32| (0..places.len() as u32).find(|i| index(*i) == vertex).unwrap();
        point.shares.iter_mut().for_each(|(vertex, _)| *vertex = number(*vertex));
        point
    }

    const PLACES: [[f64; 2]; 11] = [
        [1000.0, 500.0],
        [1000.0, 510.0],
        [1010.0, 510.0],
        [1010.0, 500.0],
        [1001.0, 501.0],
        [1004.0, 501.0],
        [1004.0, 505.0],
        [1001.0, 505.0],
        [1030.0, 500.0],
        [1042.0, 501.0],
        [1030.5, 509.0],
    ];

    #[test]
    fn a_centroid_is_that_of_all_parts_without_their_holes() {
        // Areas and centroids of square, hole and triangle.
        let third = [(1030.0 + 1042.0 + 1030.5) / 3.0, (500.0 + 501.0 + 509.0) / 3.0];
        let triangle = (12.0 * 9.0 - 1.0 * 0.5) / 2.0;
        let parts = [(100.0, [1005.0, 505.0]), (-12.0, [1002.5, 503.0]), (triangle, third)];
        let total: f64 = parts.iter().map(|(area, _)| area).sum();
        for axis in 0..2 {
            let expected = parts.iter().map(|(area, at)| area * at[axis]).sum::<f64>() / total;
            let found = point(&PLACES).at_m[axis];
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn the_shares_of_vertices_are_the_derivatives_of_the_centroid() {
        let shares = point(&PLACES).shares;
        assert_eq!(shares.len(), PLACES.len());
        for (vertex, share) in &shares {
            for of in 0..2 {
                let shifted = |by: f64| {
                    let mut places = PLACES;
                    places[*vertex as usize][of] += by;
                    point(&places).at_m
                };
                let (more, less) = (shifted(1e-3), shifted(-1e-3));
                for axis in 0..2 {
                    let derivative = (more[axis] - less[axis]) / 2e-3;
                    assert!((derivative - share[axis][of]).abs() < 1e-6, "{vertex} {axis} {of}");
                }
            }
        }
    }

    #[test]
    fn a_feature_without_an_area_has_no_centroid() {
        let flat = MapData::of_points(VertexTable::new(vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]).unwrap());
        let areas = Areas::new(&[0, 1, 2, 0], &[0], [ChainKind::Shell], &[0]);
        assert!(
            feature_points(&MapData { areas, ..flat }, &Plane::new(&Ground::METRES, [0.0; 2])).is_empty()
        );
    }
}
