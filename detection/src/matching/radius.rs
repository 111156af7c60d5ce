//! The matching radius, chosen from the distances of mutual nearest neighbours. No key is involved,
//! so decoys have the same radius.

use super::{chance::by_chance, matcher::Matcher, matches::Matches};
use serde::Serialize;

/// The radii that are tried, metres. The first one is large enough for a mark and for the noise of
/// most formats.
const RADII_M: [f64; 6] = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0];
/// The share of the vertices found within the largest radius that the chosen radius holds.
const ENOUGH: f64 = 0.97;
/// A radius reaches no further than where this share of its matches is chance.
const MOST_CHANCE: f64 = 0.5;

/// A choice of the matching radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RadiusChoice {
    /// From the distances of the vertices.
    FromData,
    /// This radius, metres.
    Given(f64),
}

/// The matching radius and its reason.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Radius {
    /// t, metres.
    pub metres: f64,
    /// The reason.
    pub reason: RadiusReason,
}

/// The reason of a matching radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RadiusReason {
    /// The request names it.
    Given,
    /// The vertices lie within the least radius.
    Least,
    /// Vertices of the reference have their matches farther away than the least radius.
    Noise,
    /// Polygon groups were shifted as a whole, and vertices match around their shifted places.
    Groups,
    /// A strong deformation was followed, and vertices match around the places to which it took
    /// them.
    Deformation,
}

impl RadiusChoice {
    /// Returns the radius of the registration, before any noise is known, metres.
    pub fn least_m(self) -> f64 {
        match self {
            RadiusChoice::FromData => RADII_M[0],
            RadiusChoice::Given(metres) => metres,
        }
    }

    /// Returns the radius for vertices of a suspect in the CRS of the reference; `unit_m` are the
    /// metres per unit in the middle of the reference.
    pub(crate) fn choose(self, matcher: &Matcher, moved: &[[f64; 2]], unit_m: [f64; 2]) -> Radius {
        match self {
            RadiusChoice::Given(metres) => Radius { metres, reason: RadiusReason::Given },
            RadiusChoice::FromData => from_data(matcher, moved, unit_m),
        }
    }
}

/// Returns the smallest radius that holds nearly all vertices which match beyond chance.
fn from_data(matcher: &Matcher, moved: &[[f64; 2]], unit_m: [f64; 2]) -> Radius {
    let largest_m = RADII_M[RADII_M.len() - 1];
    let found = counts(matcher, moved, &matcher.all(moved, largest_m));
    let (matches, shifted) = by_chance(matcher, moved, unit_m, largest_m);
    let chance = counts(matcher, &shifted, &matches);
    let most = matcher.reference_count().min(moved.len()) as f64;
    let within = |radius: usize| excess(found[radius], chance[radius], most);
    let sensible = |radius: &usize| within(*radius) >= (1.0 - MOST_CHANCE) * found[*radius];
    let sensible = (0..RADII_M.len()).filter(sensible).map(within);
    let matching = sensible.fold(0.0, f64::max);
    let first = (0..RADII_M.len()).find(|&radius| within(radius) >= ENOUGH * matching).unwrap_or(0);
    let reason = if first == 0 { RadiusReason::Least } else { RadiusReason::Noise };
    Radius { metres: RADII_M[first], reason }
}

/// Returns how many of `found` matches are more than chance, where a shifted suspect has
/// `by_chance` matches and at most `most` vertices can match. A vertex with its own match has none
/// by chance: e = found − (1 − e / most) by_chance.
fn excess(found: f64, by_chance: f64, most: f64) -> f64 {
    if by_chance >= most { 0.0 } else { ((found - by_chance) / (1.0 - by_chance / most)).max(0.0) }
}

/// Returns the number of matches within each radius.
fn counts(matcher: &Matcher, moved: &[[f64; 2]], matches: &Matches) -> [f64; RADII_M.len()] {
    let distances = matcher.distances_m(moved, matches);
    RADII_M.map(|radius_m| distances.iter().filter(|distance| **distance <= radius_m).count() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshmark_core::ground::Ground;

    /// Returns a number from −1 to 1 that looks random.
    fn random(i: usize) -> f64 {
        ((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / 2f64.powi(52) - 1.0
    }

    /// Chooses the radius for 900 vertices, 7 m apart on average, of which every `every`-th one moves
    /// by up to `noise_m` along each axis.
    fn chosen(noise_m: f64, every: usize) -> Radius {
        let place = |i: usize| [(i % 30) as f64 * 7.0, (i / 30) as f64 * 7.0];
        let reference: Vec<[f64; 2]> =
            (0..900).map(|i| [0, 1].map(|axis| place(i)[axis] + 2.0 * random(2 * i + axis))).collect();
        let noise = |i: usize| if i.is_multiple_of(every) { noise_m } else { 0.0 };
        let each = reference.iter().enumerate();
        let moved: Vec<[f64; 2]> =
            each.map(|(i, p)| [0, 1].map(|axis| p[axis] + noise(i) * random(5001 + 2 * i + axis))).collect();
        let matcher = Matcher::new(&reference, &Ground::METRES, [100.0, 100.0]);
        RadiusChoice::FromData.choose(&matcher, &moved, [1.0, 1.0])
    }

    #[test]
    fn the_radius_grows_with_the_noise_and_not_with_a_few_vertices_that_went_astray() {
        assert_eq!(chosen(0.0, 1), Radius { metres: 1.0, reason: RadiusReason::Least });
        assert_eq!(chosen(0.5, 1), Radius { metres: 1.0, reason: RadiusReason::Least });
        assert_eq!(chosen(1.3, 1), Radius { metres: 1.5, reason: RadiusReason::Noise });
        assert_eq!(chosen(1.8, 1), Radius { metres: 2.0, reason: RadiusReason::Noise });
        assert_eq!(chosen(2.5, 60), Radius { metres: 1.0, reason: RadiusReason::Least });
        let given = RadiusChoice::Given(0.4);
        let matcher = Matcher::new(&[[0.0; 2]], &Ground::METRES, [0.0; 2]);
        let found = given.choose(&matcher, &[[3.0; 2]], [1.0; 2]);
        assert_eq!(found, Radius { metres: 0.4, reason: RadiusReason::Given });
    }
}
