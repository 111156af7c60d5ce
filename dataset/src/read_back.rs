//! Reading back: what is in the file is what was meant.
//!
//! Drivers of GDAL may fail without a word, and formats round, turn rings around and change the order of
//! features; so the features of the file that was written are compared with those that were meant.

use crate::wkb::{self, WkbError};
use gdal::vector::{Feature, Layer, LayerAccess};
use meshmark_core::vertices::VertexTable;
use std::hash::{DefaultHasher, Hash, Hasher};

/// What differs when features are missing, or there are more.
pub(crate) const OTHER_NUMBER: &str = "another number of features";

/// How to compare a layer of a file with what was meant.
pub struct Comparison<'a> {
    /// How far a coordinate may be from what was meant, CRS units; 0: not one bit.
    pub tolerance: f64,
    /// Where a coordinate of the first layer was meant to be; none when nobody knows.
    pub place: &'a dyn Fn([f64; 2]) -> Option<[f64; 2]>,
    /// What GDAL's last failure on this thread was, if there was one since the comparison began.
    pub last_failure: &'a dyn Fn() -> Option<String>,
}

impl Comparison<'_> {
    /// Compares two layers; the coordinates of the second are added to `keep`.
    ///
    /// # Errors
    /// The difference, in a few words.
    pub fn layers(
        &self,
        meant: gdal::errors::Result<Layer>,
        in_file: gdal::errors::Result<Layer>,
        mut keep: Option<&mut Vec<[f64; 2]>>,
    ) -> Result<(), String> {
        let (Ok(mut one), Ok(mut other)) = (meant, in_file) else {
            return Err("the layer is missing".into());
        };
        one.reset_feature_reading(); // it was read to its end when it was written
        let (mut one, mut other) = (one.features(), other.features());
        let mut sums = [0u64; 2];
        loop {
            match (one.next(), other.next()) {
                (None, None) => break,
                (Some(a), Some(b)) => {
                    let (a, b) = (self.meant(&a)?, coords(&b)?);
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
                    return Err((self.last_failure)().unwrap_or(OTHER_NUMBER.into()));
                }
            }
        }
        if let Some(reason) = (self.last_failure)() {
            return Err(reason);
        }
        match sums[0] == sums[1] {
            true => Ok(()),
            false => Err("other coordinates".into()),
        }
    }

    /// Compares a layer with coordinates in the order of its features, not one bit of which may differ.
    ///
    /// # Errors
    /// The difference, in a few words.
    pub fn in_order(
        &self,
        mut in_file: Layer,
        mut meant: impl Iterator<Item = [f64; 2]>,
    ) -> Result<(), String> {
        for feature in in_file.features() {
            if coords(&feature)?.into_iter().any(|point| meant.next() != Some(point)) {
                return Err("other coordinates".into());
            }
        }
        match ((self.last_failure)(), meant.next()) {
            (Some(reason), _) => Err(reason),
            (None, Some(_)) => Err("another number of coordinates".into()),
            (None, None) => Ok(()),
        }
    }

    fn features(&self, a: Vec<[f64; 2]>, b: Vec<[f64; 2]>) -> Result<(), String> {
        if a.len() != b.len() {
            return Err("another number of coordinates".into());
        }
        let forth = find_all(&a, b.clone(), self.tolerance).is_some();
        match forth && find_all(&b, a, self.tolerance).is_some() {
            true => Ok(()),
            false => Err("other coordinates".into()),
        }
    }

    fn meant(&self, feature: &Feature) -> Result<Vec<[f64; 2]>, String> {
        let place = |point| {
            (self.place)(point).ok_or("a coordinate was not there when the map was marked".to_string())
        };
        coords(feature)?.into_iter().map(place).collect()
    }
}

fn coords(feature: &Feature) -> Result<Vec<[f64; 2]>, String> {
    let mut coords = Vec::new();
    // What is written has one geometry column; a null geometry has no coordinates.
    if let Ok(geometry) = feature.geometry_by_index(0) {
        let mut bytes = geometry.iso_wkb().map_err(|error| error.to_string())?;
        let mut visit = |_, point: [f64; 2]| {
            coords.push(point.map(|v| v + 0.0)); // −0.0 becomes 0.0
            Ok(point)
        };
        wkb::map_coordinates::<WkbError>(&mut bytes, &mut visit).map_err(|error| error.to_string())?;
    }
    Ok(coords)
}

/// A digest of coordinates in any order: formats turn rings around.
fn digest(mut coords: Vec<[f64; 2]>) -> u64 {
    coords.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hasher = DefaultHasher::new();
    coords.iter().flatten().for_each(|v| v.to_bits().hash(&mut hasher));
    hasher.finish()
}

/// The nearest of `places` to every one of `wanted`, or none when one has none within `tolerance` along x and y.
pub fn find_all(wanted: &[[f64; 2]], places: Vec<[f64; 2]>, tolerance: f64) -> Option<Vec<[f64; 2]>> {
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
