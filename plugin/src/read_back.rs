//! Reading back: what is in the file is what was meant, and the message can be read from it.
//!
//! Drivers of GDAL may fail without a word, and formats round, turn rings around and change the order of
//! features; so the features of the file that was written are compared with those that were meant, and the
//! message is demodulated from the vertices of the file.

use crate::{
    error::{Error, Result},
    ffi_errors::Collector,
    ffi_source::View,
    formats::Format,
    marking::Request,
};
use gdal::{
    Dataset, DatasetOptions, GdalOpenFlags,
    vector::{Feature, Layer, LayerAccess},
};
use meshmark_core::vertices::VertexTable;
use meshmark_dataset::wkb::{self, WkbError};
use std::{
    hash::{DefaultHasher, Hash, Hasher},
    path::Path,
};

/// A file that was written.
pub struct Written<'a> {
    /// Its path.
    pub path: &'a Path,
    /// Its format.
    pub format: &'static Format,
    /// Its layers.
    pub layers: Vec<WrittenLayer>,
}

/// A layer that was written.
pub struct WrittenLayer {
    /// Its name in the source of the marking.
    pub staged: String,
    /// Its name in the file.
    pub name: String,
    /// Its creation options.
    pub options: Vec<(String, String)>,
}

/// Fails unless the file holds the features of the marked map, within the precision of its format, and the
/// message.
pub fn check(written: &Written, view: &View, request: &Request, threads: usize) -> Result<()> {
    let file = open(written)?;
    let meant = view.dataset();
    let mut vertices = Vec::new();
    let mut widest = 0f64;
    for layer in &written.layers {
        let magnitude = view.marking().moved().iter().flatten().fold(0f64, |most, v| most.max(v.abs()));
        let tolerance = written.format.tolerance(&layer.options, magnitude);
        let keep = view.marking().marks_layer(&layer.staged).then_some(&mut vertices);
        let comparison = Comparison { tolerance, failed: &|d: &str| not_kept(written, layer, d) };
        // The only layer of a file may bear the file's name.
        let in_file = match written.format.many_layers {
            true => file.layer_by_name(&layer.name),
            false => file.layer(0),
        };
        comparison.layers(meant.layer_by_name(&layer.staged), in_file, keep)?;
        widest = widest.max(tolerance);
    }
    let found = find_all(view.marking().moved(), vertices, widest);
    let found = found.ok_or_else(|| not_kept(written, &written.layers[0], "a vertex is missing"))?;
    view.marking().check_message(request, &found, threads)
}

fn not_kept(written: &Written, layer: &WrittenLayer, difference: &str) -> Error {
    Error::NotKept { driver: written.format.driver, layer: layer.name.clone(), difference: difference.into() }
}

fn open(written: &Written) -> Result<Dataset> {
    let collector = Collector::new();
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_VECTOR | GdalOpenFlags::GDAL_OF_INTERNAL,
        allowed_drivers: Some(&[written.format.driver]),
        ..DatasetOptions::default()
    };
    Dataset::open_ex(written.path, options).map_err(|error| {
        let reason = collector.first_failure().unwrap_or_else(|| error.to_string());
        Error::Writing { what: "opening it again".into(), reason }
    })
}

struct Comparison<'a> {
    tolerance: f64,
    failed: &'a dyn Fn(&str) -> Error,
}

