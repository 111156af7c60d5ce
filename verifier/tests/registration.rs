//! The registration finds the way back from what is left: polygons, lines, points, parts, thinned or
//! bent maps. The tests are in this crate because they read their maps through GDAL, on which
//! `detection` does not depend.

use meshmark_core::{
    ground::Ground,
    map_data::{MapData, Polyline},
    vertices::VertexTable,
};
use meshmark_dataset::{LabelFields, Selection, survey};
use meshmark_detection::registration::{Affine, Method, Registrar, Registration, Start};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

/// Vertices and polylines without attributes.
#[derive(Clone)]
struct Map {
    points: Vec<[f64; 2]>,
    polylines: Vec<Polyline>,
}

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Random(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Uniform between ± `half_width`.
    fn symmetric(&mut self, half_width: f64) -> f64 {
        (self.0.next_u64() as f64 / u64::MAX as f64 * 2.0 - 1.0) * half_width
    }
}

impl Map {
    fn from_polylines(polylines: Vec<Polyline>) -> Self {
        Map {
            points: polylines.iter().flat_map(|polyline| polyline.vertices.iter().copied()).collect(),
            polylines,
        }
    }

    fn fixture(name: &str) -> Self {
        let path = format!("{}/../fixtures/{name}.gpkg", env!("CARGO_MANIFEST_DIR"));
        Map::from_polylines(
            survey(
                &gdal::Dataset::open(path).unwrap(),
                &Selection { labels: LabelFields::Named(&[]), ..Selection::default() },
            )
            .unwrap()
            .data
            .polylines,
        )
    }

    /// Lines that wander about a square kilometre.
    fn roads() -> Self {
        let mut random = Random::new(5);
        let mut road = |_| {
            let mut at = [random.symmetric(500.0), random.symmetric(500.0)];
            let mut heading = random.symmetric(3.0);
            let step = |_| {
                heading += random.symmetric(0.9);
                let length = 25.0 + random.symmetric(15.0);
                at = [at[0] + length * heading.cos(), at[1] + length * heading.sin()];
                at
            };
            Polyline { vertices: (0..25).map(step).collect(), closed: false }
        };
        Map::from_polylines((0..40).map(&mut road).collect())
    }

    /// Points alone, 15 m apart or so.
    fn trees() -> Self {
        let mut random = Random::new(6);
        let points = (0..2000).map(|_| [random.symmetric(400.0), random.symmetric(300.0)]).collect();
        Map { points, polylines: Vec::new() }
    }

    fn only(mut self, closed: bool) -> Self {
        self.polylines.retain(|polyline| polyline.closed == closed);
        Map::from_polylines(self.polylines)
    }

    fn without_polylines(self) -> Self {
        Map { polylines: Vec::new(), ..self }
    }

    /// Every vertex moved; occurrences of one vertex move alike.
    fn moved(&self, f: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        let mut moved = self.clone();
        moved.points.iter_mut().for_each(|p| *p = f(*p));
        moved.polylines.iter_mut().flat_map(|s| &mut s.vertices).for_each(|p| *p = f(*p));
        moved
    }

    /// As a mark does: every vertex by up to `half_width` metres on both axes.
    fn shaken(&self, half_width: f64) -> Self {
        self.moved(|p| {
            let mut random = Random::new(p[0].to_bits() ^ p[1].to_bits().rotate_left(17));
            [p[0] + random.symmetric(half_width), p[1] + random.symmetric(half_width)]
        })
    }

    fn data(&self) -> MapData {
        MapData { polylines: self.polylines.clone(), ..MapData::of_points(self.vertices()) }
    }

    fn vertices(&self) -> VertexTable {
        VertexTable::new(self.points.clone()).unwrap()
    }
}

/// Rotated, stretched, sheared, shifted, and mirrored where `mirror` is −1.
fn affine(mirror: f64) -> Affine {
    Affine { coefficients: [mirror * 0.9, -0.7, 4.0e5, mirror * 0.6, 1.1, -2.0e5] }
}

fn register(reference: &Map, suspect: &Map, start: Start) -> Registration {
    Registrar::new(&reference.data(), &Ground::METRES, 1.0).register(&suspect.data(), start)
}

/// Root mean square distance between vertices of the reference and where `there` and back takes
/// them.
fn error_m(reference: &Map, there: impl Fn([f64; 2]) -> [f64; 2], back: &Registration) -> f64 {
    let vertices = reference.vertices();
    let returned = back.apply(&vertices.coords().iter().map(|p| there(*p)).collect::<Vec<_>>());
    let squares =
        vertices.coords().iter().zip(returned).map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2));
    (squares.sum::<f64>() / vertices.len() as f64).sqrt()
}

/// Registers what is left of a shaken reference by geometry alone, mirrored and not.
#[track_caller]
fn assert_found(reference: &Map, left: impl Fn(Map) -> Map, within_m: f64) {
    for mirror in [1.0, -1.0] {
        let there = affine(mirror);
        let suspect = left(reference.shaken(0.15)).moved(|p| there.apply(p));
        let found = register(reference, &suspect, Start::Geometry);
        let error_m = error_m(reference, |p| there.apply(p), &found);
        assert!(error_m < within_m, "mirror {mirror}: {error_m} m, {found:?}");
        assert_eq!((found.method, found.polynomial), (Method::Geometry, None));
    }
}

#[test]
fn polygons_give_the_affine_map_within_a_centimetre() {
    for fixture in ["kotka", "helsinki"] {
        assert_found(&Map::fixture(fixture), |map| map.only(true), 0.01);
    }
}

