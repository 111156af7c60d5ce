//! The scale at each vertex: metres on the ground per CRS unit, which vary over the map of a
//! projected CRS.
//!
//! Version 1 of the mark has one scale for the whole map. Version 2, TOLERANCE, and the figures of
//! records and comparisons are measured by the scale of this module.

use crate::vertices::VertexTable;

/// A mark with one scale is legal where its error is at most this share at every vertex.
const MOST_OFF: f64 = 0.05;

/// The size of CRS units at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Metres per unit along x and along y.
    pub metres_per_unit: [f64; 2],
    /// Metres per unit in the directions where it is least and largest.
    pub extremes: [f64; 2],
}

impl Scale {
    /// Creates the scale from the vectors on the ground of a unit along x and of a unit along y,
    /// metres, in any three perpendicular axes.
    pub fn new(along_x: [f64; 3], along_y: [f64; 3]) -> Self {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (xx, xy, yy) = (dot(along_x, along_x), dot(along_x, along_y), dot(along_y, along_y));
        // The singular values: the square roots of the eigenvalues of the metric.
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let extremes = [(mean - half).max(0.0).sqrt(), (mean + half).sqrt()];
        Scale { metres_per_unit: [xx.sqrt(), yy.sqrt()], extremes }
    }

    /// Returns a weighted mean of scales; the weights add up to 1.
    fn mean(weighted: impl Iterator<Item = (f64, Scale)> + Clone) -> Self {
        let mean = |value: fn(&Scale) -> [f64; 2]| {
            [0, 1].map(|i| weighted.clone().map(|(weight, scale)| weight * value(&scale)[i]).sum())
        };
        Scale { metres_per_unit: mean(|s| s.metres_per_unit), extremes: mean(|s| s.extremes) }
    }

    /// Returns the error of a scale of so many metres per unit in the worst direction, as a share.
    fn off(&self, metres_per_unit: f64) -> f64 {
        self.extremes.map(|m| (metres_per_unit / m - 1.0).abs()).into_iter().fold(0.0, f64::max)
    }
}

/// Scales on a lattice over a map, between which they are interpolated.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaleLattice {
    /// The scale at the middle of the map, for places outside the projection.
    middle_metres_per_unit: f64,
    lower: [f64; 2],
    /// The sides of a cell, CRS units.
    cell: [f64; 2],
    nodes_per_side: usize,
    /// Row by row from the lower left; `None` where the projection has no such place.
    nodes: Vec<Option<Scale>>,
}

impl ScaleLattice {
    /// Measures a lattice; `scales_at` returns the scales at many places. A map in which the error
    /// of the one scale `metres_per_unit` is less than `negligible` (a share) everywhere needs
    /// none.
    pub fn measure(
        vertices: &VertexTable,
        metres_per_unit: f64,
        negligible: f64,
        scales_at: impl Fn(&[[f64; 2]]) -> Vec<Option<Scale>>,
    ) -> Option<Self> {
        let lattice = |nodes| Self::sample(vertices.bounds(), metres_per_unit, nodes, &scales_at);
        let is_even =
            |scale: &Option<Scale>| scale.is_some_and(|scale| scale.off(metres_per_unit) < negligible);
        let needs_none = vertices.is_empty() || lattice(COARSE).nodes.iter().all(is_even);
        (!needs_none).then(|| lattice(FINE))
    }

    fn sample(
        (lower, upper): ([f64; 2], [f64; 2]),
        middle_metres_per_unit: f64,
        nodes_per_side: usize,
        scales_at: &impl Fn(&[[f64; 2]]) -> Vec<Option<Scale>>,
    ) -> Self {
        let steps = (nodes_per_side - 1) as f64;
        let cell = [0, 1].map(|axis| (upper[axis] - lower[axis]) / steps);
        let at = |axis: usize, step: usize| lower[axis] + cell[axis] * step as f64;
        let row = |y: usize| (0..nodes_per_side).map(move |x| [at(0, x), at(1, y)]);
        let places: Vec<[f64; 2]> = (0..nodes_per_side).flat_map(row).collect();
        ScaleLattice { middle_metres_per_unit, lower, cell, nodes_per_side, nodes: scales_at(&places) }
    }

    /// Interpolates the scale at a point from the corners of its cell that have one; `None` where
    /// none of them has.
    fn at(&self, point: [f64; 2]) -> Option<Scale> {
        let last = self.nodes_per_side - 2;
        let place = |axis: usize| {
            let steps = (point[axis] - self.lower[axis]) / self.cell[axis];
            let steps = if steps.is_finite() { steps.clamp(0.0, (last + 1) as f64) } else { 0.0 };
            let first = (steps as usize).min(last);
            (first, steps - first as f64)
        };
        let ((x, u), (y, v)) = (place(0), place(1));
        let corner = |dx: usize, dy: usize| {
            let weight = if dx == 1 { u } else { 1.0 - u } * if dy == 1 { v } else { 1.0 - v };
            (weight, self.nodes[(y + dy) * self.nodes_per_side + x + dx])
        };
        let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        let there = || corners.iter().filter_map(|(weight, scale)| Some((*weight, (*scale)?)));
        let whole: f64 = there().map(|(weight, _)| weight).sum();
        (whole > 0.0).then(|| Scale::mean(there().map(|(weight, scale)| (weight / whole, scale))))
    }

