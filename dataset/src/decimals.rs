//! Coordinates as decimal numbers, which GDAL writes to GeoJSON.
//!
//! GDAL rounds to a number of decimals or of significant figures, and then treats a run of zeros or
//! nines at certain places as noise and ends the number there. This rule is the same from GDAL 3.6
//! to 3.12 and a function of the double: this module computes the values that a file may hold, and
//! any other value is a difference.

use meshmark_core::{counted, vertices::VertexTable};
use std::fmt;

/// The digits with which coordinates are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Digits {
    /// All digits: every bit is kept.
    Every,
    /// This many digits after the point.
    Decimals(usize),
    /// This many significant figures.
    Figures(usize),
}

impl fmt::Display for Digits {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Digits::Every => f.write_str("every digit"),
            Digits::Decimals(count) => f.write_str(&counted(*count, "decimal")),
            Digits::Figures(count) => f.write_str(&counted(*count, "significant figure")),
        }
    }
}

/// GDAL searches numbers of at least this many figures for noise, and drops at most
/// [`MOST_FIGURES_LEFT_OUT`].
const NOISY_FIGURES: usize = 11;
const MOST_FIGURES_LEFT_OUT: usize = 3;

/// No number has more decimals, nor more significant figures.
const MOST_DIGITS: usize = 1074;

impl Digits {
    /// Returns the remedy for too few digits.
    pub fn more(self) -> Option<&'static str> {
        match self {
            Digits::Every => None,
            Digits::Decimals(_) => Some("raise COORDINATE_PRECISION, or choose GPKG"),
            Digits::Figures(_) => Some("raise SIGNIFICANT_FIGURES, or choose GPKG"),
        }
    }

    /// Returns the values that a file may hold for `v`.
    fn values(self, v: f64) -> Vec<f64> {
        let texts = match self {
            Digits::Every => return vec![v],
            Digits::Decimals(count) => {
                let text = format!("{v:.*}", count.min(MOST_DIGITS));
                without_noise(&text).into_iter().chain([text]).collect::<Vec<_>>()
            }
            Digits::Figures(count) => {
                let count = count.min(MOST_DIGITS);
                let text = |count: usize| format!("{v:.*e}", count.max(1) - 1);
                let is_noisy = ["000000", "999999"].iter().any(|run| text(count).contains(run));
                let left_out = if count >= NOISY_FIGURES && is_noisy { MOST_FIGURES_LEFT_OUT } else { 0 };
                (0..=left_out).map(|left_out| text(count - left_out)).collect()
            }
        };
        texts.iter().map(|text| text.parse().expect("a number that was just written")).collect()
    }

    /// Returns how far a value in a file may be from the computed one: the conversion to decimal
    /// digits and back loses the last bits.
    fn slack(self, v: f64) -> f64 {
        if self == Digits::Every { 0.0 } else { 4.0 * f64::EPSILON * v.abs() }
    }

    /// Finds each of `wanted` among the `places` of a file; `None` when one is missing. It sets
    /// `is_explained` for each place that is a possible form of one of `wanted`.
    fn search(
        self,
        wanted: &[[f64; 2]],
        places: &[[f64; 2]],
        is_explained: &mut [bool],
    ) -> Option<Vec<[f64; 2]>> {
        let mut find = |point: &[f64; 2]| {
            let [xs, ys] = point.map(|v| self.values(v));
            let is_near = |at: f64, v: f64| (at - v).abs() <= self.slack(v);
            let mut nearest: Option<[f64; 2]> = None;
            for &x in &xs {
                let first = places.partition_point(|p| p[0] < x - self.slack(x));
                let beside = places[first..].iter().take_while(|p| is_near(p[0], x));
                for (i, place) in beside.enumerate().filter(|(_, p)| ys.iter().any(|&y| is_near(p[1], y))) {
                    is_explained[first + i] = true;
                    let distance = |p: &[f64; 2]| (p[0] - point[0]).hypot(p[1] - point[1]);
                    nearest = Some(nearest.filter(|p| distance(p) <= distance(place)).unwrap_or(*place));
                }
            }
            nearest
        };
        wanted.iter().map(&mut find).collect()
    }

    /// Finds each of `wanted` among the `places` of a file; `None` when one is missing.
    pub fn find_all(self, wanted: &[[f64; 2]], places: Vec<[f64; 2]>) -> Option<Vec<[f64; 2]>> {
        let table = VertexTable::new(places).ok()?;
        self.search(wanted, table.coords(), &mut vec![false; table.coords().len()])
    }

    /// Returns whether `places` are `wanted` in a form that a file may hold, in any order: each of
    /// either corresponds to one of the other.
    pub fn are_kept(self, wanted: &[[f64; 2]], places: Vec<[f64; 2]>) -> bool {
        let Ok(table) = VertexTable::new(places) else { return wanted.is_empty() };
        let mut is_explained = vec![false; table.coords().len()];
        self.search(wanted, table.coords(), &mut is_explained).is_some() && is_explained.iter().all(|is| *is)
    }
}

