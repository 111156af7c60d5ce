//! The kernels against their rivals, on one thread: `cargo bench -p meshmark-host-tests --bench kernels`.
//!
//! Ours computes the eigenvectors that a mark uses, the others all of them, as their interfaces go. LAPACK is
//! that of Debian's OpenBLAS, a program of its own; without the package libopenblas-dev its row is missing.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use faer::{Mat, Par, Side};
use gdal::Dataset;
use meshmark_core::{
    options::Parameters,
    patches::{Patch, Patches},
    spectrum::Basis,
};
use meshmark_dataset::{LabelFields, MOST_VERTICES, Selection, Target, survey};
use std::{
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Duration,
};

const MAP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/helsinki.gpkg");
const DSYEVD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/dsyevd.c");

/// Patches of the default profile and of one with a coefficient per channel bit: vertices, columns.
const PROFILES: [(usize, usize); 2] = [(480, 257), (260, 257)];

fn eigen_solve(criterion: &mut Criterion) {
    faer::set_global_parallelism(Par::Seq);
    let dsyevd = compile(Path::new(DSYEVD));
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

fn first_patch(patch_size: usize) -> Patch {
    let selection = Selection {
        layers: None,
        srs: None,
        labels: LabelFields::None,
        target: Target::Own,
        most_vertices: MOST_VERTICES,
        last_failure: &|| None,
    };
    let map = survey(&Dataset::open(MAP).expect("the fixture opens"), &selection).expect("and is a map");
    let parameters = Parameters { patch_size, ..Parameters::default() };
    let map = map.map().expect("with metres");
    let patches = Patches::new(&map, &parameters).expect("of enough vertices");
    patches.as_slice()[0].clone()
}

/// The matrix that [`Basis`] solves, as it gives it to any solver.
fn laplacian(patch: &Patch) -> Mat<f64> {
    let seen = std::cell::RefCell::new(Mat::new());
    let _ = Basis::with_solver(patch, 1, |matrix, _| {
        seen.replace(matrix);
        None
    });
    seen.into_inner()
}

fn compile(source: &Path) -> Result<PathBuf, String> {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("dsyevd");
    let compiler =
        Command::new("cc").arg("-O2").arg(source).arg("-o").arg(&program).arg("-lopenblas").output();
    let compiler = compiler.map_err(|error| format!("cc cannot be run: {error}"))?;
    let complaint = String::from_utf8_lossy(&compiler.stderr);
    if compiler.status.success() {
        Ok(program)
    } else {
        Err(format!("is libopenblas-dev installed?\n{complaint}"))
    }
}

fn time_dsyevd(program: &Path, matrix: &[f64], repetitions: u64) -> Duration {
    let mut child = Command::new(program)
        .args([matrix.len().isqrt().to_string(), repetitions.to_string()])
        .env("OPENBLAS_NUM_THREADS", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it was just compiled");
    let bytes: Vec<u8> = matrix.iter().flat_map(|value| value.to_ne_bytes()).collect();
    child.stdin.take().expect("stdin is piped").write_all(&bytes).expect("it reads all of it");
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success(), "dsyevd failed");
    let seconds = String::from_utf8_lossy(&output.stdout).trim().parse().expect("seconds");
    Duration::from_secs_f64(seconds)
}

criterion_group!(kernels, eigen_solve);
criterion_main!(kernels);
