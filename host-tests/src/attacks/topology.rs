//! Attacks on topology: areas are dissolved, lines cut at every crossing.

use super::{
    Feature, Layer, Map,
    features::drop_attributes,
    parts::{Part, is_polygonal, visit},
};
use crate::Result;
use gdal::vector::ToGdal;
use geo::{Geometry, LineString, MultiLineString, MultiPolygon, Orient, orient::Direction, unary_union};

/// Joins the polygons of every layer where they meet, and drops all attributes.
pub fn dissolve(map: &Map) -> Map {
    let mut map = drop_attributes(map).of_any_type();
    for layer in &mut map.layers {
        let geometries = layer.features.drain(..).filter_map(|feature| feature.geometry);
        let (areas, others): (Vec<Geometry>, Vec<Geometry>) = geometries.partition(is_polygonal);
        let oriented: Vec<MultiPolygon> = areas.into_iter().filter_map(oriented).collect();
        let joined = unary_union(&oriented).into_iter().map(Geometry::Polygon);
        layer.features = joined.chain(others).map(nameless).collect();
    }
    map
}

/// Cuts all lines and outlines at all their crossings and keeps each piece once, in one layer of
/// lines without attributes.
///
/// # Errors
/// Fails with the message of GEOS.
pub fn planarise(map: &Map) -> Result<Map> {
    let mut lines = Vec::new();
    for geometry in map.geometries() {
        visit(geometry, |part, run| match part {
            Part::Point => {}
            Part::Line => lines.push(LineString(run.to_vec())),
            Part::Ring => lines.push(LineString([run, &run[..1]].concat())),
        });
    }
    let lines = MultiLineString(lines).to_gdal()?;
    // The union of lines with themselves cuts them at their crossings.
    let planar = lines.union(&lines).ok_or("GEOS could not cut the lines at their crossings")?;
    let pieces = match planar.to_geo()? {
        Geometry::MultiLineString(pieces) => pieces.0,
        Geometry::LineString(piece) => vec![piece],
        _ => Vec::new(),
    };
    let first = drop_attributes(map).of_any_type().layers.into_iter().next().ok_or("a map has no layer")?;
    let features = pieces.into_iter().map(|piece| nameless(piece.into())).collect();
    Ok(Map { layers: vec![Layer { name: "planar".into(), features, ..first }] })
}

fn nameless(geometry: Geometry) -> Feature {
    Feature { fid: None, values: Vec::new(), geometry: Some(geometry) }
}

/// Returns polygons with their rings in the directions that the union requires.
fn oriented(geometry: Geometry) -> Option<MultiPolygon> {
    let polygons = match geometry {
        Geometry::Polygon(polygon) => MultiPolygon(vec![polygon]),
        Geometry::MultiPolygon(polygons) => polygons,
        _ => return None,
    };
    Some(polygons.orient(Direction::Default))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory, wkt};
    use geo::{Area, Euclidean, Length};

    #[test]
    fn a_terrace_becomes_one_house_whatever_the_direction_of_its_rings() {
        let map = in_memory(&[
            "POLYGON ((0 0,6 0,6 5,0 5,0 0))",
            "POLYGON ((6 5,12 5,12 0,6 0,6 5))",
            "POLYGON ((20 0,26 0,26 5,20 5,20 0))",
            "LINESTRING (0 0,9 9)",
        ]);
        let joined = dissolve(&map);
        let areas: Vec<f64> = joined.geometries().map(Area::unsigned_area).collect();
        assert_eq!(areas.len(), 3);
        assert!((areas[0] - 60.0).abs() < 1e-6 && (areas[1] - 30.0).abs() < 1e-6, "{areas:?}");
        assert_eq!(wkt(&joined)[2], "LINESTRING (0 0,9 9)");
        assert!(joined.features().all(|feature| feature.values.is_empty()));
    }

    #[test]
    fn crossings_become_vertices_and_shared_walls_one_line() {
        let cross = planarise(&in_memory(&["LINESTRING (0 0,4 4)", "LINESTRING (0 4,4 0)"])).unwrap();
        assert_eq!(cross.features().count(), 4);
        assert!(cross.vertices().unwrap().index_of([2.0, 2.0]).is_some());
        let terrace = ["POLYGON ((0 0,6 0,6 5,0 5,0 0))", "POLYGON ((6 5,6 0,12 0,12 5,6 5))"];
        let walls = planarise(&in_memory(&terrace)).unwrap();
        let length: f64 = walls
            .geometries()
            .map(|wall| match wall {
                Geometry::LineString(wall) => Euclidean.length(wall),
                _ => 0.0,
            })
            .sum();
        assert!(
            (length - (2.0 * 12.0 + 3.0 * 5.0)).abs() < 1e-9,
            "the wall between them counts once: {length}"
        );
    }

    #[test]
    fn the_vertices_of_a_real_map_stay_in_the_planar_one() {
        let map = fixture("kotka.gpkg");
        let planar = planarise(&map).unwrap().vertices().unwrap();
        let old = map.vertices().unwrap();
        let kept = old.coords().iter().filter(|p| planar.index_of(**p).is_some()).count();
        assert!(kept * 100 > old.len() * 99, "{kept} of {}", old.len());
        assert!(planar.len() > old.len(), "roads cross outlines");
    }
}