    /// Returns metres per CRS unit along x and y at a point.
    pub fn metres_per_unit(&self, point: [f64; 2]) -> [f64; 2] {
        self.at(point).map_or([self.middle_metres_per_unit; 2], |scale| scale.metres_per_unit)
    }

    /// Returns the largest share by which the scale at the middle of the map is wrong at a vertex,
    /// where it is more than version 1 of the mark allows, and the two vertices where a unit is the
    /// shortest and the longest.
    pub fn unevenness(&self, vertices: &VertexTable) -> Option<(f64, [[f64; 2]; 2])> {
        let scales = || vertices.coords().iter().filter_map(|&at| Some((at, self.at(at)?)));
        let off = scales().map(|(_, scale)| scale.off(self.middle_metres_per_unit)).fold(0.0, f64::max);
        let (shortest, _) = scales().min_by(|(_, a), (_, b)| a.extremes[0].total_cmp(&b.extremes[0]))?;
        let (longest, _) = scales().max_by(|(_, a), (_, b)| a.extremes[1].total_cmp(&b.extremes[1]))?;
        (off > MOST_OFF).then_some((off, [shortest, longest]))
    }
}

/// Nodes per side of the lattice that decides whether a finer one is needed.
const COARSE: usize = 5;
/// Nodes per side. Over a whole EPSG:3857 map up to 89.99° the interpolated scale is within 0.3 %.
const FINE: usize = 65;

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS_M: f64 = 6_378_137.0;

    /// Returns the scale of the Mercator projection of a sphere.
    fn mercator([_, y]: [f64; 2]) -> Scale {
        let metres = 1.0 / (y / RADIUS_M).cosh();
        Scale::new([metres, 0.0, 0.0], [0.0, metres, 0.0])
    }

    fn lattice(vertices: &VertexTable, one: f64) -> Option<ScaleLattice> {
        ScaleLattice::measure(vertices, one, 1e-3, |at| at.iter().map(|p| Some(mercator(*p))).collect())
    }

    #[test]
    fn a_town_has_one_scale_and_the_world_has_not() {
        let town = VertexTable::new(vec![[0.0, 8.4e6], [1000.0, 8.401e6]]).unwrap();
        let [one, _] = mercator(town.centre()).metres_per_unit;
        assert!(lattice(&town, one).is_none());
        let world = VertexTable::new(vec![[0.0, 0.0], [1000.0, 8.4e6], [0.0, 6.2e7]]).unwrap();
        let [one, _] = mercator(world.centre()).metres_per_unit;
        let lattice = lattice(&world, one).unwrap();
        for y in (0..62).map(|million| f64::from(million) * 1e6) {
            let (found, exact) = (lattice.at([500.0, y]).unwrap(), mercator([500.0, y]));
            let [found, exact] = [found, exact].map(|scale| scale.metres_per_unit[0]);
            assert!((found / exact - 1.0).abs() < 3e-3, "{y}: {found} {exact}");
        }
        let (off, [shortest, longest]) = lattice.unevenness(&world).unwrap();
        let away = |place: [f64; 2]| place[1].abs();
        let ends = world
            .coords()
            .iter()
            .map(|place| away(*place))
            .fold((f64::MAX, 0f64), |(a, b), y| (a.min(y), b.max(y)));
        assert!(off > 0.05 && (away(longest), away(shortest)) == ends);
    }

    #[test]
    fn a_unit_of_two_lengths_is_off_in_its_worst_direction() {
        let plate_carree = Scale::new([0.5, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert_eq!(plate_carree.extremes, [0.5, 1.0]);
        let turned = Scale::new([0.6, 0.8, 0.0], [-0.4, 0.3, 0.0]);
        assert!((turned.extremes[0] - 0.5).abs() < 1e-12 && (turned.extremes[1] - 1.0).abs() < 1e-12);
        assert!((plate_carree.off(0.5f64.sqrt()) - 0.414).abs() < 1e-3);
    }

    #[test]
    fn places_that_the_projection_has_not_leave_the_scale_to_the_others() {
        let vertices = VertexTable::new(vec![[0.0, 0.0], [10.0, 10.0]]).unwrap();
        let half = |p: &[f64; 2]| (p[0] < 5.1).then(|| Scale::new([2.0, 0.0, 0.0], [0.0, 2.0, 0.0]));
        let lattice =
            ScaleLattice::measure(&vertices, 3.0, 1e-3, |at| at.iter().map(half).collect()).unwrap();
        assert_eq!(lattice.metres_per_unit([1.0, 1.0]), [2.0, 2.0]);
        assert_eq!(lattice.at([9.0, 1.0]), None);
        assert_eq!(lattice.metres_per_unit([9.0, 1.0]), [3.0, 3.0]);
    }
}
