//! Marking keeps the topology of a map: proved on maps of random houses, walls and roads.

use meshmark_core::{
    code::Code,
    embedding::{Marked, embed},
    ground::Ground,
    key::SecretKey,
    map::Map,
    message::Message,
    options::{Laplacian, Parameters, Rigidity},
    orientation::orientation,
    patches::Patches,
    vertices::VertexTable,
};
use proptest::prelude::*;

/// Coordinates, the pairs of them that are joined, and which of these are sides of polygons, before
/// duplicates are merged.
#[derive(Debug, Clone, Default)]
struct Sketch {
    coords: Vec<[f64; 2]>,
    joined: Vec<[u32; 2]>,
    sides: Vec<[u32; 2]>,
}

/// A map of about a thousand vertices: room for a short message.
struct Town {
    vertices: VertexTable,
    segments: Vec<[u32; 2]>,
    polygon_roots: Vec<u32>,
}

impl Town {
    fn mark(&self, parameters: &Parameters) -> Marked {
        let key = SecretKey::from_bytes([9; 32]);
        embed(&self.map(), &key, &Message::from_hex("0123").unwrap(), parameters).unwrap()
    }

    fn map(&self) -> Map<'_> {
        let Town { vertices, segments, polygon_roots } = self;
        Map { segments, polygon_roots, ..Map::of_points(vertices, &Ground::METRES) }
    }

    fn coords(&self) -> &[[f64; 2]] {
        self.vertices.coords()
    }
}

impl Sketch {
    fn chain(&mut self, chain: &[[f64; 2]]) {
        let first = self.coords.len() as u32;
        self.coords.extend(chain);
        self.joined.extend((1..chain.len() as u32).map(|i| [first + i - 1, first + i]));
    }

    fn ring(&mut self, corners: &[[f64; 2]]) {
        let first = self.joined.len();
        self.chain(&[corners, &corners[..1]].concat());
        self.sides.extend(&self.joined[first..]);
    }

    fn survey(&self) -> Town {
        let (table, indices) = VertexTable::indexed(self.coords.clone()).unwrap();
        let pair = |&[a, b]: &[u32; 2]| {
            let (a, b) = (indices[a as usize], indices[b as usize]);
            [a.min(b), a.max(b)]
        };
        let mut segments: Vec<[u32; 2]> = self.joined.iter().map(pair).filter(|[a, b]| a != b).collect();
        segments.sort_unstable();
        segments.dedup();
        // Along a ring, labels go round in one direction or the other: two passes reach every
        // corner.
        let mut polygon_roots: Vec<u32> = (0..table.len() as u32).collect();
        let there: Vec<[u32; 2]> = self.sides.iter().map(pair).collect();
        for [a, b] in there.iter().chain(there.iter().rev()).chain(&there) {
            let first = polygon_roots[*a as usize].min(polygon_roots[*b as usize]);
            (polygon_roots[*a as usize], polygon_roots[*b as usize]) = (first, first);
        }
        Town { vertices: table, segments, polygon_roots }
    }
}

/// A turn about a place: exact junctions become inexact ones.
fn turned([x, y]: [f64; 2], about: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [about[0] + cos * x - sin * y, about[1] + sin * x + cos * y]
}

/// Blocks of three houses, centimetres to metres apart: one with a corner on the wall of its
/// neighbour, which has no vertex there, and all with a notch narrower than the mark is wide; roads
/// around them and a point between. Of each the turn, the gap, the notch and the place of the
/// corner.
fn town(blocks: &[(f64, f64, f64, f64)]) -> Sketch {
    let mut sketch = Sketch::default();
    for (number, &(angle, gap, notch, at)) in blocks.iter().enumerate() {
        let centre = [(number % 6 * 40) as f64, (number / 6 * 40) as f64];
        let place = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
            points.iter().map(|p| turned(*p, centre, angle)).collect()
        };
        let house = |x: f64, y: f64| {
            let bay = [[4.0 + notch, 6.0], [4.0 + notch, 6.0 - notch], [4.0, 6.0 - notch], [4.0, 6.0]];
            let corners = [&[[0.0, 0.0], [8.0, 0.0], [8.0, 6.0]], bay.as_slice(), &[[0.0, 6.0]]].concat();
            place(&corners.iter().map(|[u, v]| [x + u, y + v]).collect::<Vec<_>>())
        };
        sketch.ring(&house(0.0, 0.0));
        sketch.ring(&house(8.0, at));
        sketch.ring(&house(0.0, 6.0 + gap));
        sketch.chain(&place(&[[-4.0, -5.0], [12.0, -gap], [13.0, -5.0]]));
        sketch.chain(&place(&[[-5.0, -5.0], [-gap, 3.0], [-5.0, 9.0]]));
        sketch.chain(&place(&[[3.0, 6.0 + gap / 2.0]]));
    }
    sketch
}

