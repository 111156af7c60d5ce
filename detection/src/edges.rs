//! Edges: how far the lines of a suspect lie off an edge of the reference.
//!
//! A line that was drawn anew lies on the old edge, although its vertices are new. Its offset along
//! the normal of the edge is a linear function of the displacements of both ends; [`Offset`] is a
//! robust fit of that function.

use crate::linework::{Edge, Plane};
use meshmark_core::map_data::MapData;
use rayon::prelude::*;
use rstar::{AABB, RTree};

/// Shorter edges of the reference are not read, metres.
const LEAST_EDGE_M: f64 = 1.5;
/// Lines are not read near the ends of an edge, where the lines beyond a corner are: this share of
/// its length, at most so many metres.
const END_SHARE: f64 = 0.1;
const END_M: f64 = 0.3;
/// A long edge is looked at in windows of this length, metres, at most so many of them.
const WINDOW_M: f64 = 40.0;
const MOST_WINDOWS: usize = 16;
/// So many suspect segments are looked at for an edge, and so many near and parallel ones are kept.
const MOST_SEEN: usize = 2048;
const MOST_PIECES: usize = 512;
/// So many pieces, the longest ones, each propose a course of the line.
const PROPOSALS: usize = 12;
/// An edge may turn by as much as displaces one end by this, metres.
const TURN_M: f64 = 0.5;
/// Rounds of reweighting.
const ROUNDS: usize = 8;
/// The offset is unlikely beyond this share of the reach.
const LIKELY: f64 = 0.5;
/// Errors along a line are alike over about this length, metres.
const ALIKE_M: f64 = 1.0;

/// Which lines count as lines on an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// They deviate from a straight line by about this, metres.
    pub width_m: f64,
    /// Their slope against it is at most this.
    pub slope: f64,
    /// They cover this share of its length at least.
    pub covered: f64,
}

/// The offset of the suspect from an edge of the reference, as normal equations in the offsets of
/// its two ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Offset {
    /// The vertices of the edge.
    pub ends: [u32; 2],
    /// The unit normal of the edge.
    pub normal: [f64; 2],
    /// Σ w φ φᵀ for the shares φ of the two ends: first end, both, second end.
    pub products: [f64; 3],
    /// Σ w φ o of the offsets o, metres.
    pub sums: [f64; 2],
    /// Σ w.
    pub weight: f64,
    /// Mean square of the residuals, square metres.
    pub residual2: f64,
}

/// Measures the offsets of all edges of a reference, moved by `shift_m`, from the lines in `tree`,
/// which are in the same `plane`.
pub fn offsets(
    (reference, shift_m): (&MapData, [f64; 2]),
    plane: &Plane,
    tree: &RTree<Edge>,
    reach_m: f64,
    tolerance: &Tolerance,
) -> Vec<Offset> {
    let coords = reference.vertices.coords();
    let place = |vertex: u32| {
        let [x, y] = plane.at(coords[vertex as usize]);
        [x + shift_m[0], y + shift_m[1]]
    };
    let offset = |ends: &[u32; 2]| {
        let axis = Axis::new(ends.map(place))?;
        let pieces = axis.pieces(tree, reach_m, tolerance);
        axis.fit(*ends, &pieces, reach_m, tolerance)
    };
    reference.segments.par_iter().filter_map(offset).collect()
}

/// A directed edge of the reference.
struct Axis {
    start: [f64; 2],
    along: [f64; 2],
    normal: [f64; 2],
    length: f64,
}

/// A piece of a suspect line near an edge, in coordinates along and across it, metres.
#[derive(Debug, Clone, Copy)]
struct Piece {
    /// Coordinate of its middle along the edge.
    at: f64,
    length: f64,
    /// Offset of its middle.
    offset: f64,
    slope: f64,
}

/// A straight line, as its offset at the middle of the edge, metres, and its slope.
#[derive(Debug, Clone, Copy)]
struct Course {
    offset: f64,
    slope: f64,
}

impl Axis {
    fn new([start, end]: [[f64; 2]; 2]) -> Option<Self> {
        let [x, y] = [end[0] - start[0], end[1] - start[1]];
        let length = x.hypot(y);
        let along = [x / length, y / length];
        (length >= LEAST_EDGE_M).then_some(Axis { start, along, normal: [-along[1], along[0]], length })
    }

    /// Returns the coordinates of a place along and across the edge.
    fn local(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [x, y] = [x - self.start[0], y - self.start[1]];
        [x * self.along[0] + y * self.along[1], x * self.normal[0] + y * self.normal[1]]
    }

    fn place(&self, at: f64) -> [f64; 2] {
        [0, 1].map(|axis| self.start[axis] + at * self.along[axis])
    }

    /// Returns the pieces of suspect lines that are near the edge and nearly parallel to it.
    fn pieces(&self, tree: &RTree<Edge>, reach_m: f64, tolerance: &Tolerance) -> Vec<Piece> {
        let margin = END_M.min(END_SHARE * self.length);
        let (first, last) = (margin, self.length - margin);
        let windows = ((last - first) / WINDOW_M).ceil().max(1.0);
        let slope = tolerance.slope + TURN_M / self.length;
        let step = (last - first) / windows;
        let looked = (windows as usize).min(MOST_WINDOWS);
        let mut pieces = Vec::new();
        for window in 0..looked {
            // An edge of very many windows is looked at in some of them, evenly spread.
            let from = first + (window as f64 * windows / looked as f64).floor() * step;
            let to = from + step;
            let (a, b) = (self.place(from), self.place(to));
            let box_of = |pick: fn(f64, f64) -> f64, sign: f64| {
                [0, 1].map(|axis| pick(a[axis], b[axis]) + sign * reach_m)
            };
            let bounds = AABB::from_corners(box_of(f64::min, -1.0), box_of(f64::max, 1.0));
            let near = tree.locate_in_envelope_intersecting(&bounds).take(MOST_SEEN / looked);
            let inside = near.filter_map(|line| {
                let ends = [line.geom().from, line.geom().to].map(|end| self.local(end));
                Piece::between(ends, [from, to], slope).filter(|piece| piece.offset.abs() <= reach_m)
            });
            pieces.extend(inside.take(MOST_PIECES / looked));
        }
        pieces
    }

