//! The overlaps of polygons.

use super::{
    geos::{Geos, Neighbours},
    linework::Linework,
    sights::{Bounds, Outlines, Sight},
};
use crate::{Outline, wkb::Step};
use meshmark_core::distortion::Overlaps;
use rayon::prelude::*;
use rstar::{
    RTree, RTreeObject,
    primitives::{GeomWithData, Rectangle},
};
use std::collections::{BTreeMap, BTreeSet};

/// Overlaps up to this are slivers of rounding, square metres.
const SLIVER_M2: f64 = 1e-6;
/// The segments of polygons with more vertices are sorted once, not for every neighbour.
const MANY_VERTICES: usize = 256;
/// Polygons whose common areas GEOS computes at once.
const BATCH: usize = 1024;

/// The bounding box of a polygon, and its number.
type NumberedBounds = GeomWithData<Rectangle<[f64; 2]>, u32>;

/// Pairs of polygons, the lower number first, with the area they have in common, CRS units squared.
pub(super) type CommonAreas = BTreeMap<[u32; 2], f64>;

/// Computes the common areas of pairs of valid polygons that have one, CRS units squared.
pub(super) fn common_areas(
    outlines: Outlines,
    (sights, bounds): (&[Sight], Vec<Bounds>),
    geos: &dyn Geos,
) -> CommonAreas {
    let is_polygon = |number: u32| sights[number as usize].is_valid && sights[number as usize].area > 0.0;
    let polygons = (0..).zip(bounds).filter(|(number, _)| is_polygon(*number));
    let polygons = polygons.map(|(number, bounds)| NumberedBounds::new(bounds.into(), number));
    let tree = RTree::bulk_load(polygons.collect());
    let boxes: Vec<&NumberedBounds> = tree.iter().collect();
    let search = Search { outlines, large: large(outlines, &boxes) };
    let near = |polygon: &&NumberedBounds| {
        let near = tree.locate_in_envelope_intersecting(&polygon.envelope());
        let mut later: Vec<u32> =
            near.map(|other| other.data).filter(|other| *other > polygon.data).collect();
        later.sort_unstable();
        search.not_apart(polygon.data, later)
    };
    let groups: Vec<(u32, Vec<u32>)> = boxes.par_iter().filter_map(near).collect();
    let mut common = CommonAreas::new();
    for batch in groups.chunks(BATCH) {
        let outline = |number: u32| (outlines.get)(number as usize);
        let neighbours = |(polygon, others): &(u32, Vec<u32>)| {
            (outline(*polygon), others.iter().map(|other| outline(*other)).collect())
        };
        let of_batch: Vec<Neighbours> = batch.par_iter().map(neighbours).collect();
        for ((polygon, others), areas) in batch.iter().zip(geos.common_areas(&of_batch)) {
            let pairs = others.iter().zip(areas).filter(|(_, area)| *area > 0.0);
            common.extend(pairs.map(|(other, area)| ([*polygon, *other], area)));
        }
    }
    common
}

/// Returns the segments of all polygons with many vertices; `None` for those that do not consist of
/// rings.
fn large(outlines: Outlines, boxes: &[&NumberedBounds]) -> BTreeMap<u32, Option<Linework>> {
    let sorted = |polygon: &&NumberedBounds| {
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
    /// Returns a polygon with those of the others that it may overlap, if there are any.
    fn not_apart(&self, polygon: u32, mut others: Vec<u32>) -> Option<(u32, Vec<u32>)> {
        if others.is_empty() {
            return None;
        }
        let outline = (self.outlines.get)(polygon as usize);
        let own = if self.large.contains_key(&polygon) { None } else { rings(&outline) };
        let lines = self.large.get(&polygon).unwrap_or(&own);
        others.retain(|other| match self.large.get(other) {
            Some(large) => !are_apart(lines, large),
            None => !are_apart(lines, &rings(&(self.outlines.get)(*other as usize))),
        });
        (!others.is_empty()).then_some((polygon, others))
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

    #[test]
    fn a_sliver_that_grows_a_little_is_not_new() {
        let of = |before_m2, after_m2| Overlap { before_m2, after_m2, sliver_m2: SLIVER_M2 }.is_new();
        assert!(!of(0.997e-6, 1.002e-6));
        assert!(of(0.997e-6, 2.1e-6) && of(0.0, 1.1e-6));
        assert!(!of(0.0, 0.9e-6) && !of(1.0, 2.0));
    }
}
