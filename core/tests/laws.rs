//! The laws that embedding and detection rest on.

use faer::Mat;
use meshmark_core::{
    carrier::Carrier,
    code::Code,
    deformation::Deformation,
    demodulation::{self, Demodulation},
    embedding::{Embedding, embed},
    ground::Ground,
    key::SecretKey,
    map::Map,
    mesh::Mesh,
    message::Message,
    options::{Laplacian, Parameters},
    patches::{Patch, Patches},
    spectrum::{Basis, tridiagonalise_and_solve},
    vertices::VertexTable,
};
use proptest::prelude::*;

const MESSAGE: &str = "0123456789abcdef";

fn key() -> SecretKey {
    SecretKey::from_bytes([42; 32])
}

/// Parameters for small maps: 64 bits repeated, two patches of at least 150 vertices.
fn small() -> Parameters {
    Parameters { code: Code::Repetition, chip_rate: 2, patch_size: 150, ..Parameters::default() }
}

/// Distinct random vertices on about a square kilometre.
fn vertices() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::btree_set((0..1_000_000i32, 0..1_000_000i32), 300..500)
        .prop_map(|set| set.into_iter().map(|(x, y)| [f64::from(x) / 1e3, f64::from(y) / 1e3]).collect())
}

fn marked(table: &VertexTable, ground: &Ground, parameters: &Parameters) -> Vec<[f64; 2]> {
    let message = Message::from_hex(MESSAGE).unwrap();
    embed(&Map::of_points(table, ground), &key(), &message, parameters).unwrap().coords
}

fn observed(table: &VertexTable, ground: &Ground, moved: &[[f64; 2]]) -> Vec<Option<[f64; 2]>> {
    table.coords().iter().zip(moved).map(|(a, b)| Some(ground.metres_between(*a, *b))).collect()
}

