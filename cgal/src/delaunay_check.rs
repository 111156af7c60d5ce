//! Checks of Delaunay triangulations by exact predicates. They share no code with what they check.
//!
//! Points must be distinct and finite. `robust`'s predicates are exact unless products of
//! coordinate differences underflow or overflow, which no map comes near.

use robust::{Coord, incircle, orient2d};
use std::cmp::Ordering;
use std::collections::{HashMap, HashSet};

type Point = [f64; 2];

/// Whether `edges` (pairs i < j, sorted) are those of a Delaunay triangulation of `points`. Points
/// on one straight line have no triangle; their edges must join neighbours on the line.
///
/// # Errors
/// A sentence that names an edge, a vertex or a count that a Delaunay triangulation cannot have.
pub fn is_delaunay(points: &[Point], edges: &[[u32; 2]]) -> Result<(), String> {
    delaunay_triangulation(points, edges).map(|_| ())
}

/// How many edges of `ours` are not in `theirs`, when both are Delaunay triangulations of `points`
/// and every edge that only one of them has is a diagonal of a quadrilateral whose corners lie on
/// one circle: there, and nowhere else, a point set has more than one Delaunay triangulation.
///
/// # Errors
/// A sentence that says which of the two fails, and why.
pub fn differing_edges_are_cocircular(
    points: &[Point],
    ours: &[[u32; 2]],
    theirs: &[[u32; 2]],
) -> Result<usize, String> {
    let our_mesh = delaunay_triangulation(points, ours).map_err(|e| format!("ours: {e}"))?;
    let their_mesh = delaunay_triangulation(points, theirs).map_err(|e| format!("theirs: {e}"))?;
    count_cocircular(&their_mesh, &missing_from(ours, theirs)).map_err(|e| format!("theirs: {e}"))?;
    count_cocircular(&our_mesh, &missing_from(theirs, ours)).map_err(|e| format!("ours: {e}"))
}

fn missing_from(others: &[[u32; 2]], edges: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let others: HashSet<_> = others.iter().collect();
    edges.iter().filter(|e| !others.contains(e)).copied().collect()
}

/// Each differing edge is judged within its own triangulation: of five or more points on a circle
/// the other one may not even have a quadrilateral around it.
fn count_cocircular(mesh: &Triangulation, differing: &[[u32; 2]]) -> Result<usize, String> {
    for edge in differing {
        match mesh.incircle(*edge) {
            Some(0.0) => (),
            Some(_) => return Err(format!("edge {edge:?} differs, but lies on no common circle")),
            None => return Err(format!("edge {edge:?} differs, but has no quadrilateral")),
        }
    }
    Ok(differing.len())
}

/// A locally Delaunay triangulation is Delaunay (Delaunay's lemma), so the quadrilaterals of the
/// edges tell it all.
fn delaunay_triangulation<'a>(points: &'a [Point], edges: &[[u32; 2]]) -> Result<Triangulation<'a>, String> {
    let triangulation = Triangulation::new(points, edges)?;
    let violates = |edge: &&[u32; 2]| triangulation.incircle(**edge).is_some_and(|d| d > 0.0);
    match edges.iter().find(violates) {
        Some(edge) => Err(format!("edge {edge:?} is not Delaunay: a circumcircle holds a vertex")),
        None => Ok(triangulation),
    }
}

/// The triangles that a set of edges cuts the convex hull into.
struct Triangulation<'a> {
    points: &'a [Point],
    /// Half-edge [u, v] → the third corner of the triangle on its left; none on the hull's outside.
    apex: HashMap<[u32; 2], u32>,
}

impl<'a> Triangulation<'a> {
    /// Every bounded face must be a counterclockwise triangle, and the outer face that of the hull.
    /// This proves that no edges cross: the boundaries of all triangles add up to the hull's
    /// boundary, which winds once around every point inside, so one triangle covers it.
    fn new(points: &'a [Point], edges: &[[u32; 2]]) -> Result<Self, String> {
        check_form(points, edges)?;
        let order = lexicographic_order(points)?;
        if all_collinear(points, &order) {
            check_chain(&order, edges)?;
            return Ok(Triangulation { points, apex: HashMap::new() });
        }
        let hull = convex_hull(points, &order);
        check_count(points.len(), hull.len(), edges.len())?;
        let apex = triangles(points, &next_half_edges(&rings(points, edges)?));
        check_outer_face(&hull, edges, &apex)?;
        Ok(Triangulation { points, apex })
    }

