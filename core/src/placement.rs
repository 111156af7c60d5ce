//! The final place of a vertex: within the tolerance, on the output grid, and away from the edges
//! of the world.

use crate::{Error, Result, ground::Ground, map::Map, options::Parameters};

/// The limits of a displacement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placement<'a> {
    measure: &'a Ground,
    tolerance_m: f64,
    precision: Option<f64>,
}

impl<'a> Placement<'a> {
    /// # Errors
    /// [`Error::PrecisionTooCoarse`].
    pub fn new(map: &Map<'a>, parameters: &Parameters) -> Result<Self> {
        check_precision(map, parameters)?;
        let Parameters { tolerance_m, precision_crs_units: precision, .. } = *parameters;
        Ok(Placement { measure: map.measure, tolerance_m, precision })
    }

    /// Returns the place of a vertex at `from` that should move by `wanted`, CRS units.
    pub fn place(&self, from: [f64; 2], wanted: [f64; 2]) -> [f64; 2] {
        if self.is_pinned(from) {
            return from;
        }
        let scale = self.measure.metres_per_unit(from);
        let wanted_m = (wanted[0] * scale[0]).hypot(wanted[1] * scale[1]);
        let most = 1f64.min(self.tolerance_m / wanted_m);
        let (mut share, mut less) = (most, 1e-9);
        loop {
            let target = [0, 1].map(|a| from[a] + share * wanted[a]);
            if let Some(precision) = self.precision {
                return nearest_node(target, from, scale, precision, self.tolerance_m);
            }
            if distance_m(from, target, scale) <= self.tolerance_m {
                return target;
            }
            if less > 0.5 {
                // The last digit of so large a coordinate is worth more than the tolerance.
                return from;
            }
            share = most * (1.0 - less); // the sum above was rounded past the tolerance
            less *= 2.0;
        }
    }

    /// Returns whether a vertex at `from` may move to `to`.
    pub fn allows(&self, from: [f64; 2], to: [f64; 2]) -> bool {
        !self.is_pinned(from) && distance_m(from, to, self.measure.metres_per_unit(from)) <= self.tolerance_m
    }

    /// Returns whether a vertex must stay in place.
    pub fn is_pinned(&self, from: [f64; 2]) -> bool {
        self.measure.is_pinned(from, self.tolerance_m)
    }

    /// Returns the furthest that a vertex near `at` may move, metres of a `scale` in metres per
    /// unit.
    pub fn tolerance_in(&self, at: [f64; 2], scale: [f64; 2]) -> f64 {
        let there = self.measure.metres_per_unit(at);
        self.tolerance_m * (scale[0] / there[0]).min(scale[1] / there[1])
    }

    /// Returns the side of a cell of the output grid, CRS units; 0 without a grid.
    pub fn grid(&self) -> f64 {
        self.precision.unwrap_or(0.0)
    }
}

fn distance_m(a: [f64; 2], b: [f64; 2], scale: [f64; 2]) -> f64 {
    ((b[0] - a[0]) * scale[0]).hypot((b[1] - a[1]) * scale[1])
}

/// Returns the grid node nearest to `target` among those within the tolerance of `from`. As
/// `target` is within the tolerance, which is at least a cell, such a node exists less than √2
/// cells away.
fn nearest_node(
    target: [f64; 2],
    from: [f64; 2],
    scale: [f64; 2],
    precision: f64,
    tolerance_m: f64,
) -> [f64; 2] {
    // A node of PRECISION=0.1 is k / 10, the number that prints as one decimal; k × 0.1 is not.
    let per_unit = (1.0 / precision).round();
    let decimal = per_unit >= 1.0 && (per_unit * precision - 1.0).abs() < 1e-9;
    let node = |k: f64| if decimal { k / per_unit } else { k * precision };
    let index = |value: f64| if decimal { (value * per_unit).round() } else { (value / precision).round() };
    let nearest = target.map(|value| node(index(value)));
    if distance_m(from, nearest, scale) <= tolerance_m {
        return nearest;
    }
    let larger = scale[0].max(scale[1]);
    let around = |axis: usize| {
        let reach = (1.5 * larger / scale[axis]).ceil().min(1000.0);
        (0..=2 * reach as usize).map(move |step| node(index(target[axis]) - reach + step as f64))
    };
    around(0)
        .flat_map(|x| around(1).map(move |y| [x, y]))
        .filter(|&n| distance_m(from, n, scale) <= tolerance_m)
        .min_by(|&a, &b| distance_m(target, a, scale).total_cmp(&distance_m(target, b, scale)))
        .unwrap_or(from)
}

fn check_precision(map: &Map, parameters: &Parameters) -> Result<()> {
    let Some(precision) = parameters.precision_crs_units else { return Ok(()) };
    let (min, max) = map.vertices.bounds();
    // A degree of longitude is longest where the map comes nearest to the equator.
    let widest_y = if min[1] <= 0.0 && max[1] >= 0.0 { 0.0 } else { min[1].abs().min(max[1].abs()) };
    let scale = [min[1], max[1], widest_y].map(|y| map.measure.metres_per_unit([min[0], y]));
    let metres = precision * scale.iter().flatten().fold(0f64, |a, &b| a.max(b));
    if metres > parameters.tolerance_m {
        return Err(Error::PrecisionTooCoarse { precision, metres, tolerance_m: parameters.tolerance_m });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ground::Ground, vertices::VertexTable};

    #[test]
    fn every_vertex_moves_to_the_tolerance_or_stays_where_its_last_digit_is_worth_more() {
        let coords = (0..10_000).map(|i| [385_000.0 + f64::from(i), 6_671_000.0]).collect();
        let table = VertexTable::new(coords).unwrap();
        let map = Map::of_points(&table, &Ground::METRES);
        for (tolerance_m, moved) in [(1e-12, 0), (1e-7, 10_000), (1e-3, 10_000), (10.0, 10_000)] {
            let parameters = Parameters { tolerance_m, ..Parameters::default() };
            let placement = Placement::new(&map, &parameters).unwrap();
            let places = table.coords().iter().map(|from| (*from, placement.place(*from, [0.7, -0.8])));
            let found = places.filter(|(from, to)| {
                assert!(distance_m(*from, *to, [1.0; 2]) <= tolerance_m, "{to:?}");
                from != to
            });
            assert_eq!(found.count(), moved, "{tolerance_m}");
        }
    }

    #[test]
    fn a_node_is_the_decimal_number_and_never_out_of_reach() {
        let scale = [1.0, 1.0];
        assert_eq!(nearest_node([0.26, 0.74], [0.31, 0.7], scale, 0.1, 0.75), [0.3, 0.7]);
        // The node nearest to the target is 0.8 away; the best one within 0.75 is taken.
        assert_eq!(nearest_node([0.6, 0.0], [0.2, 0.0], scale, 1.0, 0.75), [0.0, 0.0]);
    }
}
