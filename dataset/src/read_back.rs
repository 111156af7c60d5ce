//! Reading back: this module checks that a file holds what was meant.
//!
//! Drivers of GDAL may fail silently, and formats round coordinates, reverse rings and reorder
//! features; so the features of the written file are compared with those that were meant.

use crate::{decimals::Digits, geometry_fault::GeometryFault};
use gdal::vector::{Feature, Layer, LayerAccess};
use meshmark_core::counted;
use meshmark_marking::wkb::{self, WkbError};
use std::{
    cmp::Ordering,
    fmt,
    hash::{DefaultHasher, Hash, Hasher},
};

/// The difference between a layer of a file and what was meant.
#[derive(Debug)]
pub enum Difference {
    /// The numbers of features differ; some of the meant features have no coordinates.
    Features {
        /// How many features were meant.
        meant: usize,
        /// How many features the file has.
        in_file: usize,
        /// How many of the meant features have a null or an empty geometry.
        without_geometry: usize,
    },
    /// Coordinates became equal with these digits, and the driver wrote one of them.
    Merged(Digits),
    /// A geometry cannot be read.
    Unreadable(GeometryFault),
    /// Any other difference, in a few words.
    Other(String),
}

const OTHER_FORMAT: &str = "choose another format or its options";

impl From<String> for Difference {
    fn from(words: String) -> Self {
        Difference::Other(words)
    }
}

impl From<GeometryFault> for Difference {
    fn from(fault: GeometryFault) -> Self {
        Difference::Unreadable(fault)
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Difference::Features { meant, in_file, without_geometry: 0 } => {
                write!(f, "{} were meant, {in_file} are there", counted(*meant, "feature"))
            }
            Difference::Features { meant, in_file, without_geometry } => write!(
                f,
                "{} were meant, {without_geometry} of them with a null or empty geometry, and {in_file} are there",
                counted(*meant, "feature")
            ),
            Difference::Merged(digits) => write!(f, "coordinates become equal, written with {digits}"),
            Difference::Unreadable(fault) => fault.fmt(f),
            Difference::Other(words) => f.write_str(words),
        }
    }
}

impl Difference {
    /// Returns the remedy.
    pub fn remedy(&self) -> &'static str {
        match self {
            Difference::Features { without_geometry: 1.., .. } => {
                "leave them out (of a GeoPackage with -where \"NOT ST_IsEmpty(geom)\"), or choose another format"
            }
            Difference::Merged(digits) => digits.more().unwrap_or(OTHER_FORMAT),
            _ => OTHER_FORMAT,
        }
    }
}

/// The numbers of features.
#[derive(Default)]
struct Counts {
    meant: usize,
    in_file: usize,
    without_geometry: usize,
}

impl Counts {
    fn add(&mut self, meant: Option<&[[f64; 2]]>, in_file: Option<&[[f64; 2]]>) {
        self.meant += usize::from(meant.is_some());
        self.in_file += usize::from(in_file.is_some());
        self.without_geometry += usize::from(meant.is_some_and(<[_]>::is_empty));
    }

    fn check(self) -> Result<(), Difference> {
        let Counts { meant, in_file, without_geometry } = self;
        match meant == in_file {
            true => Ok(()),
            false => Err(Difference::Features { meant, in_file, without_geometry }),
        }
    }
}

/// The comparison of a layer of a file with what was meant.
pub struct ReadBack<'a> {
    /// The digits with which the layer is written.
    pub digits: Digits,
    /// The meant place of a coordinate of the first layer; `None` when it is unknown.
    pub place: &'a dyn Fn([f64; 2]) -> Option<[f64; 2]>,
    /// Returns GDAL's last failure on this thread since the comparison began, if there was one.
    pub last_failure: &'a dyn Fn() -> Option<String>,
}

