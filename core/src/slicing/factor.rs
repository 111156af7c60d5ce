//! The numeric factor: L D Lᵀ = A − σ for the shifts σ of a batch, without pivoting.
//!
//! By Sylvester's law of inertia A has as many eigenvalues below σ as D has negative entries, and
//! det(A − σ) is their product (B. N. Parlett, *The Symmetric Eigenvalue Problem*, SIAM, 1998,
//! chapter 3). Without pivoting the factor is inaccurate where a pivot is small, so whoever needs
//! certainty reads [`Factor::error_bounds`].

use super::{
    lanes::{LANES, Lanes, Real, subtract_product},
    matrix::SparseSymmetric,
    symbolic::Symbolic,
};
use pulp::{Arch, Simd, WithSimd};

/// Pivots after which the product of all is scaled.
const SCALED_PIVOTS: usize = 8;

/// The factors of a batch.
pub struct Factor<T> {
    /// D.
    pivots: Vec<Lanes<T>>,
    /// 1 / D.
    inverses: Vec<Lanes<T>>,
    /// L.
    lower: Vec<Lanes<T>>,
    /// The column of L D in work.
    column: Vec<Lanes<T>>,
}

/// [`Factor::evaluate`], compiled for every instruction set.
struct Evaluation<'a, T> {
    factor: &'a mut Factor<T>,
    matrix: &'a SparseSymmetric,
    symbolic: &'a Symbolic,
    shifts: &'a Lanes<f64>,
}

impl<T: Real> WithSimd for Evaluation<'_, T> {
    type Output = Lanes<Inertia>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.factor.factorise(self.matrix, self.symbolic, self.shifts);
        self.factor.inertias()
    }
}

/// The number of eigenvalues below a shift, and the determinant there.
#[derive(Debug, Clone, Copy, Default)]
pub struct Inertia {
    /// The number of negative pivots.
    pub below: usize,
    /// |det(A − σ)| = `mantissa` · 2^`exponent`.
    pub mantissa: f64,
    /// See `mantissa`.
    pub exponent: i32,
}

impl<T: Real> Factor<T> {
    /// Makes room for the factors of a matrix.
    pub fn new(symbolic: &Symbolic, size: usize) -> Self {
        let zeros = |count| vec![[T::default(); LANES]; count];
        let widest = symbolic.columns().map(|(_, rows)| rows.len()).max().unwrap_or(0);
        Factor {
            pivots: zeros(size),
            inverses: zeros(size),
            lower: zeros(symbolic.entries()),
            column: zeros(widest),
        }
    }

    /// Factorises A − σ and returns inertia and determinant of every shift.
    pub fn evaluate(
        &mut self,
        matrix: &SparseSymmetric,
        symbolic: &Symbolic,
        shifts: &Lanes<f64>,
    ) -> Lanes<Inertia> {
        Arch::new().dispatch(Evaluation { factor: self, matrix, symbolic, shifts })
    }

    /// Factorises A − σ.
    #[inline(always)]
    pub fn factorise(&mut self, matrix: &SparseSymmetric, symbolic: &Symbolic, shifts: &Lanes<f64>) {
        self.load(matrix, symbolic, shifts);
        let mut targets = symbolic.targets();
        for (step, (start, rows)) in symbolic.columns().enumerate() {
            let inverse = self.invert_pivot(step);
            let end = start + rows.len();
            let (head, tail) = self.lower.split_at_mut(end);
            let column = &mut self.column[..rows.len()];
            for (scaled, entry) in head[start..].iter_mut().zip(column.iter_mut()) {
                *entry = *scaled;
                for lane in 0..LANES {
                    scaled[lane] = scaled[lane] * inverse[lane];
                }
            }
            let scaled = &head[start..];
            for (b, (&row, entry)) in rows.iter().zip(column.iter()).enumerate() {
                let entry = &{ *entry }; // in registers
                subtract_product(&mut self.pivots[row as usize], &scaled[b], entry);
                let (own, rest) = targets.split_at(rows.len() - b - 1);
                for (target, scaled) in own.iter().zip(&scaled[b + 1..]) {
                    subtract_product(&mut tail[*target as usize - end], scaled, entry);
                }
                targets = rest;
            }
        }
    }