fn read_back(
    table: &VertexTable,
    ground: &Ground,
    observed: &[Option<[f64; 2]>],
    p: &Parameters,
) -> [Demodulation; 2] {
    let patches = Patches::new(&Map::of_points(table, ground), p).unwrap();
    patches.validate().unwrap();
    let carrier = Carrier::new(&key());
    let disturbance = Deformation::estimate(&patches, observed, 128, p).unwrap().predict(
        &patches,
        observed,
        128,
        p.amplitude_m,
    );
    [
        demodulation::paper(&patches, &carrier, observed, 64, p, &|_| ()).unwrap(),
        demodulation::joint(&patches, &carrier, observed, 64, p, &disturbance, &|_| ()).unwrap(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn a_coded_message_is_read_when_a_sixth_of_the_vertices_is_gone(
        points in vertices(),
        bytes in prop::array::uniform16(any::<u8>()),
    ) {
        let table = VertexTable::new(points).unwrap();
        let p = Parameters { patch_size: 290, ..Parameters::default() };
        let message = Message::from_bytes(&bytes);
        let moved = embed(&Map::of_points(&table, &Ground::METRES), &key(), &message, &p).unwrap().coords;
        let mut seen = observed(&table, &Ground::METRES, &moved);
        for displacement in seen.iter_mut().step_by(6) {
            *displacement = None;
        }
        let patches = Patches::new(&Map::of_points(&table, &Ground::METRES), &p).unwrap();
        let disturbance = Deformation::none(0.02).predict(&patches, &seen, 256, p.amplitude_m);
        let found = demodulation::joint(
            &patches, &Carrier::new(&key()), &seen, 128, &p, &disturbance, &|_| ()).unwrap();
        prop_assert_eq!((p.code, found.estimate.len()), (Code::Ldpc, 256));
        prop_assert_eq!(found.message(), message.clone());
        prop_assert!(found.recipient_score(&message) > 8.0 && found.mark_score(&message) > 8.0);
    }

    #[test]
    fn analysis_after_synthesis_is_the_identity(
        points in vertices(),
        seed in prop::collection::vec(-1.0..1.0f64, 500),
        laplacian in prop_oneof![Just(Laplacian::Biggs), Just(Laplacian::Cotangent)],
    ) {
        let table = VertexTable::new(points).unwrap();
        let p = Parameters { basis: laplacian, ..small() };
        let patches = Patches::new(&Map::of_points(&table, &Ground::METRES), &p).unwrap();
        for patch in patches.as_slice() {
            let n = patch.vertices.len();
            let basis = Basis::low_frequencies(patch, n).unwrap();
            let back = basis.analyse(&basis.synthesise(&seed[..n]));
            let worst = back.iter().zip(&seed).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            prop_assert!(worst < 1e-9, "{worst}");
        }
    }

    #[test]
    fn eigenvectors_satisfy_the_cotangent_laplacian(points in vertices()) {
        let table = VertexTable::new(points).unwrap();
        let p = Parameters { basis: Laplacian::Cotangent, patch_size: table.len(), ..small() };
        let patches = Patches::new(&Map::of_points(&table, &Ground::METRES), &p).unwrap();
        let basis = Basis::low_frequencies(&patches.as_slice()[0], 100).unwrap();
        let mesh = Mesh::delaunay(&table.local(1.0)).unwrap();
        let stiffness = stiffness(table.coords(), mesh.triangles());
        let largest = (0..table.len()).map(|v| stiffness[(v, v)]).fold(0.0, f64::max);
        let image = &stiffness * &basis.vectors;
        for i in 0..100 {
            for v in 0..table.len() {
                let expected = largest * basis.eigenvalues[i] * basis.vectors[(v, i)];
                prop_assert!((image[(v, i)] - expected).abs() < 1e-9 * largest);
            }
        }
        let gram = basis.vectors.transpose() * &basis.vectors;
        prop_assert!((gram - Mat::<f64>::identity(100, 100)).norm_max() < 1e-9);
    }

    #[test]
    fn eigenvectors_satisfy_the_biggs_laplacian(points in vertices()) {
        let table = VertexTable::new(points).unwrap();
        let patches = Patches::new(&Map::of_points(&table, &Ground::METRES), &small()).unwrap();
        let patch = &patches.as_slice()[0];
        let basis = Basis::low_frequencies(patch, 100).unwrap();
        for i in 0..100 {
            // R e = e − D⁻¹ A e, computed from the edges alone.
            let e = |v: u32| basis.vectors[(v as usize, i)];
            let mut image: Vec<f64> = (0..patch.vertices.len() as u32).map(e).collect();
            for &[a, b] in &patch.edges {
                image[a as usize] -= e(b) / basis.degrees[a as usize];
                image[b as usize] -= e(a) / basis.degrees[b as usize];
            }
            for (v, value) in image.iter().enumerate() {
                prop_assert!((value - basis.eigenvalues[i] * e(v as u32)).abs() < 1e-9);
            }
        }
        prop_assert!(basis.eigenvalues[0].abs() < 1e-12 && basis.eigenvalues[1] > 1e-6);
    }

    #[test]
    fn embedding_does_not_depend_on_the_order_of_the_vertices(points in vertices(), turn in 1..299usize) {
        let mut shuffled = points.clone();
        shuffled.rotate_left(turn);
        shuffled.extend_from_slice(&points[..50]); // shared vertices occur more than once
        let (a, b) = (VertexTable::new(points).unwrap(), VertexTable::new(shuffled).unwrap());
        prop_assert_eq!(&a, &b);
        prop_assert_eq!(marked(&a, &Ground::METRES, &small()), marked(&b, &Ground::METRES, &small()));
    }

    #[test]
    fn no_vertex_moves_further_than_the_tolerance_and_every_one_is_on_the_grid(
        points in vertices(),
        tolerance_m in 0.12..0.3f64,
        precision in prop::sample::select(vec![None, Some(0.1), Some(0.01), Some(0.03)]),
    ) {
        let table = VertexTable::new(points).unwrap();
        let p = Parameters { tolerance_m, precision_crs_units: precision, amplitude_m: 0.2, ..small() };
        for (from, to) in table.coords().iter().zip(marked(&table, &Ground::METRES, &p)) {
            prop_assert!((to[0] - from[0]).hypot(to[1] - from[1]) <= tolerance_m);
            if let Some(grid) = precision {
                prop_assert!(to.iter().all(|v| (v / grid - (v / grid).round()).abs() < 1e-6));
            }
        }
    }

    #[test]
    fn both_demodulators_read_the_message_when_half_of_the_vertices_are_gone(points in vertices()) {
        let table = VertexTable::new(points).unwrap();
        let p = Parameters { amplitude_m: 0.1, ..small() };
        let mut seen = observed(&table, &Ground::METRES, &marked(&table, &Ground::METRES, &p));
        for found in read_back(&table, &Ground::METRES, &seen, &p) {
            prop_assert_eq!(found.message().to_hex(), MESSAGE);
        }
        for displacement in seen.iter_mut().step_by(2) {
            *displacement = None;
        }
        let message = Message::from_hex(MESSAGE).unwrap();
        let [paper, joint] = read_back(&table, &Ground::METRES, &seen, &p);
        prop_assert!(joint.mark_score(&message) > 8.0 && paper.mark_score(&message) > 8.0);
        prop_assert!(joint.message().errors(&message) <= paper.message().errors(&message));
    }
}

#[test]
fn degrees_are_marked_in_metres_and_the_seam_stays() {
    let mut coords: Vec<[f64; 2]> =
        (0..400).map(|i| [179.0 + f64::from(i % 20) * 0.05, 59.0 + f64::from(i / 20) * 0.07]).collect();
    coords.extend((0..20).map(|i| [180.0, 59.03 + f64::from(i) * 0.07]));
    let table = VertexTable::new(coords).unwrap();
    let p = small();
    let moved = marked(&table, &Ground::WGS84, &p);
    let seen = observed(&table, &Ground::WGS84, &moved);
    let metres: Vec<f64> = seen.iter().map(|d| d.map_or(0.0, |[x, y]| x.hypot(y))).collect();
    assert!(metres.iter().cloned().fold(0.0, f64::max) < 0.75);
    assert!(metres.iter().sum::<f64>() / metres.len() as f64 > 0.05);
    for (from, to) in table.coords().iter().zip(&moved) {
        assert_eq!(from[0] == 180.0, from == to, "only the seam stays: {from:?}");
    }
}

#[test]
fn output_is_bit_equal_for_any_number_of_threads() {
    let table = grid(40);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| marked(&table, &Ground::METRES, &small()))
    };
    assert!(with(1) == with(2) && with(2) == with(8));
}

