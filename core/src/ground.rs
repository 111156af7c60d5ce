//! Metres on the ground: the size of a CRS unit at a place of the map.

use crate::scale::ScaleLattice;
use std::sync::Arc;

/// The size of a CRS unit on the ground.
#[derive(Debug, Clone, PartialEq)]
pub enum Ground {
    /// A projected CRS, or none: the size is the same everywhere and measured at the map's centre.
    Plane {
        /// Metres on the ground per CRS unit.
        metres_per_unit: f64,
    },
    /// A projected CRS whose units differ over the map: the size is measured at many places.
    Uneven(Arc<ScaleLattice>),
    /// A geographic CRS: x is longitude, y is latitude.
    Ellipsoid {
        /// Semi-major axis, metres.
        semi_major_m: f64,
        /// Semi-minor axis, metres.
        semi_minor_m: f64,
        /// Radians per CRS unit: π/180 for degrees.
        radians_per_unit: f64,
    },
}

impl Ground {
    /// A plane in metres.
    pub const METRES: Ground = Ground::Plane { metres_per_unit: 1.0 };

    /// WGS 84 in degrees.
    pub const WGS84: Ground = Ground::Ellipsoid {
        semi_major_m: 6_378_137.0,
        semi_minor_m: 6_356_752.314_245_179,
        radians_per_unit: std::f64::consts::PI / 180.0,
    };

    /// Returns metres per CRS unit along x and y at `point`. On the ellipsoid they follow from the
    /// radii of curvature of the parallel (N cos φ) and of the meridian (M) (Snyder, *Map
    /// Projections*, 1987, eq. 4-18 to 4-20).
    pub fn metres_per_unit(&self, point: [f64; 2]) -> [f64; 2] {
        match self {
            &Ground::Plane { metres_per_unit } => [metres_per_unit; 2],
            Ground::Uneven(lattice) => lattice.metres_per_unit(point),
            &Ground::Ellipsoid { semi_major_m: a, semi_minor_m: b, radians_per_unit } => {
                let (sin, cos) = (point[1] * radians_per_unit).sin_cos();
                let e2 = 1.0 - (b / a).powi(2);
                let w2 = 1.0 - e2 * sin * sin;
                let parallel = a / w2.sqrt() * cos.abs();
                let meridian = a * (1.0 - e2) / (w2 * w2.sqrt());
                [parallel * radians_per_unit, meridian * radians_per_unit]
            }
        }
    }

    /// Returns the geocentric coordinates of a point of the ellipsoid, metres (EPSG method 9602);
    /// `None` in a projected CRS. Unlike degrees, they are continuous across the 180th meridian and
    /// at the poles.
    pub fn in_space(&self, point: [f64; 2]) -> Option<[f64; 3]> {
        let Ground::Ellipsoid { semi_major_m: a, semi_minor_m: b, radians_per_unit } = *self else {
            return None;
        };
        let [(sin_lon, cos_lon), (sin_lat, cos_lat)] =
            point.map(|degrees| (degrees * radians_per_unit).sin_cos());
        let e2 = 1.0 - (b / a).powi(2);
        let normal = a / (1.0 - e2 * sin_lat * sin_lat).sqrt();
        Some([normal * cos_lat * cos_lon, normal * cos_lat * sin_lon, normal * (1.0 - e2) * sin_lat])
    }

    /// Returns the vector from `a` to `b` (CRS units) in metres, measured at `a`.
    pub fn metres_between(&self, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        let [mx, my] = self.metres_per_unit(a);
        [(b[0] - a[0]) * mx, (b[1] - a[1]) * my]
    }

    /// Returns where places, CRS units, lie after displacements in metres.
    pub fn displaced(&self, places: &[[f64; 2]], displacement_m: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let displaced = |(p, d): (&[f64; 2], &[f64; 2])| {
            let unit_m = self.metres_per_unit(*p);
            [p[0] + d[0] / unit_m[0], p[1] + d[1] / unit_m[1]]
        };
        places.iter().zip(displacement_m).map(displaced).collect()
    }

    /// Returns the factor on x that makes both axes of the mesh coordinates about equal in scale:
    /// 1, or the cosine of the map's middle latitude, rounded to 2⁻²⁰ so that every machine meshes
    /// the same numbers.
    pub fn x_scale(&self, middle_y: f64) -> f64 {
        match self {
            Ground::Plane { .. } | Ground::Uneven(_) => 1.0,
            Ground::Ellipsoid { radians_per_unit, .. } => {
                let steps = 2f64.powi(20);
                ((middle_y * radians_per_unit).cos().abs() * steps).round().max(1.0) / steps
            }
        }
    }

    /// Returns whether `point` must stay in place: within `tolerance_m` of ±180° or ±90° a shift
    /// would leave the legal range or tear a map apart at its seam.
    pub fn is_pinned(&self, point: [f64; 2], tolerance_m: f64) -> bool {
        let Ground::Ellipsoid { radians_per_unit, .. } = self else { return false };
        let [mx, my] = self.metres_per_unit(point);
        let half_turn = std::f64::consts::PI / radians_per_unit;
        let to_seam = ((half_turn - point[0].abs()) * mx).abs();
        let to_pole = (half_turn / 2.0 - point[1].abs()) * my;
        to_seam <= tolerance_m || to_pole <= tolerance_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_degree_has_its_textbook_length() {
        // Table 2 of Snyder 1987 holds for Clarke 1866; WGS 84 has 110.574 km at 0°, 111.694 km at
        // 90°.
        let [x0, y0] = Ground::WGS84.metres_per_unit([10.0, 0.0]);
        let [x90, y90] = Ground::WGS84.metres_per_unit([10.0, 90.0]);
        assert!((x0 - 111_319.49).abs() < 0.01 && (y0 - 110_574.28).abs() < 0.01);
        assert!(x90 < 1e-6 && (y90 - 111_693.98).abs() < 0.01);
    }

    #[test]
    fn a_small_step_has_one_length_in_space_and_on_the_ground() {
        for place in [[25.0, 60.0], [-100.0, -35.0], [10.0, 0.0]] {
            let [mx, my] = Ground::WGS84.metres_per_unit(place);
            let there =
                |dx: f64, dy: f64| Ground::WGS84.in_space([place[0] + dx / mx, place[1] + dy / my]).unwrap();
            for (dx, dy) in [(1.0, 0.0), (0.0, 1.0)] {
                let (from, to) = (there(-dx, -dy), there(dx, dy));
                let length = (0..3).map(|i| (to[i] - from[i]).powi(2)).sum::<f64>().sqrt();
                assert!((length - 2.0).abs() < 1e-6, "{place:?} {length}");
            }
        }
    }

    #[test]
    fn only_the_seam_and_the_poles_are_pinned() {
        assert!(Ground::WGS84.is_pinned([180.0, 10.0], 0.75));
        assert!(Ground::WGS84.is_pinned([-179.999_999, 10.0], 0.75));
        assert!(Ground::WGS84.is_pinned([20.0, -90.0], 0.75));
        assert!(!Ground::WGS84.is_pinned([179.9, 89.9], 0.75));
        assert!(!Ground::Plane { metres_per_unit: 1.0 }.is_pinned([180.0, 90.0], 0.75));
    }
}
