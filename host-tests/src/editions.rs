//! Editions of a map as its producer edits it: features are moved, drawn anew, removed and added.

use crate::{
    Result,
    attacks::{Map, Random},
};
use geo::{Coord, CoordsIter, Geometry, MapCoords};
use std::collections::BTreeMap;

/// Returns the next edition of a map, in which a share of the features has changed: equal parts are
/// moved by some metres, have one vertex elsewhere, are removed, and have a new neighbour.
pub fn next(map: &Map, share: f64, seed: u64) -> Map {
    let mut random = Random::new(seed);
    let mut changes = random.share(map.features().count(), share).into_iter();
    let mut edited = map.clone();
    for layer in &mut edited.layers {
        let mut added = Vec::new();
        layer.features.retain_mut(|feature| {
            let Some(geometry) = feature.geometry.as_mut().filter(|_| changes.next() == Some(true)) else {
                return true;
            };
            let by = [random.symmetric(8.0), random.symmetric(8.0)];
            match random.below(4) {
                0 => *geometry = moved(geometry, by),
                1 => *geometry = reshaped(geometry, &mut random),
                2 => return false,
                _ => {
                    let mut neighbour = feature.clone();
                    neighbour.fid = None;
                    neighbour.geometry = feature.geometry.as_ref().map(|g| moved(g, [by[0] + 40.0, by[1]]));
                    added.push(neighbour);
                }
            }
            true
        });
        layer.features.extend(added);
    }
    edited
}

fn moved(geometry: &Geometry, by: [f64; 2]) -> Geometry {
    geometry.map_coords(|c| Coord { x: c.x + by[0], y: c.y + by[1] })
}

/// Moves all occurrences of one vertex by less than a metre.
fn reshaped(geometry: &Geometry, random: &mut Random) -> Geometry {
    let corners: Vec<[f64; 2]> = geometry.coords_iter().map(|c| [c.x, c.y]).collect();
    let chosen = corners[random.below(corners.len())];
    let by = [random.symmetric(0.8), random.symmetric(0.8)];
    geometry.map_coords(|c| match [c.x, c.y] == chosen {
        true => Coord { x: c.x + by[0], y: c.y + by[1] },
        false => c,
    })
}

/// Returns where a copy has every vertex of its source, of which it has the features in order.
///
/// # Errors
/// Fails where they differ in the number of coordinates, or one vertex has two places.
pub fn places(source: &Map, copy: &Map) -> Result<BTreeMap<[u64; 2], [f64; 2]>> {
    if source.coords().count() != copy.coords().count() {
        return Err("the copy does not have the coordinates of its source".into());
    }
    let mut places = BTreeMap::new();
    for (from, to) in source.coords().zip(copy.coords()) {
        // −0.0 is 0.0.
        let vertex = from.map(|value| (value + 0.0).to_bits());
        if *places.entry(vertex).or_insert(to) != to {
            return Err(format!("the vertex ({}, {}) has two places", from[0], from[1]).into());
        }
    }
    Ok(places)
}

/// Counts the vertices that two copies have in common, and those of them at the same place to the last
/// bit.
pub fn common(a: &BTreeMap<[u64; 2], [f64; 2]>, b: &BTreeMap<[u64; 2], [f64; 2]>) -> [usize; 2] {
    let shared = a.iter().filter_map(|(vertex, place)| Some((place, b.get(vertex)?)));
    let shared: Vec<_> = shared.collect();
    [shared.len(), shared.iter().filter(|(a, b)| a.map(f64::to_bits) == b.map(f64::to_bits)).count()]
}