/// A square grid of side² vertices, 10 m apart: hundreds of repeated eigenvalues.
#[test]
fn messages_marked_together_are_those_marked_alone() {
    let table = grid(40);
    let map = Map::of_points(&table, &Ground::METRES);
    for parameters in [small(), Parameters { shape: meshmark_core::options::Rigidity::Rigid, ..small() }] {
        let messages =
            [MESSAGE, "fedcba9876543210", "00ff00ff00ff00ff"].map(|h| Message::from_hex(h).unwrap());
        let embedding = Embedding::new(&map, &key(), 64, &parameters).unwrap().for_many().unwrap();
        let steps = std::sync::atomic::AtomicUsize::new(0);
        let wanted = embedding.wanted(&messages, &|n| {
            steps.fetch_add(n, std::sync::atomic::Ordering::Relaxed);
        });
        assert_eq!(steps.into_inner(), embedding.patches());
        for (message, wanted) in messages.iter().zip(wanted.unwrap()) {
            let together = embedding.settle(message, &wanted).unwrap();
            assert_eq!(together, embed(&map, &key(), message, &parameters).unwrap());
        }
    }
}

fn grid(side: i32) -> VertexTable {
    let coords = (0..side * side).map(|i| [f64::from(i % side) * 10.0, f64::from(i / side) * 10.0]);
    VertexTable::new(coords.collect()).unwrap()
}

/// Clusters so far apart that the patches between them fall apart.
fn clusters() -> VertexTable {
    let mut coords = Vec::new();
    for cluster in 0..7 {
        let (cx, cy) = (f64::from(cluster % 3) * 5000.0, f64::from(cluster / 3) * 4000.0);
        for i in 0..64 {
            coords.push([cx + f64::from(i % 8), cy + f64::from(i / 8)]);
        }
    }
    VertexTable::new(coords).unwrap()
}

