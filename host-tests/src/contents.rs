//! The content of a dataset, for the comparison of two datasets feature by feature.

use gdal::{
    Dataset,
    vector::{Layer, LayerAccess},
};
use meshmark_marking::wkb::{self, WkbError};
use std::{collections::HashMap, path::Path};

/// A layer with all its features.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerContents {
    /// Its name.
    pub name: String,
    /// Its features in reading order.
    pub features: Vec<FeatureContents>,
}

/// A feature.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureContents {
    /// Its id.
    pub fid: Option<u64>,
    /// Names and values.
    pub attributes: String,
    /// ISO WKB of every geometry column; `None` for a null geometry.
    pub geometries: Vec<Option<Vec<u8>>>,
}

/// Reads a dataset that GDAL opens without our driver.
pub fn read(path: &Path) -> Vec<LayerContents> {
    let dataset = Dataset::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    read_dataset(&dataset)
}

/// Reads an open dataset.
pub fn read_dataset(dataset: &Dataset) -> Vec<LayerContents> {
    dataset.layers().map(|mut layer| read_layer(&mut layer)).collect()
}

/// Reads a layer.
pub fn read_layer(layer: &mut Layer) -> LayerContents {
    let columns = layer.defn().geom_fields().count();
    let name = layer.name();
    let features = layer.features().map(|feature| FeatureContents {
        fid: feature.fid(),
        attributes: format!("{:?}", feature.fields().collect::<Vec<_>>()),
        geometries: (0..columns)
            .map(|column| feature.geometry_by_index(column).ok().map(|g| g.iso_wkb().unwrap()))
            .collect(),
    });
    LayerContents { name, features: features.collect() }
}

impl LayerContents {
    /// Returns every coordinate of every geometry.
    pub fn coords(&self) -> Vec<[f64; 2]> {
        let geometries = self.features.iter().flat_map(|f| f.geometries.iter().flatten());
        geometries.flat_map(|wkb| coords(wkb)).collect()
    }
}

/// Returns the coordinates of a geometry.
pub fn coords(wkb: &[u8]) -> Vec<[f64; 2]> {
    let mut coords = Vec::new();
    let mut keep = |_, point| {
        coords.push(point);
        Ok(point)
    };
    wkb::map_coordinates::<WkbError>(&mut wkb.to_vec(), &mut keep).unwrap();
    coords
}

/// Returns the bytes of a geometry with every coordinate pair zeroed: type, structure, Z and M.
fn skeleton(wkb: &[u8]) -> Vec<u8> {
    let mut bytes = wkb.to_vec();
    wkb::map_coordinates::<WkbError>(&mut bytes, &mut |_, _| Ok([0.0, 0.0])).unwrap();
    bytes
}

/// Returns where every vertex of `before` is in `after`.
///
/// # Panics
/// Panics unless the two differ in nothing but coordinates, and all occurrences of a vertex move to
/// one place.
#[track_caller]
pub fn moves(before: &[LayerContents], after: &[LayerContents]) -> Vec<([f64; 2], [f64; 2])> {
    let names = |layers: &[LayerContents]| layers.iter().map(|l| l.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(before), names(after));
    let mut places = HashMap::new();
    for (before, after) in before.iter().zip(after) {
        assert_eq!(before.features.len(), after.features.len(), "features of {}", before.name);
        for (before, after) in before.features.iter().zip(&after.features) {
            assert_eq!((before.fid, &before.attributes), (after.fid, &after.attributes));
            for (before, after) in before.geometries.iter().zip(&after.geometries) {
                moves_of_geometry(before.as_deref(), after.as_deref(), &mut places);
            }
        }
    }
    places.into_iter().map(|(from, to)| (from.map(f64::from_bits), to)).collect()
}

#[track_caller]
fn moves_of_geometry(before: Option<&[u8]>, after: Option<&[u8]>, places: &mut HashMap<[u64; 2], [f64; 2]>) {
    assert_eq!(before.map(skeleton), after.map(skeleton), "structure, Z and M stay");
    let (Some(before), Some(after)) = (before, after) else { return };
    for (from, to) in coords(before).into_iter().zip(coords(after)) {
        let known = places.insert(from.map(f64::to_bits), to);
        assert!(known.is_none_or(|known| known == to), "the vertex {from:?} went to {known:?} and to {to:?}");
    }
}

/// Returns the root mean square and the largest length of moves, CRS units.
pub fn lengths(moves: &[([f64; 2], [f64; 2])]) -> (f64, f64) {
    let lengths = moves.iter().map(|(a, b)| (b[0] - a[0]).hypot(b[1] - a[1]));
    let (sum, max) = lengths.fold((0.0, 0f64), |(sum, max), d| (sum + d * d, max.max(d)));
    ((sum / moves.len() as f64).sqrt(), max)
}
