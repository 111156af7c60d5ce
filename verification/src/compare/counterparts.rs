//! The counterparts of features: which feature of a marked map is which of the reference.

use crate::{Error, Result};
use meshmark_marking::{FeatureGeometry, Outline};

/// A geometry before and after.
pub(crate) struct Pair {
    pub before: Outline,
    pub after: Outline,
}

/// The features of a layer in their order, with its name.
type Layer = (String, Vec<FeatureGeometry>);

/// Pairs the features of two maps, which correspond by their order in layers of the same name. Where both
/// maps have one layer, these are counterparts whatever their names, which a Shapefile has from its file.
///
/// # Errors
/// [`Error::OtherLayers`], [`Error::OtherCount`], [`Error::OtherVertices`].
pub(super) fn pairs(before: Vec<FeatureGeometry>, after: Vec<FeatureGeometry>) -> Result<Vec<Pair>> {
    if before.is_empty() != after.is_empty() {
        return Err(Error::OtherCount { layer: None, reference: before.len(), marked: after.len() });
    }
    let (before, mut after) = (by_layer(before), by_layer(after));
    if let ([(name, _)], [(other, _)]) = (&before[..], &mut after[..]) {
        other.clone_from(name);
    }
    let lacking = |layers: &[Layer], others: &[Layer]| -> Vec<String> {
        let names = layers.iter().map(|(name, _)| name);
        names.filter(|name| !others.iter().any(|(other, _)| other == *name)).cloned().collect()
    };
    let (reference, marked) = (lacking(&before, &after), lacking(&after, &before));
    if !reference.is_empty() || !marked.is_empty() {
        return Err(Error::OtherLayers { reference, marked });
    }
    let is_one = before.len() == 1;
    let mut pairs = Vec::new();
    for (name, features) in before {
        let place = after.iter().position(|(other, _)| *other == name).expect("it has a counterpart");
        let (_, others) = after.swap_remove(place);
        if features.len() != others.len() {
            let (reference, marked) = (features.len(), others.len());
            return Err(Error::OtherCount { layer: (!is_one).then_some(name), reference, marked });
        }
        let own: Vec<Pair> = features.into_iter().zip(others).map(pair).collect::<Result<_>>()?;
        pairs.extend(own);
    }
    Ok(pairs)
}

/// Groups features by the names of their layers, in the order of the map.
fn by_layer(features: Vec<FeatureGeometry>) -> Vec<Layer> {
    let mut layers: Vec<Layer> = Vec::new();
    for feature in features {
        match layers.iter_mut().rev().find(|(name, _)| *name == feature.layer) {
            Some((_, own)) => own.push(feature),
            None => layers.push((feature.layer.clone(), vec![feature])),
        }
    }
    layers
}

fn pair((before, after): (FeatureGeometry, FeatureGeometry)) -> Result<Pair> {
    let counts = |feature: &FeatureGeometry| feature.outline.chains.iter().map(Vec::len).collect::<Vec<_>>();
    if counts(&before) != counts(&after) {
        return Err(Error::OtherVertices { layer: before.layer, fid: before.fid, other: after.layer });
    }
    Ok(Pair { before: before.outline, after: after.outline })
}