impl Comparison<'_> {
    /// Compares two layers; the coordinates of the second are added to `keep`.
    fn layers(
        &self,
        meant: gdal::errors::Result<Layer>,
        in_file: gdal::errors::Result<Layer>,
        mut keep: Option<&mut Vec<[f64; 2]>>,
    ) -> Result<()> {
        let collector = Collector::new();
        let mut one = meant.map_err(|_| (self.failed)("the layer is missing"))?;
        let mut other = in_file.map_err(|_| (self.failed)("the layer is missing"))?;
        one.reset_feature_reading(); // it was read to its end when it was written
        let (mut one, mut other) = (one.features(), other.features());
        let mut sums = [0u64; 2];
        loop {
            match (one.next(), other.next()) {
                (None, None) => break,
                (Some(a), Some(b)) => {
                    let (a, b) = (self.coords(&a)?, self.coords(&b)?);
                    if let Some(keep) = &mut keep {
                        keep.extend_from_slice(&b);
                    }
                    if self.tolerance > 0.0 {
                        self.features(a, b)?;
                    } else {
                        // The order of features may be another one: what is in all of them counts.
                        sums[0] = sums[0].wrapping_add(digest(a));
                        sums[1] = sums[1].wrapping_add(digest(b));
                    }
                }
                _ => {
                    let reason = collector.first_failure();
                    return Err((self.failed)(reason.as_deref().unwrap_or("another number of features")));
                }
            }
        }
        if let Some(reason) = collector.first_failure() {
            return Err((self.failed)(&reason));
        }
        match sums[0] == sums[1] {
            true => Ok(()),
            false => Err((self.failed)("other coordinates")),
        }
    }

    fn features(&self, a: Vec<[f64; 2]>, b: Vec<[f64; 2]>) -> Result<()> {
        if a.len() != b.len() {
            return Err((self.failed)("another number of coordinates"));
        }
        let forth = find_all(&a, b.clone(), self.tolerance).is_some();
        match forth && find_all(&b, a, self.tolerance).is_some() {
            true => Ok(()),
            false => Err((self.failed)("other coordinates")),
        }
    }

    fn coords(&self, feature: &Feature) -> Result<Vec<[f64; 2]>> {
        let mut coords = Vec::new();
        // The staging GeoPackage has one geometry column; a null geometry has no coordinates.
        if let Ok(geometry) = feature.geometry_by_index(0) {
            let mut bytes = geometry.iso_wkb().map_err(|error| (self.failed)(&error.to_string()))?;
            let mut visit = |_, point: [f64; 2]| {
                coords.push(point.map(|v| v + 0.0)); // −0.0 becomes 0.0
                Ok(point)
            };
            wkb::map_coordinates::<WkbError>(&mut bytes, &mut visit)
                .map_err(|error| (self.failed)(&error.to_string()))?;
        }
        Ok(coords)
    }
}

/// A digest of coordinates in any order: formats turn rings around.
fn digest(mut coords: Vec<[f64; 2]>) -> u64 {
    coords.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hasher = DefaultHasher::new();
    coords.iter().flatten().for_each(|v| v.to_bits().hash(&mut hasher));
    hasher.finish()
}

/// The nearest of `places` to every one of `wanted`, or none when one has none within `tolerance` along x and y.
fn find_all(wanted: &[[f64; 2]], places: Vec<[f64; 2]>, tolerance: f64) -> Option<Vec<[f64; 2]>> {
    let table = VertexTable::new(places).ok()?;
    let places = table.coords();
    let find = |&[x, y]: &[f64; 2]| {
        let first = places.partition_point(|p| p[0] < x - tolerance);
        let near = places[first..].iter().take_while(|p| p[0] <= x + tolerance);
        let near = near.filter(|p| (p[1] - y).abs() <= tolerance);
        let distance = |p: &[f64; 2]| (p[0] - x).hypot(p[1] - y);
        near.min_by(|a, b| distance(a).total_cmp(&distance(b))).copied()
    };
    wanted.iter().map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_knows_every_bit_and_no_order() {
        let ring = vec![[0.0, 1.0], [2.0, 3.0], [2.0, 1.0]];
        let turned: Vec<_> = ring.iter().rev().copied().collect();
        assert_eq!(digest(ring.clone()), digest(turned));
        let mut other = ring.clone();
        other[1][0] = 2.0f64.next_up();
        assert_ne!(digest(ring), digest(other));
    }

    #[test]
    fn the_nearest_place_within_the_tolerance_is_found_or_none() {
        let places = vec![[0.0, 0.0], [0.04, 0.0], [0.0, 0.3], [5.0, 5.0]];
        assert_eq!(
            find_all(&[[0.03, 0.0], [5.0, 5.0]], places.clone(), 0.05),
            Some(vec![[0.04, 0.0], [5.0, 5.0]])
        );
        assert_eq!(find_all(&[[0.0, 0.1]], places.clone(), 0.05), None);
        assert_eq!(find_all(&[[0.0, 0.3]], places, 0.0), Some(vec![[0.0, 0.3]]));
    }
}
