//! Recognition of six neighbouring vertices by their arrangement, for the remains of cut or thinned
//! lines and rings, and for maps of points alone.
//!
//! At unit covariance the vertices of a window differ between maps only by a rotation or
//! reflection, whatever affine map separates them. Products of neighbouring vertices as complex
//! numbers remove the rotation; they are the key for the lookup of windows. A pair of windows then
//! determines an affine map, and the map that most other pairs agree on wins.

use super::affine::Affine;
use meshmark_core::{ground::Ground, map_data::Polyline};
use rayon::prelude::*;
use rstar::{AABB, PointDistance, RTree, RTreeObject, primitives::GeomWithData};

/// Number of vertices of a window.
const SIZE: usize = 6;
/// Length of a key: real and imaginary parts of the products.
const KEY: usize = 2 * (SIZE - 1);
/// Number of windows of the reference that are compared: the largest, which exceed the noise most.
const MOST_REFERENCE: usize = 60_000;
/// Number of windows of the suspect that are looked up.
const MOST_SUSPECT: usize = 1_000;
/// A pair counts when the second-best one is this many times further away.
const DISTINCT: f64 = 1.3;
/// Number of pairs examined for a consensus: the most distinct.
const MOST_PAIRS: usize = 800;
/// Number of pairs whose affine maps are fitted completely.
const MOST_REFITTED: usize = 8;
/// Fewer pairs than this may agree by chance.
const LEAST_AGREEING: usize = 5;
/// Vertices where a line turns by less than this angle, radians, are left out.
const STRAIGHT: f64 = 0.01;

/// The stored order of the vertices of a window.
const PLAIN: [usize; SIZE] = [0, 1, 2, 3, 4, 5];

/// Six neighbouring vertices.
#[derive(Debug, Clone)]
pub struct Window {
    vertices: [[f64; 2]; SIZE],
    /// The vertices at unit covariance, as complex numbers.
    white: [[f64; 2]; SIZE],
    /// Determinant of the covariance; affine maps preserve its order among windows.
    size: f64,
}

/// The arrangement of the vertices of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrangement {
    /// Along a line, from either end.
    Line,
    /// One vertex in the middle, the others around it.
    Star,
}

/// Returns the windows of the lines and rings of a map.
pub fn of_polylines(polylines: &[Polyline]) -> Vec<Window> {
    let of_polyline = |polyline: &Polyline| {
        let vertices = turning(polyline);
        let n = vertices.len();
        let starts = match polyline.closed {
            _ if n < SIZE => 0,
            true => n,
            false => n + 1 - SIZE,
        };
        let window = move |start: usize| {
            Window::new(std::array::from_fn(|i| vertices[(start + i) % n]), Arrangement::Line)
        };
        (0..starts).filter_map(window).collect::<Vec<_>>()
    };
    let mut windows: Vec<Window> = polylines.par_iter().flat_map_iter(of_polyline).collect();
    // Neighbouring polygons share walls and therefore windows.
    let place = |w: &Window| {
        let mut vertices = w.vertices;
        vertices.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        vertices
    };
    windows.sort_by_cached_key(|w| place(w).map(|v| v.map(f64::to_bits)));
    windows.dedup_by_key(|w| place(w));
    windows
}

/// Returns the vertices at which a polyline turns, as edits may add or drop others on straight
/// edges.
fn turning(polyline: &Polyline) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::with_capacity(polyline.vertices.len());
    let turns = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
        let (cross, dot) = (u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1]);
        cross.abs() > STRAIGHT * dot.abs()
    };
    let n = polyline.vertices.len();
    for (i, &vertex) in polyline.vertices.iter().enumerate() {
        let before = match kept.last() {
            Some(&last) => last,
            None if polyline.closed => polyline.vertices[n - 1],
            None => {
                kept.push(vertex);
                continue;
            }
        };
        let after = polyline.vertices[(i + 1) % n];
        if (!polyline.closed && i + 1 == n) || turns(before, vertex, after) {
            kept.push(vertex);
        }
    }
    kept
}