    fn fit(&self, ends: [u32; 2], pieces: &[Piece], reach_m: f64, tolerance: &Tolerance) -> Option<Offset> {
        let mut course = self.best_proposal(pieces, reach_m, tolerance.width_m)?;
        for _ in 0..ROUNDS {
            course = self.refit(course, pieces, tolerance.width_m);
        }
        let mut offset = Offset {
            ends,
            normal: self.normal,
            products: [0.0; 3],
            sums: [0.0; 2],
            weight: 0.0,
            residual2: 0.0,
        };
        for (at, y, weight) in self.samples(course, pieces, tolerance.width_m) {
            let share = at / self.length;
            let shares = [1.0 - share, share];
            let products = [shares[0] * shares[0], shares[0] * shares[1], shares[1] * shares[1]];
            (0..3).for_each(|i| offset.products[i] += weight * products[i]);
            (0..2).for_each(|i| offset.sums[i] += weight * shares[i] * y);
            offset.weight += weight;
            offset.residual2 += weight * (y - self.value(course, at)).powi(2);
        }
        offset.residual2 /= offset.weight.max(f64::MIN_POSITIVE);
        (offset.weight * ALIKE_M >= tolerance.covered * self.length).then_some(offset)
    }

    fn value(&self, course: Course, at: f64) -> f64 {
        course.offset + course.slope * (at - self.length / 2.0)
    }

    /// Returns coordinate, offset and weight of two places of every piece that lies on a course.
    /// The places are the nodes of Gauss's rule.
    fn samples(
        &self,
        course: Course,
        pieces: &[Piece],
        width_m: f64,
    ) -> impl Iterator<Item = (f64, f64, f64)> {
        pieces.iter().flat_map(move |piece| {
            [-0.5, 0.5].map(|side| {
                let step = side * piece.length / 3f64.sqrt();
                let (at, y) = (piece.at + step, piece.offset + piece.slope * step);
                let residual = (y - self.value(course, at)) / (2.5 * width_m);
                let biweight = (1.0 - residual * residual).max(0.0).powi(2);
                (at, y, biweight * piece.length / (2.0 * ALIKE_M))
            })
        })
    }

    /// Returns the course, among those of the longest pieces, on which most of the pieces lie.
    fn best_proposal(&self, pieces: &[Piece], reach_m: f64, width_m: f64) -> Option<Course> {
        let mut longest: Vec<&Piece> = pieces.iter().collect();
        longest.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.at.total_cmp(&b.at)));
        let of_piece = |piece: &Piece| {
            let sloped = Course {
                offset: piece.offset + piece.slope * (self.length / 2.0 - piece.at),
                slope: piece.slope,
            };
            [sloped, Course { offset: piece.offset, slope: 0.0 }]
        };
        let score = |course: Course| {
            let turn = course.slope * self.length / 2.0;
            let unlikely = (course.offset.powi(2) + turn.powi(2)) / (LIKELY * reach_m).powi(2);
            let covered: f64 = self.samples(course, pieces, width_m).map(|(_, _, weight)| weight).sum();
            covered * (-unlikely / 2.0).exp()
        };
        let courses = longest.into_iter().take(PROPOSALS).flat_map(of_piece);
        let scored = courses.map(|course| (score(course), course));
        scored.max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, course)| course)
    }

    /// Fits a straight line to the pieces on a course. The slope is that of a turn by about
    /// [`TURN_M`].
    fn refit(&self, course: Course, pieces: &[Piece], width_m: f64) -> Course {
        let middle = self.length / 2.0;
        let [mut weight, mut x, mut y, mut xx, mut xy] = [0.0; 5];
        for (at, offset, w) in self.samples(course, pieces, width_m) {
            let at = at - middle;
            weight += w;
            x += w * at;
            y += w * offset;
            xx += w * at * at;
            xy += w * at * offset;
        }
        if weight <= 0.0 {
            return course;
        }
        let prior = (width_m / 2.0 * self.length / TURN_M).powi(2);
        let slope = (xy - x * y / weight) / (xx - x * x / weight + prior);
        Course { offset: (y - slope * x) / weight, slope }
    }
}

impl Piece {
    /// Returns the part of a segment whose coordinate along the edge is in a range, where its slope
    /// is small.
    fn between([p, q]: [[f64; 2]; 2], [from, to]: [f64; 2], most_slope: f64) -> Option<Self> {
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        let slope = dy / dx;
        if dx == 0.0 || slope.abs() > most_slope {
            return None;
        }
        let (low, high) = (p[0].min(q[0]).max(from), p[0].max(q[0]).min(to));
        let at = (low + high) / 2.0;
        (high > low).then_some(Piece { at, length: high - low, offset: p[1] + slope * (at - p[0]), slope })
    }
}
