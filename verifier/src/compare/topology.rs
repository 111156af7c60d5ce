//! Validity, overlaps and crossings.

use super::{Crossings, Overlaps, Pair, Pairs, Validity};
use gdal::vector::Geometry;
use meshmark_core::ground::Ground;
use meshmark_dataset::FeatureGeometry;
use rayon::prelude::*;
use robust::{Coord, orient2d};
use rstar::{
    AABB, RTree, RTreeObject,
    primitives::{GeomWithData, Rectangle},
};
use std::collections::BTreeSet;

/// Overlaps up to this are slivers of rounding, square metres.
const SLIVER_M2: f64 = 1e-6;
/// Crossings up to this are rounding, metres.
const GRAZE_M: f64 = 1e-6;

fn geometry(feature: &FeatureGeometry) -> Option<Geometry> {
    Geometry::from_wkb(&feature.wkb).ok()
}

fn is_valid(feature: &FeatureGeometry) -> bool {
    geometry(feature).is_some_and(|geometry| geometry.is_valid())
}

impl Pairs {
    /// Also where geometries became invalid.
    pub(super) fn validity(&self) -> (Validity, Vec<[f64; 2]>) {
        let each = |pair: &Pair| [is_valid(&pair.before), is_valid(&pair.after)];
        let valid: Vec<[bool; 2]> = self.features.par_iter().map(each).collect();
        let count = |wanted: fn(&[bool; 2]) -> bool| valid.iter().filter(|v| wanted(v)).count();
        let counts = Validity {
            invalid_before: count(|v| !v[0]),
            invalid_after: count(|v| !v[1]),
            newly_invalid: count(|v| v[0] && !v[1]),
        };
        let new = self.features.iter().zip(&valid).filter(|(_, v)| v[0] && !v[1]);
        (counts, new.filter_map(|(pair, _)| pair.before.chains.first()?.first().copied()).collect())
    }

    /// Overlaps among polygons that are valid in both maps, for GEOS has no answer for others, and where new ones are.
    pub(super) fn overlaps(&self) -> (Overlaps, Vec<[f64; 2]>) {
        let polygons = self.polygons();
        let tree = RTree::bulk_load(polygons.clone());
        let of_polygon = |polygon: &Polygon| -> Vec<Overlap> {
            let near = tree.locate_in_envelope_intersecting(&polygon.envelope());
            let later = near.filter(|other| other.data > polygon.data);
            let mut later: Vec<u32> = later.map(|other| other.data).collect();
            later.sort_unstable();
            self.common_areas(polygon.data, &later)
        };
        let all: Vec<Overlap> = polygons.par_iter().flat_map_iter(of_polygon).collect();
        let new: Vec<&Overlap> = all.iter().filter(|overlap| overlap.is_new()).collect();
        let counts = Overlaps {
            before: all.iter().filter(|o| o.is_more(o.before_m2)).count(),
            after: all.iter().filter(|o| o.is_more(o.after_m2)).count(),
            new: new.len(),
            new_area_m2: new.iter().fold(0.0, |sum, o| sum + o.after_m2 - o.before_m2),
            new_slivers: all.iter().filter(|o| o.before_m2 == 0.0 && o.is_sliver(o.after_m2)).count(),
        };
        (counts, new.iter().map(|overlap| overlap.at).collect())
    }

    fn polygons(&self) -> Vec<Polygon> {
        let polygon = |(number, pair): (usize, &Pair)| {
            let (before, after) = (geometry(&pair.before)?, geometry(&pair.after)?);
            if before.area() <= 0.0 || !before.is_valid() || !after.is_valid() {
                return None;
            }
            let (a, b) = (before.envelope(), after.envelope());
            let lower = [a.MinX.min(b.MinX), a.MinY.min(b.MinY)];
            let upper = [a.MaxX.max(b.MaxX), a.MaxY.max(b.MaxY)];
            Some(Polygon::new(Rectangle::from_corners(lower, upper), number as u32))
        };
        self.features.par_iter().enumerate().filter_map(polygon).collect()
    }

    /// What a polygon has in common with each of some others.
    fn common_areas(&self, polygon: u32, others: &[u32]) -> Vec<Overlap> {
        if others.is_empty() {
            return Vec::new();
        }
        let pair = &self.features[polygon as usize];
        let [x, y] = self.scale(&pair.before);
        let sliver_m2 = SLIVER_M2.max(self.grid * self.grid * x * y);
        let (before, after) = (geometry(&pair.before), geometry(&pair.after));
        let common = |a: &Option<Geometry>, b: &FeatureGeometry| {
            let (Some(a), Some(b)) = (a, geometry(b)) else { return 0.0 };
            a.intersection(&b).map_or(0.0, |common| common.area() * x * y)
        };
        let each = |other: &u32| {
            let other = &self.features[*other as usize];
            let (before_m2, after_m2) = (common(&before, &other.before), common(&after, &other.after));
            let at = other.before.chains.first().and_then(|chain| chain.first()).copied().unwrap_or_default();
            Overlap { at, before_m2, after_m2, sliver_m2 }
        };
        others.iter().map(each).collect()
    }
}