/// Returns the windows of points: each with its five nearest neighbours, anticlockwise. `metric`
/// maps points to the coordinates in which distances are measured.
pub fn of_points(points: &[[f64; 2]], metric: impl Fn([f64; 2]) -> [f64; 2] + Sync) -> Vec<Window> {
    let node = |(index, p): (usize, &[f64; 2])| GeomWithData::new(metric(*p), index as u32);
    let tree = RTree::bulk_load(points.iter().enumerate().map(node).collect());
    let window = |p: &[f64; 2]| {
        let at = metric(*p);
        let nearest: Vec<[f64; 2]> =
            tree.nearest_neighbor_iter(&at).take(SIZE).map(|place| points[place.data as usize]).collect();
        let mut vertices: [[f64; 2]; SIZE] = nearest.try_into().ok()?;
        let centre = vertices[0];
        let angle = |v: &[f64; 2]| (v[1] - centre[1]).atan2(v[0] - centre[0]);
        vertices[1..].sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        Window::new(vertices, Arrangement::Star)
    };
    points.par_iter().filter_map(window).collect()
}

impl Window {
    /// Creates a window; returns `None` when the vertices lie on a line.
    fn new(vertices: [[f64; 2]; SIZE], arrangement: Arrangement) -> Option<Self> {
        let centre = centre(&vertices);
        let centred = vertices.map(|v| [v[0] - centre[0], v[1] - centre[1]]);
        let sum = |f: fn(&[f64; 2]) -> f64| centred.iter().map(f).sum::<f64>() / SIZE as f64;
        let (xx, xy, yy) = (sum(|v| v[0] * v[0]), sum(|v| v[0] * v[1]), sum(|v| v[1] * v[1]));
        let size = xx * yy - xy * xy;
        if size.is_nan() || size <= 1e-8 * (xx + yy).powi(2) {
            return None;
        }
        // Any root of the covariance serves, as roots differ by a rotation; this is the Cholesky
        // factor.
        let a = xx.sqrt();
        let b = xy / a;
        let c = (yy - b * b).sqrt();
        let white = centred.map(|v| [v[0] / a, (v[1] - b / a * v[0]) / c]);
        let order = arrangement.canonical(&white);
        Some(Window { vertices: order.map(|i| vertices[i]), white: order.map(|i| white[i]), size })
    }

    /// Returns the key of the vertices in another order, optionally mirrored.
    fn key(&self, order: &[usize; SIZE], mirrored: bool) -> [f64; KEY] {
        let sign = if mirrored { -1.0 } else { 1.0 };
        let mut key = [0.0; KEY];
        for (i, product) in key.chunks_mut(2).enumerate() {
            let (p, q) = (self.white[order[i]], self.white[order[i + 1]]);
            product[0] = p[0] * q[0] + p[1] * q[1];
            product[1] = sign * (p[1] * q[0] - p[0] * q[1]);
        }
        key
    }
}

fn centre(vertices: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| vertices.iter().map(|v| v[axis]).sum::<f64>() / vertices.len() as f64)
}

impl Arrangement {
    /// Returns an order that all maps agree on: it starts from the end, or the neighbour, that is
    /// further out at unit covariance.
    fn canonical(self, white: &[[f64; 2]; SIZE]) -> [usize; SIZE] {
        let out = |i: usize| white[i][0].powi(2) + white[i][1].powi(2);
        match self {
            Arrangement::Line if out(0) >= out(SIZE - 1) => PLAIN,
            Arrangement::Line => std::array::from_fn(|i| SIZE - 1 - i),
            Arrangement::Star => {
                let furthest = (1..SIZE).max_by(|&a, &b| out(a).total_cmp(&out(b))).expect("five neighbours");
                std::array::from_fn(|i| if i == 0 { 0 } else { 1 + (furthest + i - 2) % (SIZE - 1) })
            }
        }
    }

    /// Returns the order of the same vertices in a mirrored map.
    fn mirrored(self) -> [usize; SIZE] {
        match self {
            Arrangement::Line => PLAIN,
            Arrangement::Star => std::array::from_fn(|i| if i < 2 { i } else { SIZE + 1 - i }),
        }
    }
}

struct Node {
    key: [f64; KEY],
    index: u32,
}

impl RTreeObject for Node {
    type Envelope = AABB<[f64; KEY]>;
    fn envelope(&self) -> Self::Envelope {
        AABB::from_point(self.key)
    }
}

impl PointDistance for Node {
    fn distance_2(&self, p: &[f64; KEY]) -> f64 {
        self.key.iter().zip(p).map(|(a, b)| (a - b).powi(2)).sum()
    }
}

/// A window of the suspect and the most similar one of the reference.
struct Pair {
    from: [[f64; 2]; SIZE],
    to: [[f64; 2]; SIZE],
    affine: Affine,
    /// Square of the ratio of the second-best distance to the best.
    distinct: f64,
}