    /// Positive when the two corners facing the edge violate the empty-circle rule, zero when its
    /// quadrilateral is cocircular, none when the edge has no triangle on one side.
    fn incircle(&self, [i, j]: [u32; 2]) -> Option<f64> {
        let (left, right) = (self.apex.get(&[i, j])?, self.apex.get(&[j, i])?);
        let [a, b, c, d] = [i, j, *left, *right].map(|v| coord(self.points[v as usize]));
        Some(incircle(a, b, c, d))
    }
}

fn check_form(points: &[Point], edges: &[[u32; 2]]) -> Result<(), String> {
    if let Some(i) = points.iter().position(|p| !p[0].is_finite() || !p[1].is_finite()) {
        return Err(format!("point {i} is not finite"));
    }
    if let Some([i, j]) = edges.iter().find(|[i, j]| i >= j || *j as usize >= points.len()) {
        return Err(format!("edge [{i}, {j}] is no pair i < j < {}", points.len()));
    }
    match edges.windows(2).find(|pair| pair[0] >= pair[1]) {
        Some(pair) => Err(format!("edge {:?} is given twice or out of order", pair[1])),
        None => Ok(()),
    }
}

fn lexicographic_order(points: &[Point]) -> Result<Vec<u32>, String> {
    let at = |i: &u32| points[*i as usize];
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_by(|i, j| at(i).partial_cmp(&at(j)).expect("finite").then(i.cmp(j)));
    match order.windows(2).find(|pair| at(&pair[0]) == at(&pair[1])) {
        Some(pair) => Err(format!("points {} and {} are equal", pair[0], pair[1])),
        None => Ok(order),
    }
}

fn all_collinear(points: &[Point], order: &[u32]) -> bool {
    let (Some(&first), Some(&last)) = (order.first(), order.last()) else { return true };
    order.iter().all(|&i| orientation(points, [first, last, i]) == 0.0)
}

fn check_chain(order: &[u32], edges: &[[u32; 2]]) -> Result<(), String> {
    let joined = |pair: &[u32]| [pair[0].min(pair[1]), pair[0].max(pair[1])];
    let mut chain: Vec<_> = order.windows(2).map(joined).collect();
    chain.sort_unstable();
    if chain == edges {
        return Ok(());
    }
    Err("the points lie on one straight line, but the edges do not join its neighbours".into())
}

/// Euler's formula for a triangulation of n points, h of them on the hull.
fn check_count(n: usize, h: usize, edges: usize) -> Result<(), String> {
    let expected = 3 * n - 3 - h;
    if edges == expected {
        return Ok(());
    }
    Err(format!("{edges} edges, but a triangulation of {n} points, {h} on the hull, has {expected}"))
}

/// The hull counterclockwise, collinear points included (monotone chain).
fn convex_hull(points: &[Point], order: &[u32]) -> Vec<u32> {
    let mut hull = half_hull(points, order.iter());
    hull.extend(half_hull(points, order.iter().rev()));
    hull
}

/// The chain from the first point to the last, without the last, everything to its left.
fn half_hull<'i>(points: &[Point], order: impl Iterator<Item = &'i u32>) -> Vec<u32> {
    let mut chain: Vec<u32> = Vec::new();
    for &i in order {
        while let [.., a, b] = chain[..]
            && orientation(points, [a, b, i]) < 0.0
        {
            chain.pop();
        }
        chain.push(i);
    }
    chain.pop();
    chain
}

/// The neighbours of every vertex, counterclockwise.
fn rings(points: &[Point], edges: &[[u32; 2]]) -> Result<Vec<Vec<u32>>, String> {
    let mut rings = vec![Vec::new(); points.len()];
    for &[i, j] in edges {
        rings[i as usize].push(j);
        rings[j as usize].push(i);
    }
    for (ring, centre) in rings.iter_mut().zip(0..) {
        ring.sort_by(|&a, &b| by_angle(points, centre, a, b));
        let same = |pair: &&[u32]| by_angle(points, centre, pair[0], pair[1]) == Ordering::Equal;
        if let Some(pair) = ring.windows(2).find(same) {
            return Err(format!("edges from {centre} to {} and {} overlap", pair[0], pair[1]));
        }
    }
    Ok(rings)
}

