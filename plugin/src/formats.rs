//! The formats a marked map is written to: those whose drivers were seen to keep what they were given.

use crate::error::{Error, Result};
use std::path::Path;

/// A format, by GDAL's driver for it.
#[derive(Debug)]
pub struct Format {
    /// GDAL's short name.
    pub driver: &'static str,
    /// Of the file that bears the target's name, lower case.
    extensions: &'static [&'static str],
    /// Whether a file holds several layers.
    pub many_layers: bool,
    rounding: Rounding,
}

#[derive(Debug)]
enum Rounding {
    /// Coordinates are kept bit by bit.
    None,
    /// Coordinates are written as decimal numbers; how many digits after the point an option of the layer says.
    Decimals { option: &'static str, default: i32 },
}

const FORMATS: &[Format] = &[
    Format { driver: "GPKG", extensions: &["gpkg"], many_layers: true, rounding: Rounding::None },
    Format { driver: "ESRI Shapefile", extensions: &["shp"], many_layers: false, rounding: Rounding::None },
    Format { driver: "FlatGeobuf", extensions: &["fgb"], many_layers: false, rounding: Rounding::None },
    Format {
        driver: "GeoJSON",
        extensions: &["geojson", "json"],
        many_layers: false,
        rounding: Rounding::Decimals { option: "COORDINATE_PRECISION", default: 15 },
    },
];

impl Format {
    /// The format that a user names, or that of the target's extension.
    pub fn find(named: Option<&str>, target: &Path) -> Result<&'static Format> {
        let extension = target.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let found = match named {
            Some(name) => FORMATS.iter().find(|format| format.driver.eq_ignore_ascii_case(name)),
            None => FORMATS.iter().find(|format| format.extensions.contains(&extension.as_str())),
        };
        found.ok_or_else(|| {
            let known: Vec<_> = FORMATS.iter().map(|format| format.driver).collect();
            let what =
                named.map_or_else(|| format!("extension \"{extension}\""), |name| format!("FORMAT={name}"));
            Error::UnknownFormat { what, known: known.join(", ") }
        })
    }

    /// How far a coordinate of this size may be from what was written, CRS units; zero where every bit is kept.
    pub fn tolerance(&self, layer_options: &[(String, String)], magnitude: f64) -> f64 {
        match self.rounding {
            Rounding::None => 0.0,
            Rounding::Decimals { option, default } => {
                let given = layer_options.iter().find(|(name, _)| name.eq_ignore_ascii_case(option));
                let digits = given.and_then(|(_, value)| value.trim().parse().ok()).unwrap_or(default);
                // The last bits go in the conversion to decimal digits and back.
                0.5 * 10f64.powi(-digits) * (1.0 + 1e-6) + 4.0 * f64::EPSILON * magnitude
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_decides_unless_a_format_is_named() {
        let driver = |named, path| Format::find(named, Path::new(path)).map(|f| f.driver);
        assert_eq!(driver(None, "a/b.GPKG").unwrap(), "GPKG");
        assert_eq!(driver(None, "b.json").unwrap(), "GeoJSON");
        assert_eq!(driver(Some("flatgeobuf"), "b.gpkg").unwrap(), "FlatGeobuf");
        let error = driver(None, "folder").unwrap_err().to_string();
        assert!(error.contains("extension \"\"") && error.contains("ESRI Shapefile"), "{error}");
        assert!(driver(Some("PDF"), "a.gpkg").unwrap_err().to_string().contains("FORMAT=PDF"));
    }

    #[test]
    fn digits_after_the_point_are_those_of_the_layer_option() {
        let format = Format::find(Some("GeoJSON"), Path::new("")).unwrap();
        let options = [("coordinate_precision".to_string(), "2".to_string())];
        assert!((format.tolerance(&options, 0.0) - 0.005).abs() < 1e-6);
        assert!(format.tolerance(&[], 1e6) < 1e-8);
        assert_eq!(Format::find(Some("GPKG"), Path::new("")).unwrap().tolerance(&options, 1e6), 0.0);
    }
}
