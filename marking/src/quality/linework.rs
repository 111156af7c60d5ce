//! The segments of a geometry, with a search for near ones.

use crate::Outline;
use meshmark_core::orientation::orientation;
use rstar::{AABB, Envelope, PointDistance, RTree, RTreeObject, primitives::Line};

/// More segments than this are put into a tree.
const MOST_UNSORTED: usize = 64;

/// A geometry as segments; points are segments of no length.
pub struct Linework {
    /// The first vertex of every chain.
    pub firsts: Vec<[f64; 2]>,
    pub bounds: AABB<[f64; 2]>,
    segments: Segments,
}

enum Segments {
    Few(Vec<Line<[f64; 2]>>),
    Many(RTree<Line<[f64; 2]>>),
}

impl Linework {
    /// Creates the segments of an outline with x and y multiplied by `scale`.
    pub fn new(outline: &Outline, scale: [f64; 2]) -> Self {
        let place = |p: [f64; 2]| [p[0] * scale[0], p[1] * scale[1]];
        let (mut firsts, mut segments) = (Vec::new(), Vec::new());
        for chain in &outline.chains {
            let Some(&first) = chain.first() else { continue };
            firsts.push(place(first));
            match chain.len() {
                1 => segments.push(Line::new(place(first), place(first))),
                _ => segments.extend(chain.windows(2).map(|w| Line::new(place(w[0]), place(w[1])))),
            }
        }
        let mut bounds = AABB::new_empty();
        segments.iter().for_each(|line| bounds.merge(&line.envelope()));
        let segments = match segments.len() {
            0..=MOST_UNSORTED => Segments::Few(segments),
            _ => Segments::Many(RTree::bulk_load(segments)),
        };
        Linework { firsts, bounds, segments }
    }

    fn len(&self) -> usize {
        match &self.segments {
            Segments::Few(all) => all.len(),
            Segments::Many(tree) => tree.size(),
        }
    }

    /// Returns the segments whose bounding boxes meet this one.
    fn near(&self, bounds: AABB<[f64; 2]>) -> Box<dyn Iterator<Item = &Line<[f64; 2]>> + '_> {
        match &self.segments {
            Segments::Few(all) => {
                Box::new(all.iter().filter(move |line| line.envelope().intersects(&bounds)))
            }
            Segments::Many(tree) => Box::new(tree.locate_in_envelope_intersecting(&bounds)),
        }
    }

    fn distance(&self, point: &[f64; 2]) -> f64 {
        let distance2 = match &self.segments {
            Segments::Few(all) => all.iter().map(|line| line.distance_2(point)).min_by(f64::total_cmp),
            Segments::Many(tree) => tree.nearest_neighbor(point).map(|line| line.distance_2(point)),
        };
        distance2.unwrap_or(0.0).sqrt()
    }

    /// Returns whether two geometries of closed rings are disjoint, as far as this can be decided
    /// without computing their intersection. It is exact where the result is true.
    pub fn is_apart_from(&self, other: &Linework) -> bool {
        let (few, many) = if self.len() <= other.len() { (self, other) } else { (other, self) };
        let meets = |line: &Line<[f64; 2]>| many.near(line.envelope()).any(|near| may_meet(line, near));
        !few.near(many.bounds).any(meets)
            && !few.firsts.iter().any(|point| many.encloses(*point))
            && !many.firsts.iter().any(|point| few.encloses(*point))
    }

    /// Returns whether a point on no segment is inside, which it is when the number of segments to
    /// its right is odd.
    fn encloses(&self, [x, y]: [f64; 2]) -> bool {
        if !self.bounds.contains_point(&[x, y]) {
            return false;
        }
        let right = AABB::from_corners([x, y], [self.bounds.upper()[0], y]);
        let passes = |line: &&Line<[f64; 2]>| {
            let (a, b) = (line.from, line.to);
            let upward = if a[1] <= b[1] { orientation(a, b, [x, y]) } else { orientation(b, a, [x, y]) };
            (a[1] > y) != (b[1] > y) && upward > 0.0
        };
        self.near(right).filter(passes).count() % 2 == 1
    }
}

/// Returns the Hausdorff distance of two geometries whose vertices correspond, with x and y
/// multiplied by `scale`.
pub fn hausdorff(before: &Outline, after: &Outline, scale: [f64; 2]) -> f64 {
    let place = |p: &[f64; 2]| [p[0] * scale[0], p[1] * scale[1]];
    let [from, to] = [before, after].map(|outline| outline.chains.iter().flatten().map(place));
    let apart = |(a, b): ([f64; 2], [f64; 2])| ((a[0] - b[0]).hypot(a[1] - b[1]), a, b);
    let mut pairs: Vec<(f64, [f64; 2], [f64; 2])> = from.zip(to).map(apart).collect();
    pairs.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    let (before, after) = (Linework::new(before, scale), Linework::new(after, scale));
    let mut largest = 0f64;
    for (apart, a, b) in pairs {
        if apart <= largest {
            break; // no vertex is further from the other geometry than from its own new place
        }
        largest = largest.max(after.distance(&a)).max(before.distance(&b));
    }
    largest
}

/// Returns false when the ends of one are strictly on one side of the other.
fn may_meet(s: &Line<[f64; 2]>, t: &Line<[f64; 2]>) -> bool {
    let one_side = |s: &Line<[f64; 2]>, t: &Line<[f64; 2]>| {
        let (a, b) = (orientation(s.from, s.to, t.from), orientation(s.from, s.to, t.to));
        (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)
    };
    !one_side(s, t) && !one_side(t, s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wkb::{self, Step};

    fn line(vertices: impl Iterator<Item = [f64; 2]>) -> Outline {
        Outline::of_wkb(wkb::of_chains(&[vertices.collect()], &[Step::First])).unwrap()
    }

    #[test]
    fn a_vertex_that_slides_along_its_line_is_as_far_as_the_line_goes() {
        for vertices in [5, 500] {
            let along = |shift: f64| {
                let last = vertices - 1;
                let slide = move |i: i32| if i == 0 || i == last { 0.0 } else { shift };
                line((0..vertices).map(move |i| [f64::from(i) + slide(i), 0.0]))
            };
            assert_eq!(hausdorff(&along(0.0), &along(0.25), [1.0, 1.0]), 0.0);
            let away = line((0..vertices).map(|i| [f64::from(i), if i == 2 { 0.5 } else { 0.0 }]));
            assert_eq!(hausdorff(&along(0.25), &away, [1.0, 2.0]), 1.0);
        }
    }
}