#[test]
fn lines_give_the_affine_map_when_nothing_else_is_left() {
    assert_found(&Map::roads(), |map| map, 0.02);
    assert_found(&Map::fixture("helsinki"), |map| map.only(false), 0.02);
}

#[test]
fn lines_of_which_a_third_of_the_vertices_is_deleted_give_the_affine_map() {
    let thinned = |mut map: Map| {
        let mut random = Random::new(9);
        for polyline in &mut map.polylines {
            polyline.vertices.retain(|_| random.symmetric(1.5).abs() < 1.0);
        }
        Map::from_polylines(map.polylines)
    };
    assert_found(&Map::roads(), thinned, 0.03);
}

#[test]
fn pieces_of_lines_give_the_affine_map() {
    let cut = |mut map: Map| {
        map.polylines.iter_mut().for_each(|polyline| polyline.vertices.retain(|v| v[0] < 0.0));
        map.polylines.retain(|polyline| polyline.vertices.len() > 1);
        Map::from_polylines(map.polylines)
    };
    assert_found(&Map::roads(), cut, 0.05);
}

#[test]
fn points_give_the_affine_map_by_their_arrangement() {
    assert_found(&Map::trees(), |map| map, 0.01);
    assert_found(&Map::fixture("kotka"), Map::without_polylines, 0.01);
}

#[test]
fn a_part_of_the_points_gives_a_similarity() {
    let reference = Map::fixture("kotka").without_polylines();
    let middle = reference.vertices().centre();
    let there = Affine { coefficients: [0.6, 0.8, 1e5, 0.8, -0.6, 3e4] }; // rotated and mirrored
    let mut suspect = reference.shaken(0.15);
    suspect.points.retain(|p| p[0] < middle[0]);
    let found = register(&reference, &suspect.moved(|p| there.apply(p)), Start::Geometry);
    assert!(error_m(&reference, |p| there.apply(p), &found) < 0.05, "{found:?}");
}

#[test]
fn half_a_metre_of_noise_leaves_the_affine_map_within_centimetres() {
    for reference in [Map::fixture("kotka"), Map::roads(), Map::trees()] {
        let there = affine(-1.0);
        let suspect = reference.shaken(0.5).moved(|p| there.apply(p));
        let found = register(&reference, &suspect, Start::Auto);
        let error_m = error_m(&reference, |p| there.apply(p), &found);
        assert!(error_m < 0.05, "{error_m}");
        assert_eq!(found.polynomial, None, "noise is no distortion");
    }
}

/// Up to 12 m off what any affine map can do, over the width of the map.
fn bend(reference: &Map) -> impl Fn([f64; 2]) -> [f64; 2] {
    let (centre, (min, max)) = (reference.vertices().centre(), reference.vertices().bounds());
    let half = (max[0] - min[0]) / 2.0;
    move |p| {
        let [u, v] = [0, 1].map(|axis| (p[axis] - centre[axis]) / half);
        [p[0] + 12.0 * u * u - 4.0 * u * v, p[1] + 9.0 * u * u * u + 6.0 * v * u]
    }
}

#[test]
fn a_smooth_distortion_is_followed_by_a_polynomial_and_its_linear_part_stays_affine() {
    let reference = Map::fixture("kotka");
    let (bend, there) = (bend(&reference), affine(-1.0));
    let distort = |p: [f64; 2]| there.apply(bend(p));
    let found = register(&reference, &reference.shaken(0.15).moved(distort), Start::Auto);
    assert!(found.polynomial.is_some(), "{found:?}");
    assert!(found.share > 0.95 && error_m(&reference, distort, &found) < 0.1, "{found:?}");
    let flat = Registration { polynomial: None, ..found };
    assert!((0.5..20.0).contains(&error_m(&reference, distort, &flat)));
}

#[test]
fn a_map_with_ten_times_the_vertices_is_registered_too() {
    let reference = Map::fixture("kotka");
    let there = affine(1.0);
    let mut suspect = reference.shaken(0.15);
    let middle = |a: [f64; 2], b: [f64; 2], share: f64| [0, 1].map(|i| a[i] + share * (b[i] - a[i]));
    for polyline in &mut suspect.polylines {
        let mut dense = Vec::new();
        let n = polyline.vertices.len();
        for i in 0..if polyline.closed { n } else { n - 1 } {
            let (a, b) = (polyline.vertices[i], polyline.vertices[(i + 1) % n]);
            dense.extend((0..11).map(|k| middle(a, b, k as f64 / 11.0)));
        }
        polyline.vertices = dense;
    }
    let suspect = Map::from_polylines(suspect.polylines);
    assert!(suspect.vertices().len() > 10 * reference.vertices().len());
    let found = register(&reference, &suspect.moved(|p| there.apply(p)), Start::Geometry);
    let error_m = error_m(&reference, |p| there.apply(p), &found);
    assert!(error_m < 0.02, "{error_m}, {found:?}");
}

#[test]
fn nothing_is_found_where_there_is_nothing_to_find() {
    let reference = Map::fixture("kotka");
    let empty = Map::from_polylines(Vec::new());
    let one = Map { points: vec![[1.0, 2.0]], polylines: Vec::new() };
    let row = Map { points: (0..500).map(|i| [i as f64, 2.0 * i as f64]).collect(), polylines: Vec::new() };
    let same = Map { points: vec![[1e9, 1e9]; 50], polylines: Vec::new() };
    for suspect in [empty, one, row, same, Map::trees(), Map::roads()] {
        for start in [Start::Auto, Start::Geometry, Start::Landmarks, Start::None] {
            let found = register(&reference, &suspect, start);
            assert!(!found.agrees_in_part() && found.polynomial.is_none(), "{start:?}: {found:?}");
        }
    }
}
