//! Geometries one by one, for comparing two maps feature by feature.

use crate::{CoordinateSystem, Error, Result, crs::as_crs, selection::chosen_layers, turns::turn};
use gdal::{Dataset, vector::LayerAccess};
use meshmark_marking::{self as marking, Extent, FeatureGeometry, Outline};

/// Reads the geometries of all features of the chosen layers (all when `None`), in the order of the
/// dataset, without features that have none. `last_failure` is as in [`crate::Selection`].
///
/// # Errors
/// Fails for a layer that does not exist or cannot be read to its end, a malformed geometry, and
/// coordinates outside the extent of the CRS.
pub fn features(
    dataset: &Dataset,
    layers: Option<&[String]>,
    last_failure: &dyn Fn() -> Option<String>,
) -> Result<Vec<FeatureGeometry>> {
    let mut all = Vec::new();
    for (index, name) in chosen_layers(dataset, layers)? {
        let _turn = turn(dataset, &name)?;
        let mut layer = dataset.layer(index)?;
        let srs = layer.defn().geom_fields().map(|field| field.spatial_ref().ok());
        let crs = srs.map(|srs| srs.and_then(CoordinateSystem::of_layer));
        let extents: Vec<Extent> = crs.map(|crs| Extent::in_crs(as_crs(&crs))).collect();
        for feature in layer.features() {
            for (column, extent) in extents.iter().enumerate() {
                // A null geometry is an error.
                let Ok(geometry) = feature.geometry_by_index(column) else { continue };
                let fid = feature.fid();
                let id = || fid.map_or("without id".into(), |fid| fid.to_string());
                let wkb = geometry.iso_wkb().map_err(|error| marking::Error::geometry(&name, id(), error))?;
                let outline = Outline::of_wkb(wkb);
                let outline = outline.map_err(|error| marking::Error::geometry(&name, id(), error))?;
                outline.chains.iter().flatten().try_for_each(|&point| extent.check(point, &name, id))?;
                all.push(FeatureGeometry { layer: name.clone(), fid: id(), outline });
            }
        }
        if let Some(reason) = last_failure() {
            return Err(Error::Unreadable { layer: name, reason });
        }
    }
    Ok(all)
}
