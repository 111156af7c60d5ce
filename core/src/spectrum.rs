//! The mesh spectrum of a patch: eigenvectors of its Laplacian, low frequencies first
//! (paper, section 3.3).

use crate::{
    Error, Result,
    patches::Patch,
    slicing::{self, SparseSymmetric},
    tridiagonal::Tridiagonal,
};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::evd::tridiag::{self, TridiagParams};
use faer::linalg::{householder, qr};
use faer::{Auto, Conj, Mat, MatRef, Par, Spec};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use std::borrow::Cow;

/// Eigenvalues closer than this share one subspace, whose basis [`canonical_rotation`] chooses, not
/// the solver.
const EQUAL_EIGENVALUES: f64 = 1e-8;

/// The first eigenvectors of the Laplacian of a patch.
///
/// The Biggs Laplacian R = I − D⁻¹A is not symmetric. With L = I − D^−½ A D^−½ = U Λ Uᵀ, its
/// eigenvectors are w_i = D^−½ u_i and the basis is e_i = w_i / |w_i|. E is not orthogonal;
/// analysis uses its dual, whose row i is |w_i| u_iᵀ D^½ = |w_i|² e_iᵀ D.
///
/// The cotangent Laplacian is symmetric: the same holds with D = I.
#[derive(Debug, Clone)]
pub struct Basis {
    /// n × k, column i = e_i, |e_i| = 1; column 0 is the constant one (eigenvalue 0).
    pub vectors: Mat<f64>,
    /// k eigenvalues, ascending; those of Biggs are in [0, 2], cotangent ones are shares of the
    /// largest diagonal entry.
    pub eigenvalues: Vec<f64>,
    /// n vertex degrees, the diagonal of D; 1 each with the cotangent Laplacian.
    pub degrees: Vec<f64>,
    /// k values |w_i|².
    pub norms_squared: Vec<f64>,
}

impl Basis {
    /// Solves for the `count` lowest frequencies of a connected patch, the mean included.
    ///
    /// # Errors
    /// [`Error::NoConvergence`], never seen on a real map.
    pub fn low_frequencies(patch: &Patch, count: usize) -> Result<Self> {
        let (laplacian, degrees) = laplacian(patch);
        let solved = slicing::lowest(&laplacian, count, EQUAL_EIGENVALUES)
            .or_else(|| tridiagonalise_and_solve(laplacian.to_dense(), count));
        Self::of_solution(solved, degrees, count)
    }

    /// Solves with another symmetric eigen-solver, which takes L (n × n) and `count` and returns
    /// the `count` lowest eigenvalues, ascending, and their eigenvectors as columns, with all that
    /// are equal to the last of them; further ones are ignored. With it tests prove that the basis
    /// does not depend on the solver.
    #[doc(hidden)]
    pub fn with_solver(
        patch: &Patch,
        count: usize,
        solver: impl Fn(Mat<f64>, usize) -> Option<(Vec<f64>, Mat<f64>)>,
    ) -> Result<Self> {
        let (laplacian, degrees) = laplacian(patch);
        Self::of_solution(solver(laplacian.to_dense(), count), degrees, count)
    }

    fn of_solution(solved: Option<(Vec<f64>, Mat<f64>)>, degrees: Vec<f64>, count: usize) -> Result<Self> {
        let (values, mut vectors) = solved.ok_or(Error::NoConvergence { vertices: degrees.len() })?;
        canonicalise(&values[..end_of_group(&values, count)], &mut vectors);
        vectors.truncate(degrees.len(), count);
        let norms_squared = to_unit_columns(&mut vectors, &degrees);
        Ok(Basis { vectors, eigenvalues: values[..count].to_vec(), degrees, norms_squared })
    }

