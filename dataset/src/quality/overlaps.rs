//! The overlaps of polygons.

use super::{
    linework::Linework,
    sights::{Outlines, Sight},
};
use crate::{Outline, wkb::Step};
use meshmark_core::distortion::Overlaps;
use rayon::prelude::*;
use rstar::{
    RTree,
    primitives::{GeomWithData, Rectangle},
};
use std::{
    cell::LazyCell,
    collections::{BTreeMap, BTreeSet},
};

/// Overlaps up to this are slivers of rounding, square metres.
const SLIVER_M2: f64 = 1e-6;
/// The segments of polygons with more vertices are sorted once, not for every neighbour.
const MANY_VERTICES: usize = 256;

/// The bounding box of a polygon, and its number.
type NumberedBounds = GeomWithData<Rectangle<[f64; 2]>, u32>;

/// Pairs of polygons, the lower number first, with the area they have in common, CRS units squared.
pub(super) type CommonAreas = BTreeMap<[u32; 2], f64>;

/// Computes the common areas of pairs of valid polygons that have one, CRS units squared.
pub(super) fn common_areas(outlines: Outlines, sights: &[Sight]) -> CommonAreas {
    let polygons = (0u32..).zip(sights).filter(|(_, sight)| sight.is_valid && sight.area > 0.0);
    let boxes: Vec<NumberedBounds> =
        polygons.map(|(number, sight)| NumberedBounds::new(sight.bounds.into(), number)).collect();
    let tree = RTree::bulk_load(boxes.clone());
    let search = Search { outlines, large: large(outlines, &boxes) };
    let of_polygon = |polygon: &NumberedBounds| {
        let near = tree.locate_in_envelope_intersecting(&sights[polygon.data as usize].bounds);
        let mut later: Vec<u32> =
            near.map(|other| other.data).filter(|other| *other > polygon.data).collect();
        later.sort_unstable();
        search.common(polygon.data, &later)
    };
    boxes.par_iter().flat_map_iter(of_polygon).collect()
}

/// Returns the segments of all polygons with many vertices; `None` for those that do not consist of
/// rings.
fn large(outlines: Outlines, boxes: &[NumberedBounds]) -> BTreeMap<u32, Option<Linework>> {
    let sorted = |polygon: &NumberedBounds| {
        let outline = (outlines.get)(polygon.data as usize);
        let vertices: usize = outline.chains.iter().map(Vec::len).sum();
        (vertices > MANY_VERTICES).then(|| (polygon.data, rings(&outline)))
    };
    boxes.par_iter().filter_map(sorted).collect()
}

/// Returns the segments of a geometry of closed rings; `None` for others, such as those with arcs.
fn rings(outline: &Outline) -> Option<Linework> {
    let is_ring = |(chain, kind): (&Vec<[f64; 2]>, &Step)| {
        matches!(kind, Step::Shell | Step::Hole) && chain.first() == chain.last()
    };
    let are_rings = outline.chains.iter().zip(&outline.kinds).all(is_ring);
    (are_rings && outline.is_plain()).then(|| Linework::new(outline, [1.0; 2]))
}

struct Search<'a> {
    outlines: Outlines<'a>,
    large: BTreeMap<u32, Option<Linework>>,
}

impl Search<'_> {
    /// Computes the common areas of a polygon with others.
    fn common(&self, polygon: u32, others: &[u32]) -> Vec<([u32; 2], f64)> {
        if others.is_empty() {
            return Vec::new();
        }
        let outline = (self.outlines.get)(polygon as usize);
        let own = if self.large.contains_key(&polygon) { None } else { rings(&outline) };
        let lines = self.large.get(&polygon).unwrap_or(&own);
        let whole = LazyCell::new(|| outline.geometry());
        let common = |other: &u32| {
            let large = self.large.get(other);
            if large.is_some_and(|large| are_apart(lines, large)) {
                return None;
            }
            let neighbour = (self.outlines.get)(*other as usize);
            if large.is_none() && are_apart(lines, &rings(&neighbour)) {
                return None;
            }
            let area = whole.as_ref()?.intersection(&neighbour.geometry()?)?.area();
            (area > 0.0).then_some(([polygon, *other], area))
        };
        others.iter().filter_map(common).collect()
    }
}

