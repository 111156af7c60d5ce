//! Attacks on features: deletion, order, attributes, features of another map.

use super::{Feature, Layer, Map, random::Random, similarity};
use crate::Result;
use std::collections::HashMap;

/// Deletes a share of the features, chosen at random over all layers.
pub fn delete(map: &Map, share: f64, seed: u64) -> Map {
    let count = map.features().count();
    let mut deleted = Random::new(seed).share(count, share).into_iter();
    let mut map = map.clone();
    for layer in &mut map.layers {
        layer.features.retain(|_| deleted.next() == Some(false));
    }
    map
}

/// Exchanges the geometries of a share of the features for those of an unmarked map, by layer and
/// feature id.
///
/// # Errors
/// Fails on a feature that the unmarked map does not have.
pub fn exchange(map: &Map, unmarked: &Map, share: f64, seed: u64) -> Result<Map> {
    let mut exchanged = Random::new(seed).share(map.features().count(), share).into_iter();
    let mut map = map.clone();
    for layer in &mut map.layers {
        let same = unmarked.layers.iter().find(|other| other.name == layer.name);
        let originals: HashMap<Option<u64>, &Feature> = same
            .into_iter()
            .flat_map(|layer| &layer.features)
            .map(|feature| (feature.fid, feature))
            .collect();
        for feature in &mut layer.features {
            if exchanged.next() == Some(true) {
                let original = originals.get(&feature.fid).ok_or_else(|| {
                    format!("the unmarked layer \"{}\" has no feature {:?}", layer.name, feature.fid)
                })?;
                feature.geometry.clone_from(&original.geometry);
            }
        }
    }
    Ok(map)
}

/// Puts layers and features in random order and removes their ids, by which they could be sorted
/// again.
pub fn scramble(map: &Map, seed: u64) -> Map {
    let mut random = Random::new(seed);
    let mut map = map.clone();
    random.shuffle(&mut map.layers);
    for layer in &mut map.layers {
        random.shuffle(&mut layer.features);
        layer.features.iter_mut().for_each(|feature| feature.fid = None);
    }
    map
}

/// Removes all attributes.
pub fn drop_attributes(map: &Map) -> Map {
    let mut map = map.clone();
    for layer in &mut map.layers {
        layer.fields.clear();
        layer.features.iter_mut().for_each(|feature| feature.values.clear());
    }
    map
}

/// Lays another map over this one, centre on centre, in layers of its own.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn merge(map: &Map, foreign: &Map) -> Result<Map> {
    let (here, there) = (map.vertices()?.centre(), foreign.vertices()?.centre());
    let foreign = similarity::translate(foreign, [here[0] - there[0], here[1] - there[1]]);
    let crs = map.layers.first().and_then(|layer| layer.crs.clone());
    let mut merged = map.clone();
    merged.layers.extend(foreign.layers.into_iter().map(|layer| Layer {
        name: format!("foreign_{}", layer.name),
        crs: crs.clone(),
        ..layer
    }));
    Ok(merged)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::fixture;

    #[test]
    fn so_many_features_are_deleted_and_the_others_are_untouched() {
        let map = fixture("kotka.gpkg");
        let left = delete(&map, 0.8, 3);
        assert_eq!(left.features().count(), (map.features().count() as f64 * 0.2).round() as usize);
        assert!(left.features().all(|feature| map.features().any(|other| other == feature)));
        assert_eq!(left, delete(&map, 0.8, 3));
        assert_ne!(left, delete(&map, 0.8, 4));
    }

    #[test]
    fn exchanged_features_are_the_unmarked_ones_and_the_others_are_untouched() {
        let unmarked = fixture("kotka.gpkg");
        let marked = similarity::translate(&unmarked, [1.0, 0.0]);
        let mixed = exchange(&marked, &unmarked, 0.3, 3).unwrap();
        let count = unmarked.features().count();
        let same = |other: &Map| mixed.features().zip(other.features()).filter(|(a, b)| a == b).count();
        assert_eq!(same(&unmarked), (0.3 * count as f64).round() as usize);
        assert_eq!(same(&unmarked) + same(&marked), count);
        let stranger = fixture("helsinki.gpkg");
        assert!(exchange(&stranger, &unmarked, 1.0, 3).is_err());
    }

    #[test]
    fn scrambling_changes_the_order_and_nothing_else() {
        let map = fixture("helsinki.gpkg");
        let scrambled = scramble(&map, 2);
        assert_eq!(scrambled.vertices().unwrap(), map.vertices().unwrap());
        for layer in &map.layers {
            let other = scrambled.layers.iter().find(|other| other.name == layer.name).unwrap();
            let geometries = |layer: &Layer| -> Vec<_> {
                layer.features.iter().map(|f| format!("{:?} {:?}", f.values, f.geometry)).collect()
            };
            let (mut before, mut after) = (geometries(layer), geometries(other));
            assert_ne!(before, after);
            before.sort();
            after.sort();
            assert_eq!(before, after);
        }
    }

    #[test]
    fn without_attributes_the_geometry_is_the_same() {
        let map = fixture("kotka.gpkg");
        let bare = drop_attributes(&map);
        assert!(bare.geometries().eq(map.geometries()));
        assert!(bare.layers.iter().all(|layer| layer.fields.is_empty()));
    }

    #[test]
    fn a_merged_map_has_the_features_of_both_in_one_place() {
        let (map, foreign) = (fixture("helsinki.gpkg"), fixture("kotka.gpkg"));
        let merged = merge(&map, &foreign).unwrap();
        assert_eq!(merged.features().count(), map.features().count() + foreign.features().count());
        let n = map.layers.len();
        let theirs = Map { layers: merged.layers[n..].to_vec() };
        let (here, there) = (map.vertices().unwrap().centre(), theirs.vertices().unwrap().centre());
        assert!((here[0] - there[0]).hypot(here[1] - there[1]) < 1e-6);
        assert_eq!(merged.layers[..n], map.layers);
    }
}