impl ReadBack<'_> {
    /// Compares two layers; the coordinates of the second are added to `keep`.
    ///
    /// # Errors
    /// Returns the difference.
    pub fn layers(
        &self,
        meant: gdal::errors::Result<Layer>,
        in_file: gdal::errors::Result<Layer>,
        mut keep: Option<&mut Vec<[f64; 2]>>,
    ) -> Result<(), Difference> {
        let (Ok(mut one), Ok(mut other)) = (meant, in_file) else {
            return Err("the layer is missing".to_string().into());
        };
        one.reset_feature_reading(); // it was read to its end when it was written
        let (mut one, mut other) = (one.features(), other.features());
        let (mut counts, mut sums, mut kept) = (Counts::default(), [0u64; 2], Ok(()));
        loop {
            let (a, b) = (one.next(), other.next());
            if a.is_none() && b.is_none() {
                break;
            }
            let a = a.map(|feature| self.meant(&feature)).transpose()?;
            let b = b.map(|feature| coords(&feature)).transpose()?;
            counts.add(a.as_deref(), b.as_deref());
            if let Some((keep, b)) = keep.as_mut().zip(b.as_ref()) {
                keep.extend_from_slice(b);
            }
            let (Some(a), Some(b)) = (a, b) else { continue };
            if self.digits == Digits::Every {
                // The order of features may differ, so sums over all features are compared.
                sums[0] = sums[0].wrapping_add(digest(a));
                sums[1] = sums[1].wrapping_add(digest(b));
            } else if kept.is_ok() {
                kept = self.feature(a, b);
            }
        }
        if let Some(reason) = (self.last_failure)() {
            return Err(reason.into());
        }
        counts.check()?;
        match sums[0] == sums[1] {
            true => kept,
            false => Err("other coordinates".to_string().into()),
        }
    }

    /// Compares a layer with coordinates in the order of its features, bit by bit.
    ///
    /// # Errors
    /// Returns the difference.
    pub fn in_order(
        &self,
        mut in_file: Layer,
        mut meant: impl Iterator<Item = [f64; 2]>,
    ) -> Result<(), Difference> {
        for feature in in_file.features() {
            if coords(&feature)?.into_iter().any(|point| meant.next() != Some(point)) {
                return Err("other coordinates".to_string().into());
            }
        }
        match ((self.last_failure)(), meant.next()) {
            (Some(reason), _) => Err(reason.into()),
            (None, Some(_)) => Err("another number of coordinates".to_string().into()),
            (None, None) => Ok(()),
        }
    }

    /// Compares a feature of a format with few digits. The GeoJSON of GDAL 3.10, unlike 3.6,
    /// drops a coordinate that equals the one before it.
    fn feature(&self, a: Vec<[f64; 2]>, b: Vec<[f64; 2]>) -> Result<(), Difference> {
        match a.len().cmp(&b.len()) {
            Ordering::Greater => Err(Difference::Merged(self.digits)),
            Ordering::Less => Err("another number of coordinates".to_string().into()),
            Ordering::Equal if self.digits.are_kept(&a, b) => Ok(()),
            Ordering::Equal => Err("other coordinates".to_string().into()),
        }
    }

    fn meant(&self, feature: &Feature) -> Result<Vec<[f64; 2]>, Difference> {
        let place = |point| {
            let unknown = || "a coordinate was not there when the map was marked".to_string().into();
            (self.place)(point).ok_or_else(unknown)
        };
        coords(feature)?.into_iter().map(place).collect()
    }
}

fn coords(feature: &Feature) -> Result<Vec<[f64; 2]>, GeometryFault> {
    let mut coords = Vec::new();
    // A written layer has one geometry column; a null geometry has no coordinates.
    if let Ok(geometry) = feature.geometry_by_index(0) {
        let mut bytes = geometry.iso_wkb()?;
        let mut visit = |_, point: [f64; 2]| {
            coords.push(point.map(|v| v + 0.0)); // −0.0 becomes 0.0
            Ok(point)
        };
        wkb::map_coordinates::<WkbError>(&mut bytes, &mut visit)?;
    }
    Ok(coords)
}

/// Returns a digest of coordinates in any order, as formats reverse rings.
fn digest(mut coords: Vec<[f64; 2]>) -> u64 {
    coords.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hasher = DefaultHasher::new();
    coords.iter().flatten().for_each(|v| v.to_bits().hash(&mut hasher));
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_that_became_equal_need_more_digits() {
        let line = [[0.0, 1.02], [0.0, 1.04], [2.0, 3.0]];
        let read_back = ReadBack { digits: Digits::Decimals(1), place: &Some, last_failure: &|| None };
        let difference = read_back.feature(line.to_vec(), vec![[0.0, 1.0], [2.0, 3.0]]).unwrap_err();
        assert!(difference.to_string().ends_with("written with 1 decimal"), "{difference}");
        assert!(difference.remedy().starts_with("raise COORDINATE_PRECISION"), "{}", difference.remedy());
        let difference = read_back.feature(line[..2].to_vec(), line.to_vec()).unwrap_err();
        assert_eq!(difference.remedy(), OTHER_FORMAT, "{difference}");
    }

    #[test]
    fn the_digest_has_every_bit_and_no_order() {
        let ring = vec![[0.0, 1.0], [2.0, 3.0], [2.0, 1.0]];
        let turned: Vec<_> = ring.iter().rev().copied().collect();
        assert_eq!(digest(ring.clone()), digest(turned));
        let mut other = ring.clone();
        other[1][0] = 2.0f64.next_up();
        assert_ne!(digest(ring), digest(other));
    }
}