/// The stiffness matrix of linear finite elements: the sides a and b of a triangle that face two of
/// its corners make an entry a·b / 4A. Triangles flatter than 1 : 100 are as stiff as those.
fn stiffness(coords: &[[f64; 2]], triangles: &[[u32; 3]]) -> Mat<f64> {
    let mut matrix = Mat::zeros(coords.len(), coords.len());
    for triangle in triangles {
        let at = triangle.map(|v| coords[v as usize]);
        let side = |i: usize| [0, 1].map(|axis| at[(i + 2) % 3][axis] - at[(i + 1) % 3][axis]);
        let product = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let ([ax, ay], [bx, by]) = (side(0), side(1));
        let longest2 = (0..3).map(|i| product(side(i), side(i))).fold(0.0, f64::max);
        let area2 = (ax * by - ay * bx).abs().max(0.01 * longest2);
        for i in 0..3 {
            for j in 0..3 {
                matrix[(triangle[i] as usize, triangle[j] as usize)] += product(side(i), side(j)) / area2;
            }
        }
    }
    matrix
}

fn by_nalgebra(matrix: Mat<f64>, _: usize) -> Option<(Vec<f64>, Mat<f64>)> {
    let n = matrix.nrows();
    let solved = nalgebra::DMatrix::from_fn(n, n, |i, j| matrix[(i, j)]).symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| solved.eigenvalues[a].total_cmp(&solved.eigenvalues[b]));
    let vectors = Mat::from_fn(n, n, |i, j| solved.eigenvectors[(i, order[j])]);
    Some((order.iter().map(|&i| solved.eigenvalues[i]).collect(), vectors))
}

fn largest_difference(patch: &Patch, count: usize) -> f64 {
    let ours = Basis::low_frequencies(patch, count).unwrap();
    let theirs = Basis::with_solver(patch, count, by_nalgebra).unwrap();
    let difference = &ours.vectors - &theirs.vectors;
    difference.norm_max()
}

#[test]
fn another_solver_gives_the_same_basis_on_grids_and_on_patches_that_fall_apart() {
    for table in [grid(20), grid(25), clusters()] {
        for laplacian in [Laplacian::Biggs, Laplacian::Cotangent] {
            let p = Parameters { basis: laplacian, ..small() };
            for patch in Patches::new(&Map::of_points(&table, &Ground::METRES), &p).unwrap().as_slice() {
                assert!(largest_difference(patch, 129) < 1e-6, "{laplacian:?}");
            }
        }
    }
}

#[test]
fn a_complete_grid_patch_has_repeated_eigenvalues_and_still_one_basis() {
    // Without the canonical choice this fails: the two solvers rotate repeated eigenvectors freely.
    let side = 12u32;
    let mut edges = Vec::new();
    for i in 0..side * side {
        if i % side + 1 < side {
            edges.push([i, i + 1]);
        }
        if i + side < side * side {
            edges.push([i, i + side]);
        }
    }
    edges.sort_unstable();
    let patch = Patch { vertices: (0..side * side).collect(), edges, ..Patch::default() };
    let values = Basis::low_frequencies(&patch, 100).unwrap().eigenvalues;
    assert!(values.windows(2).filter(|w| w[1] - w[0] < 1e-8).count() > 20, "no repeated eigenvalues");
    for count in [99, 100, 101] {
        assert!(largest_difference(&patch, count) < 1e-6);
    }
}

#[test]
fn another_solver_gives_the_same_basis_on_paths_cycles_stars_and_complete_graphs() {
    let n = 60u32;
    let path: Vec<[u32; 2]> = (1..n).map(|i| [i - 1, i]).collect();
    let mut cycle = path.clone();
    cycle.push([0, n - 1]);
    cycle.sort_unstable();
    let star = (1..n).map(|i| [0, i]).collect();
    let complete = (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j])).collect();
    for edges in [path, cycle, star, complete] {
        let patch = Patch { vertices: (0..n).collect(), edges, ..Patch::default() };
        for count in [2, 31, 32, 60] {
            assert!(largest_difference(&patch, count) < 1e-9, "{count}");
        }
    }
}

