//! Registration by the course of lines, for suspects whose vertices are new: the lines of the
//! suspect are laid on nearby parallel lines of the reference (closest points along normals, Chen
//! and Medioni 1992).

use super::affine::Affine;
use crate::{
    linework::{Edge, Plane},
    matching::{OUT_OF_PLACE, is_chance},
};
use meshmark_core::map_data::MapData;
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;
use rstar::{PointDistance, RTree};

/// Number of suspect segments that are laid on the reference; more do not improve it.
const SAMPLE: usize = 20_000;
/// So many edges near a sample are looked at for a parallel one.
const LOOKED_AT: usize = 12;
/// Cosine of the largest angle between parallel lines.
const PARALLEL: f64 = 0.95;
/// At least this share of the lines of a registered suspect are laid.
const AGREE: f64 = 0.3;
/// Distances below this have equal weight, metres.
const LEAST_DISTANCE_M: f64 = 0.05;
/// Reaches of the rounds, in matching radii.
const REACHES: [f64; 8] = [8.0, 4.0, 4.0, 2.0, 1.0, 1.0, 1.0, 1.0];

/// The middle of a segment of the suspect and its direction, plane of metres.
struct Sample {
    place: [f64; 2],
    along: [f64; 2],
}

/// The lines of a suspect and those of its reference, in the plane of the reference.
pub struct Curves {
    plane: Plane,
    edges: RTree<Edge>,
    samples: Vec<Sample>,
    radius_m: f64,
}

/// Lines that lie on lines of the reference under an affine map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Laid {
    /// The map in the plane of metres.
    pub affine: Affine,
    /// Number of samples within the matching radius.
    pub count: usize,
    /// Root mean square of their distances, metres.
    pub rms_m: f64,
}

impl Curves {
    /// Prepares a reference and a suspect.
    pub fn new(reference: &MapData, suspect: &MapData, plane: Plane, radius_m: f64) -> Self {
        let edges = plane.tree(reference.vertices.coords(), reference.segments.iter().copied());
        let coords = suspect.vertices.coords();
        let step = suspect.segments.len().div_ceil(SAMPLE).max(1);
        let sample = |ends: &[u32; 2]| {
            let [a, b] = ends.map(|vertex| plane.at(coords[vertex as usize]));
            Sample {
                place: [0, 1].map(|axis| (a[axis] + b[axis]) / 2.0),
                along: [0, 1].map(|axis| b[axis] - a[axis]),
            }
        };
        let samples = suspect.segments.iter().step_by(step).map(sample).collect();
        Curves { plane, edges, samples, radius_m }
    }

    /// Returns the number of lines of the suspect that are laid.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Returns the coefficients in CRS units of an affine map of the plane.
    pub fn in_units(&self, Affine { coefficients: [a, b, c, d, e, f] }: Affine) -> [f64; 6] {
        let Plane { centre: [x, y], unit_m: [u, v] } = self.plane;
        let (b, d) = (b * v / u, d * u / v);
        [a, b, c / u + x - a * x - b * y, d, e, f / v + y - d * x - e * y]
    }

    /// Returns how the suspect lies on the reference under an affine map.
    pub fn laid(&self, affine: Affine) -> Laid {
        let found = self.offsets(affine, self.radius_m);
        let squares: f64 = found.iter().map(|offset| offset.distance_m.powi(2)).sum();
        Laid { affine, count: found.len(), rms_m: (squares / found.len().max(1) as f64).sqrt() }
    }

    /// Returns whether more lines agree than by chance, and more than [`AGREE`] of them.
    pub fn agrees(&self, laid: &Laid) -> bool {
        let [a, b, c, d, e, f] = laid.affine.coefficients;
        let [x, y] = OUT_OF_PLACE.map(|reaches| reaches * self.radius_m);
        let shifted = self.laid(Affine { coefficients: [a, b, c + x, d, e, f + y] });
        laid.count as f64 >= AGREE * self.len() as f64 && !is_chance(laid.count, shifted.count)
    }

