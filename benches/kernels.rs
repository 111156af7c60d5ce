//! The kernels beside their rivals, on one thread: `cargo bench -p meshmark-benches`.
//!
//! Our kernel computes the eigenvectors that a mark uses; the interfaces of the others allow only
//! all of them. LAPACK is that of Debian's OpenBLAS; CGAL and SciPy run as programs. Rivals that
//! are not installed are left out: the packages libopenblas-dev and libcgal-dev, and the Python
//! packages that `make bench` installs.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use faer::{Mat, Par, Side};
use gdal::Dataset;
use meshmark_cgal as cgal;
use meshmark_core::{
    ground::Ground,
    mesh::Mesh,
    options::Parameters,
    patches::{Patch, Patches},
    spectrum::Basis,
};
use meshmark_dataset::{Selection, Survey, survey};
use meshmark_detection::matching::Matcher;
use meshmark_host_tests::process;
use std::{
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Duration,
};

const MAP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/helsinki.gpkg");
const MATCHING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/matching.py");
const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/bench-python/bin/python");
const DSYEVD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/dsyevd.c");

/// Patches of the default profile and of one with a coefficient per channel bit: vertices, columns.
const PROFILES: [(usize, usize); 2] = [(480, 257), (260, 257)];

fn eigen_solve(criterion: &mut Criterion) {
    faer::set_global_parallelism(Par::Seq);
    let dsyevd = compiled_dsyevd();
    let mut group = criterion.benchmark_group("eigen-solve");
    group.sample_size(20);
    for (patch_size, columns) in PROFILES {
        let patch = first_patch(patch_size);
        let name = |solver: &str| BenchmarkId::new(solver, patch_size);
        group.bench_function(name("ours"), |b| b.iter(|| Basis::low_frequencies(&patch, columns)));
        let laplacian = laplacian(&patch);
        group.bench_function(name("faer"), |b| b.iter(|| laplacian.self_adjoint_eigen(Side::Lower)));
        let same = nalgebra::DMatrix::from_fn(laplacian.nrows(), laplacian.ncols(), |i, j| laplacian[(i, j)]);
        group.bench_function(name("nalgebra"), |b| b.iter(|| same.clone().symmetric_eigen()));
        match &dsyevd {
            Ok(program) => drop(group.bench_function(name("dsyevd"), |b| {
                b.iter_custom(|repetitions| time_dsyevd(program, same.as_slice(), repetitions));
            })),
            Err(reason) => eprintln!("dsyevd is left out: {reason}"),
        }
    }
    group.finish();
}

fn delaunay(criterion: &mut Criterion) {
    let points = points();
    let mut group = criterion.benchmark_group("delaunay");
    group.bench_function("ours", |b| b.iter(|| Mesh::delaunay(&points).expect("points of a map")));
    match cgal::build(Path::new(env!("CARGO_TARGET_TMPDIR"))) {
        Ok(program) => drop(group.bench_function("CGAL", |b| {
            let seconds = || cgal::delaunay_seconds(&program, &points).expect("it was just compiled");
            b.iter_custom(|times| Duration::from_secs_f64((0..times).map(|_| seconds()).sum()));
        })),
        Err(reason) => eprintln!("CGAL is left out: {reason}"),
    }
    group.finish();
}

/// Measures the search for the counterpart of every vertex in a copy whose vertices moved by less
/// than the radius.
fn matching(criterion: &mut Criterion) {
    const RADIUS_M: f64 = 1.0;
    let points = points();
    let shift = |(i, p): (usize, &[f64; 2])| {
        let angle = i as f64;
        [p[0] + 0.3 * angle.cos(), p[1] + 0.3 * angle.sin()]
    };
    let moved: Vec<[f64; 2]> = points.iter().enumerate().map(shift).collect();
    let ground = Ground::METRES;
    let mut group = criterion.benchmark_group("matching");
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let ours = || one_thread.install(|| Matcher::new(&points, &ground, [0.0, 0.0]).all(&moved, RADIUS_M));
    group.bench_function("ours", |b| b.iter(ours));
    match Path::new(PYTHON).exists() {
        true => drop(group.bench_function("SciPy", |b| {
            let numbers: Vec<f64> = [&points, &moved].into_iter().flatten().flatten().copied().collect();
            b.iter_custom(|times| {
                let mut command = Command::new(PYTHON);
                time_program(command.args([MATCHING, &RADIUS_M.to_string(), &times.to_string()]), &numbers)
            });
        })),
        false => eprintln!("SciPy is left out: {PYTHON} is missing, `make bench` makes it"),
    }
    group.finish();
}

fn survey_of(map: &str) -> Survey {
    survey(&Dataset::open(map).expect("the fixture opens"), &Selection::default()).expect("and is a map")
}

/// Returns the vertices of a map, metres from its middle.
fn points() -> Vec<[f64; 2]> {
    survey_of(MAP).data.vertices.local(1.0)
}

fn first_patch(patch_size: usize) -> Patch {
    let survey = survey_of(MAP);
    let parameters = Parameters { patch_size, ..Parameters::default() };
    let map = survey.map(&parameters).expect("with metres");
    let patches = Patches::new(&map, &parameters).expect("of enough vertices");
    patches.as_slice()[0].clone()
}

/// Returns the matrix that [`Basis`] passes to a solver.
fn laplacian(patch: &Patch) -> Mat<f64> {
    let seen = std::cell::RefCell::new(Mat::new());
    let _ = Basis::with_solver(patch, 1, |matrix, _| {
        seen.replace(matrix);
        None
    });
    seen.into_inner()
}

fn compiled_dsyevd() -> meshmark_host_tests::Result<PathBuf> {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("dsyevd");
    process::compile(Path::new(DSYEVD), &["-O2", "-lopenblas"], &program)
        .map_err(|error| format!("is libopenblas-dev installed?\n{error}"))?;
    Ok(program)
}

fn time_dsyevd(program: &Path, matrix: &[f64], repetitions: u64) -> Duration {
    let mut command = Command::new(program);
    command.args([matrix.len().isqrt().to_string(), repetitions.to_string()]);
    time_program(command.env("OPENBLAS_NUM_THREADS", "1"), matrix)
}

/// Passes numbers to a program, which prints the seconds it takes.
fn time_program(command: &mut Command, numbers: &[f64]) -> Duration {
    let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = piped.spawn().expect("a program that was found");
    let bytes: Vec<u8> = numbers.iter().flat_map(|value| value.to_ne_bytes()).collect();
    child.stdin.take().expect("stdin is piped").write_all(&bytes).expect("it reads all of it");
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{command:?} failed");
    let seconds = String::from_utf8_lossy(&output.stdout).trim().parse().expect("seconds");
    Duration::from_secs_f64(seconds)
}

criterion_group!(kernels, eigen_solve, delaunay, matching);
criterion_main!(kernels);
