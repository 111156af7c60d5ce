//! An attack through pixels: polygons are rasterised, and their outlines traced from the raster.

use super::{
    Map,
    buffers::one_or_many,
    curves::walk,
    features::drop_attributes,
    parts::{Part, is_polygonal, rewrite},
};
use crate::Result;
use gdal::{DriverManager, raster::rasterize, vector::ToGdal};
use geo::{BoundingRect, Coord, Geometry, LineString, Polygon, Rect, Simplify, unary_union};

/// The tolerance of simplification, pixels: the middles of stairs lie in a strip of this width
/// along a straight wall, so less would leave stairs.
const SMOOTHING_PIXELS: f64 = 1.0;

/// Returns polygons as traced from a raster with pixels of this size, units of the CRS, each from
/// its own band. The rest of the map and the attributes are dropped.
///
/// # Errors
/// Fails with the message of GDAL.
pub fn vectorise(map: &Map, pixel: f64) -> Result<Map> {
    let mut map = drop_attributes(map).try_map_geometries(|geometry| traced(geometry, pixel))?.of_any_type();
    map.layers.iter_mut().flat_map(|layer| &mut layer.features).for_each(|feature| feature.fid = None);
    Ok(map)
}

fn traced(geometry: &Geometry, pixel: f64) -> Result<Option<Geometry>> {
    if !is_polygonal(geometry) {
        return Ok(None);
    }
    let stairs = unary_union(&runs_of_pixels(geometry, pixel)?);
    let Some(stairs) = one_or_many(stairs) else { return Ok(None) };
    Ok(rewrite(&stairs, &mut |_, run| between_the_stairs(run, pixel)))
}

/// Straightens an outline of stairs: it simplifies the middles of the pixels' edges. Tracers such
/// as potrace do nearly the same, but draw curves.
fn between_the_stairs(run: &[Coord], pixel: f64) -> Vec<Coord> {
    let mut middles = walk(Part::Ring, run, pixel, 0.5);
    middles.push(middles[0]);
    let mut outline = LineString(middles).simplify(SMOOTHING_PIXELS * pixel).0;
    outline.pop();
    outline
}

/// Returns the pixels whose centres a geometry covers, on a grid through the origin, each run of a
/// row as a rectangle.
fn runs_of_pixels(geometry: &Geometry, pixel: f64) -> Result<Vec<Polygon>> {
    let Some(bounds) = geometry.bounding_rect() else { return Ok(Vec::new()) };
    let west = (bounds.min().x / pixel).floor();
    let north = (bounds.max().y / pixel).ceil();
    let columns = ((bounds.max().x / pixel).ceil() - west).max(1.0) as usize;
    let rows = (north - (bounds.min().y / pixel).floor()).max(1.0) as usize;
    let mut raster = DriverManager::get_driver_by_name("MEM")?.create("", columns, rows, 1)?;
    raster.set_geo_transform(&[west * pixel, pixel, 0.0, north * pixel, 0.0, -pixel])?;
    rasterize(&mut raster, &[1], &[geometry.to_gdal()?], &[1.0], None)?;
    let pixels = raster.rasterband(1)?.read_band_as::<u8>()?;
    let corner = |column: usize, row: usize| Coord {
        x: (west + column as f64) * pixel,
        y: (north - row as f64) * pixel,
    };
    let mut runs = Vec::new();
    for (row, values) in pixels.data().chunks(columns).enumerate() {
        let mut column = 0;
        for run in values.chunk_by(|a, b| a == b) {
            if run[0] != 0 {
                runs.push(Rect::new(corner(column, row), corner(column + run.len(), row + 1)).to_polygon());
            }
            column += run.len();
        }
    }
    Ok(runs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory};
    use geo::Area;

    #[test]
    fn pixels_are_set_whose_centres_are_covered() {
        let map = in_memory(&["POLYGON ((0.4 0.6,3.6 0.6,3.6 2.4,0.4 2.4,0.4 0.6))", "POINT (1 1)"]);
        let runs = runs_of_pixels(map.geometries().next().unwrap(), 1.0).unwrap();
        // Columns 0.5, 1.5, 2.5 and 3.5 are inside, of the rows 1.5 alone.
        assert_eq!(runs, [Rect::new([0.0, 1.0], [4.0, 2.0]).to_polygon()]);
    }

    #[test]
    fn courts_stay_open_and_slanted_walls_are_no_stairs() {
        let slanted = "POLYGON ((0 0,40 10,30 50,-10 40,0 0),(5 10,20 15,15 30,0 25,5 10))";
        let map = in_memory(&[slanted]);
        let back = vectorise(&map, 0.5).unwrap();
        let area = |map: &Map| -> f64 { map.geometries().map(Area::unsigned_area).sum() };
        assert!((area(&back) / area(&map) - 1.0).abs() < 0.01, "{} of {}", area(&back), area(&map));
        assert!(back.coords().count() < 40, "{} vertices, 8 before", back.coords().count());
    }

    #[test]
    fn the_areas_of_a_real_map_come_back() {
        let map = fixture("kotka.gpkg");
        let back = vectorise(&map, 0.5).unwrap();
        let polygons: Vec<&Geometry> = map.geometries().filter(|geometry| is_polygonal(geometry)).collect();
        assert!(
            back.features().count() <= polygons.len() && back.features().count() * 10 > polygons.len() * 9
        );
        let before: f64 = polygons.iter().map(|polygon| polygon.unsigned_area()).sum();
        let after: f64 = back.geometries().map(Area::unsigned_area).sum();
        assert!((after / before - 1.0).abs() < 0.02, "{after} of {before}");
        assert!(back.layers.iter().all(|layer| layer.fields.is_empty()));
    }
}
