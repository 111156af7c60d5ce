//! Smooth deformation of a whole map, like that of wet paper or of a georeferenced scan.

use super::{Map, Random};
use crate::Result;
use std::f64::consts::TAU;

/// The lengths of the waves, units of the CRS.
const WAVELENGTHS: [f64; 2] = [100.0, 200.0];
/// Waves of either coordinate.
const WAVES: usize = 3;

/// A plane wave of displacement.
struct Wave {
    /// Radians a unit of the CRS.
    vector: [f64; 2],
    phase: f64,
    amplitude: f64,
}

impl Wave {
    fn draw(random: &mut Random, amplitude: f64) -> Wave {
        let [shortest, longest] = WAVELENGTHS;
        let length = shortest + (longest - shortest) * random.unit();
        let (sin, cos) = (TAU * random.unit()).sin_cos();
        Wave { vector: [cos, sin].map(|c| TAU * c / length), phase: TAU * random.unit(), amplitude }
    }

    fn at(&self, [x, y]: [f64; 2]) -> f64 {
        self.amplitude * (self.vector[0] * x + self.vector[1] * y + self.phase).sin()
    }
}

/// Moves every vertex by a field of displacements, of which either coordinate is a sum of a few
/// plane waves of random directions and phases. `amplitude` is the sum of theirs: no coordinate
/// moves further.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn bend(map: &Map, amplitude: f64, seed: u64) -> Result<Map> {
    let mut random = Random::new(seed);
    let mut waves = || [(); WAVES].map(|()| Wave::draw(&mut random, amplitude / WAVES as f64));
    let field = [waves(), waves()];
    let centre = map.vertices()?.centre(); // keeps the sines exact
    Ok(map.map_coords(|vertex| {
        let local = [0, 1].map(|axis| vertex[axis] - centre[axis]);
        let displacement = |axis: usize| field[axis].iter().map(|wave| wave.at(local)).sum::<f64>();
        [0, 1].map(|axis| vertex[axis] + displacement(axis))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{assert_shared_vertices_stay_shared, fixture, pairs};

    #[test]
    fn vertices_move_up_to_the_amplitude_and_neighbours_move_alike() {
        let map = fixture("helsinki.gpkg");
        let bent = bend(&map, 10.0, 1).unwrap();
        let moves: Vec<([f64; 2], [f64; 2])> =
            pairs(&map, &bent).map(|(a, b)| (a, [b[0] - a[0], b[1] - a[1]])).collect();
        let most = moves.iter().flat_map(|(_, by)| by).fold(0f64, |most, by| most.max(by.abs()));
        assert!(most <= 10.0 && most > 7.0, "{most}");
        // A wave of a metre has at most 2π/100 a metre of slope.
        for pair in moves.windows(2) {
            let [(a, moved_a), (b, moved_b)] = [pair[0], pair[1]];
            let bound = 10.0 * TAU / WAVELENGTHS[0] * (a[0] - b[0]).hypot(a[1] - b[1]) + 1e-6;
            assert!((moved_a[0] - moved_b[0]).abs() <= bound && (moved_a[1] - moved_b[1]).abs() <= bound);
        }
        assert_shared_vertices_stay_shared(&map, &bent);
    }

    #[test]
    fn a_seed_repeats_the_field_and_the_axes_differ() {
        let map = fixture("kotka.gpkg");
        let bent = bend(&map, 2.0, 7).unwrap();
        assert_eq!(bent, bend(&map, 2.0, 7).unwrap());
        assert_ne!(bent, bend(&map, 2.0, 8).unwrap());
        assert!(pairs(&map, &bent).any(|(a, b)| ((b[0] - a[0]) - (b[1] - a[1])).abs() > 0.5));
    }
}
