//! Round trips through exchange formats by `ogr2ogr`.

use super::{Layer, Map};
use crate::Result;
use std::{path::Path, process::Command};

/// An exchange format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Shapefile: names of ten characters, one geometry type per file.
    Shapefile,
    /// RFC 7946: degrees with 7 decimals.
    GeoJson,
    /// Features in the order of a Hilbert curve.
    FlatGeobuf,
    /// Degrees.
    Kml,
}

impl Format {
    /// Returns the usual name.
    pub fn name(self) -> &'static str {
        match self {
            Format::Shapefile => "Shapefile",
            Format::GeoJson => "GeoJSON",
            Format::FlatGeobuf => "FlatGeobuf",
            Format::Kml => "KML",
        }
    }

    /// Returns GDAL's driver, the file's extension and the options for a file according to the
    /// standard.
    fn gdal(self) -> (&'static str, &'static str, &'static [&'static str]) {
        match self {
            Format::Shapefile => ("ESRI Shapefile", "shp", &["-lco", "ENCODING=UTF-8"]),
            Format::GeoJson => ("GeoJSON", "geojson", &["-lco", "RFC7946=YES"]),
            Format::FlatGeobuf => ("FlatGeobuf", "fgb", &[]),
            Format::Kml => ("KML", "kml", &[]),
        }
    }
}

/// Writes every layer to a file of its own and reads it back.
///
/// # Errors
/// Fails with the output of `ogr2ogr`, and when temporary files cannot be written.
pub fn round_trip(map: &Map, format: Format) -> Result<Map> {
    let folder = tempfile::tempdir()?;
    let source = folder.path().join("source.gpkg");
    map.write(&source)?;
    let (driver, extension, options) = format.gdal();
    let layers = map.layers.iter().enumerate().map(|(i, layer)| {
        let file = folder.path().join(format!("{i}.{extension}"));
        ogr2ogr(&source, &layer.name, driver, options, &file)?;
        let read = Map::read(&file)?.layers.into_iter().next();
        Ok(Layer { name: layer.name.clone(), ..read.ok_or("the file has no layer")? })
    });
    Ok(Map { layers: layers.collect::<Result<_>>()? })
}

fn ogr2ogr(source: &Path, layer: &str, driver: &str, options: &[&str], target: &Path) -> Result<()> {
    let output = Command::new("ogr2ogr")
        .args(["-q", "-f", driver])
        .args(options)
        .args([target, source])
        .arg(layer)
        .output()?;
    match output.status.success() {
        true => Ok(()),
        false => Err(format!("ogr2ogr to {driver}: {}", String::from_utf8_lossy(&output.stderr)).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::fixture;

    #[test]
    fn every_format_brings_back_all_features() {
        let map = fixture("helsinki.gpkg");
        for format in [Format::Shapefile, Format::GeoJson, Format::FlatGeobuf, Format::Kml] {
            let back = round_trip(&map, format).unwrap();
            let count = |map: &Map| -> Vec<(String, usize)> {
                map.layers.iter().map(|layer| (layer.name.clone(), layer.features.len())).collect()
            };
            assert_eq!(count(&back), count(&map), "{}", format.name());
        }
    }

    #[test]
    fn shapefiles_and_flatgeobufs_keep_every_vertex_and_degrees_are_degrees() {
        let map = fixture("kotka.gpkg");
        for format in [Format::Shapefile, Format::FlatGeobuf] {
            let back = round_trip(&map, format).unwrap();
            assert_eq!(back.vertices().unwrap(), map.vertices().unwrap(), "{}", format.name());
        }
        for format in [Format::GeoJson, Format::Kml] {
            let (min, max) = round_trip(&map, format).unwrap().vertices().unwrap().bounds();
            assert!(min[0] > 26.9 && max[0] < 27.0 && min[1] > 60.5 && max[1] < 60.6, "{min:?} {max:?}");
        }
    }
}