/// Returns affine maps from the suspect to the reference on which several pairs of windows agree,
/// and the number of those pairs. `within_m` is the largest distance of agreeing places, metres.
pub fn candidates(
    reference: Vec<Window>,
    suspect: Vec<Window>,
    arrangement: Arrangement,
    ground: &Ground,
    within_m: f64,
) -> Vec<(Affine, usize)> {
    let pairs = pairs(&largest(reference, MOST_REFERENCE), &spread(suspect), arrangement);
    let agreeing = |affine: &Affine, about: [f64; 2], slope: f64| -> Vec<&Pair> {
        let agrees = |pair: &&Pair| {
            let (from, to) = (centre(&pair.from), centre(&pair.to));
            let length = |a: [f64; 2], b: [f64; 2]| {
                let [dx, dy] = ground.metres_between(a, b);
                dx.hypot(dy)
            };
            length(to, affine.apply(from)) <= within_m + slope * length(to, about)
        };
        pairs.iter().filter(agrees).collect()
    };
    // A window is small, so the error of its map grows with the distance from it.
    let mut votes: Vec<(usize, usize)> = (0..pairs.len())
        .into_par_iter()
        .map(|i| (agreeing(&pairs[i].affine, centre(&pairs[i].to), 0.1).len(), i))
        .collect();
    votes.sort_by_key(|(votes, i)| (std::cmp::Reverse(*votes), *i));
    let refit = |&(_, i): &(usize, usize)| {
        let about = centre(&pairs[i].to);
        let unit = ground.metres_per_unit(about);
        let mut affine = pairs[i].affine;
        let mut count = 0;
        for slope in [0.1, 0.05, 0.02, 0.01, 0.0] {
            let agreeing = agreeing(&affine, about, slope);
            count = agreeing.len();
            let from: Vec<_> = agreeing.iter().flat_map(|pair| pair.from).collect();
            let to: Vec<_> = agreeing.iter().flat_map(|pair| pair.to).collect();
            affine = Affine::fit_robustly(&from, &to, 0.01 / unit[0].max(unit[1]))?;
        }
        (count >= LEAST_AGREEING).then_some((affine, count))
    };
    let mut found: Vec<(Affine, usize)> = votes.iter().take(MOST_REFITTED).filter_map(refit).collect();
    found.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    found.truncate(3);
    found.dedup_by(|a, b| a.0 == b.0);
    found
}

fn largest(mut windows: Vec<Window>, most: usize) -> Vec<Window> {
    windows.sort_by(|a, b| b.size.total_cmp(&a.size));
    windows.truncate(most);
    windows
}

/// Selects windows to look up: half of them are the largest, the others are spread over smaller
/// ones.
fn spread(windows: Vec<Window>) -> Vec<Window> {
    let windows = largest(windows, MOST_REFERENCE / 4);
    let half = MOST_SUSPECT / 2;
    let step = (windows.len().saturating_sub(half)).div_ceil(half).max(1);
    let chosen = |i: usize| i < half || (i - half).is_multiple_of(step);
    windows.into_iter().enumerate().filter(|(i, _)| chosen(*i)).map(|(_, window)| window).collect()
}

/// Returns the distinct pairs of similar windows, the most distinct first.
fn pairs(reference: &[Window], suspect: &[Window], arrangement: Arrangement) -> Vec<Pair> {
    let node = |(index, w): (usize, &Window)| Node { key: w.key(&PLAIN, false), index: index as u32 };
    let tree = RTree::bulk_load(reference.iter().enumerate().map(node).collect());
    let orders = [(PLAIN, false), (arrangement.mirrored(), true)];
    let pair = |window: &Window| {
        let mut nearest: Vec<(f64, u32, usize)> = Vec::new();
        for (i, (order, mirrored)) in orders.iter().enumerate() {
            let two = tree.nearest_neighbor_iter_with_distance_2(&window.key(order, *mirrored)).take(2);
            nearest.extend(two.map(|(node, distance)| (distance, node.index, i)));
        }
        nearest.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let &(distance, index, order) = nearest.first()?;
        // A symmetric window is similar to itself in several orders and carries no information.
        let distinct = nearest.get(1).map_or(f64::INFINITY, |next| next.0 / distance);
        let from = orders[order].0.map(|i| window.vertices[i]);
        let to = reference[index as usize].vertices;
        let affine = Affine::fit(&from, &to, &[1.0; SIZE])?;
        (distinct > DISTINCT * DISTINCT).then_some(Pair { from, to, affine, distinct })
    };
    let mut pairs: Vec<Pair> = suspect.par_iter().filter_map(pair).collect();
    pairs.sort_by(|a, b| b.distinct.total_cmp(&a.distinct));
    pairs.truncate(MOST_PAIRS);
    pairs
}