/// The area that two polygons have in common, square metres.
struct Overlap {
    /// A vertex of the second one.
    at: [f64; 2],
    before_m2: f64,
    after_m2: f64,
    /// Up to this, it is rounding.
    sliver_m2: f64,
}

impl Overlap {
    fn is_more(&self, area_m2: f64) -> bool {
        area_m2 > self.sliver_m2
    }

    /// A sliver that grows over the limit by less than another one is none: it was there.
    fn is_new(&self) -> bool {
        !self.is_more(self.before_m2) && self.is_more(self.after_m2 - self.before_m2)
    }

    fn is_sliver(&self, area_m2: f64) -> bool {
        area_m2 > 0.0 && !self.is_more(area_m2)
    }
}

type Polygon = GeomWithData<Rectangle<[f64; 2]>, u32>;
type Segment = GeomWithData<Rectangle<[f64; 2]>, u32>;

/// Counts pairs of segments that cross before and after, and says where one of the two did not or does no longer.
pub(super) fn crossings(
    segments: &[[u32; 2]],
    before: &[[f64; 2]],
    after: &[[f64; 2]],
    ground: &Ground,
) -> (Crossings, Vec<[f64; 2]>) {
    let (old, new) = (crossing_pairs(segments, before), crossing_pairs(segments, after));
    let is_deep = |[i, j]: &[u32; 2], coords: &[[f64; 2]]| {
        let ends = [*i, *j].map(|s| segments[s as usize].map(|v| coords[v as usize]));
        depth_m(ends, ground) > GRAZE_M
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

fn side(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    let coord = |p: [f64; 2]| Coord { x: p[0], y: p[1] };
    orient2d(coord(a), coord(b), coord(p))
}

/// Whether the ends of either are on different sides of the other.
fn cross([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

/// How far the nearest of the four ends of two crossing segments is from the other segment's line.
fn depth_m([[a, b], [c, d]]: [[[f64; 2]; 2]; 2], ground: &Ground) -> f64 {
    let height = |a: [f64; 2], b: [f64; 2], p: [f64; 2]| {
        let ([ex, ey], [px, py]) = (ground.metres_between(a, b), ground.metres_between(a, p));
        (ex * py - ey * px).abs() / ex.hypot(ey)
    };
    height(a, b, c).min(height(a, b, d)).min(height(c, d, a)).min(height(c, d, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(from: f64, to: f64) -> FeatureGeometry {
        let ring = vec![[from, 0.0], [to, 0.0], [to, 1.0], [from, 1.0], [from, 0.0]];
        let text: Vec<String> = ring.iter().map(|[x, y]| format!("{x} {y}")).collect();
        let geometry = Geometry::from_wkt(&format!("POLYGON (({}))", text.join(", "))).unwrap();
        let wkb = geometry.wkb().unwrap();
        FeatureGeometry { layer: "plots".into(), fid: None, wkb, chains: vec![ring] }
    }

    #[test]
    fn an_overlap_up_to_a_cell_of_the_grid_is_a_sliver() {
        let pair = |before: [f64; 2], after: [f64; 2]| Pair {
            before: rectangle(before[0], before[1]),
            after: rectangle(after[0], after[1]),
        };
        let overlaps = |grid: f64| {
            let features = vec![pair([0.0, 1.0], [0.0, 1.005]), pair([1.0, 2.0], [1.0, 2.0])];
            Pairs { features, ground: Ground::Plane { metres_per_unit: 1.0 }, grid }.overlaps().0
        };
        assert_eq!((overlaps(0.0).new, overlaps(0.0).new_slivers), (1, 0));
        assert!((overlaps(0.0).new_area_m2 - 0.005).abs() < 1e-9);
        assert_eq!((overlaps(0.1).new, overlaps(0.1).new_slivers), (0, 1));
        assert_eq!(overlaps(0.1).new_area_m2, 0.0);
    }

    #[test]
    fn a_sliver_that_grows_a_little_is_not_new() {
        let of = |before_m2, after_m2| {
            Overlap { at: [0.0; 2], before_m2, after_m2, sliver_m2: SLIVER_M2 }.is_new()
        };
        assert!(!of(0.997e-6, 1.002e-6));
        assert!(of(0.997e-6, 2.1e-6) && of(0.0, 1.1e-6));
        assert!(!of(0.0, 0.9e-6) && !of(1.0, 2.0));
    }
}
