//! Recognition of features by their shape, for maps without usable attributes.
//!
//! The triangles of neighbouring vertices of a ring have areas whose ratio to the area of the ring
//! is invariant under affine maps, reflections included. Rings with equal sequences of these ratios
//! are the same feature. A line has no area, so the sum of the triangles replaces it.

use meshmark_core::map_data::Polyline;

/// Number of polylines of a map that are compared: those with the most vertices, which differ most.
const MOST_POLYLINES: usize = 3000;
/// A pair counts when the second-best one is this many times further away (idea of Lowe 2004).
const DISTINCT: f64 = 2.5;
/// Sums of squares below this count as equal, so that rounding does not distinguish row houses.
const SAME: f64 = 1e-6;
/// Longer rings and lines are skipped, as the effort grows with the square of the number of
/// vertices.
const MOST_VERTICES: usize = 1000;
/// Vertices whose triangle has less than this share of the area are left out, as edits may add or
/// drop them.
const STRAIGHT: f64 = 2e-3;
/// A ring of fewer remaining vertices is not distinctive.
const LEAST_VERTICES: usize = Polyline::LEAST_VERTICES;

/// Returns pairs of places (suspect, reference) of polylines that most likely correspond.
pub fn pairs(reference: &[Polyline], suspect: &[Polyline]) -> Vec<[[f64; 2]; 2]> {
    let (ours, theirs) = (signatures(reference), signatures(suspect));
    let forward = best(&theirs, &ours);
    let backward = best(&ours, &theirs);
    let mutual = forward.iter().enumerate().filter_map(|(i, partner)| {
        let j = (*partner)?;
        (backward[j] == Some(i)).then(|| [theirs[i].place, ours[j].place])
    });
    mutual.collect()
}

/// The affine invariants of a polyline, and its place.
struct Signature {
    closed: bool,
    /// One share of the area for each vertex that is kept.
    areas: Vec<f64>,
    /// Mean of these vertices, CRS units.
    place: [f64; 2],
}

fn signatures(polylines: &[Polyline]) -> Vec<Signature> {
    let mut all: Vec<Signature> = polylines.iter().filter_map(signature).collect();
    // A stable sort keeps the order of the file among equal counts, which matters only beyond the
    // limit.
    all.sort_by_key(|s| std::cmp::Reverse(s.areas.len()));
    all.truncate(MOST_POLYLINES);
    all
}

fn signature(polyline: &Polyline) -> Option<Signature> {
    if polyline.vertices.len() > MOST_VERTICES {
        return None;
    }
    let mut vertices = polyline.vertices.clone();
    let (mut areas, mut total) = areas(&vertices, polyline.closed);
    // The straightest vertex goes first, as each removal changes its neighbours (Visvalingam,
    // Whyatt 1993).
    while vertices.len() >= LEAST_VERTICES {
        let inner = (0..vertices.len()).filter(|&i| !is_end(i, vertices.len(), polyline.closed));
        let straightest = inner.min_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs()))?;
        if areas[straightest].abs() > STRAIGHT * total.abs() {
            break;
        }
        vertices.remove(straightest);
        (areas, total) = self::areas(&vertices, polyline.closed);
    }
    if vertices.len() < LEAST_VERTICES || total == 0.0 || !total.is_finite() {
        return None;
    }
    let count = vertices.len() as f64;
    let mean = |axis: usize| vertices.iter().map(|v| v[axis]).sum::<f64>() / count;
    let place = [mean(0), mean(1)];
    Some(Signature { closed: polyline.closed, areas: areas.iter().map(|a| a / total).collect(), place })
}

fn is_end(i: usize, count: usize, closed: bool) -> bool {
    !closed && (i == 0 || i + 1 == count)
}

/// Returns twice the signed area of the triangle at every vertex (0 at the ends of a line) and the
/// total: that of the ring, or the sum over a line.
fn areas(vertices: &[[f64; 2]], closed: bool) -> (Vec<f64>, f64) {
    let n = vertices.len();
    let cross =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    let at = |i: usize| match is_end(i, n, closed) {
        true => 0.0,
        false => cross(vertices[(i + n - 1) % n], vertices[i], vertices[(i + 1) % n]),
    };
    let areas: Vec<f64> = (0..n).map(at).collect();
    let whole = match closed {
        true => vertices.windows(2).map(|w| cross(vertices[0], w[0], w[1])).sum(),
        false => areas.iter().map(|a| a.abs()).sum(),
    };
    (areas, whole)
}