    /// Returns the basis of patch `number` from the `known` ones of the first patches, or solves
    /// for it.
    pub(crate) fn known_or_solved<'a>(
        known: &'a [Basis],
        number: usize,
        patch: &Patch,
        count: usize,
    ) -> Result<Cow<'a, Self>> {
        match known.get(number) {
            Some(basis) => Ok(Cow::Borrowed(basis)),
            None => Ok(Cow::Owned(Self::low_frequencies(patch, count)?)),
        }
    }

    /// Analyses n `values` of one axis with the dual basis; returns k coefficients.
    pub fn analyse(&self, values: &[f64]) -> Vec<f64> {
        let n = values.len();
        let weighted = Mat::from_fn(n, 1, |v, _| values[v] * self.degrees[v]);
        let product = self.vectors.transpose() * weighted;
        self.norms_squared.iter().enumerate().map(|(i, norm2)| norm2 * product[(i, 0)]).collect()
    }

    /// Synthesises n values of one axis, E times the k `coefficients`.
    pub fn synthesise(&self, coefficients: &[f64]) -> Vec<f64> {
        let product = &self.vectors * Mat::from_fn(coefficients.len(), 1, |i, _| coefficients[i]);
        (0..product.nrows()).map(|v| product[(v, 0)]).collect()
    }
}

/// Returns the Laplacian (n × n) that the patch is marked with, and the degrees D.
fn laplacian(patch: &Patch) -> (SparseSymmetric, Vec<f64>) {
    match patch.weights.is_empty() {
        true => symmetric_laplacian(patch),
        false => (cotangent_laplacian(patch), vec![1.0; patch.vertices.len()]),
    }
}

/// Returns L = I − D^−½ A D^−½ and the degrees D.
fn symmetric_laplacian(patch: &Patch) -> (SparseSymmetric, Vec<f64>) {
    let mut degrees = vec![0.0; patch.vertices.len()];
    patch.edges.iter().flatten().for_each(|row| degrees[*row as usize] += 1.0);
    let weight = |[a, b]: [u32; 2]| -1.0 / f64::sqrt(degrees[a as usize] * degrees[b as usize]);
    let off_diagonal = patch.edges.iter().map(|&edge| (edge, weight(edge)));
    (SparseSymmetric::new(vec![1.0; degrees.len()], off_diagonal), degrees)
}

/// Returns the Dirichlet Laplacian of a patch, −(cot α + cot β) off the diagonal and rows that sum
/// to 0 (U. Pinkall, K. Polthier, *Computing discrete minimal surfaces and their conjugates*, Exp.
/// Math. 2, 1993), divided by its largest diagonal entry: which eigenvalues are equal must not
/// depend on the unit of the map.
fn cotangent_laplacian(patch: &Patch) -> SparseSymmetric {
    let weighted = patch.edges.iter().zip(&patch.weights);
    let mut diagonal = vec![0.0; patch.vertices.len()];
    for ([a, b], weight) in weighted.clone() {
        diagonal[*a as usize] += weight;
        diagonal[*b as usize] += weight;
    }
    let scale = 1.0 / diagonal.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    diagonal.iter_mut().for_each(|entry| *entry *= scale);
    SparseSymmetric::new(diagonal, weighted.map(|(&edge, weight)| (edge, -weight * scale)))
}

/// Solves for the lowest eigenvalues and eigenvectors of a symmetric matrix, as
/// [`Basis::with_solver`] needs them: it tridiagonalises, solves the tridiagonal problem, and
/// transforms only the resulting columns back. It uses one thread, so that the result does not
/// depend on the number of threads.
#[doc(hidden)]
pub fn tridiagonalise_and_solve(mut matrix: Mat<f64>, count: usize) -> Option<(Vec<f64>, Mat<f64>)> {
    let n = matrix.nrows();
    let block = qr::no_pivoting::factor::recommended_block_size::<f64>(n, n);
    let params: Spec<TridiagParams, f64> = <TridiagParams as Auto<f64>>::auto().into();
    let scratch = StackReq::any_of(&[
        tridiag::tridiag_in_place_scratch::<f64>(n, Par::Seq, params),
        householder::apply_block_householder_sequence_on_the_left_in_place_scratch::<f64>(n - 1, block, n),
    ]);
    let mut memory = MemBuffer::new(scratch);
    let memory = MemStack::new(&mut memory);
    let mut reflectors = Mat::zeros(block, n - 1);
    tridiag::tridiag_in_place(matrix.as_mut(), reflectors.as_mut(), Par::Seq, memory, params);
    let diagonal = (0..n).map(|i| matrix[(i, i)]).collect();
    let below = (0..n - 1).map(|i| matrix[(i + 1, i)]).collect();
    let (values, mut vectors) = Tridiagonal::new(diagonal, below).lowest(count, EQUAL_EIGENVALUES)?;
    vectors.truncate(n, end_of_group(&values, count));
    householder::apply_block_householder_sequence_on_the_left_in_place_with_conj(
        matrix.submatrix(1, 0, n - 1, n - 1),
        reflectors.as_ref(),
        Conj::No,
        vectors.as_mut().subrows_mut(1, n - 1),
        Par::Seq,
        memory,
    );
    Some((values, vectors))
}