/// Returns the number that GDAL writes when it treats the last digits as noise: after a run of five
/// zeros or nines before the last digit, or of up to seven, shorter in larger numbers, before about
/// the last eight.
fn without_noise(text: &str) -> Option<String> {
    let digits = text.as_bytes();
    let point = text.find('.')?;
    if digits.len() <= 10 {
        return None;
    }
    // One less than the digits before the point.
    let before = point - 1 - usize::from(digits[0] == b'-');
    let decimals = digits.len() - point - 1;
    let last = |nth: usize| digits[digits.len() - nth];
    let is_near_end = |digit| (2..=6).all(|nth| last(nth) == digit);
    let is_further_in = |digit| {
        decimals >= 8
            && (3..=7).all(|nth| before > nth || last(nth) == digit)
            && last(8) == digit
            && last(9) == digit
    };
    let cut = |count: usize| &text[..text.len() - count];
    let rounded_up = |count: usize| next_decimal(cut(count));
    if is_near_end(b'0') {
        Some(cut(1).into())
    } else if is_further_in(b'0') {
        Some(cut(8).into())
    } else if is_near_end(b'9') {
        Some(rounded_up(6))
    } else if is_further_in(b'9') {
        Some(rounded_up(9))
    } else {
        None
    }
}

/// Returns a decimal number increased by one in its last digit, away from zero.
fn next_decimal(text: &str) -> String {
    let mut digits = text.as_bytes().to_vec();
    for digit in digits.iter_mut().rev().filter(|digit| digit.is_ascii_digit()) {
        match *digit {
            b'9' => *digit = b'0',
            _ => {
                *digit += 1;
                return String::from_utf8(digits).expect("digits and a point");
            }
        }
    }
    let sign = if text.starts_with('-') { "-" } else { "" };
    format!("{sign}1{}", String::from_utf8(digits).expect("digits and a point").trim_start_matches('-'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Format;
    use gdal::{
        Dataset, DatasetOptions, DriverManager, GdalOpenFlags,
        spatial_ref::SpatialRef,
        vector::{Geometry, LayerAccess, LayerOptions, OGRwkbGeometryType},
    };
    use proptest::{prelude::*, test_runner::Config};
    use std::path::Path;

    /// Generates numbers like the longitudes and metres of maps, many of them with runs of zeros
    /// and nines anywhere.
    fn numbers() -> impl Strategy<Value = f64> {
        let run = || {
            proptest::sample::select(vec!["0", "9"])
                .prop_flat_map(|digit| (1..12usize).prop_map(move |length| digit.repeat(length)))
        };
        let noisy = ("[1-9][0-9]{0,7}", "[0-9]{0,7}", run(), "[0-9]{0,6}", run(), "[0-9]{0,4}");
        let noisy =
            noisy.prop_map(|(whole, a, b, c, d, e)| format!("{whole}.{a}{b}{c}{d}{e}").parse().unwrap());
        let of_ten = (-6..8, -9i64..9).prop_map(|(power, ulps)| {
            let ten = 10f64.powi(power).to_bits();
            f64::from_bits(ten.wrapping_add_signed(ulps))
        });
        let size = prop_oneof![3 => noisy, 1 => of_ten, 1 => 0.0..180.0f64, 1 => 0.0..2e7f64];
        (size, any::<bool>()).prop_map(|(v, is_negative)| if is_negative { -v } else { v })
    }

    /// Writes numbers as both coordinates of points by a driver of GDAL and reads them back.
    fn written(driver: &str, options: &[(String, String)], numbers: &[f64]) -> Vec<[f64; 2]> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.json");
        let options: Vec<_> = options.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let options: Vec<_> = options.iter().map(String::as_str).collect();
        let mut file = DriverManager::get_driver_by_name(driver).unwrap().create_vector_only(&path).unwrap();
        let srs = SpatialRef::from_epsg(4326).unwrap();
        let layer_options =
            LayerOptions { srs: Some(&srs), options: Some(&options), ..LayerOptions::default() };
        let mut layer = file.create_layer(layer_options).unwrap();
        for &number in numbers {
            let mut point = Geometry::empty(OGRwkbGeometryType::wkbPoint).unwrap();
            point.add_point_2d((number, number));
            layer.create_feature(point).unwrap();
        }
        file.close().unwrap();
        let open_flags = GdalOpenFlags::GDAL_OF_VECTOR;
        let options = DatasetOptions { open_flags, ..DatasetOptions::default() };
        let file = Dataset::open_ex(&path, options).unwrap(); // drivers of rasters open some texts
        let mut layer = file.layer(0).unwrap();
        layer
            .features()
            .map(|f| {
                let (x, y, _) = f.geometry().unwrap().get_point(0);
                [x, y]
            })
            .collect()
    }

    /// Returns a format with layer options.
    fn formats() -> impl Strategy<Value = (&'static str, Vec<(String, String)>)> {
        let number = |least, most| proptest::option::of((least..=most).prop_map(|n: i32| n.to_string()));
        let driver = proptest::sample::select(vec!["GeoJSON", "GeoJSONSeq"]);
        (driver, number(-1, 17), number(-1, 17), any::<bool>()).prop_map(
            |(driver, decimals, figures, is_rfc)| {
                let rfc = (is_rfc && driver == "GeoJSON").then(|| "YES".to_string());
                let given =
                    [("COORDINATE_PRECISION", decimals), ("SIGNIFICANT_FIGURES", figures), ("RFC7946", rfc)];
                let given = given.into_iter().filter_map(|(name, value)| Some((name.to_string(), value?)));
                (driver, given.collect())
            },
        )
    }

    proptest! {
        #![proptest_config(Config { cases: 400, ..Config::default() })]

        #[test]
        fn what_gdal_writes_is_computed((driver, options) in formats(), numbers in prop::collection::vec(numbers(), 1..40)) {
            let format = Format::find(Some(driver), Path::new("")).unwrap();
            let digits = format.digits(&options);
            // Degrees, where nothing else is written.
            let in_range = |v: f64| if format.is_wgs84_only(&options) { v % 85.0 } else { v };
            let numbers: Vec<_> = numbers.into_iter().map(in_range).collect();
            let points = written(driver, &options, &numbers);
            prop_assert_eq!(points.len(), numbers.len());
            for (v, [x, y]) in numbers.into_iter().zip(points) {
                let values = digits.values(v);
                let is_it = match digits {
                    Digits::Figures(_) => values.contains(&x),
                    _ => values[0] == x,
                };
                prop_assert!(is_it && x == y, "{v:e} with {digits:?} is {x:e}, computed was {values:?}");
            }
        }

        #[test]
        fn digits_beyond_those_of_any_number_are_computed(more in 1074..140_000usize, numbers in prop::collection::vec(numbers(), 1..9)) {
            for (name, digits) in [("COORDINATE_PRECISION", Digits::Decimals(more)), ("SIGNIFICANT_FIGURES", Digits::Figures(more))] {
                let options = [(name.to_string(), more.to_string())];
                prop_assert_eq!(Format::find(Some("GeoJSON"), Path::new("")).unwrap().digits(&options), digits);
                for (v, [x, _]) in numbers.iter().zip(written("GeoJSON", &options, &numbers)) {
                    prop_assert!(digits.values(*v).contains(&x), "{v:e} with {digits:?} is {x:e}");
                }
            }
        }

        #[test]
        fn another_place_is_not_kept(decimals in 0..9usize, numbers in prop::collection::vec(numbers(), 2..40)) {
            let digits = Digits::Decimals(decimals);
            let points: Vec<_> = numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
            let mut places: Vec<_> = points.iter().map(|point| point.map(|v| digits.values(v)[0])).collect();
            prop_assert!(digits.are_kept(&points, places.clone()));
            prop_assert_eq!(digits.find_all(&points, places.clone()).map(|found| found.len()), Some(points.len()));
            // Two units off, which is neither the number nor the number without noise.
            let other = places[0][0] + 2.0 * 10f64.powi(-(decimals as i32));
            prop_assume!(points.iter().all(|point| !digits.values(point[0]).iter().any(|v| (v - other).abs() < digits.slack(other))));
            places[0][0] = other;
            prop_assert!(!digits.are_kept(&points, places));
        }
    }
}
