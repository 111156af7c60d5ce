//! The base of all copies: the map as `ogr2ogr` copies it, and a GeoPackage whose geometries move.

use super::{ogr2ogr, plain::Plain, request::DistributeRequest, staged::Staged};
use crate::{Error, Result, inputs::maps};
use gdal::{
    Dataset, DriverManager,
    vector::{Feature, Layer, LayerAccess, LayerOptions},
};
use meshmark_core::options::Spelling;
use meshmark_dataset::{Error as MapError, Survey, formats::Format, parse_srs, traces, workplace::Workplace};
use meshmark_marking::TransformableCrs;
use std::path::Path;

/// The base of all copies.
pub struct Stage {
    /// The unmarked map: completely where copies are GeoPackages, otherwise its geometries alone.
    pub staged: Staged,
    /// The other parts of the map, unless copies are GeoPackages.
    pub plain: Option<Plain>,
    /// The names of the layers of the map.
    pub layers: Vec<String>,
}

impl Stage {
    /// Copies the map; `warn` receives the warnings of `ogr2ogr`.
    pub fn new(
        request: &DistributeRequest,
        format: &'static Format,
        (dataset, map): (&Dataset, &Survey),
        workplace: &Workplace,
        warn: &mut dyn FnMut(&str),
    ) -> Result<Self> {
        let layers: Vec<String> = dataset.layers().map(|layer| layer.name()).collect();
        check_fits(request, format, map, &layers)?;
        let path = workplace.folder().join("staged.gpkg");
        let marks = |name: &str| {
            let chosen = request.options.layers.as_ref();
            chosen.is_none_or(|chosen| chosen.iter().any(|layer| layer == name))
        };
        let (staged, plain) = if format.driver == "GPKG" {
            let options = ["-lco", "SPATIAL_INDEX=YES"];
            ogr2ogr::copy("GPKG", &request.map, &path, &options)?.iter().for_each(|text| warn(text));
            (Staged::read(path, &map.data.vertices, marks)?, None)
        } else {
            let plain = Plain::new(&request.map, &workplace.subfolder("plain")?, format, warn)?;
            let failed = |error| maps::failed("map", &request.map, error);
            if format.has_native_data() {
                let found = plain.search_traces(map, &request.options, &layers[0])?;
                let warnings = traces::warnings(found.as_slice(), &request.options, Spelling::Flag);
                warnings.map_err(failed)?.iter().for_each(|text| warn(text));
            }
            copy_geometries(dataset.layer(0).map_err(|error| failed(error.into()))?, &path)
                .map_err(|error| Error::unwritten(path.display(), error))?;
            (Staged::read(path, &map.data.vertices, |_| true)?, Some(plain))
        };
        let geometries = map.geometries.as_ref().expect("the map was read with them");
        let staged_geometries: usize = staged.layers.iter().map(|layer| layer.fids.len()).sum();
        match staged_geometries == geometries.len() {
            true => Ok(Stage { staged, plain, layers }),
            false => Err(Error::MapChanged),
        }
    }
}

/// Refuses a map that the format cannot hold unchanged.
fn check_fits(
    request: &DistributeRequest,
    format: &'static Format,
    map: &Survey,
    layers: &[String],
) -> Result<()> {
    let driver = format.driver;
    let refused =
        |error: MapError| Err(Error::Refused { path: request.map.clone(), source: Box::new(error) });
    if layers.len() > 1 && !format.many_layers {
        return refused(MapError::OneLayer { driver });
    }
    let is_wgs84 =
        map.crs.as_ref().is_none_or(|crs| parse_srs("EPSG:4326").is_ok_and(|wgs84| crs.is_same(&wgs84)));
    match layers.first() {
        Some(layer) if format.is_wgs84_only(&[]) && !is_wgs84 => {
            refused(MapError::NotWgs84 { driver, layer: layer.clone() })
        }
        _ => Ok(()),
    }
}

/// Copies the geometries of a layer, in its order, to a GeoPackage.
fn copy_geometries(mut layer: Layer, path: &Path) -> gdal::errors::Result<()> {
    let mut staged = DriverManager::get_driver_by_name("GPKG")?.create_vector_only(path)?;
    let (srs, ty) = (layer.spatial_ref(), layer.defn().geometry_type());
    let options = Some(&["SPATIAL_INDEX=NO"][..]);
    let mut transaction = staged.start_transaction()?;
    let to = transaction.create_layer(LayerOptions { name: "map", srs: srs.as_ref(), ty, options })?;
    layer.reset_feature_reading(); // an earlier reading reached its end
    for feature in layer.features() {
        let mut copy = Feature::new(to.defn())?;
        if let Ok(geometry) = feature.geometry_by_index(0) {
            copy.set_geometry(geometry.clone())?;
        }
        copy.create(&to)?;
    }
    transaction.commit()?;
    staged.close()
}
