//! Geometries of GDAL's features as chains.

use crate::Result;
use gdal::vector::Feature;
use meshmark_marking::{Chains, Error, Extent, Faults};

/// Appends the coordinates of one geometry of a feature as [`Chains::read`] does.
pub(crate) fn read_geometry(
    feature: &Feature,
    column: usize,
    layer: &str,
    how: (bool, Extent),
    mut faults: Faults,
    chains: &mut Chains,
) -> Result<()> {
    let Ok(geometry) = feature.geometry_by_index(column) else { return Ok(()) }; // a null geometry
    let fid = || feature.fid().map_or("without id".into(), |fid| fid.to_string());
    match geometry.iso_wkb() {
        Ok(bytes) => Ok(chains.read(bytes, (layer, &fid), how, faults)?),
        Err(error) => Ok(faults.feature(Error::geometry(layer, fid(), error))?),
    }
}