/// Compares the directions from `centre` to `a` and to `b`, counterclockwise from the x axis.
fn by_angle(points: &[Point], centre: u32, a: u32, b: u32) -> Ordering {
    let [x, y] = points[centre as usize];
    let lower_half = |v: u32| {
        let [vx, vy] = points[v as usize];
        vy < y || (vy == y && vx < x)
    };
    let turn = orientation(points, [centre, a, b]);
    lower_half(a).cmp(&lower_half(b)).then(0.0.partial_cmp(&turn).expect("finite"))
}

/// Half-edge [u, v] → the half-edge's end after v, on the face to the left: the neighbour of v
/// that comes clockwise after u.
fn next_half_edges(rings: &[Vec<u32>]) -> HashMap<[u32; 2], u32> {
    let mut next = HashMap::new();
    for (ring, v) in rings.iter().zip(0..) {
        for (k, &u) in ring.iter().enumerate() {
            next.insert([u, v], ring[(k + ring.len() - 1) % ring.len()]);
        }
    }
    next
}

/// Half-edge → apex for all faces that are counterclockwise triangles.
fn triangles(points: &[Point], next: &HashMap<[u32; 2], u32>) -> HashMap<[u32; 2], u32> {
    let closes = |u, v, w| next[&[v, w]] == u && next[&[w, u]] == v;
    let is_triangle = |&(&[u, v], &w): &(&[u32; 2], &u32)| {
        w != u && closes(u, v, w) && orientation(points, [u, v, w]) > 0.0
    };
    next.iter().filter(is_triangle).map(|(edge, apex)| (*edge, *apex)).collect()
}

/// The half-edges without a triangle must be the hull's, clockwise.
fn check_outer_face(hull: &[u32], edges: &[[u32; 2]], apex: &HashMap<[u32; 2], u32>) -> Result<(), String> {
    let after = hull.iter().cycle().skip(1);
    let expected: HashSet<_> = hull.iter().zip(after).map(|(u, v)| [*v, *u]).collect();
    let half_edges = edges.iter().flat_map(|&[i, j]| [[i, j], [j, i]]);
    let outer: HashSet<_> = half_edges.filter(|e| !apex.contains_key(e)).collect();
    match outer.symmetric_difference(&expected).next() {
        Some([u, v]) => Err(format!("beside the edge {u}-{v} is neither a triangle nor the hull")),
        None => Ok(()),
    }
}

/// Positive when the three points turn counterclockwise, zero when they are collinear.
fn orientation(points: &[Point], corners: [u32; 3]) -> f64 {
    let [a, b, c] = corners.map(|v| coord(points[v as usize]));
    orient2d(a, b, c)
}