    /// Fills the factor with A − σ.
    #[inline(always)]
    fn load(&mut self, matrix: &SparseSymmetric, symbolic: &Symbolic, shifts: &Lanes<f64>) {
        for (pivot, diagonal) in self.pivots.iter_mut().zip(matrix.diagonal()) {
            for lane in 0..LANES {
                pivot[lane] = T::rounded(diagonal - shifts[lane]);
            }
        }
        self.lower.fill([T::default(); LANES]);
        for &(place, value) in &symbolic.own {
            self.lower[place as usize] = [T::rounded(value); LANES];
        }
    }

    /// Keeps the pivot of a step away from 0, and inverts it.
    #[inline(always)]
    fn invert_pivot(&mut self, step: usize) -> Lanes<T> {
        let pivot = &mut self.pivots[step];
        let inverse = &mut self.inverses[step];
        for lane in 0..LANES {
            let least = T::LEAST_PIVOT;
            let is_small = pivot[lane] < least && -pivot[lane] < least;
            pivot[lane] = if is_small { least } else { pivot[lane] };
            inverse[lane] = T::ONE / pivot[lane];
        }
        *inverse
    }

    /// Returns inertia and determinant of every shift.
    #[inline(always)]
    fn inertias(&self) -> Lanes<Inertia> {
        let mut below = [0u64; LANES];
        let mut product = [1.0f64; LANES];
        let mut exponents = [0i64; LANES];
        for pivots in self.pivots.chunks(SCALED_PIVOTS) {
            for pivot in pivots {
                for lane in 0..LANES {
                    product[lane] *= pivot[lane].double();
                    below[lane] += pivot[lane].double().to_bits() >> 63;
                }
            }
            for lane in 0..LANES {
                let bits = product[lane].to_bits();
                exponents[lane] += (bits >> 52 & 0x7ff) as i64 - 1023;
                product[lane] = f64::from_bits(bits & 0x000f_ffff_ffff_ffff | 1023 << 52);
            }
        }
        std::array::from_fn(|lane| Inertia {
            below: below[lane] as usize,
            mantissa: product[lane],
            exponent: exponents[lane] as i32,
        })
    }

    /// Returns for every shift a bound of the norm of L D Lᵀ − (A − σ), in double precision.
    ///
    /// Entry by entry the error is at most n ε |L| |D| |L|ᵀ (N. J. Higham, *Accuracy and Stability
    /// of Numerical Algorithms*, SIAM, 2002, theorem 9.3), and the norm of this positive
    /// semidefinite matrix is at most its trace.
    pub fn error_bounds(&self, symbolic: &Symbolic) -> Lanes<f64> {
        let mut traces = [0.0; LANES];
        for ((start, rows), pivot) in symbolic.columns().zip(&self.pivots) {
            let mut squares = [1.0; LANES];
            for entry in &self.lower[start..start + rows.len()] {
                for lane in 0..LANES {
                    let value = entry[lane].double();
                    squares[lane] += value * value;
                }
            }
            for lane in 0..LANES {
                traces[lane] += squares[lane] * pivot[lane].double().abs();
            }
        }
        traces.map(|trace| (self.pivots.len() + 10) as f64 * f64::EPSILON * trace)
    }

    /// Solves (A − σ) z = b in place.
    #[inline(always)]
    pub fn solve(&self, symbolic: &Symbolic, vectors: &mut [Lanes<T>]) {
        for (step, (start, rows)) in symbolic.columns().enumerate() {
            let entries = &self.lower[start..start + rows.len()];
            let known = vectors[step];
            for (row, entry) in rows.iter().zip(entries) {
                subtract_product(&mut vectors[*row as usize], entry, &known);
            }
            for lane in 0..LANES {
                vectors[step][lane] = known[lane] * self.inverses[step][lane];
            }
        }
        for (step, (start, rows)) in symbolic.columns().enumerate().rev() {
            let entries = &self.lower[start..start + rows.len()];
            let mut sum = vectors[step];
            for (row, entry) in rows.iter().zip(entries) {
                subtract_product(&mut sum, entry, &vectors[*row as usize]);
            }
            vectors[step] = sum;
        }
    }
}
