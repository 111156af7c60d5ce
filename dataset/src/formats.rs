//! The formats of marked maps: those whose drivers preserve what they write, as tests show.

use crate::{Error, Result, decimals::Digits};
use std::path::Path;

/// A format and GDAL's driver for it.
#[derive(Debug)]
pub struct Format {
    /// GDAL's short name.
    pub driver: &'static str,
    /// The endings of the main file, lower case.
    endings: &'static [&'static str],
    /// Whether a file holds several layers.
    pub many_layers: bool,
    coordinates: Coordinates,
}

/// The encoding of coordinates.
#[derive(Debug)]
enum Coordinates {
    /// Every bit is kept.
    Binary,
    /// As decimal numbers; RFC 7946 allows longitudes and latitudes of WGS 84 only.
    Json { always_rfc7946: bool },
}

const FORMATS: &[Format] = &[
    Format { driver: "GPKG", endings: &[".gpkg"], many_layers: true, coordinates: Coordinates::Binary },
    Format {
        driver: "ESRI Shapefile",
        endings: &[".shp", ".shz", ".shp.zip"],
        many_layers: false,
        coordinates: Coordinates::Binary,
    },
    Format { driver: "FlatGeobuf", endings: &[".fgb"], many_layers: false, coordinates: Coordinates::Binary },
    Format {
        driver: "GeoJSON",
        endings: &[".geojson", ".json"],
        many_layers: false,
        coordinates: Coordinates::Json { always_rfc7946: false },
    },
    Format {
        driver: "GeoJSONSeq",
        endings: &[".geojsonl", ".geojsons"],
        many_layers: false,
        coordinates: Coordinates::Json { always_rfc7946: true },
    },
];

type Options<'a> = &'a [(String, String)];

impl Format {
    /// Finds the format that the user names, or that of the target's name.
    pub fn find(named: Option<&str>, target: &Path) -> Result<&'static Format> {
        let target_name = target.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let is_meant = |format: &&Format| match named {
            Some(name) => format.driver.eq_ignore_ascii_case(name),
            None => format.endings.iter().any(|ending| target_name.ends_with(ending)),
        };
        FORMATS.iter().find(is_meant).ok_or_else(|| {
            let known: Vec<_> = FORMATS.iter().map(|format| format.driver).collect();
            let extension = target.extension().map(|extension| extension.to_string_lossy().into_owned());
            Error::UnknownFormat { named: named.map(String::from), extension, known: known.join(", ") }
        })
    }

    /// Returns the name of a file without the ending of its format; `None` where it has none.
    pub fn stem(file_name: &str) -> Option<&str> {
        let lower = file_name.to_ascii_lowercase();
        let endings = FORMATS.iter().flat_map(|format| format.endings);
        let longest = endings.filter(|ending| lower.ends_with(**ending)).map(|ending| ending.len()).max()?;
        Some(&file_name[..file_name.len() - longest])
    }

    /// Returns the ending of the names of its files.
    pub fn ending(&self) -> &'static str {
        self.endings[0]
    }

    /// Returns whether the driver writes native data: the parts of a GeoJSON text that GDAL's
    /// features do not hold.
    pub fn has_native_data(&self) -> bool {
        matches!(self.coordinates, Coordinates::Json { .. })
    }

    /// Returns whether the driver reprojects a layer with these options to WGS 84, which would
    /// happen after the marking.
    pub fn is_wgs84_only(&self, layer_options: Options) -> bool {
        match self.coordinates {
            Coordinates::Binary => false,
            Coordinates::Json { always_rfc7946: true } => true,
            Coordinates::Json { always_rfc7946: false } => {
                let is_no =
                    |text: &str| ["NO", "FALSE", "OFF", "0"].iter().any(|no| no.eq_ignore_ascii_case(text));
                value(layer_options, "RFC7946").is_some_and(|text| !is_no(text))
            }
        }
    }

    /// Returns the digits with which a layer with these options is written.
    pub fn digits(&self, layer_options: Options) -> Digits {
        let Coordinates::Json { always_rfc7946 } = self.coordinates else { return Digits::Every };
        let number = |name| value(layer_options, name).map(leading_number);
        let is_rfc7946 = self.is_wgs84_only(layer_options);
        let rfc7946 = || is_rfc7946.then_some(RFC7946_DECIMALS);
        let count = |number: i64| usize::try_from(number).ok();
        let decimals = match number("COORDINATE_PRECISION") {
            // GeoJSONSeq uses any given number; to GeoJSON a negative number means none.
            Some(given) => count(given).or_else(|| if always_rfc7946 { None } else { rfc7946() }),
            None => rfc7946(),
        };
        match (decimals, number("SIGNIFICANT_FIGURES").and_then(count)) {
            (Some(decimals), _) => Digits::Decimals(decimals),
            (None, Some(figures)) => Digits::Figures(figures),
            (None, None) => Digits::Decimals(DEFAULT_DECIMALS),
        }
    }
}

