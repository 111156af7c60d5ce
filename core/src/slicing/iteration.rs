//! Inverse iteration: the eigenvectors, for a batch of guesses of eigenvalues.
//!
//! With θ = xᵀAx and the residual r = (A − θ) x, the direction of (A − σ)⁻¹ x is that of
//! x − (A − σ)⁻¹ r. The residual is small and computed in double precision, so a factor in single
//! precision suffices: every step reduces the error by its rounding, or by the distance of σ over
//! the gap (B. N. Parlett, *The Symmetric Eigenvalue Problem*, SIAM, 1998, chapter 4; iterative
//! refinement: J. H. Wilkinson, *Rounding Errors in Algebraic Processes*, 1963).

use super::{
    factor::Factor,
    lanes::{LANES, Lanes, Real, add_product, double, one_row_at_a_time, product, rounded, subtract_product},
    matrix::SparseSymmetric,
    symbolic::Symbolic,
};
use pulp::{Arch, Simd, WithSimd};

/// A residual this small, relative to the norm of the matrix, needs no further step.
pub const SMALL_RESIDUAL: f64 = 2e-15;

/// A vector with a smaller residual is not improved together with others.
const LEAST_RESIDUAL: f64 = 2e-16;

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
    steps: usize,
}

impl<T: Real> WithSimd for Iteration<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Iteration { batch, matrix, symbolic, factor, guesses, norm, steps } = self;
        factor.factorise(matrix, symbolic, guesses);
        batch.iterate_with(matrix, symbolic, factor, SMALL_RESIDUAL * norm, steps);
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
    /// the matrix, but improves the vectors at most `steps` times.
    pub fn iterate(
        &mut self,
        (matrix, norm): (&SparseSymmetric, f64),
        symbolic: &Symbolic,
        factor: &mut Factor<T>,
        guesses: &Lanes<f64>,
        steps: usize,
    ) {
        Arch::new().dispatch(Iteration { batch: self, matrix, symbolic, factor, guesses, norm, steps });
    }

    #[inline(always)]
    fn iterate_with(
        &mut self,
        matrix: &SparseSymmetric,
        symbolic: &Symbolic,
        factor: &Factor<T>,
        small: f64,
        steps: usize,
    ) {
        // What is done with the other lanes costs nothing. In double precision a shift may be so close
        // to the eigenvalue that the correction is no more than rounding.
        let least = if T::IS_SINGLE { LEAST_RESIDUAL / SMALL_RESIDUAL * small } else { small };
        self.start(symbolic, factor);
        self.measure(matrix);
        for _ in 0..steps {
            if self.residuals.iter().all(|residual| *residual < small) {
                break;
            }
            self.improve(symbolic, factor, least);
            self.measure(matrix);
        }
    }

    /// Starts with (A − σ)⁻¹ b, where b is pseudo-random.
    #[inline(always)]
    fn start(&mut self, symbolic: &Symbolic, factor: &Factor<T>) {
        let mut state = 0x9e37_79b9_7f4a_7c15u64;
        for entry in &mut self.correction {
            one_row_at_a_time();
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // Uniform in [−1, 1).
            let value = (state as i64 >> 11) as f64 / 2f64.powi(52);
            *entry = [T::rounded(value); LANES];
        }
        factor.solve(symbolic, &mut self.correction);
        let mut squares = [0.0; LANES];
        for (vector, solution) in self.vectors.iter_mut().zip(&self.correction) {
            one_row_at_a_time();
            *vector = double(solution);
            add_product(&mut squares, vector, vector);
        }
        self.normalise(&squares);
    }

    /// Updates values and residuals. The sum q = xᵀAx is long, so that θ = q + xᵀ(A − q) x has less
    /// rounding, and r is orthogonal to x: what it has of x would be magnified by the next step.
    #[inline(always)]
    fn measure(&mut self, matrix: &SparseSymmetric) {
        let quotients = matrix.multiply(&self.vectors, &mut self.image);
        let mut squares = [0.0; LANES];
        let mut rests = [0.0; LANES];
        for (image, vector) in self.image.iter_mut().zip(&self.vectors) {
            one_row_at_a_time();
            subtract_product(image, &quotients, vector);
            add_product(&mut squares, image, image);
            add_product(&mut rests, image, vector);
        }
        for lane in 0..LANES {
            let rest = rests[lane];
            self.values[lane] = quotients[lane] + rest;
            self.residuals[lane] = (squares[lane] - rest * rest).max(0.0).sqrt();
        }
        self.rests = rests;
    }

    /// Replaces x by the direction of x − (A − σ)⁻¹ r where r is not small yet.
    #[inline(always)]
    fn improve(&mut self, symbolic: &Symbolic, factor: &Factor<T>, small: f64) {
        let mut steps = self.residuals;
        steps.iter_mut().filter(|step| **step < small).for_each(|step| *step = 0.0);
        let scales: Lanes<f64> = std::array::from_fn(|lane| 1.0 / self.residuals[lane].max(1e-300));
        let rests = self.rests;
        let residuals = self.image.iter().zip(&self.vectors);
        for (to, (image, vector)) in self.correction.iter_mut().zip(residuals) {
            one_row_at_a_time();
            let mut residual = *image;
            subtract_product(&mut residual, &rests, vector);
            *to = rounded(&product(&residual, &scales));
        }
        factor.solve(symbolic, &mut self.correction);
        let mut squares = [0.0; LANES];
        for (vector, correction) in self.vectors.iter_mut().zip(&self.correction) {
            one_row_at_a_time();
            subtract_product(vector, &steps, &double(correction));
            add_product(&mut squares, vector, vector);
        }
        self.normalise(&squares);
    }

    #[inline(always)]
    fn normalise(&mut self, squares: &Lanes<f64>) {
        let scales = squares.map(|square| 1.0 / square.sqrt());
        for vector in &mut self.vectors {
            one_row_at_a_time();
            *vector = product(vector, &scales);
        }
    }

    /// Copies the vector of a lane to the rows `order` of a column.
    pub fn copy_vector(&self, lane: usize, order: &[u32], column: &mut [f64]) {
        for (&row, entries) in order.iter().zip(&self.vectors) {
            column[row as usize] = entries[lane];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slicing::ordering::Ordering;
    use pulp::Scalar;

    /// Iterates with one instruction set or another, and returns all bits of the result.
    fn bits<T: Real>(run: impl Fn(Iteration<'_, T>)) -> Vec<u64> {
        let chain = (1..90u32).map(|row| ([row - 1, row], -0.5));
        let chords = (9..90u32).map(|row| ([row - 9, row], -0.1 - f64::from(row % 5) / 50.0));
        let matrix = SparseSymmetric::new(vec![1.0; 90], chain.chain(chords));
        let ordering = Ordering::of_minimum_degree(&matrix, usize::MAX).unwrap();
        let matrix = matrix.permuted(&ordering.order);
        let symbolic = Symbolic::new(&matrix, &ordering);
        let mut factor = Factor::<T>::new(&symbolic, 90);
        let mut batch = Batch::new(90);
        let guesses = std::array::from_fn(|lane| 0.11 * lane as f64);
        run(Iteration {
            batch: &mut batch,
            matrix: &matrix,
            symbolic: &symbolic,
            factor: &mut factor,
            guesses: &guesses,
            norm: 2.0,
            steps: 3,
        });
        let numbers = batch.vectors.as_flattened().iter().chain(&batch.values).chain(&batch.residuals);
        numbers.map(|number| number.to_bits()).collect()
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits() {
        fn check<T: Real>() {
            let scalar = bits::<T>(|iteration| Simd::vectorize(Scalar::new(), iteration));
            assert!(scalar.iter().any(|bits| *bits != scalar[0]));
            assert!(bits::<T>(|iteration| Arch::new().dispatch(iteration)) == scalar);
            #[cfg(target_arch = "x86_64")]
            if let Some(avx2) = pulp::x86::V3::try_new() {
                assert!(bits::<T>(|iteration| Simd::vectorize(avx2, iteration)) == scalar);
            }
        }
        check::<f32>();
        check::<f64>();
    }
}
