//! Reprojection into another CRS.

use super::Map;
use crate::Result;
use gdal::spatial_ref::{AxisMappingStrategy, CoordTransform, SpatialRef};
use geo::{Coord, CoordsIter, MapCoords};
use std::cell::Cell;

/// Brings a map into an EPSG CRS; `decimals` rounds its coordinates.
///
/// # Errors
/// Fails on a layer without a CRS, and with the message of PROJ.
pub fn reproject(map: &Map, epsg: u32, decimals: Option<u32>) -> Result<Map> {
    let target = east_north(SpatialRef::from_epsg(epsg)?);
    let scale = decimals.map(|decimals| 10f64.powi(decimals as i32));
    let rounded = |value: f64| scale.map_or(value, |scale| (value * scale).round() / scale);
    let mut map = map.clone();
    for layer in &mut map.layers {
        let wkt = layer.crs.as_ref().ok_or_else(|| format!("layer \"{}\" has no CRS", layer.name))?;
        let transform = CoordTransform::new(&east_north(SpatialRef::from_wkt(wkt)?), &target)?;
        for geometry in layer.features.iter_mut().filter_map(|feature| feature.geometry.as_mut()) {
            let (mut x, mut y): (Vec<f64>, Vec<f64>) = geometry.coords_iter().map(|c| (c.x, c.y)).unzip();
            transform.transform_coords(&mut x, &mut y, &mut [])?;
            let next = Cell::new(0);
            *geometry = geometry.map_coords(|_| {
                let i = next.replace(next.get() + 1);
                Coord { x: rounded(x[i]), y: rounded(y[i]) }
            });
        }
        layer.crs = Some(target.to_wkt()?);
    }
    Ok(map)
}

fn east_north(mut crs: SpatialRef) -> SpatialRef {
    crs.set_axis_mapping_strategy(AxisMappingStrategy::TraditionalGisOrder);
    crs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, pairs};

    #[test]
    fn there_and_back_again_is_the_same_place() {
        let map = fixture("kotka.gpkg");
        for (epsg, decimals, metres) in [(3857, None, 1e-6), (4326, Some(7), 0.02)] {
            let there = reproject(&map, epsg, decimals).unwrap();
            let back = reproject(&there, 3067, None).unwrap();
            let farthest =
                pairs(&map, &back).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0f64, f64::max);
            assert!(farthest < metres, "EPSG:{epsg}: {farthest}");
        }
    }

    #[test]
    fn degrees_are_east_then_north_with_seven_decimals() {
        let degrees = reproject(&fixture("kotka.gpkg"), 4326, Some(7)).unwrap();
        let (min, max) = degrees.vertices().unwrap().bounds();
        assert!(min[0] > 26.9 && max[0] < 27.0 && min[1] > 60.5 && max[1] < 60.6, "{min:?} {max:?}");
        let is_round = |v: f64| (v * 1e7 - (v * 1e7).round()).abs() < 1e-3;
        assert!(degrees.coords().flatten().all(is_round));
    }
}