fn coord([x, y]: Point) -> Coord<f64> {
    Coord { x, y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::{ChaCha20Rng, rand_core::Rng, rand_core::SeedableRng};

    const SQUARE: [Point; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    const KITE: [Point; 4] = [[0.0, 0.0], [2.0, -1.0], [4.0, 0.0], [2.0, 1.0]];
    const DIAGONAL_02: [[u32; 2]; 5] = [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]];
    const DIAGONAL_13: [[u32; 2]; 5] = [[0, 1], [0, 3], [1, 2], [1, 3], [2, 3]];

    fn random_points(count: usize, side: u32, seed: u64) -> Vec<Point> {
        let mut rng = ChaCha20Rng::seed_from_u64(seed);
        let mut coordinate = || f64::from(rng.next_u32() % side);
        let mut points = Vec::new();
        while points.len() < count {
            let point = [coordinate(), coordinate()];
            if !points.contains(&point) {
                points.push(point);
            }
        }
        points
    }

    /// All edges with an empty circle through their ends, by trying every third corner: the
    /// Delaunay triangulation when no four points are cocircular.
    fn delaunay_by_brute_force(points: &[Point]) -> Vec<[u32; 2]> {
        let all = 0..points.len() as u32;
        let empty = |corners: [u32; 3]| {
            let [a, b, c] = corners.map(|v| coord(points[v as usize]));
            orient2d(a, b, c) > 0.0 && points.iter().all(|&d| incircle(a, b, c, coord(d)) <= 0.0)
        };
        let is_edge = |i, j| all.clone().any(|k| empty([i, j, k]) || empty([j, i, k]));
        let pairs = all.clone().flat_map(|i| (i + 1..points.len() as u32).map(move |j| [i, j]));
        pairs.filter(|&[i, j]| is_edge(i, j)).collect()
    }

    /// Edges of the polygon 0, 1, … and of the fan of diagonals from one corner.
    fn fan(corners: u32, from: u32) -> Vec<[u32; 2]> {
        let sides = (0..corners).map(|i| [i, (i + 1) % corners]);
        let diagonals = (0..corners).map(|i| [from, i]).filter(|[a, b]| a != b);
        let mut edges: Vec<_> = sides.chain(diagonals).map(|[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    #[test]
    fn a_square_may_have_either_diagonal() {
        assert_eq!(differing_edges_are_cocircular(&SQUARE, &DIAGONAL_02, &DIAGONAL_13), Ok(1));
        assert_eq!(differing_edges_are_cocircular(&SQUARE, &DIAGONAL_02, &DIAGONAL_02), Ok(0));
    }

    #[test]
    fn a_kite_may_have_only_its_short_diagonal() {
        assert_eq!(is_delaunay(&KITE, &DIAGONAL_13), Ok(()));
        assert!(is_delaunay(&KITE, &DIAGONAL_02).unwrap_err().contains("[0, 2] is not Delaunay"));
        let differing = differing_edges_are_cocircular;
        assert!(differing(&KITE, &DIAGONAL_02, &DIAGONAL_13).unwrap_err().starts_with("ours"));
        assert!(differing(&KITE, &DIAGONAL_13, &DIAGONAL_02).unwrap_err().starts_with("theirs"));
    }

    #[test]
    fn the_last_bit_of_a_coordinate_decides_about_a_diagonal() {
        let mut square = SQUARE.map(|[x, y]| [x + 15e6, y + 15e6]);
        square[2] = square[2].map(f64::next_down);
        assert_eq!(is_delaunay(&square, &DIAGONAL_02), Ok(()));
        assert!(is_delaunay(&square, &DIAGONAL_13).is_err());
        square[2] = [15_000_001.0, f64::next_up(15_000_001.0)];
        assert!(is_delaunay(&square, &DIAGONAL_02).is_err());
        assert_eq!(is_delaunay(&square, &DIAGONAL_13), Ok(()));
    }

    #[test]
    fn twelve_cocircular_points_may_have_any_triangulation() {
        let circle: [Point; 12] = [
            [5.0, 0.0],
            [4.0, 3.0],
            [3.0, 4.0],
            [0.0, 5.0],
            [-3.0, 4.0],
            [-4.0, 3.0],
            [-5.0, 0.0],
            [-4.0, -3.0],
            [-3.0, -4.0],
            [0.0, -5.0],
            [3.0, -4.0],
            [4.0, -3.0],
        ];
        assert_eq!(differing_edges_are_cocircular(&circle, &fan(12, 0), &fan(12, 3)), Ok(8));
        assert_eq!(differing_edges_are_cocircular(&circle, &fan(12, 0), &fan(12, 6)), Ok(8));
    }

    #[test]
    fn random_points_have_one_triangulation_and_no_other_set_of_edges_passes() {
        for seed in 0..20 {
            let points = random_points(9, 1 << 20, seed);
            let edges = delaunay_by_brute_force(&points);
            assert_eq!(is_delaunay(&points, &edges), Ok(()), "seed {seed}");
            let absent = |e: &[u32; 2]| !edges.contains(e);
            let pairs = (0..9).flat_map(|i| (i + 1..9).map(move |j| [i, j]));
            for (other, k) in pairs.filter(absent).flat_map(|o| (0..edges.len()).map(move |k| (o, k))) {
                let mut changed = edges.clone();
                changed[k] = other;
                changed.sort_unstable();
                assert!(is_delaunay(&points, &changed).is_err(), "seed {seed}: {k} → {other:?}");
            }
        }
    }

    #[test]
    fn a_missing_or_an_additional_edge_is_found() {
        assert!(is_delaunay(&SQUARE, &DIAGONAL_02[1..]).unwrap_err().contains("has 5"));
        let all = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
        assert!(is_delaunay(&SQUARE, &all).unwrap_err().contains("6 edges"));
        assert!(is_delaunay(&SQUARE, &[]).is_err());
    }

    #[test]
    fn an_edge_that_passes_over_a_vertex_is_found() {
        let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 3.0]];
        assert_eq!(is_delaunay(&points, &[[0, 1], [0, 3], [1, 2], [1, 3], [2, 3]]), Ok(()));
        let over = [[0, 1], [0, 2], [0, 3], [1, 3], [2, 3]];
        assert!(is_delaunay(&points, &over).unwrap_err().contains("overlap"));
    }

    #[test]
    fn collinear_points_are_joined_to_their_neighbours() {
        let line = [[0.0, 0.0], [2.0, 4.0], [1.0, 2.0]];
        assert_eq!(is_delaunay(&line, &[[0, 2], [1, 2]]), Ok(()));
        assert!(is_delaunay(&line, &[[0, 1], [1, 2]]).is_err());
        assert_eq!(is_delaunay(&line[..1], &[]), Ok(()));
        assert_eq!(is_delaunay(&[], &[]), Ok(()));
    }

    #[test]
    fn malformed_input_is_refused() {
        let triangle = |edges: [[u32; 2]; 3]| is_delaunay(&SQUARE[..3], &edges);
        assert_eq!(triangle([[0, 1], [0, 2], [1, 2]]), Ok(()));
        assert!(triangle([[0, 1], [0, 2], [1, 3]]).unwrap_err().contains("no pair"));
        assert!(triangle([[0, 1], [0, 2], [2, 1]]).unwrap_err().contains("no pair"));
        assert!(triangle([[0, 1], [0, 1], [1, 2]]).unwrap_err().contains("twice"));
        let twice = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[0]];
        assert!(is_delaunay(&twice, &DIAGONAL_02).unwrap_err().contains("0 and 3 are equal"));
        let nan = [SQUARE[0], SQUARE[1], [f64::NAN, 0.0]];
        assert!(is_delaunay(&nan, &[]).unwrap_err().contains("point 2"));
    }

    /// Small integers leave no room for rounding: every determinant fits into 128 bits.
    fn exact_incircle(corners: [Point; 4]) -> i128 {
        let [a, b, c, d] = corners.map(|p| p.map(|v| v as i128));
        let row = |[x, y]: [i128; 2]| {
            let (x, y) = (x - d[0], y - d[1]);
            [x, y, x * x + y * y]
        };
        let ([ax, ay, al], [bx, by, bl], [cx, cy, cl]) = (row(a), row(b), row(c));
        al * (bx * cy - cx * by) + bl * (cx * ay - ax * cy) + cl * (ax * by - bx * ay)
    }

    #[test]
    fn the_predicate_agrees_with_integer_arithmetic_on_nearly_cocircular_points() {
        // (±a, ±b), (±b, ±a) lie on one circle; its corners are moved by at most one unit.
        let mut rng = ChaCha20Rng::seed_from_u64(1);
        let mut below = |n: u32| f64::from(rng.next_u32() % n);
        let mut cocircular = 0;
        for _ in 0..10_000 {
            let (a, b) = (below(1 << 28), below(1 << 28));
            let mut corners = [[a, b], [-b, a], [-a, -b], [b, -a]];
            corners[below(4) as usize][0] += below(3) - 1.0;
            let exact = exact_incircle(corners);
            let [p, q, r, s] = corners.map(coord);
            assert_eq!(incircle(p, q, r, s).partial_cmp(&0.0), Some(exact.cmp(&0)));
            cocircular += usize::from(exact == 0);
        }
        assert!((1_000..9_000).contains(&cocircular));
    }
}
