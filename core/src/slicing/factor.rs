//! The numeric factor: L D Lᵀ = A − σ for the shifts σ of a batch, without pivoting.
//!
//! By Sylvester's law of inertia A has as many eigenvalues below σ as D has negative entries, and
//! det(A − σ) is their product (B. N. Parlett, *The Symmetric Eigenvalue Problem*, SIAM, 1998,
//! chapter 3). Without pivoting the factor is inaccurate where a pivot is small, so whoever needs
//! certainty reads [`Factor::error_bounds`].

use super::{
    lanes::{LANES, Lanes, Real, one_row_at_a_time, product, subtract_product},
    matrix::SparseSymmetric,
    symbolic::{Panel, Symbolic, WIDEST_PANEL},
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
    /// The columns of L D of the panel in work.
    unscaled: [Vec<Lanes<T>>; WIDEST_PANEL],
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
        Factor {
            pivots: zeros(size),
            inverses: zeros(size),
            lower: zeros(symbolic.entries()),
            unscaled: std::array::from_fn(|_| zeros(symbolic.longest_column())),
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
        for panel in symbolic.panels() {
            self.factorise_panel(symbolic, *panel);
            targets = match panel.width {
                1 => self.update::<1>(symbolic, panel.first, targets),
                2 => self.update::<2>(symbolic, panel.first, targets),
                3 => self.update::<3>(symbolic, panel.first, targets),
                _ => self.update::<WIDEST_PANEL>(symbolic, panel.first, targets),
            };
        }
    }

    /// Factorises the columns of a panel.
    #[inline(always)]
    fn factorise_panel(&mut self, symbolic: &Symbolic, Panel { first, width }: Panel) {
        for step in first..first + width {
            let inverse = self.invert_pivot(step);
            let (start, rows) = symbolic.column(step);
            let unscaled = &mut self.unscaled[step - first];
            for (scaled, unscaled) in
                self.lower[start..start + rows.len()].iter_mut().zip(unscaled.iter_mut())
            {
                *unscaled = *scaled;
                *scaled = product(scaled, &inverse);
            }
            for (b, later) in (step + 1..first + width).enumerate() {
                let entry = unscaled[b];
                subtract_product(&mut self.pivots[later], &self.lower[start + b], &entry);
                let (next, rows) = symbolic.column(later);
                let (head, tail) = self.lower.split_at_mut(next);
                for (target, scaled) in tail[..rows.len()].iter_mut().zip(&head[start + b + 1..]) {
                    subtract_product(target, scaled, &entry);
                }
            }
        }
    }

    /// Subtracts the products of the W columns of a panel from the entries to its right, and
    /// returns the targets of the next panel.
    #[inline(always)]
    fn update<'a, const W: usize>(
        &mut self,
        symbolic: &Symbolic,
        first: usize,
        mut targets: &'a [u32],
    ) -> &'a [u32] {
        let (start, rows) = symbolic.column(first + W - 1);
        let end = start + rows.len();
        let (head, tail) = self.lower.split_at_mut(end);
        let scaled = below_panel::<T, W>(head, symbolic, first);
        for (b, &row) in rows.iter().enumerate() {
            let mut entries = [[T::default(); LANES]; W];
            for c in 0..W {
                entries[c] = self.unscaled[c][W - 1 - c + b];
            }
            let mut pivot = self.pivots[row as usize];
            for c in 0..W {
                subtract_product(&mut pivot, &scaled[c][b], &entries[c]);
            }
            self.pivots[row as usize] = pivot;
            let (own, rest) = targets.split_at(rows.len() - b - 1);
            for (i, target) in own.iter().enumerate() {
                let target = &mut tail[*target as usize - end];
                let mut sum = *target;
                for c in 0..W {
                    subtract_product(&mut sum, &scaled[c][b + 1 + i], &entries[c]);
                }
                *target = sum;
            }
            targets = rest;
        }
        targets
    }

    /// Fills the factor with A − σ.
    #[inline(always)]
    fn load(&mut self, matrix: &SparseSymmetric, symbolic: &Symbolic, shifts: &Lanes<f64>) {
        for (pivot, diagonal) in self.pivots.iter_mut().zip(matrix.diagonal()) {
            one_row_at_a_time();
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
        let mut products = [1.0f64; LANES];
        let mut exponents = [0i64; LANES];
        for pivots in self.pivots.chunks(SCALED_PIVOTS) {
            for pivot in pivots {
                one_row_at_a_time();
                for lane in 0..LANES {
                    products[lane] *= pivot[lane].double();
                    below[lane] += pivot[lane].double().to_bits() >> 63;
                }
            }
            for lane in 0..LANES {
                let bits = products[lane].to_bits();
                exponents[lane] += (bits >> 52 & 0x7ff) as i64 - 1023;
                products[lane] = f64::from_bits(bits & 0x000f_ffff_ffff_ffff | 1023 << 52);
            }
        }
        std::array::from_fn(|lane| Inertia {
            below: below[lane] as usize,
            mantissa: products[lane],
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
        for (column, pivot) in self.pivots.iter().enumerate() {
            let (start, rows) = symbolic.column(column);
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
        for panel in symbolic.panels() {
            match panel.width {
                1 => self.forward::<1>(symbolic, panel.first, vectors),
                2 => self.forward::<2>(symbolic, panel.first, vectors),
                3 => self.forward::<3>(symbolic, panel.first, vectors),
                _ => self.forward::<WIDEST_PANEL>(symbolic, panel.first, vectors),
            }
        }
        for panel in symbolic.panels().iter().rev() {
            match panel.width {
                1 => self.backward::<1>(symbolic, panel.first, vectors),
                2 => self.backward::<2>(symbolic, panel.first, vectors),
                3 => self.backward::<3>(symbolic, panel.first, vectors),
                _ => self.backward::<WIDEST_PANEL>(symbolic, panel.first, vectors),
            }
        }
    }

    /// Solves L D y = b for the rows of a panel, and takes them out of the rows below it.
    #[inline(always)]
    fn forward<const W: usize>(&self, symbolic: &Symbolic, first: usize, vectors: &mut [Lanes<T>]) {
        let mut known = [[T::default(); LANES]; W];
        for c in 0..W {
            known[c] = vectors[first + c];
            let (start, _) = symbolic.column(first + c);
            for later in c + 1..W {
                let entry = &self.lower[start + later - c - 1];
                subtract_product(&mut vectors[first + later], entry, &known[c]);
            }
            vectors[first + c] = product(&known[c], &self.inverses[first + c]);
        }
        let (_, rows) = symbolic.column(first + W - 1);
        let entries = below_panel::<T, W>(&self.lower, symbolic, first);
        for (i, row) in rows.iter().enumerate() {
            let mut sum = vectors[*row as usize];
            for c in 0..W {
                subtract_product(&mut sum, &entries[c][i], &known[c]);
            }
            vectors[*row as usize] = sum;
        }
    }

    /// Solves Lᵀ z = y for the rows of a panel.
    #[inline(always)]
    fn backward<const W: usize>(&self, symbolic: &Symbolic, first: usize, vectors: &mut [Lanes<T>]) {
        let mut sums = [[T::default(); LANES]; W];
        sums.copy_from_slice(&vectors[first..first + W]);
        let (_, rows) = symbolic.column(first + W - 1);
        let entries = below_panel::<T, W>(&self.lower, symbolic, first);
        for (i, row) in rows.iter().enumerate() {
            let known = vectors[*row as usize];
            for c in 0..W {
                subtract_product(&mut sums[c], &entries[c][i], &known);
            }
        }
        for c in (0..W).rev() {
            let (start, _) = symbolic.column(first + c);
            for later in c + 1..W {
                let known = vectors[first + later];
                subtract_product(&mut sums[c], &self.lower[start + later - c - 1], &known);
            }
            vectors[first + c] = sums[c];
        }
    }
}

/// Returns the entries of the W columns of a panel in the rows below it.
#[inline(always)]
fn below_panel<'a, T, const W: usize>(
    lower: &'a [Lanes<T>],
    symbolic: &Symbolic,
    first: usize,
) -> [&'a [Lanes<T>]; W] {
    let mut columns: [&[Lanes<T>]; W] = [&[]; W];
    for (c, column) in columns.iter_mut().enumerate() {
        let (start, rows) = symbolic.column(first + c);
        *column = &lower[start + W - 1 - c..start + rows.len()];
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slicing::ordering::Ordering;
    use proptest::prelude::*;

    /// Returns the largest entry of (A − σ) z − b over the largest of z, and whether the counts are
    /// those of nalgebra.
    fn check<T: Real>(matrix: &SparseSymmetric, shifts: &Lanes<f64>, values: &[f64]) -> (f64, bool) {
        let ordering = Ordering::of_minimum_degree(matrix, usize::MAX).unwrap();
        let permuted = matrix.permuted(&ordering.order);
        let symbolic = Symbolic::new(&permuted, &ordering);
        let mut factor = Factor::<T>::new(&symbolic, matrix.size());
        let inertias = factor.evaluate(&permuted, &symbolic, shifts);
        let counts_agree = (0..LANES)
            .all(|lane| inertias[lane].below == values.iter().filter(|value| **value < shifts[lane]).count());
        let right = |row: usize| (row % 7) as f64 - 3.0;
        let mut solved: Vec<Lanes<T>> =
            (0..matrix.size()).map(|row| [T::rounded(right(row)); LANES]).collect();
        factor.solve(&symbolic, &mut solved);
        let solved: Vec<Lanes<f64>> = solved.iter().map(crate::slicing::lanes::double).collect();
        let mut image = solved.clone();
        permuted.multiply(&solved, &mut image);
        let mut worst = 0.0f64;
        for lane in 0..LANES {
            let largest = solved.iter().map(|entries| entries[lane].abs()).fold(1.0, f64::max);
            for row in 0..matrix.size() {
                let miss = image[row][lane] - shifts[lane] * solved[row][lane] - right(row);
                worst = worst.max(miss.abs() / largest);
            }
        }
        (worst, counts_agree)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn solutions_solve_and_counts_are_those_of_nalgebra(
            diagonal in prop::collection::vec(-1.0..1.0f64, 60),
            entries in prop::collection::btree_map((0..60u32, 0..60u32), -1.0..1.0f64, 0..150),
            first in -3.0..-2.0f64,
        ) {
            let lower = entries.iter().filter(|((a, b), _)| a > b).map(|(&(a, b), &value)| ([b, a], value));
            let matrix = SparseSymmetric::new(diagonal, lower);
            let dense = matrix.to_dense();
            let dense = nalgebra::DMatrix::from_fn(60, 60, |i, j| dense[(i, j)]);
            let values: Vec<f64> = dense.symmetric_eigenvalues().iter().copied().collect();
            let shifts: Lanes<f64> = std::array::from_fn(|lane| first + 0.31 * lane as f64);
            let gap = |shift: &f64| values.iter().map(|v| (v - shift).abs()).fold(f64::MAX, f64::min);
            prop_assume!(shifts.iter().all(|shift| gap(shift) > 1e-3));
            let (double, double_counts) = check::<f64>(&matrix, &shifts, &values);
            prop_assert!(double < 1e-8 && double_counts, "{}", double);
            // A small pivot costs digits, of which single precision has few.
            let (single, _) = check::<f32>(&matrix, &shifts, &values);
            prop_assert!(single < 1.0, "{}", single);
        }
    }
}
