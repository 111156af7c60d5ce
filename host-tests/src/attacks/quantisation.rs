//! Attacks by formats with coordinates on a grid: vector tiles, TopoJSON, drawings for the screen.

use super::{
    Map,
    features::drop_attributes,
    parts::{Part, rewrite_map},
    reproject::reproject,
};
use crate::Result;
use geo::Coord;

/// Width of the world in EPSG:3857, metres.
const WORLD: f64 = 40_075_016.685_578_49;
/// Units along the side of a tile, as the specification of Mapbox recommends.
const TILE_UNITS: f64 = 4096.0;
/// Points along either axis of a TopoJSON, as its tools quantise by default.
const TOPOJSON_POINTS: f64 = 1e4;
/// Decimals in a drawing.
const SVG_DECIMALS: i32 = 2;

/// The grid of a format. Repeated points are dropped, and parts that become too small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantisation {
    /// The grid of vector tiles at a zoom level, in EPSG:3857. The borders of tiles do not cut
    /// lines.
    VectorTiles { zoom: i32 },
    /// Ten thousand points over the extent, in the map's CRS.
    TopoJson,
    /// A drawing with this width in pixels, with two decimals and y downwards, without CRS and
    /// attributes.
    Svg { width: f64 },
}

impl Quantisation {
    /// Puts the map on the grid.
    ///
    /// # Errors
    /// Fails on coordinates that are not finite, and with the message of PROJ.
    pub fn apply(self, map: &Map) -> Result<Map> {
        let (min, max) = map.vertices()?.bounds();
        let extent = [0, 1].map(|axis| max[axis] - min[axis]);
        match self {
            Quantisation::VectorTiles { zoom } => {
                // The corner of the tiles is also a point of the grid through the origin.
                let unit = WORLD / 2f64.powi(zoom) / TILE_UNITS;
                Ok(on_grid(&reproject(map, 3857, None)?, [0.0; 2], [unit; 2]))
            }
            Quantisation::TopoJson => Ok(on_grid(map, min, extent.map(|e| e / (TOPOJSON_POINTS - 1.0)))),
            Quantisation::Svg { width } => {
                let scale = width / extent[0];
                let drawn =
                    drop_attributes(map).map_coords(|[x, y]| [(x - min[0]) * scale, (max[1] - y) * scale]);
                let mut drawn = on_grid(&drawn, [0.0; 2], [10f64.powi(-SVG_DECIMALS); 2]);
                drawn.layers.iter_mut().for_each(|layer| layer.crs = None);
                Ok(drawn)
            }
        }
    }
}

/// Puts every vertex on the nearest point of a grid.
fn on_grid(map: &Map, origin: [f64; 2], step: [f64; 2]) -> Map {
    let nearest = |value: f64, axis: usize| match step[axis] > 0.0 {
        true => ((value - origin[axis]) / step[axis]).round() * step[axis] + origin[axis],
        false => value, // a map without a width
    };
    rewrite_map(map, &mut |part, run| {
        let mut run: Vec<Coord> =
            run.iter().map(|c| Coord { x: nearest(c.x, 0), y: nearest(c.y, 1) }).collect();
        run.dedup();
        if part == Part::Ring && run.len() > 1 && run.first() == run.last() {
            run.pop();
        }
        run
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory, wkt};

    #[test]
    fn repeated_points_and_collapsed_parts_go() {
        let map = in_memory(&[
            "LINESTRING (0.1 0,0.2 0.1,3.9 0)",
            "POLYGON ((0 0,0.3 0,0.3 0.3,0 0.3,0 0))",
            "POLYGON ((0 0,5 0,5 5,0.2 0.2,0 0))",
        ]);
        let coarse = on_grid(&map, [0.0; 2], [1.0; 2]);
        assert_eq!(wkt(&coarse), ["LINESTRING (0 0,4 0)", "POLYGON ((0 0,5 0,5 5,0 0))"]);
    }

    #[test]
    fn tiles_are_coarser_at_lower_zooms_and_in_web_mercator() {
        let map = fixture("kotka.gpkg");
        let exact = reproject(&map, 3857, None).unwrap();
        let mut left = exact.vertices().unwrap().len();
        for (zoom, unit) in [(16, 0.149_291), (14, 0.597_164), (11, 4.777_314)] {
            let tiles = Quantisation::VectorTiles { zoom }.apply(&map).unwrap();
            let is_on_grid = |v: f64| (v / unit - (v / unit).round()).abs() < 0.2;
            let (min, _) = tiles.vertices().unwrap().bounds();
            let near: Vec<f64> = tiles.coords().map(|p| p[0] - min[0]).collect();
            assert!(near.into_iter().all(is_on_grid), "z{zoom}");
            let count = tiles.vertices().unwrap().len();
            assert!(count < left, "z{zoom}: {count} of {left}");
            left = count;
        }
    }

    #[test]
    fn a_topojson_has_ten_thousand_places_an_axis() {
        let map = fixture("kotka.gpkg");
        let (min, max) = map.vertices().unwrap().bounds();
        let coarse = Quantisation::TopoJson.apply(&map).unwrap();
        let (coarse_min, coarse_max) = coarse.vertices().unwrap().bounds();
        for axis in [0, 1] {
            assert!(
                (min[axis] - coarse_min[axis]).abs() < 1e-6 && (max[axis] - coarse_max[axis]).abs() < 1e-6
            );
        }
        let place = |v: f64| (v - min[0]) / (max[0] - min[0]) * 9999.0;
        assert!(coarse.coords().all(|p| (place(p[0]) - place(p[0]).round()).abs() < 1e-3));
    }

    #[test]
    fn a_drawing_is_so_wide_and_upside_down_and_bare() {
        let map = in_memory(&["LINESTRING (100 200,200 240,300 260)"]);
        let drawn = Quantisation::Svg { width: 1600.0 }.apply(&map).unwrap();
        assert_eq!(wkt(&drawn), ["LINESTRING (0 480,800 160,1600 0)"]);
        assert!(drawn.layers[0].fields.is_empty() && drawn.layers[0].crs.is_none());
    }
}
