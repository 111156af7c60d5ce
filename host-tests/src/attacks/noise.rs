//! Noise and rounding.

use super::{Map, Random, random::PerVertex};
use crate::Result;
use geo::{Coord, Geometry, MapCoords};

/// Adds a number from `draw` to both coordinates of every vertex, units of the CRS.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn add(map: &Map, seed: u64, draw: impl Fn(&mut Random) -> f64) -> Result<Map> {
    let noise = PerVertex::draw(map, seed, |random| [draw(random), draw(random)])?;
    Ok(map.map_coords(|vertex| {
        let [dx, dy] = noise.at(vertex);
        [vertex[0] + dx, vertex[1] + dy]
    }))
}

/// Adds Gaussian noise to the vertices of a share of the features, so vertices that they share with
/// others separate.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn redraw(map: &Map, share: f64, deviation: f64, seed: u64) -> Result<Map> {
    let mut random = Random::new(seed);
    let noise = PerVertex::draw(map, random.seed(), |random| [(); 2].map(|()| deviation * random.normal()))?;
    let mut chosen = random.share(map.features().count(), share).into_iter();
    let mut map = map.clone();
    for feature in map.layers.iter_mut().flat_map(|layer| &mut layer.features) {
        if chosen.next() == Some(true) {
            feature.geometry = feature.geometry.take().map(|geometry: Geometry| {
                geometry.map_coords(|c| {
                    let [dx, dy] = noise.at([c.x, c.y]);
                    Coord { x: c.x + dx, y: c.y + dy }
                })
            });
        }
    }
    Ok(map)
}

/// Puts every vertex on the nearest node of a grid through the origin.
pub fn snap(map: &Map, spacing: f64) -> Map {
    // Nodes with a spacing such as 0.1 are k / 10, which prints as one decimal, unlike k × 0.1.
    let per_unit = 1.0 / spacing;
    let whole = (per_unit - per_unit.round()).abs() < 1e-9;
    let node = |value: f64| match whole {
        true => (value * per_unit.round()).round() / per_unit.round(),
        false => (value / spacing).round() * spacing,
    };
    map.map_coords(|vertex| vertex.map(node))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{assert_shared_vertices_stay_shared, fixture, in_memory, pairs, wkt};

    #[test]
    fn noise_fills_its_square_and_a_seed_repeats_it() {
        let map = fixture("kotka.gpkg");
        let noisy = add(&map, 5, |random| random.symmetric(0.3)).unwrap();
        let moved: Vec<[f64; 2]> = pairs(&map, &noisy).map(|(a, b)| [b[0] - a[0], b[1] - a[1]]).collect();
        let most = moved.iter().flatten().fold(0f64, |a, b| a.max(b.abs()));
        assert!(most <= 0.3 + 1e-8 && most > 0.299, "{most}");
        let mean_square = moved.iter().flatten().map(|d| d * d).sum::<f64>() / (2 * moved.len()) as f64;
        assert!((mean_square - 0.03).abs() < 0.002, "variance of a uniform distribution: {mean_square}");
        assert_eq!(noisy, add(&map, 5, |random| random.symmetric(0.3)).unwrap());
        assert_ne!(noisy, add(&map, 6, |random| random.symmetric(0.3)).unwrap());
    }

    #[test]
    fn a_share_of_the_features_is_redrawn_and_the_others_stay() {
        let map = fixture("kotka.gpkg");
        let redrawn = redraw(&map, 0.3, 0.5, 2).unwrap();
        let changed = map.features().zip(redrawn.features()).filter(|(a, b)| a != b).count();
        assert_eq!(changed, (map.features().count() as f64 * 0.3).round() as usize);
        let moves: Vec<f64> =
            pairs(&map, &redrawn).map(|(a, b)| b[0] - a[0]).filter(|by| *by != 0.0).collect();
        let deviation = (moves.iter().map(|by| by * by).sum::<f64>() / moves.len() as f64).sqrt();
        assert!((deviation - 0.5).abs() < 0.05, "{deviation}");
    }

    #[test]
    fn shared_walls_stay_shared() {
        let map = fixture("helsinki.gpkg");
        assert_shared_vertices_stay_shared(&map, &add(&map, 1, |random| random.symmetric(0.5)).unwrap());
    }

    #[test]
    fn snapped_coordinates_print_as_the_decimals_they_are() {
        let map = in_memory(&["LINESTRING (0.26 0.34,385418.2914 6671463.552)"]);
        assert_eq!(wkt(&snap(&map, 0.1)), ["LINESTRING (0.3 0.3,385418.3 6671463.6)"]);
        assert_eq!(wkt(&snap(&map, 0.25)), ["LINESTRING (0.25 0.25,385418.25 6671463.5)"]);
        assert_eq!(wkt(&snap(&map, 3.0)), ["LINESTRING (0 0,385419 6671463)"]);
    }
}
