//! Attacks on buildings: each shifts and turns as a rigid body.

use super::{Layer, Map, Random, parts::is_polygonal, similarity::rotation};
use crate::Result;
use geo::{Centroid, Coord, Geometry, GeometryCollection, MapCoords};
use meshmark_core::disjoint_sets::DisjointSets;
use std::collections::{BTreeMap, HashMap};

/// The motion of bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Standard deviation of the shift along either axis, units of the CRS.
    pub deviation: f64,
    /// The turn about the centroid is uniform between minus and plus this angle.
    pub degrees: f64,
}

/// Shifts and turns every body: a polygon, or the polygons of one layer that share vertices, such
/// as the houses of a terrace. Lines and points stay.
///
/// # Errors
/// Fails on a body without a centroid.
pub fn shift_and_turn(map: &Map, motion: Motion, seed: u64) -> Result<Map> {
    let mut random = Random::new(seed);
    let mut map = map.clone();
    for layer in &mut map.layers {
        for body in bodies(layer) {
            let shift = [(); 2].map(|()| motion.deviation * random.normal());
            let turn = rotation(random.symmetric(motion.degrees));
            let geometries = body.iter().filter_map(|i| layer.features[*i].geometry.clone()).collect();
            let about = GeometryCollection(geometries).centroid().ok_or("a polygon has no centroid")?.0;
            let moved = |c: Coord| {
                let (dx, dy) = (c.x - about.x, c.y - about.y);
                let [x, y] = turn.map(|row| row[0] * dx + row[1] * dy);
                Coord { x: about.x + x + shift[0], y: about.y + y + shift[1] }
            };
            for i in body {
                let geometry = &mut layer.features[i].geometry;
                *geometry = geometry.take().map(|geometry: Geometry| geometry.map_coords(moved));
            }
        }
    }
    Ok(map)
}

/// Returns the bodies of a layer, each as the numbers of its features.
fn bodies(layer: &Layer) -> Vec<Vec<usize>> {
    let mut joined = DisjointSets::new(layer.features.len());
    let mut first_with: HashMap<[u64; 2], u32> = HashMap::new();
    for (i, geometry) in polygons(layer) {
        for [x, y] in super::map::coords(geometry) {
            let first = *first_with.entry([x.to_bits(), y.to_bits()]).or_insert(i as u32);
            joined.join(first, i as u32);
        }
    }
    let roots = joined.roots();
    let mut bodies: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, _) in polygons(layer) {
        bodies.entry(roots[i]).or_default().push(i);
    }
    bodies.into_values().collect()
}

fn polygons(layer: &Layer) -> impl Iterator<Item = (usize, &Geometry)> {
    let geometries = layer.features.iter().enumerate().filter_map(|(i, f)| Some((i, f.geometry.as_ref()?)));
    geometries.filter(|(_, geometry)| is_polygonal(geometry))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory, pairs};

    const HOUSES: [&str; 4] = [
        "POLYGON ((0 0,6 0,6 5,0 5,0 0))",
        "POLYGON ((6 5,6 0,12 0,12 5,6 5))",
        "POLYGON ((50 0,56 0,56 5,50 5,50 0))",
        "LINESTRING (0 0,50 0)",
    ];

    fn moves(motion: Motion) -> Vec<[f64; 2]> {
        let map = in_memory(&HOUSES);
        let moved = shift_and_turn(&map, motion, 1).unwrap();
        pairs(&map, &moved).map(|(a, b)| [b[0] - a[0], b[1] - a[1]]).collect()
    }

    fn is_close(a: [f64; 2], b: [f64; 2]) -> bool {
        (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9
    }

    #[test]
    fn houses_of_a_terrace_shift_together_and_lines_stay() {
        let moves = moves(Motion { deviation: 1.0, degrees: 0.0 });
        assert!(moves[..10].iter().all(|by| is_close(*by, moves[0])));
        assert!(moves[10..15].iter().all(|by| is_close(*by, moves[10])));
        assert!(!is_close(moves[0], moves[10]) && !is_close(moves[0], [0.0; 2]));
        assert_eq!(moves[15..], [[0.0; 2]; 2]);
    }

    #[test]
    fn a_turn_keeps_the_centroid_of_the_body_and_stays_within_its_angle() {
        let moves = moves(Motion { deviation: 0.0, degrees: 2.0 });
        for corners in [&moves[10..14], &moves[..4]] {
            assert!(corners.iter().all(|by| by[0].hypot(by[1]) > 1e-6), "{corners:?}");
        }
        let sum = moves[10..14].iter().fold([0.0; 2], |sum, by| [sum[0] + by[0], sum[1] + by[1]]);
        assert!(is_close(sum, [0.0; 2]), "{sum:?}");
        let most = 3f64.hypot(2.5) * 2f64.to_radians();
        assert!(moves[10..14].iter().all(|by| by[0].hypot(by[1]) <= most));
    }

    #[test]
    fn the_shifts_of_a_real_map_have_the_deviation() {
        let map = fixture("astana.gpkg");
        let bodies = bodies(&map.layers[0]).len();
        assert!(bodies > 300, "{bodies} buildings stand by themselves");
        let moved = shift_and_turn(&map, Motion { deviation: 2.0, degrees: 0.0 }, 3).unwrap();
        let buildings = |map: &Map| Map { layers: vec![map.layers[0].clone()] };
        let east: Vec<f64> = pairs(&buildings(&map), &buildings(&moved)).map(|(a, b)| b[0] - a[0]).collect();
        let deviation = (east.iter().map(|d| d * d).sum::<f64>() / east.len() as f64).sqrt();
        assert!((deviation - 2.0).abs() < 0.4, "{deviation}");
        assert_eq!(moved, shift_and_turn(&map, Motion { deviation: 2.0, degrees: 0.0 }, 3).unwrap());
    }
}