    /// Refines an affine map; the best of all rounds.
    pub fn refine(&self, start: Affine) -> Laid {
        let mut best = self.laid(start);
        let mut affine = start;
        for reach in REACHES {
            let Some(next) = fit(affine, &self.offsets(affine, reach * self.radius_m)) else { break };
            affine = next;
            let laid = self.laid(affine);
            if (laid.count, -laid.rms_m) > (best.count, -best.rms_m) {
                best = laid;
            }
        }
        best
    }

    fn offsets(&self, affine: Affine, reach_m: f64) -> Vec<Offset> {
        self.samples.par_iter().filter_map(|sample| self.offset(sample, affine, reach_m)).collect()
    }

    /// Returns the offset of a sample from the nearest parallel edge within reach.
    fn offset(&self, sample: &Sample, affine: Affine, reach_m: f64) -> Option<Offset> {
        let place = affine.apply(sample.place);
        let [a, b, _, d, e, _] = affine.coefficients;
        let [x, y] = sample.along;
        let along = unit([a * x + b * y, d * x + e * y])?;
        let near = self.edges.nearest_neighbor_iter(&place).take(LOOKED_AT);
        let mut near = near.take_while(|edge| edge.geom().distance_2(&place) <= reach_m * reach_m);
        near.find_map(|edge| {
            let [from, to] = [edge.geom().from, edge.geom().to];
            let course = unit([to[0] - from[0], to[1] - from[1]])?;
            let is_parallel = (along[0] * course[0] + along[1] * course[1]).abs() >= PARALLEL;
            let normal = [-course[1], course[0]];
            let distance_m = (from[0] - place[0]) * normal[0] + (from[1] - place[1]) * normal[1];
            is_parallel.then_some(Offset { from: sample.place, normal, distance_m })
        })
    }
}

/// The distance from a place of the suspect to an edge along the normal of the edge.
struct Offset {
    from: [f64; 2],
    normal: [f64; 2],
    distance_m: f64,
}

fn unit([x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let length = x.hypot(y);
    (length > 0.0 && length.is_finite()).then(|| [x / length, y / length])
}

/// Returns the affine map that brings the places to their edges with about the least sum of
/// distances.
fn fit(affine: Affine, offsets: &[Offset]) -> Option<Affine> {
    let count = offsets.len() as f64;
    let centre = [0, 1].map(|axis| offsets.iter().map(|offset| offset.from[axis]).sum::<f64>() / count);
    let spread =
        offsets.iter().flat_map(|offset| [0, 1].map(|axis| (offset.from[axis] - centre[axis]).abs()));
    let scale = spread.fold(0.0, f64::max);
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let (mut normal, mut right) = (Matrix6::<f64>::zeros(), Vector6::<f64>::zeros());
    for offset in offsets {
        let [x, y] = [0, 1].map(|axis| (offset.from[axis] - centre[axis]) / scale);
        let [u, v] = offset.normal;
        let row = Vector6::new(u * x, u * y, u, v * x, v * y, v);
        let weight = 1.0 / offset.distance_m.abs().max(LEAST_DISTANCE_M);
        normal += row * row.transpose() * weight;
        right += row * (weight * offset.distance_m);
    }
    let condition = normal.symmetric_eigenvalues();
    if condition.min() <= 1e-9 * condition.max() {
        return None;
    }
    let s = normal.cholesky()?.solve(&right);
    let step = |i: usize| {
        let (a, b) = (s[i] / scale, s[i + 1] / scale);
        [a, b, s[i + 2] - a * centre[0] - b * centre[1]]
    };
    let ([a, b, c], [d, e, f]) = (step(0), step(3));
    let [p, q, r, t, u, v] = affine.coefficients;
    Some(Affine { coefficients: [p + a, q + b, r + c, t + d, u + e, v + f] })
}