#[test]
fn displacements_are_those_of_the_tridiagonal_solver() {
    let hash = |i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31) % 1_000_003;
    let scattered = (0..1300).map(|i| [hash(i) as f64 / 100.0, hash(i + 1300) as f64 / 100.0]).collect();
    let scattered = VertexTable::new(scattered).unwrap();
    for (table, patch_size) in
        [(&scattered, 130), (&scattered, 480), (&scattered, 1300), (&grid(20), 400), (&clusters(), 448)]
    {
        for laplacian in [Laplacian::Biggs, Laplacian::Cotangent] {
            let p = Parameters { basis: laplacian, patch_size, ..small() };
            let patches = Patches::new(&Map::of_points(table, &Ground::METRES), &p).unwrap();
            let patch = &patches.as_slice()[0];
            let n = patch.vertices.len();
            for count in [65, 129, n / 2, n - 1, n] {
                let ours = Basis::low_frequencies(patch, count).unwrap();
                let theirs = Basis::with_solver(patch, count, tridiagonalise_and_solve).unwrap();
                let mark: Vec<f64> =
                    (0..count).map(|i| if hash(i as u64) % 2 == 0 { 0.1 } else { -0.1 }).collect();
                let [ours, theirs] = [ours, theirs].map(|basis| basis.synthesise(&mark));
                let miss = ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(miss < 1e-9, "{laplacian:?} {patch_size} {count}: {miss}");
            }
        }
    }
}

#[test]
fn a_mark_made_with_one_solver_is_read_with_another() {
    for table in [grid(20), clusters()] {
        let p = small();
        let seen = observed(&table, &Ground::METRES, &marked(&table, &Ground::METRES, &p));
        let patches = Patches::new(&Map::of_points(&table, &Ground::METRES), &p).unwrap();
        let mut scores = vec![0.0; 64];
        for (number, patch) in patches.as_slice().iter().enumerate() {
            let basis = Basis::with_solver(patch, 129, by_nalgebra).unwrap();
            for axis in 0..2 {
                let values: Vec<f64> =
                    patch.vertices.iter().map(|&v| seen[v as usize].unwrap()[axis]).collect();
                let coefficients = basis.analyse(&values);
                for (i, chip) in Carrier::new(&key()).chips(number, axis, 128).iter().enumerate() {
                    scores[i / 2] += chip * coefficients[i + 1];
                }
            }
        }
        assert_eq!(Message::from_signs(&scores).to_hex(), MESSAGE);
    }
}

#[test]
fn decoy_keys_score_like_a_standard_normal_on_a_marked_map() {
    let table = grid(25);
    let p = small();
    let seen = observed(&table, &Ground::METRES, &marked(&table, &Ground::METRES, &p));
    let patches = Patches::new(&Map::of_points(&table, &Ground::METRES), &p).unwrap();
    let message = Message::from_hex(MESSAGE).unwrap();
    let score = |seed: u8| {
        let carrier = Carrier::new(&SecretKey::from_bytes([seed; 32]));
        demodulation::paper(&patches, &carrier, &seen, 64, &p, &|_| ()).unwrap().mark_score(&message)
    };
    let scores: Vec<f64> = (100..200).map(score).collect();
    let spread = (scores.iter().map(|s| s * s).sum::<f64>() / 100.0).sqrt();
    assert!((0.7..1.3).contains(&spread), "{spread}");
    assert!(score(42) > 15.0, "{}", score(42));
}

/// The number behind the first `before` in a text.
fn number_after(text: &str, before: &str) -> Option<usize> {
    let digits = text.split_once(before)?.1;
    digits.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

#[test]
fn what_a_map_with_too_few_vertices_is_advised_to_use_works() {
    let scattered = |count: u64| (0..count).map(|i| [(i * 7919 % 1009) as f64, (i * 104_729 % 997) as f64]);
    for count in [16, 17, 33, 68, 128, 129, 130, 256, 257, 300, 513, 600] {
        let table = VertexTable::new(scattered(count).collect()).unwrap();
        let map = Map::of_points(&table, &Ground::METRES);
        for (code, chip_rate) in
            [(Code::Ldpc, 1), (Code::Ldpc, 3), (Code::Repetition, 2), (Code::Repetition, 9)]
        {
            let wanted = Parameters { code, chip_rate, patch_size: 4096, ..Parameters::default() };
            let text = Patches::new(&map, &wanted).unwrap_err().to_string();
            let advice = text.split_once("use ").unwrap().1;
            let advised = Parameters {
                code: if advice.contains("CODE=REPETITION") { Code::Repetition } else { code },
                chip_rate: number_after(advice, "CHIP_RATE=").unwrap_or(chip_rate),
                patch_size: number_after(advice, "PATCH_SIZE=").unwrap(),
                ..wanted
            };
            let bits = number_after(advice, "at most ").map_or(128, |digits| 4 * digits);
            let patches = Patches::new(&map, &advised).unwrap();
            assert!(patches.carriers(bits, &advised).is_ok(), "{text}");
        }
    }
}
