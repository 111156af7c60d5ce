//! The geometries of a survey, made again.

use gdal::{
    DriverManager,
    vector::{Geometry, LayerAccess},
};
use meshmark_dataset::{Selection, survey};

#[test]
fn geometries_are_made_again_from_their_vertices() {
    let made_again = [
        ("POINT (1 2)", "POINT (1 2)"),
        ("MULTIPOINT ((1 2),(3 4))", "MULTIPOINT ((1 2),(3 4))"),
        ("LINESTRING Z (1 2 9,3 4 9,1 2 9)", "LINESTRING (1 2,3 4,1 2)"),
        ("MULTILINESTRING ((1 2,3 4))", "LINESTRING (1 2,3 4)"),
        ("POLYGON EMPTY", "GEOMETRYCOLLECTION EMPTY"),
        (
            "MULTIPOLYGON (((0 0,9 0,9 9,0 0),(6 2,7 2,7 3,6 2)),((20 0,29 0,29 9,20 0)))",
            "MULTIPOLYGON (((0 0,9 0,9 9,0 0),(6 2,7 2,7 3,6 2)),((20 0,29 0,29 9,20 0)))",
        ),
        (
            "GEOMETRYCOLLECTION (POLYGON ((0 0,9 0,9 9,0 0)),LINESTRING (1 2,3 4),POINT (5 6))",
            "GEOMETRYCOLLECTION (POLYGON ((0 0,9 0,9 9,0 0)),LINESTRING (1 2,3 4),POINT (5 6))",
        ),
        ("TIN (((0 0,9 0,9 9,0 0)))", "TIN (((0 0,9 0,9 9,0 0)))"),
        (
            "CURVEPOLYGON (COMPOUNDCURVE (CIRCULARSTRING (0 0,1 1,2 0),(2 0,0 0)))",
            "CURVEPOLYGON (COMPOUNDCURVE (CIRCULARSTRING (0 0,1 1,2 0),(2 0,0 0)))",
        ),
    ];
    let memory = DriverManager::get_driver_by_name("Memory").unwrap();
    let mut dataset = memory.create_vector_only("").unwrap();
    for layer in 0..2 {
        let options = gdal::vector::LayerOptions { name: &format!("layer {layer}"), ..Default::default() };
        let mut layer = dataset.create_layer(options).unwrap();
        for (text, _) in made_again {
            layer.create_feature(Geometry::from_wkt(text).unwrap()).unwrap();
        }
    }
    let map = survey(&dataset, &Selection { geometries: true, ..Selection::default() }).unwrap();
    let geometries = map.geometries.unwrap();
    assert_eq!(geometries.len(), 2 * made_again.len());
    for number in 0..geometries.len() {
        let outline = geometries.outline(number, map.data.vertices.coords());
        let text = Geometry::from_wkb(&outline.wkb()).unwrap().iso_wkt().unwrap();
        assert_eq!(text, made_again[number % made_again.len()].1);
    }
}
