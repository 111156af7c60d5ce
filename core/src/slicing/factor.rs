//! The numeric factor: L D Lᵀ = A − σ for the shifts σ of a batch, without pivoting.
//!
//! By Sylvester's law of inertia A has as many eigenvalues below σ as D has negative entries, and
//! det(A − σ) is their product (B. N. Parlett, *The Symmetric Eigenvalue Problem*, SIAM, 1998,
//! chapter 3). Without pivoting the factor is inaccurate where a pivot is small, so whoever needs
//! certainty reads [`Factor::error_bounds`].

use super::{
    lanes::{LANES, Lanes, Real, add_product, one_row_at_a_time, product, subtract_product},
    matrix::SparseSymmetric,
    symbolic::{Panel, Symbolic, WIDEST_PANEL},
};
use pulp::{Arch, Simd, WithSimd};

/// Pivots after which the product of all is scaled.
const SCALED_PIVOTS: usize = 8;

/// The factors of a batch.
pub struct Factor<T> {
    /// 1 / D.
    inverses: Vec<Lanes<T>>,
    /// L D, panel by panel.
    entries: Vec<Lanes<T>>,
}

/// 1 / D of a panel of W columns, its own rows, and those below it.
type Parts<'a, T, const W: usize> = (&'a [Lanes<T>; W], &'a [[Lanes<T>; W]; W], &'a [[Lanes<T>; W]]);

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
        self.factor.inertias(self.symbolic)
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
        Factor { inverses: zeros(size), entries: zeros(symbolic.entries()) }
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
            let rows = symbolic.rows(panel).len();
            let (own, rest) = targets.split_at(rows * (rows + 1) / 2);
            match panel.width {
                1 => self.eliminate::<1>(panel, own),
                2 => self.eliminate::<2>(panel, own),
                3 => self.eliminate::<3>(panel, own),
                _ => self.eliminate::<WIDEST_PANEL>(panel, own),
            }
            targets = rest;
        }
    }

    /// Fills the factor with A − σ.
    #[inline(always)]
    fn load(&mut self, matrix: &SparseSymmetric, symbolic: &Symbolic, shifts: &Lanes<f64>) {
        self.entries.fill([T::default(); LANES]);
        for &(place, value) in &symbolic.own {
            self.entries[place as usize] = [T::rounded(value); LANES];
        }
        for (place, diagonal) in symbolic.diagonal().iter().zip(matrix.diagonal()) {
            one_row_at_a_time();
            let mut entry = [T::default(); LANES];
            for lane in 0..LANES {
                entry[lane] = T::rounded(diagonal - shifts[lane]);
            }
            self.entries[*place as usize] = entry;
        }
    }

    /// Factorises a panel of W columns, and subtracts their products from the entries to its right.
    #[inline(always)]
    fn eliminate<const W: usize>(&mut self, panel: &Panel, targets: &[u32]) {
        let [start, end] = panel.entries;
        let (before, right) = self.entries.split_at_mut(end);
        let (rows, _) = before[start..].as_chunks_mut::<W>();
        let inverses: &mut [Lanes<T>; W] =
            (&mut self.inverses[panel.first..][..W]).try_into().expect("W columns");
        let (own, below) = rows.split_at_mut(W);
        let factors = triangle(own.try_into().expect("W rows"), inverses);
        for row in below.iter_mut() {
            one_row_at_a_time();
            *row = reduced(row, &factors);
        }
        let mut below = &*below;
        let mut targets = targets;
        while let Some(first) = below.first() {
            let mut factors = *first;
            for c in 0..W {
                factors[c] = product(&first[c], &inverses[c]);
            }
            let (own, rest) = targets.split_at(below.len());
            for (target, row) in own.iter().zip(below) {
                one_row_at_a_time();
                let target = &mut right[*target as usize - end];
                let mut sum = *target;
                for c in 0..W {
                    subtract_product(&mut sum, &row[c], &factors[c]);
                }
                *target = sum;
            }
            targets = rest;
            below = &below[1..];
        }
    }

    /// Returns inertia and determinant of every shift.
    #[inline(always)]
    fn inertias(&self, symbolic: &Symbolic) -> Lanes<Inertia> {
        let mut below = [0u64; LANES];
        let mut products = [1.0f64; LANES];
        let mut exponents = [0i64; LANES];
        for places in symbolic.diagonal().chunks(SCALED_PIVOTS) {
            for place in places {
                one_row_at_a_time();
                let pivot = &self.entries[*place as usize];
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
        for panel in symbolic.panels() {
            let [start, end] = panel.entries;
            for (row, entries) in self.entries[start..end].chunks(panel.width).enumerate() {
                for (c, entry) in entries.iter().enumerate().take(row + 1) {
                    let inverse = &self.inverses[panel.first + c];
                    for lane in 0..LANES {
                        let value = entry[lane].double();
                        traces[lane] += value * value * inverse[lane].double().abs();
                    }
                }
            }
        }
        traces.map(|trace| (self.inverses.len() + 10) as f64 * f64::EPSILON * trace)
    }

    /// Solves (A − σ) z = b in place.
    #[inline(always)]
    pub fn solve(&self, symbolic: &Symbolic, vectors: &mut [Lanes<T>]) {
        for panel in symbolic.panels() {
            match panel.width {
                1 => self.forward::<1>(symbolic, panel, vectors),
                2 => self.forward::<2>(symbolic, panel, vectors),
                3 => self.forward::<3>(symbolic, panel, vectors),
                _ => self.forward::<WIDEST_PANEL>(symbolic, panel, vectors),
            }
        }
        for panel in symbolic.panels().iter().rev() {
            match panel.width {
                1 => self.backward::<1>(symbolic, panel, vectors),
                2 => self.backward::<2>(symbolic, panel, vectors),
                3 => self.backward::<3>(symbolic, panel, vectors),
                _ => self.backward::<WIDEST_PANEL>(symbolic, panel, vectors),
            }
        }
    }

    /// Returns 1 / D of a panel, its own rows and those below it.
    #[inline(always)]
    fn panel<const W: usize>(&self, panel: &Panel) -> Parts<'_, T, W> {
        let inverses = self.inverses[panel.first..].first_chunk().expect("W columns");
        let (rows, _) = self.entries[panel.entries[0]..panel.entries[1]].as_chunks::<W>();
        let (own, below) = rows.split_first_chunk().expect("W rows");
        (inverses, own, below)
    }

    /// Solves L D y = b for the rows of a panel, and takes them out of the rows below it.
    #[inline(always)]
    fn forward<const W: usize>(&self, symbolic: &Symbolic, panel: &Panel, vectors: &mut [Lanes<T>]) {
        let (inverses, own, below) = self.panel::<W>(panel);
        let known: &mut [Lanes<T>; W] = vectors[panel.first..].first_chunk_mut().expect("W rows");
        let mut solved = *known;
        for c in 0..W {
            for e in 0..c {
                let earlier = solved[e];
                subtract_product(&mut solved[c], &own[c][e], &earlier);
            }
            solved[c] = product(&solved[c], &inverses[c]);
        }
        *known = solved;
        for (row, entries) in symbolic.rows(panel).iter().zip(below) {
            one_row_at_a_time();
            let vector = &mut vectors[*row as usize];
            let mut sum = *vector;
            for c in 0..W {
                subtract_product(&mut sum, &entries[c], &solved[c]);
            }
            *vector = sum;
        }
    }

    /// Solves Lᵀ z = y for the rows of a panel.
    #[inline(always)]
    fn backward<const W: usize>(&self, symbolic: &Symbolic, panel: &Panel, vectors: &mut [Lanes<T>]) {
        let (inverses, own, below) = self.panel::<W>(panel);
        let mut sums = [[T::default(); LANES]; W];
        for (row, entries) in symbolic.rows(panel).iter().zip(below) {
            one_row_at_a_time();
            let known = vectors[*row as usize];
            for c in 0..W {
                subtract_product(&mut sums[c], &entries[c], &known);
            }
        }
        let vectors: &mut [Lanes<T>; W] = vectors[panel.first..].first_chunk_mut().expect("W rows");
        let mut solved = *vectors;
        for c in (0..W).rev() {
            for d in c + 1..W {
                subtract_product(&mut sums[c], &own[d][c], &solved[d]);
            }
            add_product(&mut solved[c], &sums[c], &inverses[c]);
        }
        *vectors = solved;
    }
}

