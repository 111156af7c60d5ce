//! Crossings of segments before and after marking.

use meshmark_core::{ground::Ground, orientation::orientation};
use rayon::prelude::*;
use rstar::{
    AABB, RTree, RTreeObject,
    primitives::{GeomWithData, Rectangle},
};
use serde::Serialize;
use std::collections::BTreeSet;

/// Crossings up to this depth are rounding, metres.
const GRAZE_M: f64 = 1e-6;

type Segment = GeomWithData<Rectangle<[f64; 2]>, u32>;

/// Counts of pairs of segments, of any features, that cross by more than 1e-6 m.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Crossings {
    /// Pairs in the reference.
    pub before: usize,
    /// Pairs in the marked map.
    pub after: usize,
    /// Pairs that cross only in the marked map.
    pub new: usize,
    /// Pairs that cross only in the reference.
    pub lost: usize,
}

/// Counts pairs of segments that cross before and after. Also returns the places, CRS units, where
/// only one of the two crosses.
pub(super) fn crossings(
    segments: &[[u32; 2]],
    before: &[[f64; 2]],
    after: &[[f64; 2]],
    measure: &Ground,
) -> (Crossings, Vec<[f64; 2]>) {
    let (old, new) = (crossing_pairs(segments, before), crossing_pairs(segments, after));
    let is_deep = |[i, j]: &[u32; 2], coords: &[[f64; 2]]| {
        let ends = [*i, *j].map(|s| segments[s as usize].map(|v| coords[v as usize]));
        depth_m(ends, measure) > GRAZE_M
    };
    let counts = Crossings {
        before: old.iter().filter(|pair| is_deep(pair, before)).count(),
        after: new.iter().filter(|pair| is_deep(pair, after)).count(),
        new: new.difference(&old).filter(|pair| is_deep(pair, after)).count(),
        lost: old.difference(&new).filter(|pair| is_deep(pair, before)).count(),
    };
    let changed = new.difference(&old).filter(|pair| is_deep(pair, after));
    let changed = changed.chain(old.difference(&new).filter(|pair| is_deep(pair, before)));
    let places = changed.map(|[segment, _]| before[segments[*segment as usize][0] as usize]);
    (counts, places.collect())
}

fn crossing_pairs(segments: &[[u32; 2]], coords: &[[f64; 2]]) -> BTreeSet<[u32; 2]> {
    let ends = |segment: u32| segments[segment as usize].map(|v| coords[v as usize]);
    let leaf = |number: u32| {
        let [p, q] = ends(number);
        Segment::new(Rectangle::from_corners(p, q), number)
    };
    let leaves: Vec<Segment> = (0..segments.len() as u32).map(leaf).collect();
    let tree = RTree::bulk_load(leaves.clone());
    let of_segment = |leaf: &Segment| {
        let envelope: AABB<[f64; 2]> = leaf.envelope();
        let later = tree.locate_in_envelope_intersecting(&envelope).filter(|other| other.data > leaf.data);
        let crossing = later.filter(|other| cross(ends(leaf.data), ends(other.data)));
        crossing.map(|other| [leaf.data, other.data]).collect::<Vec<_>>()
    };
    leaves.par_iter().flat_map_iter(of_segment).collect()
}

/// Returns whether the ends of each segment are on different sides of the other.
fn cross([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    orientation(a, b, c) * orientation(a, b, d) < 0.0 && orientation(c, d, a) * orientation(c, d, b) < 0.0
}

/// Returns the distance of the nearest of the four ends of two crossing segments from the line of
/// the other segment, metres.
fn depth_m([[a, b], [c, d]]: [[[f64; 2]; 2]; 2], measure: &Ground) -> f64 {
    let height = |a: [f64; 2], b: [f64; 2], p: [f64; 2]| {
        let ([ex, ey], [px, py]) = (measure.metres_between(a, b), measure.metres_between(a, p));
        (ex * py - ey * px).abs() / ex.hypot(ey)
    };
    height(a, b, c).min(height(a, b, d)).min(height(c, d, a)).min(height(c, d, b))
}
