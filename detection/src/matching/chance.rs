//! Matches by chance: any two maps have some vertices within a radius of each other.

use super::{matcher::Matcher, matches::Matches};

/// Fewer matched vertices than this count as chance.
pub const LEAST_MATCHED: usize = 30;
/// Fewer than this many times the vertices that match out of place also count as chance.
const TIMES_CHANCE: usize = 2;
/// A shift, in matching radii, that moves any map out of place.
pub(crate) const OUT_OF_PLACE: [f64; 2] = [7.3, -5.1];

/// Returns whether `matched` vertices are no more than chance yields, where `by_chance` match out
/// of place.
pub(crate) fn is_chance(matched: usize, by_chance: usize) -> bool {
    matched < LEAST_MATCHED || matched < TIMES_CHANCE * by_chance
}

/// Returns a shift that moves any map out of place, CRS units; `unit_m` are the metres per unit
/// along each axis.
pub(crate) fn out_of_place(unit_m: [f64; 2], radius_m: f64) -> [f64; 2] {
    [0, 1].map(|axis| OUT_OF_PLACE[axis] * radius_m / unit_m[axis].max(f64::MIN_POSITIVE))
}

/// Returns the matches by chance: those of a suspect after a shift that moves any map out of place,
/// and its shifted vertices. `unit_m` are the metres per unit along each axis.
pub fn by_chance(
    matcher: &Matcher,
    moved: &[[f64; 2]],
    unit_m: [f64; 2],
    radius_m: f64,
) -> (Matches, Vec<[f64; 2]>) {
    let [x, y] = out_of_place(unit_m, radius_m);
    let shifted: Vec<[f64; 2]> = moved.iter().map(|p| [p[0] + x, p[1] + y]).collect();
    (matcher.all(&shifted, radius_m), shifted)
}
