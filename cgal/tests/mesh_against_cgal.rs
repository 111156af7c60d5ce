//! Our mesh against CGAL's, on point sets that real maps are made of and on those that are known
//! to break triangulations.

use meshmark_cgal::{self as cgal, delaunay_check::differing_edges_are_cocircular};
use meshmark_core::{mesh::Mesh, vertices::VertexTable};
use meshmark_dataset::{Selection, numbers};
use rand_chacha::{ChaCha20Rng, rand_core::Rng, rand_core::SeedableRng};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Where false origins and web Mercator put a map: 8 digits before the decimal point.
const FAR: f64 = 1.5e7;

fn oracle() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| cgal::build(Path::new(env!("CARGO_TARGET_TMPDIR"))).unwrap())
}

fn compare(coords: Vec<[f64; 2]>) -> usize {
    compare_meshes(&VertexTable::new(coords).unwrap())
}

/// The number of edges, all on cocircular quadrilaterals, in which the two meshes differ.
fn compare_meshes(vertices: &VertexTable) -> usize {
    let points = vertices.local(1.0);
    let ours = Mesh::delaunay(&points).unwrap();
    let theirs = cgal::delaunay_edges(oracle(), &points).unwrap();
    differing_edges_are_cocircular(&points, ours.edges(), &theirs).unwrap()
}

fn far_away(coords: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    coords.into_iter().map(|[x, y]| [x + FAR, y + FAR]).collect()
}

fn square_grid(side: usize) -> Vec<[f64; 2]> {
    (0..side * side).map(|i| [(i % side) as f64, (i / side) as f64]).collect()
}

fn regular_polygon(corners: usize) -> Vec<[f64; 2]> {
    let angle = |i| i as f64 / corners as f64 * std::f64::consts::TAU;
    let corner = |i| [100.0 * f64::cos(angle(i)), 100.0 * f64::sin(angle(i))];
    (0..corners).map(corner).collect()
}

/// Detached and terraced houses of 12 m × 8 m along parallel streets, the streets turned by
/// `angle`: right angles and common lines everywhere, exact only when `angle` is zero.
fn buildings(angle: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = angle.sin_cos();
    let turned = |[x, y]: [f64; 2]| [x * cos - y * sin, x * sin + y * cos];
    let house = |i: usize| {
        let (row, column) = (i / 30, i % 30);
        let gap = if row.is_multiple_of(2) { 5.0 } else { 0.0 };
        let (x, y) = (column as f64 * (12.0 + gap), row as f64 * 20.0);
        [[x, y], [x + 12.0, y], [x + 12.0, y + 8.0], [x, y + 8.0]]
    };
    (0..30 * 40).flat_map(house).map(turned).collect()
}

/// A line that rounding keeps from being straight, and a point far from it.
fn nearly_collinear_and_one_off() -> Vec<[f64; 2]> {
    (0..1000).map(|i| [f64::from(i) * 0.1, f64::from(i) * 0.3]).chain([[40.0, -700.0]]).collect()
}

fn random(count: usize, side: f64) -> Vec<[f64; 2]> {
    let mut rng = ChaCha20Rng::seed_from_u64(count as u64);
    let mut coordinate = || rng.next_u64() as f64 / 2f64.powi(64) * side;
    (0..count).map(|_| [coordinate(), coordinate()]).collect()
}

/// Vertices on a grid of 1 m: most of them are given several times, many are cocircular.
fn random_with_duplicates() -> Vec<[f64; 2]> {
    random(20_000, 80.0).into_iter().map(|p| p.map(f64::round)).collect()
}

fn vertices_of(map: &Path) -> VertexTable {
    let dataset = gdal::Dataset::open(map).unwrap();
    numbers(&dataset, &Selection::default()).unwrap().raw().unwrap().data.vertices
}

#[test]
fn a_square_grid_near_the_origin_and_far_away() {
    compare(square_grid(60));
    compare(far_away(square_grid(60)));
}

#[test]
fn a_regular_polygon_with_and_without_its_centre() {
    let polygon = regular_polygon(100); // cocircular but for the rounding of its corners
    compare(polygon.clone());
    compare([polygon, vec![[0.0, 0.0]]].concat());
}

#[test]
fn buildings_in_rows() {
    compare(buildings(0.0));
    compare(buildings(0.3));
}

#[test]
fn a_nearly_straight_line_with_a_point_beside_it() {
    compare(nearly_collinear_and_one_off());
}

#[test]
fn random_points_have_exactly_one_mesh() {
    assert_eq!(compare(random(20_000, 1000.0)), 0);
}

#[test]
fn random_points_far_from_the_origin() {
    compare(far_away(random(20_000, 1000.0)));
}

#[test]
fn random_points_given_several_times() {
    compare(random_with_duplicates());
}

#[test]
fn every_fixture() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures"));
    let entries = folder.read_dir().unwrap().map(|entry| entry.unwrap().path());
    let maps: Vec<_> = entries.filter(|p| p.extension().is_some_and(|e| e == "gpkg")).collect();
    assert!(!maps.is_empty(), "no GeoPackage in {}", folder.display());
    for map in maps {
        let differing = compare_meshes(&vertices_of(&map));
        println!("{}: {differing} edges on cocircular quadrilaterals differ", map.display());
    }
}

mod oracle {
    use super::{cgal, oracle};

    fn edges(points: &[[f64; 2]]) -> Result<Vec<[u32; 2]>, String> {
        cgal::delaunay_edges(oracle(), points)
    }

    #[test]
    fn the_shorter_diagonal_of_a_kite_is_the_delaunay_edge() {
        let kite = [[0.0, 0.0], [2.0, -1.0], [4.0, 0.0], [2.0, 1.0]];
        assert_eq!(edges(&kite).unwrap(), [[0, 1], [0, 3], [1, 2], [1, 3], [2, 3]]);
    }

    #[test]
    fn equal_points_bear_the_first_of_their_indices() {
        let points = [[1.0, 0.0], [-0.0, 0.0], [0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, -0.0]];
        assert_eq!(edges(&points).unwrap(), [[0, 1], [0, 3], [1, 3]]);
    }

    #[test]
    fn few_or_collinear_points_have_the_edges_between_neighbours() {
        assert_eq!(edges(&[]).unwrap(), [[0; 2]; 0]);
        assert_eq!(edges(&[[3.0, 4.0]]).unwrap(), [[0; 2]; 0]);
        assert_eq!(edges(&[[3.0, 4.0], [0.0, 0.0]]).unwrap(), [[0, 1]]);
        assert_eq!(edges(&[[0.0, 0.0], [2.0, 2.0], [1.0, 1.0]]).unwrap(), [[0, 2], [1, 2]]);
    }

    #[test]
    fn a_failure_is_a_sentence() {
        let mut points = vec![[0.0, 0.0]; 100_000]; // more than a pipe holds
        points[0][1] = f64::NAN;
        assert!(edges(&points).unwrap_err().contains("point 0 is not finite"));
    }
}
