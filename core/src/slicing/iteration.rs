//! Inverse iteration: the eigenvectors, for a batch of guesses of eigenvalues.
//!
//! With θ = xᵀAx and the residual r = (A − θ) x, the direction of (A − σ)⁻¹ x is that of
//! x − (A − σ)⁻¹ r. The residual is small and computed in double precision, so a factor in single
//! precision suffices: every step reduces the error by its rounding, or by the distance of σ over
//! the gap (B. N. Parlett, *The Symmetric Eigenvalue Problem*, SIAM, 1998, chapter 4; iterative
//! refinement: J. H. Wilkinson, *Rounding Errors in Algebraic Processes*, 1963).

use super::{
    factor::Factor,
    lanes::{LANES, Lanes, Real},
    matrix::SparseSymmetric,
    symbolic::Symbolic,
};
use pulp::{Arch, Simd, WithSimd};

/// A vector is improved at most this often.
const STEPS: usize = 7;
/// A residual this small, relative to the norm of the matrix, needs no further step.
pub const SMALL_RESIDUAL: f64 = 1e-15;

/// A batch of vectors under iteration.
pub struct Batch<T> {
    /// n entries of the vectors x.
    pub vectors: Vec<Lanes<f64>>,
    /// The Rayleigh quotients θ.
    pub values: Lanes<f64>,
    /// |(A − θ) x|.
    pub residuals: Lanes<f64>,
    /// (A − q) x, where q is xᵀAx as a rounded sum.
    image: Vec<Lanes<f64>>,
    /// θ − q.
    rests: Lanes<f64>,
    correction: Vec<Lanes<T>>,
}

/// [`Batch::iterate`], compiled for every instruction set.
struct Iteration<'a, T> {
    batch: &'a mut Batch<T>,
    matrix: &'a SparseSymmetric,
    symbolic: &'a Symbolic,
    factor: &'a mut Factor<T>,
    guesses: &'a Lanes<f64>,
    norm: f64,
}

impl<T: Real> WithSimd for Iteration<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Iteration { batch, matrix, symbolic, factor, guesses, norm } = self;
        batch.iterate_all(matrix, symbolic, factor, guesses, norm);
    }
}

impl<T: Real> Batch<T> {
    /// Makes room for vectors of `size` entries.
    pub fn new(size: usize) -> Self {
        Batch {
            vectors: vec![[0.0; LANES]; size],
            values: [0.0; LANES],
            residuals: [f64::INFINITY; LANES],
            image: vec![[0.0; LANES]; size],
            rests: [0.0; LANES],
            correction: vec![[T::default(); LANES]; size],
        }
    }

    /// Iterates from guesses of eigenvalues until all residuals are small, relative to the norm of
    /// the matrix, or as often as is worth it.
    pub fn iterate(
        &mut self,
        (matrix, norm): (&SparseSymmetric, f64),
        symbolic: &Symbolic,
        factor: &mut Factor<T>,
        guesses: &Lanes<f64>,
    ) {
        Arch::new().dispatch(Iteration { batch: self, matrix, symbolic, factor, guesses, norm });
    }

    #[inline(always)]
    fn iterate_all(
        &mut self,
        matrix: &SparseSymmetric,
        symbolic: &Symbolic,
        factor: &mut Factor<T>,
        guesses: &Lanes<f64>,
        norm: f64,
    ) {
        factor.factorise(matrix, symbolic, guesses);
        self.start(symbolic, factor);
        self.measure(matrix);
        let small = SMALL_RESIDUAL * norm;
        for _ in 1..STEPS {
            if self.residuals.iter().all(|residual| *residual < small) {
                break;
            }
            self.improve(symbolic, factor, small);
            self.measure(matrix);
        }
    }

    /// Starts with (A − σ)⁻¹ b, where b is pseudo-random.
    #[inline(always)]
    fn start(&mut self, symbolic: &Symbolic, factor: &Factor<T>) {
        let mut state = 0x9e37_79b9_7f4a_7c15u64;
        for entry in &mut self.correction {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // Uniform in [−1, 1).
            let value = (state as i64 >> 11) as f64 / 2f64.powi(52);
            *entry = [T::rounded(value); LANES];
        }
        factor.solve(symbolic, &mut self.correction);
        let mut squares = [0.0; LANES];
        for (vector, solution) in self.vectors.iter_mut().zip(&self.correction) {
            for lane in 0..LANES {
                vector[lane] = solution[lane].double();
                squares[lane] += vector[lane] * vector[lane];
            }
        }
        self.normalise(&squares);
    }

    /// Updates values and residuals. The sum q = xᵀAx is long, so that θ = q + xᵀ(A − q) x has less
    /// rounding, and r is orthogonal to x: what it has of x would be magnified by the next step.
    #[inline(always)]
    fn measure(&mut self, matrix: &SparseSymmetric) {
        let quotients = matrix.multiply(&self.vectors, &mut self.image);
        let mut squares = [0.0; LANES];
        self.rests = [0.0; LANES];
        for (image, vector) in self.image.iter_mut().zip(&self.vectors) {
            for lane in 0..LANES {
                image[lane] -= quotients[lane] * vector[lane];
                squares[lane] += image[lane] * image[lane];
                self.rests[lane] += image[lane] * vector[lane];
            }
        }
        for lane in 0..LANES {
            let rest = self.rests[lane];
            self.values[lane] = quotients[lane] + rest;
            self.residuals[lane] = (squares[lane] - rest * rest).max(0.0).sqrt();
        }
    }

    /// Replaces x by the direction of x − (A − σ)⁻¹ r where r is not small yet.
    #[inline(always)]
    fn improve(&mut self, symbolic: &Symbolic, factor: &Factor<T>, small: f64) {
        let mut steps = self.residuals;
        steps.iter_mut().filter(|step| **step < small).for_each(|step| *step = 0.0);
        let scales: Lanes<f64> = std::array::from_fn(|lane| 1.0 / self.residuals[lane].max(1e-300));
        let residuals = self.image.iter().zip(&self.vectors);
        for (to, (image, vector)) in self.correction.iter_mut().zip(residuals) {
            for lane in 0..LANES {
                to[lane] = T::rounded((image[lane] - self.rests[lane] * vector[lane]) * scales[lane]);
            }
        }
        factor.solve(symbolic, &mut self.correction);
        let mut squares = [0.0; LANES];
        for (vector, correction) in self.vectors.iter_mut().zip(&self.correction) {
            for lane in 0..LANES {
                vector[lane] -= steps[lane] * correction[lane].double();
                squares[lane] += vector[lane] * vector[lane];
            }
        }
        self.normalise(&squares);
    }

    #[inline(always)]
    fn normalise(&mut self, squares: &Lanes<f64>) {
        let scales = squares.map(|square| 1.0 / square.sqrt());
        for vector in &mut self.vectors {
            for lane in 0..LANES {
                vector[lane] *= scales[lane];
            }
        }
    }

    /// Copies the vector of a lane to the rows `order` of a column.
    pub fn copy_vector(&self, lane: usize, order: &[u32], column: &mut [f64]) {
        for (&row, entries) in order.iter().zip(&self.vectors) {
            column[row as usize] = entries[lane];
        }
    }
}