/// Returns for each signature of `these` the distinctly most similar one of `those`.
fn best(these: &[Signature], those: &[Signature]) -> Vec<Option<usize>> {
    use rayon::prelude::*;
    let find = |a: &Signature| {
        let mut nearest = (f64::INFINITY, None);
        let mut second = f64::INFINITY;
        for (j, b) in those.iter().enumerate() {
            if a.closed != b.closed || a.areas.len() != b.areas.len() {
                continue;
            }
            let distance = distance(a, b, second);
            if distance < nearest.0 {
                second = nearest.0;
                nearest = (distance, Some(j));
            } else {
                second = second.min(distance);
            }
        }
        nearest.1.filter(|_| second > (nearest.0 * DISTINCT * DISTINCT).max(SAME))
    };
    these.par_iter().map(find).collect()
}

/// Returns the least sum of squares over all alignments of two sequences: any start and direction
/// for rings, either direction and sign for lines. The search stops beyond `limit`.
fn distance(a: &Signature, b: &Signature, limit: f64) -> f64 {
    let n = a.areas.len();
    let starts = if a.closed { n } else { 1 };
    let signs: &[f64] = if a.closed { &[1.0] } else { &[1.0, -1.0] };
    let mut least = f64::INFINITY;
    for start in 0..starts {
        for &sign in signs {
            for backward in [false, true] {
                let mut sum = 0.0;
                for i in 0..n {
                    let j = if backward { (start + 2 * n - 1 - i) % n } else { (start + i) % n };
                    sum += (a.areas[i] - sign * b.areas[j]).powi(2);
                    if sum >= least.min(limit) {
                        break;
                    }
                }
                least = least.min(sum);
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::Affine;

    /// Returns a ring of 8 vertices that differs for every seed.
    fn ring(seed: u64) -> Polyline {
        let noise =
            |i: u64| ((seed * 31 + i).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / 2f64.powi(24);
        let vertex = |i: u64| {
            let angle = i as f64 / 8.0 * std::f64::consts::TAU;
            let radius = 5.0 + 5.0 * noise(i);
            [100.0 * seed as f64 + radius * angle.cos(), 70.0 * noise(99) + radius * angle.sin()]
        };
        Polyline { vertices: (0..8).map(vertex).collect(), closed: true }
    }

    #[test]
    fn mirrored_turned_rings_with_another_start_and_direction_are_recognised() {
        let reference: Vec<Polyline> = (0..20).map(ring).collect();
        let affine = Affine { coefficients: [-0.6, 0.3, 900.0, 0.2, 1.4, -50.0] };
        let mut suspect = reference.clone();
        for (i, polyline) in suspect.iter_mut().enumerate() {
            polyline.vertices.iter_mut().for_each(|v| *v = affine.apply(*v));
            polyline.vertices.rotate_left(i % 8);
            if i % 2 == 1 {
                polyline.vertices.reverse();
            }
        }
        suspect.rotate_left(7);
        let pairs = pairs(&reference, &suspect);
        assert_eq!(pairs.len(), 20);
        for [from, to] in pairs {
            let back = affine.apply(to);
            assert!((back[0] - from[0]).abs() < 1e-9 && (back[1] - from[1]).abs() < 1e-9);
        }
    }

    #[test]
    fn vertices_added_on_edges_do_not_matter() {
        let reference: Vec<Polyline> = (0..5).map(ring).collect();
        let mut suspect = reference.clone();
        for polyline in &mut suspect {
            let middle = |a: [f64; 2], b: [f64; 2]| [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0];
            polyline.vertices.insert(3, middle(polyline.vertices[2], polyline.vertices[3]));
        }
        assert_eq!(pairs(&reference, &suspect).len(), 5);
    }

    #[test]
    fn equal_rings_are_not_told_apart() {
        let mut reference: Vec<Polyline> = (0..2).map(|_| ring(1)).collect();
        reference[1].vertices.iter_mut().for_each(|v| v[0] += 500.0);
        assert_eq!(pairs(&reference, &reference).len(), 0);
    }
}