/// Returns the end of the group of equal eigenvalues that holds value `count − 1`.
fn end_of_group(values: &[f64], count: usize) -> usize {
    (count..values.len()).find(|&i| values[i] - values[i - 1] >= EQUAL_EIGENVALUES).unwrap_or(values.len())
}

/// Replaces the solver's basis of every group of equal eigenvalues by the canonical one.
fn canonicalise(values: &[f64], vectors: &mut Mat<f64>) {
    let mut probes = Probes::new(vectors.nrows());
    let mut start = 0;
    while start < values.len() {
        let end = end_of_group(values, start + 1);
        let probes = probes.columns(end - start);
        if end - start == 1 {
            let column = vectors.col_as_slice_mut(start);
            let seen: f64 = column.iter().zip(probes.col(0).iter()).map(|(u, f)| u * f).sum();
            column.iter_mut().for_each(|u| *u *= seen.signum());
        } else {
            let group = vectors.as_ref().subcols(start, end - start);
            let rotated = group * canonical_rotation(group, probes);
            vectors.as_mut().subcols_mut(start, end - start).copy_from(rotated);
        }
        start = end;
    }
}

/// Returns the rotation Q (g × g) that takes the eigenvectors U (n × g) of one eigenvalue to a
/// basis that depends on their subspace alone: with probes F (n × g), UᵀF = QR, diag R > 0. Any
/// other orthonormal basis UO gives OᵀQ and so the same UQ. For g = 1 it is the sign of uᵀf.
fn canonical_rotation(group: MatRef<'_, f64>, probes: MatRef<'_, f64>) -> Mat<f64> {
    let size = group.ncols();
    let seen = group.transpose() * probes;
    let factors = seen.qr();
    let (mut rotation, upper) = (factors.compute_thin_Q(), factors.thin_R());
    for i in (0..size).filter(|&i| upper[(i, i)] < 0.0) {
        for row in 0..size {
            rotation[(row, i)] = -rotation[(row, i)];
        }
    }
    rotation
}

/// Fixed pseudo-random test functions on the vertices of a patch. They come from ChaCha20 with a
/// published seed: anyone can reproduce them, and no symmetric map is orthogonal to them by its
/// symmetry.
///
/// Column i is made when a group first needs it; entry (v, i) is uniform in [−1, 1).
struct Probes {
    columns: Mat<f64>,
}

impl Probes {
    fn new(rows: usize) -> Self {
        Probes { columns: Mat::zeros(rows, 0) }
    }

    /// Returns the first `count` columns, n × count.
    fn columns(&mut self, count: usize) -> MatRef<'_, f64> {
        for i in self.columns.ncols()..count {
            let mut stream = ChaCha20Rng::from_seed(*b"meshmark: canonical eigenvectors");
            stream.set_stream(i as u64);
            let uniform = |_, _| stream.next_u64() as i64 as f64 / 2f64.powi(63);
            self.columns.resize_with(self.columns.nrows(), i + 1, uniform);
        }
        self.columns.as_ref().subcols(0, count)
    }
}

/// Turns every column from u_i into e_i = D^−½ u_i / |D^−½ u_i| and returns |D^−½ u_i|².
fn to_unit_columns(vectors: &mut Mat<f64>, degrees: &[f64]) -> Vec<f64> {
    let count = vectors.ncols();
    let factors: Vec<f64> = degrees.iter().map(|degree| 1.0 / degree.sqrt()).collect();
    let to_unit = |i: usize| {
        let column = vectors.col_as_slice_mut(i);
        column.iter_mut().zip(&factors).for_each(|(u, factor)| *u *= factor);
        let norm2: f64 = column.iter().map(|w| w * w).sum();
        let scale = 1.0 / norm2.sqrt();
        column.iter_mut().for_each(|w| *w *= scale);
        norm2
    };
    (0..count).map(to_unit).collect()
}
