//! What matches by chance: any two maps have vertices within a radius of each other.

/// Fewer matched vertices than this are chance: nothing was found.
pub const LEAST_MATCHED: usize = 30;
/// And so are fewer than this many times those that match out of place.
const TIMES_CHANCE: usize = 2;
/// A shift, in matching radii, after which no map is in place.
const OUT_OF_PLACE: [f64; 2] = [7.3, -5.1];

/// Whether so many matched vertices are no more than chance makes, where `by_chance` match out of place.
pub fn is_chance(matched: usize, by_chance: usize) -> bool {
    matched < LEAST_MATCHED || matched < TIMES_CHANCE * by_chance
}

/// A shift that puts any map out of place, CRS units, where a unit has so many metres along each axis.
pub fn out_of_place(unit_m: [f64; 2], radius_m: f64) -> [f64; 2] {
    [0, 1].map(|axis| OUT_OF_PLACE[axis] * radius_m / unit_m[axis].max(f64::MIN_POSITIVE))
}