fn towns() -> impl Strategy<Value = Sketch> {
    let block = (0.0..3.2f64, 0.02..0.5f64, 0.02..0.4f64, 1.0..5.0f64);
    prop::collection::vec(block, 30).prop_map(|blocks| town(&blocks))
}

/// One of them, always the same.
fn small_town() -> Sketch {
    let share = |i: usize, k: usize| ((i * 7919 + k * 104_729) % 1009) as f64 / 1009.0;
    let block =
        |i| (3.2 * share(i, 1), 0.02 + 0.4 * share(i, 2), 0.02 + 0.3 * share(i, 3), 1.0 + 4.0 * share(i, 4));
    town(&(0..30).map(block).collect::<Vec<_>>())
}

fn shapes() -> impl Strategy<Value = Rigidity> {
    prop_oneof![Just(Rigidity::Free), Just(Rigidity::Rigid)]
}

fn laplacians() -> impl Strategy<Value = Laplacian> {
    prop_oneof![Just(Laplacian::Biggs), Just(Laplacian::Cotangent)]
}

fn parameters() -> Parameters {
    Parameters { code: Code::Repetition, chip_rate: 2, patch_size: 150, ..Parameters::default() }
}

fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Distance of a point from a segment.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let e = [b[0] - a[0], b[1] - a[1]];
    let t = (((p[0] - a[0]) * e[0] + (p[1] - a[1]) * e[1]) / (e[0] * e[0] + e[1] * e[1])).clamp(0.0, 1.0);
    (p[0] - a[0] - t * e[0]).hypot(p[1] - a[1] - t * e[1])
}

/// The pairs of segments that cross by more than a micrometre.
fn crossings(segments: &[[u32; 2]], coords: &[[f64; 2]]) -> Vec<[usize; 2]> {
    let ends = |s: usize| segments[s].map(|v| coords[v as usize]);
    let mut found = Vec::new();
    for i in 0..segments.len() {
        for j in i + 1..segments.len() {
            let ([a, b], [c, d]) = (ends(i), ends(j));
            let apart = (0..2).any(|x| a[x].max(b[x]) < c[x].min(d[x]) || c[x].max(d[x]) < a[x].min(b[x]));
            if apart || turn(a, b, c) * turn(a, b, d) >= 0.0 || turn(c, d, a) * turn(c, d, b) >= 0.0 {
                continue;
            }
            let nearest = [distance(a, c, d), distance(b, c, d), distance(c, a, b), distance(d, a, b)];
            if nearest.into_iter().fold(f64::MAX, f64::min) > 1e-6 {
                found.push([i, j]);
            }
        }
    }
    found
}

fn length(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn nothing_crosses_that_did_not_and_junctions_hold(sketch in towns(), shape in shapes(), laplacian in laplacians()) {
        let town = sketch.survey();
        let marked = town.mark(&Parameters { shape, basis: laplacian, ..parameters() });
        prop_assert_eq!(crossings(&town.segments, town.coords()), crossings(&town.segments, &marked.coords));
        for &[a, b] in &town.segments {
            let [a, b] = [a as usize, b as usize];
            for v in (0..town.coords().len()).filter(|v| *v != a && *v != b) {
                let before = distance(town.coords()[v], town.coords()[a], town.coords()[b]);
                if before < 1e-9 {
                    let after = distance(marked.coords[v], marked.coords[a], marked.coords[b]);
                    prop_assert!(after < 1e-8, "vertex {v} left segment {a} {b}: {after}");
                }
            }
        }
    }

    #[test]
    fn no_vertex_is_further_away_than_the_tolerance(
        sketch in towns(),
        shape in shapes(),
        tolerance_m in 0.15..0.6f64,
    ) {
        let town = sketch.survey();
        let marked = town.mark(&Parameters { tolerance_m, shape, ..parameters() });
        for (from, to) in town.coords().iter().zip(&marked.coords) {
            prop_assert!((to[0] - from[0]).hypot(to[1] - from[1]) <= tolerance_m);
        }
    }
}