/// Factorises the first rows of a panel, and returns their entries of L.
#[inline(always)]
fn triangle<T: Real, const W: usize>(
    rows: &mut [[Lanes<T>; W]; W],
    inverses: &mut [Lanes<T>; W],
) -> [[Lanes<T>; W]; W] {
    let mut factors = [[[T::default(); LANES]; W]; W];
    for c in 0..W {
        rows[c] = reduced(&rows[c], &factors);
        let mut pivot = rows[c][c];
        for e in 0..c {
            factors[c][e] = product(&rows[c][e], &inverses[e]);
            subtract_product(&mut pivot, &factors[c][e], &rows[c][e]);
        }
        (rows[c][c], inverses[c]) = inverted(pivot);
    }
    factors
}

/// Returns the entries of L D of a row of A − σ, by the entries of L above it. Where these are 0 the
/// entry does not change.
#[inline(always)]
fn reduced<T: Real, const W: usize>(row: &[Lanes<T>; W], factors: &[[Lanes<T>; W]; W]) -> [Lanes<T>; W] {
    let mut reduced = *row;
    for c in 0..W {
        for e in 0..c {
            let earlier = reduced[e];
            subtract_product(&mut reduced[c], &factors[c][e], &earlier);
        }
    }
    reduced
}

/// Keeps a pivot away from 0, and returns it with its inverse.
#[inline(always)]
fn inverted<T: Real>(mut pivot: Lanes<T>) -> (Lanes<T>, Lanes<T>) {
    for lane in 0..LANES {
        pivot[lane] = pivot[lane].away_from_zero();
    }
    let mut inverse = [T::ONE; LANES];
    for lane in 0..LANES {
        inverse[lane] = inverse[lane] / pivot[lane];
    }
    (pivot, inverse)
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
