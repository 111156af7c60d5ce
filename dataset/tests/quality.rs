//! Validity, areas and overlaps of geometries, decided by the GEOS of GDAL.

use gdal::vector::Geometry;
use meshmark_core::ground::Ground;
use meshmark_dataset::GeosOfGdal;
use meshmark_marking::{
    Outline,
    quality::{BeforeAfter, Outlines, Quality, State},
};
use std::borrow::Cow;

fn outlines(texts: &[String]) -> Vec<Outline> {
    let outline = |text: &String| Outline::of_wkb(Geometry::from_wkt(text).unwrap().wkb().unwrap());
    texts.iter().map(|text| outline(text).unwrap()).collect()
}

fn quality(before: &[String], after: &[String], grid: f64) -> Quality {
    let (before, after) = (outlines(before), outlines(after));
    let [get_before, get_after] =
        [&before, &after].map(|all| move |number: usize| Cow::Borrowed(&all[number]));
    let before = Outlines { count: before.len(), get: &get_before };
    let after = Outlines { count: after.len(), get: &get_after };
    let (states, ground) = ([before, after].map(|map| State::measure(map, &GeosOfGdal)), Ground::METRES);
    BeforeAfter { before: (before, &states[0]), after: (after, &states[1]), measure: &ground, grid }.quality()
}

fn square(x: f64, y: f64, size: f64) -> String {
    let (right, top) = (x + size, y + size);
    format!("(({x} {y}, {right} {y}, {right} {top}, {x} {top}, {x} {y}))")
}

fn polygon(x: f64, y: f64, size: f64) -> String {
    format!("POLYGON {}", square(x, y, size))
}

/// Returns a circle of so many vertices.
fn circle(vertices: usize, radius: f64) -> String {
    let place = |i: usize| {
        let (y, x) = (std::f64::consts::TAU * (i % vertices) as f64 / vertices as f64).sin_cos();
        format!("{} {}", radius * x, radius * y)
    };
    format!("POLYGON (({}))", (0..=vertices).map(place).collect::<Vec<_>>().join(", "))
}

#[test]
fn an_overlap_up_to_a_cell_of_the_grid_is_a_sliver() {
    let before = [polygon(0.0, 0.0, 1.0), polygon(1.0, 0.0, 1.0)];
    let after = [polygon(0.0, 0.0, 1.0), polygon(0.995, 0.0, 1.0)];
    let exact = quality(&before, &after, 0.0);
    assert_eq!((exact.overlaps.new, exact.overlaps.new_slivers), (1, 0));
    assert_eq!(exact.newly_overlapping, [[0, 1]]);
    assert!((exact.overlaps.new_area_m2 - 0.005).abs() < 1e-9);
    let on_grid = quality(&before, &after, 0.1).overlaps;
    assert_eq!((on_grid.new, on_grid.new_slivers, on_grid.new_area_m2), (0, 1, 0.0));
}

#[test]
fn arcs_overlap_by_their_bellies() {
    let disc = "CURVEPOLYGON (CIRCULARSTRING (0 0, 10 0, 0 0))".to_string();
    for (other, expected) in
        [(polygon(4.5, 3.0, 1.0), 1), (polygon(4.5, 5.5, 1.0), 0), (polygon(0.0, 4.0, 1.0), 0)]
    {
        let all = [disc.clone(), other.clone()];
        assert_eq!(quality(&all, &all, 0.0).overlaps.before, expected, "{other}");
    }
}

#[test]
fn what_lies_inside_overlaps_and_what_lies_in_a_hole_does_not() {
    for vertices in [8, 40, 1000] {
        let disc = circle(vertices, 10.0);
        let ring = disc.replace("))", &format!("), {}", &square(-2.0, -2.0, 4.0)[1..]));
        let overlaps = |other: &String| {
            let all = [disc.clone(), other.clone()];
            quality(&all, &all, 0.0).overlaps.before
        };
        assert_eq!(overlaps(&polygon(0.0, 0.0, 1.0)), 1, "inside");
        assert_eq!(overlaps(&polygon(7.9, 7.9, 1.0)), 0, "in the corner of its box");
        let islands = format!("MULTIPOLYGON ({}, {})", square(7.9, 7.9, 1.0), square(0.0, 0.0, 1.0));
        assert_eq!(overlaps(&islands), 1, "the second part inside");
        assert_eq!(overlaps(&polygon(-20.0, -20.0, 40.0)), 1, "around it");
        let in_hole = [ring, polygon(-1.0, -1.0, 2.0)];
        assert_eq!(quality(&in_hole, &in_hole, 0.0).overlaps.before, 0, "in its hole");
    }
}

#[test]
fn areas_are_those_of_gdal() {
    for text in [
        "POLYGON ((385000 6671000, 385009 6671000, 385009 6671007.5, 385000 6671000))",
        "POLYGON ((0 0, 9 0, 9 9, 0 9, 0 0), (2 2, 2 3, 3 3, 2 2))",
        "MULTIPOLYGON (((0 0, 9 0, 9 9, 0 0), (6 2, 7 2, 7 3, 6 2)), ((20 0, 29 0, 29 9, 20 0)))",
        "POINT (1 2)",
        "POLYGON EMPTY",
    ] {
        let geometry = Geometry::from_wkt(text).unwrap();
        let outline = Outline::of_wkb(geometry.wkb().unwrap()).unwrap();
        assert_eq!(outline.area(), geometry.area(), "{text}");
    }
    // GDAL takes a closed line for a ring.
    let roundabout = Geometry::from_wkt("LINESTRING (0 0, 9 0, 9 9, 0 0)").unwrap();
    assert_eq!(Outline::of_wkb(roundabout.wkb().unwrap()).unwrap().area(), 0.0);
}