/// Decimals of RFC 7946, section 11.2, as GDAL writes them.
const RFC7946_DECIMALS: usize = 7;
/// GDAL's default.
const DEFAULT_DECIMALS: usize = 15;

/// Returns the whole number at the start of a text, or 0, like GDAL.
fn leading_number(text: &str) -> i64 {
    let digits = text.trim_start_matches(['+', '-']);
    let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
    text[..text.len() - digits.len() + end].parse().unwrap_or(0)
}

fn value<'a>(options: Options<'a>, name: &str) -> Option<&'a str> {
    let given = options.iter().find(|(option, _)| option.eq_ignore_ascii_case(name));
    given.map(|(_, value)| value.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_decides_unless_a_format_is_named() {
        let driver = |named, path| Format::find(named, Path::new(path)).map(|f| f.driver);
        assert_eq!(driver(None, "a/b.GPKG").unwrap(), "GPKG");
        assert_eq!(driver(None, "b.json").unwrap(), "GeoJSON");
        assert_eq!(driver(None, "b.shp.zip").unwrap(), "ESRI Shapefile");
        assert_eq!(driver(Some("flatgeobuf"), "b.gpkg").unwrap(), "FlatGeobuf");
        let refused = |named, path| driver(named, path).unwrap_err().to_string();
        assert!(refused(None, "folder").contains("without extension"));
        assert!(refused(None, "b.zip").contains("extension \"zip\""));
        let error = refused(Some("PDF"), "a.gpkg");
        assert!(error.contains("FORMAT=PDF") && error.contains("ESRI Shapefile"), "{error}");
    }

    fn options(name: &str, value: &str) -> [(String, String); 1] {
        [(name.to_string(), value.to_string())]
    }

    #[test]
    fn digits_are_those_of_the_layer_options() {
        let format = Format::find(Some("GeoJSON"), Path::new("")).unwrap();
        let two = options("coordinate_precision", " 2 ");
        assert_eq!(format.digits(&two), Digits::Decimals(2));
        assert_eq!(format.digits(&options("RFC7946", "YES")), Digits::Decimals(7));
        assert_eq!(format.digits(&options("SIGNIFICANT_FIGURES", "10")), Digits::Figures(10));
        assert_eq!(format.digits(&options("SIGNIFICANT_FIGURES", "-1")), format.digits(&[]));
        assert_eq!(Format::find(Some("GPKG"), Path::new("")).unwrap().digits(&two), Digits::Every);
    }

    #[test]
    fn rfc_7946_is_said_or_the_format_itself() {
        let is_wgs84_only = |driver, options: &[(String, String)]| {
            Format::find(Some(driver), Path::new("")).unwrap().is_wgs84_only(options)
        };
        assert!(is_wgs84_only("GeoJSONSeq", &[]));
        assert!(is_wgs84_only("GeoJSON", &options("rfc7946", "yes")));
        assert!(!is_wgs84_only("GeoJSON", &options("RFC7946", "no")) && !is_wgs84_only("GeoJSON", &[]));
        assert!(!is_wgs84_only("GPKG", &options("RFC7946", "YES")));
    }
}
