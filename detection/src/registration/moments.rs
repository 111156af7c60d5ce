//! Recognition of features by the moments of their areas and lengths, for maps whose vertices are
//! new.
//!
//! The moments of a ring's area, and of a line's length, hardly depend on where its vertices lie.
//! Complex moments c_pq = ∫ z^p z̄^q about the centroid turn by known angles with the shape, so
//! their magnitudes and some products are invariant under similarities (Flusser 2000).

use meshmark_core::map_data::Polyline;
use nalgebra::Complex;
use rayon::prelude::*;
use rstar::{RTree, primitives::GeomWithData};
use std::f64::consts::PI;

/// Number of polylines of a map that are compared: the largest ones.
const MOST_POLYLINES: usize = 20_000;
/// So many reference polylines are proposed for one of the suspect.
const PROPOSALS: usize = 4;
/// Order of magnitude of the invariants of real outlines, which makes them comparable.
const SCALES: [f64; INVARIANTS] = [0.1, 0.1, 0.03, 0.02, 0.03, 0.03, 0.03, 0.02];
const INVARIANTS: usize = 8;
/// Nodes and weights of Gauss's rule of three points on 0 to 1, exact up to degree 5.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// A shape of the suspect that may be a shape of the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likeness {
    /// The centroids in suspect and reference, plane of metres.
    pub places: [[f64; 2]; 2],
    /// Size of the reference shape over that of the suspect, as a logarithm.
    pub log_scale: f64,
    /// Directions of the longer axes in suspect and reference, radians from 0 to π.
    pub directions: [f64; 2],
}

/// Returns likely pairs of polylines of a reference and a suspect, whose places `plane` maps to
/// metres.
pub fn likenesses(
    reference: &[Polyline],
    suspect: &[Polyline],
    plane: impl Fn([f64; 2]) -> [f64; 2] + Sync,
) -> Vec<Likeness> {
    let (ours, theirs) = (shapes(reference, &plane), shapes(suspect, &plane));
    let mut found = Vec::new();
    for closed in [true, false] {
        let node = |(i, shape): (usize, &Shape)| GeomWithData::new(shape.invariants, i);
        let nodes = ours.iter().enumerate().filter(|(_, shape)| shape.closed == closed).map(node);
        let tree = RTree::bulk_load(nodes.collect());
        let of_kind: Vec<&Shape> = theirs.iter().filter(|shape| shape.closed == closed).collect();
        let near = |shape: &&Shape| -> Vec<Likeness> {
            let nearest = tree.nearest_neighbor_iter(&shape.invariants).take(PROPOSALS);
            nearest.map(|node| shape.likeness(&ours[node.data])).collect()
        };
        found.par_extend(of_kind.par_iter().flat_map_iter(near));
    }
    found
}

/// The place, size, direction and invariants of a polyline.
struct Shape {
    closed: bool,
    place: [f64; 2],
    /// Square root of the area of a ring, length of a line, metres.
    size: f64,
    direction: f64,
    invariants: [f64; INVARIANTS],
}

impl Shape {
    fn likeness(&self, reference: &Shape) -> Likeness {
        Likeness {
            places: [self.place, reference.place],
            log_scale: (reference.size / self.size).ln(),
            directions: [self.direction, reference.direction],
        }
    }
}

fn shapes(polylines: &[Polyline], plane: &(impl Fn([f64; 2]) -> [f64; 2] + Sync)) -> Vec<Shape> {
    let mut all: Vec<Shape> = polylines.par_iter().filter_map(|polyline| shape(polyline, plane)).collect();
    all.sort_by(|a, b| b.size.total_cmp(&a.size));
    all.truncate(MOST_POLYLINES);
    all
}

fn shape(polyline: &Polyline, plane: impl Fn([f64; 2]) -> [f64; 2]) -> Option<Shape> {
    let place = |p: &[f64; 2]| {
        let [x, y] = plane(*p);
        Complex::new(x, y)
    };
    let first = place(polyline.vertices.first()?);
    let mut places: Vec<Complex<f64>> = polyline.vertices.iter().map(|p| place(p) - first).collect();
    if polyline.closed {
        places.push(places[0]);
    }
    let measure = moment(&places, polyline.closed, 0, 0).re;
    if !(measure.abs() > 0.0 && measure.is_finite()) {
        return None;
    }
    let size = if polyline.closed { measure.abs().sqrt() } else { measure };
    let centroid = moment(&places, polyline.closed, 1, 0) / measure;
    let unit: Vec<Complex<f64>> = places.iter().map(|z| (z - centroid) / size).collect();
    let sign = measure.signum();
    let c = |p, q| moment(&unit, polyline.closed, p, q) * sign;
    let (c20, c30, c21, c40, c31) = (c(2, 0), c(3, 0), c(2, 1), c(4, 0), c(3, 1));
    let values = [
        c(1, 1).re,
        c20.norm(),
        c30.norm(),
        c21.norm(),
        c40.norm(),
        c31.norm(),
        c(2, 2).re,
        // The magnitude of the imaginary part is that of a mirrored shape, too.
        (c20 * c21.conj().powu(2)).re.cbrt() / 3.0,
    ];
    let invariants: [f64; INVARIANTS] = std::array::from_fn(|i| values[i] / SCALES[i]);
    let place = first + centroid;
    invariants.iter().all(|i| i.is_finite()).then_some(Shape {
        closed: polyline.closed,
        place: [place.re, place.im],
        size,
        direction: (c20.arg() / 2.0).rem_euclid(PI),
        invariants,
    })
}

/// Returns ∫ z^p z̄^q over the area within a ring (by Green's theorem, positive where it runs
/// counter-clockwise), or along a line.
fn moment(places: &[Complex<f64>], closed: bool, p: u32, q: u32) -> Complex<f64> {
    let mut sum = Complex::new(0.0, 0.0);
    for ends in places.windows(2) {
        let step = ends[1] - ends[0];
        for (at, weight) in GAUSS {
            let z = ends[0] + step * at;
            sum += match closed {
                true => z.powu(p) * z.conj().powu(q + 1) * step * weight,
                false => z.powu(p) * z.conj().powu(q) * (step.norm() * weight),
            };
        }
    }
    // ∫∫ f dA = 1 / (2 i) ∮ F dz with ∂F/∂z̄ = f.
    if closed { Complex::new(sum.im, -sum.re) * (0.5 / f64::from(q + 1)) } else { sum }
}
