//! Geometries one by one, for comparing two maps feature by feature.

use crate::{Error, Outline, Result, survey::chosen_layers, turns::turn};
use gdal::{Dataset, vector::LayerAccess};

/// One geometry of a dataset.
#[derive(Debug, Clone)]
pub struct FeatureGeometry {
    /// The name of its layer.
    pub layer: String,
    /// The feature's id, when it has one.
    pub fid: Option<u64>,
    /// Itself.
    pub outline: Outline,
}

/// The geometries of all features of the chosen layers (all when `None`), in the order of the dataset; features
/// without one are left out. `last_failure` is as in [`crate::Selection`].
///
/// # Errors
/// A layer that does not exist or cannot be read to its end, a geometry that makes no sense, coordinates that are not
/// finite.
pub fn features(
    dataset: &Dataset,
    layers: Option<&[String]>,
    last_failure: &dyn Fn() -> Option<String>,
) -> Result<Vec<FeatureGeometry>> {
    let mut all = Vec::new();
    for (index, name) in chosen_layers(dataset, layers)? {
        let _turn = turn(dataset, &name)?;
        let mut layer = dataset.layer(index)?;
        let columns = layer.defn().geom_fields().count();
        for feature in layer.features() {
            for column in 0..columns {
                let Ok(geometry) = feature.geometry_by_index(column) else { continue }; // a null geometry
                let fid = feature.fid();
                let id = || fid.map_or("without id".into(), |fid| fid.to_string());
                let failed = |reason: String| Error::Geometry { layer: name.clone(), fid: id(), reason };
                let wkb = geometry.iso_wkb().map_err(|error| failed(error.to_string()))?;
                let outline = Outline::of_wkb(wkb).map_err(|error| failed(error.to_string()))?;
                if let Some(&[x, y]) =
                    outline.chains.iter().flatten().find(|p| !p.iter().all(|v| v.is_finite()))
                {
                    return Err(Error::NotFinite { layer: name.clone(), fid: id(), x, y });
                }
                all.push(FeatureGeometry { layer: name.clone(), fid, outline });
            }
        }
        if let Some(reason) = last_failure() {
            return Err(Error::Unreadable { layer: name, reason });
        }
    }
    Ok(all)
}