fn are_apart(one: &Option<Linework>, other: &Option<Linework>) -> bool {
    one.as_ref().zip(other.as_ref()).is_some_and(|(one, other)| one.is_apart_from(other))
}

/// Counts the overlaps among polygons that are valid before and after, and lists the new ones.
/// `common` are the common areas before and after, `scale` metres per unit at a polygon, `grid` as
/// in [`super::BeforeAfter`].
pub(super) fn compare(
    common: [&CommonAreas; 2],
    is_valid: impl Fn(u32) -> bool,
    scale: impl Fn(u32) -> [f64; 2],
    grid: f64,
) -> (Overlaps, Vec<[u32; 2]>) {
    let overlap = |pair: &[u32; 2]| {
        let [x, y] = scale(pair[0]);
        let [before_m2, after_m2] = common.map(|areas| areas.get(pair).map_or(0.0, |area| area * x * y));
        Overlap { before_m2, after_m2, sliver_m2: SLIVER_M2.max(grid * grid * x * y) }
    };
    let pairs: BTreeSet<&[u32; 2]> = common.iter().flat_map(|areas| areas.keys()).collect();
    let valid = pairs.into_iter().filter(|pair| pair.iter().all(|&number| is_valid(number)));
    let all: Vec<([u32; 2], Overlap)> = valid.map(|pair| (*pair, overlap(pair))).collect();
    let new: Vec<&([u32; 2], Overlap)> = all.iter().filter(|(_, overlap)| overlap.is_new()).collect();
    let counts = Overlaps {
        before: all.iter().filter(|(_, o)| o.is_more(o.before_m2)).count(),
        after: all.iter().filter(|(_, o)| o.is_more(o.after_m2)).count(),
        new: new.len(),
        new_area_m2: new.iter().fold(0.0, |sum, (_, o)| sum + o.after_m2 - o.before_m2),
        new_slivers: all.iter().filter(|(_, o)| o.before_m2 == 0.0 && o.is_sliver(o.after_m2)).count(),
    };
    (counts, new.iter().map(|(pair, _)| *pair).collect())
}

/// The common area of two polygons, square metres.
struct Overlap {
    before_m2: f64,
    after_m2: f64,
    /// Up to this area the overlap is an effect of rounding.
    sliver_m2: f64,
}

impl Overlap {
    fn is_more(&self, area_m2: f64) -> bool {
        area_m2 > self.sliver_m2
    }

    /// Returns whether the overlap is new. A sliver that grows by no more than another sliver is
    /// not: it existed before.
    fn is_new(&self) -> bool {
        !self.is_more(self.before_m2) && self.is_more(self.after_m2 - self.before_m2)
    }

    fn is_sliver(&self, area_m2: f64) -> bool {
        area_m2 > 0.0 && !self.is_more(area_m2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality::{BeforeAfter, Quality, State};
    use gdal::vector::Geometry;
    use meshmark_core::ground::Ground;
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
        let (states, ground) = ([before, after].map(State::measure), Ground::METRES);
        BeforeAfter { before: (before, &states[0]), after: (after, &states[1]), measure: &ground, grid }
            .quality()
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
    fn a_sliver_that_grows_a_little_is_not_new() {
        let of = |before_m2, after_m2| Overlap { before_m2, after_m2, sliver_m2: SLIVER_M2 }.is_new();
        assert!(!of(0.997e-6, 1.002e-6));
        assert!(of(0.997e-6, 2.1e-6) && of(0.0, 1.1e-6));
        assert!(!of(0.0, 0.9e-6) && !of(1.0, 2.0));
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
}