#[test]
fn rigid_houses_keep_their_shape_and_move_as_far_as_free_ones() {
    let town = small_town().survey();
    let rigid = Parameters { shape: Rigidity::Rigid, ..parameters() };
    let marked = town.mark(&rigid);
    // Sides and diagonals of every house: all distances between vertices of one polygon.
    for i in 0..town.coords().len() {
        for j in (0..i).filter(|&j| town.polygon_roots[i] == town.polygon_roots[j]) {
            let before = length(town.coords()[i], town.coords()[j]);
            let after = length(marked.coords[i], marked.coords[j]);
            assert!((after - before).abs() < 1e-6 * before, "{before} became {after}");
        }
    }
    let free = town.mark(&parameters());
    assert!(free.coords != marked.coords);
    let ratio = marked.displacement.rms_m / free.displacement.rms_m;
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn a_house_is_never_cut_by_the_border_of_a_patch() {
    let town = small_town().survey();
    let patches = Patches::new(&town.map(), &Parameters { shape: Rigidity::Rigid, ..parameters() }).unwrap();
    patches.validate().unwrap();
    assert!(patches.as_slice().len() > 4);
    let mut patch_of = vec![0; town.coords().len()];
    for (number, patch) in patches.as_slice().iter().enumerate() {
        patch.vertices.iter().for_each(|&v| patch_of[v as usize] = number);
    }
    for (v, &first) in town.polygon_roots.iter().enumerate() {
        assert_eq!(patch_of[v], patch_of[first as usize]);
    }
    let smallest = patches.as_slice().iter().map(|patch| patch.vertices.len()).min().unwrap();
    assert!(smallest >= 150 - 60, "{smallest}");
}

#[test]
fn the_same_for_any_number_of_threads() {
    let town = small_town().survey();
    let with_threads = |count: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
        pool.install(|| town.mark(&parameters()))
    };
    let marked = with_threads(1);
    assert_eq!(marked, with_threads(3));
    assert!(marked.attenuated > 0, "the town is so dense that something has to give way");
}

#[test]
fn on_a_grid_junctions_hold_within_a_step() {
    let town = small_town().survey();
    let marked = town.mark(&Parameters { precision_crs_units: Some(0.001), ..parameters() });
    for &[a, b] in &town.segments {
        let [a, b] = [a as usize, b as usize];
        for v in (0..town.coords().len()).filter(|v| *v != a && *v != b) {
            if distance(town.coords()[v], town.coords()[a], town.coords()[b]) < 1e-9 {
                assert!(distance(marked.coords[v], marked.coords[a], marked.coords[b]) < 0.0015);
            }
        }
    }
}

#[test]
fn a_hole_that_touches_the_wall_stays_inside_to_the_last_bit() {
    // Squares, each with a triangle inside that touches the wall on its left; some are turned.
    let mut sketch = Sketch::default();
    let mut contacts = Vec::new();
    for i in 0..400 {
        let at = [f64::from(i % 20) * 13.1, f64::from(i / 20) * 13.3];
        let angle = if i % 2 == 0 { 0.0 } else { 0.01 * f64::from(i) };
        let corners = |ring: &[[f64; 2]]| -> Vec<[f64; 2]> {
            ring.iter().map(|[x, y]| turned([at[0] + x, at[1] + y], at, angle)).collect()
        };
        let shell = corners(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]);
        let hole = corners(&[[0.0, 5.0], [4.0, 3.0], [4.0, 7.0]]);
        sketch.ring(&shell);
        sketch.ring(&hole);
        // This one is with the square on the left of the first two.
        contacts.push([shell[3], shell[0], hole[0]]);
    }
    let town = sketch.survey();
    let side = |[a, b, p]: [[f64; 2]; 3]| orientation(a, b, p);
    for shape in [Rigidity::Free, Rigidity::Rigid] {
        let marked = town.mark(&Parameters { shape, ..parameters() });
        for contact in &contacts {
            let moved = contact.map(|vertex| marked.coords[town.vertices.index_of(vertex).unwrap()]);
            let (before, after) = (side(*contact), side(moved));
            let is_kept = if before == 0.0 { after >= 0.0 } else { before * after > 0.0 };
            assert!(is_kept, "{shape:?}: {before} {after}");
        }
        assert!(marked.displacement.max_m <= parameters().tolerance_m);
    }
}

#[test]
fn where_nothing_is_rigid_rigid_shapes_are_free_ones() {
    // A wall of bricks, each on the joint of two others: one group, too large to move as one.
    let mut sketch = Sketch::default();
    for row in 0..20 {
        for brick in 0..20 {
            let (x, y) = (4.0 * f64::from(brick) + 2.0 * f64::from(row % 2), 2.0 * f64::from(row));
            sketch.ring(&[[x, y], [x + 4.0, y], [x + 4.0, y + 2.0], [x, y + 2.0]]);
        }
    }
    let town = sketch.survey();
    let marked = |shape| town.mark(&Parameters { shape, ..parameters() });
    assert_eq!(marked(Rigidity::Rigid).coords, marked(Rigidity::Free).coords);
}
