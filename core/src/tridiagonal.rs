//! The lowest eigenvalues and eigenvectors of a symmetric tridiagonal matrix.
//!
//! Divide and conquer computes all n vectors at O(n³) together. When the wanted eigenvalues lie
//! apart, as those of a real map do, a single vector costs O(n): Sturm counts enclose its
//! eigenvalue (J. H. Wilkinson, *The Algebraic Eigenvalue Problem*, 1965, chapter 5), and a twisted
//! factorisation gives the vector and a better eigenvalue (B. N. Parlett, I. S. Dhillon,
//! *Fernando's solution to Wilkinson's problem*, Linear Algebra and its Applications 267, 1997).
//! Both treat a batch of eigenvalues at a time.
//!
//! The result is verified: an eigenvalue lies within the residual of each value, the enclosures are
//! disjoint, and the error of a vector is at most its residual over the distance to the next
//! eigenvalue. Divide and conquer solves a matrix that fails, for example one with repeated
//! eigenvalues.
#![expect(clippy::needless_range_loop)] // one lane of several arrays at a time

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{self, SelfAdjointEvdParams};
use faer::{Auto, Col, Mat, Par};
use pulp::{Arch, Simd, WithSimd};
use std::array::from_fn;

/// Eigenvalues of a batch: two registers of AVX-512, four of AVX.
const LANES: usize = 16;
type Lanes = [f64; LANES];

/// The first shifts divide the range of all eigenvalues into this many parts.
const PARTS: usize = 256;
/// Bisection ends at this width. All sizes are relative to the norm of the matrix.
const ENCLOSURE: f64 = 1e-7;
/// A rounded value may lie outside its enclosure by this much.
const ROUNDING: f64 = 1e-14;
/// A residual this small needs no further iteration.
const SMALL_RESIDUAL: f64 = 1e-15;
/// A vector with a residual this large is refused.
const LARGE_RESIDUAL: f64 = 1e-13;
/// A vector is iterated at most this often; three times is usual.
const ITERATIONS: usize = 6;
/// Vectors of eigenvalues closer than this are made orthogonal, as LAPACK's dstein does.
const CLOSE: f64 = 1e-3;
/// A pivot is never smaller than this.
const LEAST_PIVOT: f64 = 1e-20;
/// An entry below the diagonal that is smaller than this splits the matrix in two.
const LEAST_BELOW: f64 = 1e-18;
/// Rows after which the Sturm sequence is scaled. It shrinks by 1e-36 in a row at most.
const SCALED_ROWS: usize = 8;

/// A symmetric tridiagonal matrix T, n × n.
pub(crate) struct Tridiagonal {
    diagonal: Vec<f64>,
    /// n entries, the last one 0.
    below: Vec<f64>,
}

impl Tridiagonal {
    /// Creates the matrix from the n entries of the diagonal and the n − 1 below it.
    pub fn new(diagonal: Vec<f64>, mut below: Vec<f64>) -> Self {
        assert_eq!(diagonal.len(), below.len() + 1);
        below.push(0.0);
        Tridiagonal { diagonal, below }
    }

    /// Returns at least the `count` lowest eigenvalues, ascending, and their eigenvectors, columns
    /// of n: `count` of them when all are more than `least_gap` from any other eigenvalue, else all
    /// n.
    ///
    /// It is `None` when divide and conquer does not converge.
    pub fn lowest(&self, count: usize, least_gap: f64) -> Option<(Vec<f64>, Mat<f64>)> {
        Arch::new().dispatch(Apart { matrix: self, count, least_gap }).or_else(|| self.divide_and_conquer())
    }

    fn divide_and_conquer(&self) -> Option<(Vec<f64>, Mat<f64>)> {
        let n = self.diagonal.len();
        let mut params = <SelfAdjointEvdParams as Auto<f64>>::auto();
        params.recursion_threshold = 32;
        let scratch =
            evd::self_adjoint_evd_scratch::<f64>(n, evd::ComputeEigenvectors::Yes, Par::Seq, params.into());
        let column = |values: &[f64]| values.iter().copied().collect::<Col<f64>>();
        let mut values = Col::zeros(n);
        let mut vectors = Mat::zeros(n, n);
        evd::tridiagonal_self_adjoint_evd(
            column(&self.diagonal).as_diagonal(),
            column(&self.below[..n - 1]).as_diagonal(),
            values.as_mut().as_diagonal_mut(),
            Some(vectors.as_mut()),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            params.into(),
        )
        .ok()?;
        Some((values.iter().copied().collect(), vectors))
    }

    /// Returns the range of all eigenvalues (Gershgorin).
    fn range(&self) -> [f64; 2] {
        let mut above = 0.0;
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for (a, b) in self.diagonal.iter().zip(&self.below) {
            let radius = above + b.abs();
            range = [range[0].min(a - radius), range[1].max(a + radius)];
            above = b.abs();
        }
        range
    }
}

/// [`Tridiagonal::lowest`] for eigenvalues that lie apart. Everything it calls is inlined, so that
/// it is compiled for every instruction set; the results are the same on all, as no operations are
/// fused.
struct Apart<'a> {
    matrix: &'a Tridiagonal,
    count: usize,
    least_gap: f64,
}

impl WithSimd for Apart<'_> {
    type Output = Option<(Vec<f64>, Mat<f64>)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Apart { matrix, count, least_gap } = self;
        let n = matrix.diagonal.len();
        let range = matrix.range();
        let norm = range[0].abs().max(range[1].abs());
        if matrix.below[..n - 1].iter().any(|b| b.abs() < LEAST_BELOW * norm) {
            return None;
        }
        let mut enclosures = matrix.enclose((count + 1).min(n), range, ENCLOSURE * norm);
        let clear = least_gap + 2.0 * ROUNDING * norm;
        if enclosures.windows(2).any(|pair| pair[1][0] - pair[0][1] < clear) {
            return None;
        }
        enclosures.truncate(count);
        let mut values = Vec::with_capacity(count);
        let mut vectors = Mat::zeros(n, count);
        let mut batch = Batch::new(n);
        for enclosures in enclosures.chunks(LANES) {
            batch.shifts = lanes(enclosures, |[low, high]| (low + high) / 2.0);
            let residuals = batch.iterate(matrix, SMALL_RESIDUAL * norm);
            for (lane, [low, high]) in enclosures.iter().enumerate() {
                let value = batch.shifts[lane];
                let inside = low - ROUNDING * norm < value && value < high + ROUNDING * norm;
                if !inside || residuals[lane] >= LARGE_RESIDUAL * norm {
                    return None;
                }
                batch.copy_vector(lane, vectors.col_as_slice_mut(values.len()));
                values.push(value);
            }
        }
        orthogonalise(&values, &mut vectors, CLOSE * norm);
        Some((values, vectors))
    }
}

/// Applies `f` to every item, and to the last one in the remaining lanes.
#[inline(always)]
fn lanes<T>(items: &[T], f: impl Fn(&T) -> f64) -> Lanes {
    from_fn(|lane| f(&items[lane.min(items.len() - 1)]))
}

impl Tridiagonal {
    /// Returns intervals of at most `width` around the `count` lowest eigenvalues.
    #[inline(always)]
    fn enclose(&self, count: usize, [low, high]: [f64; 2], width: f64) -> Vec<[f64; 2]> {
        let mut enclosures = vec![[low, high]; count];
        let part = (high - low) / PARTS as f64;
        for start in (0..PARTS).step_by(LANES) {
            let shifts: Lanes = from_fn(|lane| low + part * (start + lane) as f64);
            for (shift, below) in shifts.iter().zip(self.sturm_counts(&shifts)) {
                let (lower, upper) = enclosures.split_at_mut((below as usize).min(count));
                lower.iter_mut().for_each(|enclosure| enclosure[1] = enclosure[1].min(*shift));
                upper.iter_mut().for_each(|enclosure| enclosure[0] = *shift);
            }
        }
        for _ in 0..(part / width).log2().ceil() as usize {
            for (batch, enclosures) in enclosures.chunks_mut(LANES).enumerate() {
                let middles = lanes(enclosures, |[low, high]| (low + high) / 2.0);
                let below = self.sturm_counts(&middles);
                for (lane, enclosure) in enclosures.iter_mut().enumerate() {
                    let is_below = below[lane] as usize > batch * LANES + lane;
                    enclosure[usize::from(is_below)] = middles[lane];
                }
            }
        }
        enclosures
    }

    /// Counts the eigenvalues below each shift λ, which are the changes of sign in the sequence of
    /// the leading principal minors of T − λ.
    #[inline(always)]
    fn sturm_counts(&self, shifts: &Lanes) -> [u64; LANES] {
        let mut counts = [0; LANES];
        let mut before = [0.0; LANES];
        let mut minor = [1.0f64; LANES];
        let mut above = 0.0;
        for (diagonal, below) in self.diagonal.chunks(SCALED_ROWS).zip(self.below.chunks(SCALED_ROWS)) {
            for (a, b) in diagonal.iter().zip(below) {
                for lane in 0..LANES {
                    let next = (a - shifts[lane]) * minor[lane] - above * before[lane];
                    counts[lane] += (next.to_bits() ^ minor[lane].to_bits()) >> 63;
                    before[lane] = minor[lane];
                    minor[lane] = next;
                }
                above = b * b;
            }
            for lane in 0..LANES {
                let scale = 1.0 / (minor[lane].abs() + before[lane].abs());
                minor[lane] *= scale;
                before[lane] *= scale;
            }
        }
        counts
    }
}

/// A batch of eigenvalues under iteration, with the twisted factorisation of T − λ of each.
struct Batch {
    /// λ.
    shifts: Lanes,
    /// 1 / |z|.
    scales: Lanes,
    /// n entries of L where L D Lᵀ = T − λ.
    lower: Vec<Lanes>,
    /// n entries of U where U D Uᵀ = T − λ.
    upper: Vec<Lanes>,
    /// n entries of the vector z.
    vectors: Vec<Lanes>,
}

impl Batch {
    fn new(n: usize) -> Self {
        let zeros = || vec![[0.0; LANES]; n];
        let (lower, upper, vectors) = (zeros(), zeros(), zeros());
        Batch { shifts: [0.0; LANES], scales: [0.0; LANES], lower, upper, vectors }
    }

    /// Improves shifts and vectors until all residuals are small, and returns these.
    #[inline(always)]
    fn iterate(&mut self, matrix: &Tridiagonal, small: f64) -> Lanes {
        let mut residuals = [f64::INFINITY; LANES];
        for _ in 0..ITERATIONS {
            let (twists, gammas) = self.factorise(matrix);
            let squares = self.solve(&twists);
            self.scales = from_fn(|lane| 1.0 / squares[lane].sqrt());
            residuals = from_fn(|lane| gammas[lane].abs() * self.scales[lane]);
            // This is the Rayleigh quotient.
            self.shifts = from_fn(|lane| self.shifts[lane] + gammas[lane] / squares[lane]);
            if residuals.iter().all(|residual| *residual < small) {
                break;
            }
        }
        residuals
    }

    /// Factorises T − λ from above and from below, and returns the row k where the two meet with
    /// the smallest |γ_k|, and that γ_k.
    #[inline(always)]
    fn factorise(&mut self, Tridiagonal { diagonal, below }: &Tridiagonal) -> (Lanes, Lanes) {
        let n = diagonal.len();
        let mut eliminated = [0.0; LANES];
        for i in 0..n {
            for lane in 0..LANES {
                let pivot = diagonal[i] - self.shifts[lane] - eliminated[lane];
                self.lower[i][lane] = below[i] / away_from_zero(pivot);
                eliminated[lane] = below[i] * self.lower[i][lane];
            }
        }
        let mut twists = [0.0; LANES];
        let mut gammas = [f64::INFINITY; LANES];
        let mut eliminated = [0.0; LANES];
        for i in (0..n).rev() {
            let (above, lower) = if i > 0 { (below[i - 1], self.lower[i - 1]) } else { (0.0, [0.0; LANES]) };
            for lane in 0..LANES {
                let pivot = diagonal[i] - self.shifts[lane] - eliminated[lane];
                let gamma = pivot - above * lower[lane];
                let smaller = gamma.abs() < gammas[lane].abs();
                gammas[lane] = if smaller { gamma } else { gammas[lane] };
                twists[lane] = if smaller { i as f64 } else { twists[lane] };
                self.upper[i][lane] = above / away_from_zero(pivot);
                eliminated[lane] = above * self.upper[i][lane];
            }
        }
        (twists, gammas)
    }

    /// Solves (T − λ) z = γ_k e_k with z_k = 1, where k are the `twists`; returns |z|².
    #[inline(always)]
    fn solve(&mut self, twists: &Lanes) -> Lanes {
        let n = self.vectors.len();
        let mut squares = [0.0; LANES];
        let mut entries = [0.0; LANES]; // 0 until row k is reached
        for i in (0..n).rev() {
            for lane in 0..LANES {
                let next = -self.lower[i][lane] * entries[lane];
                entries[lane] = if twists[lane] == i as f64 { 1.0 } else { next };
                self.vectors[i][lane] = entries[lane];
                squares[lane] += entries[lane] * entries[lane];
            }
        }
        let mut entries = [0.0; LANES];
        for i in 0..n {
            for lane in 0..LANES {
                let next = -self.upper[i][lane] * entries[lane];
                entries[lane] = if twists[lane] == i as f64 { 1.0 } else { next };
                self.vectors[i][lane] += next;
                squares[lane] += next * next;
            }
        }
        squares
    }

    #[inline(always)]
    fn copy_vector(&self, lane: usize, column: &mut [f64]) {
        let entries = self.vectors.iter().map(|entries| entries[lane] * self.scales[lane]);
        column.iter_mut().zip(entries).for_each(|(to, entry)| *to = entry);
    }
}

#[inline(always)]
fn away_from_zero(pivot: f64) -> f64 {
    if pivot.abs() < LEAST_PIVOT { LEAST_PIVOT } else { pivot }
}

/// Orthogonalises the vectors of eigenvalues closer than `close` by the process of Gram and
/// Schmidt.
#[inline(always)]
pub(crate) fn orthogonalise(values: &[f64], vectors: &mut Mat<f64>, close: f64) {
    for i in 1..values.len() {
        let first = values.partition_point(|value| *value <= values[i] - close);
        if first == i {
            continue;
        }
        let mut vector = vectors.col_as_slice(i).to_vec();
        for other in (first..i).map(|j| vectors.col_as_slice(j)) {
            let overlap: f64 = vector.iter().zip(other).map(|(a, b)| a * b).sum();
            vector.iter_mut().zip(other).for_each(|(a, b)| *a -= overlap * b);
        }
        vectors.col_as_slice_mut(i).copy_from_slice(&vector);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn dense(matrix: &Tridiagonal) -> Mat<f64> {
        let n = matrix.diagonal.len();
        Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => matrix.diagonal[i],
            1 => matrix.below[i.min(j)],
            _ => 0.0,
        })
    }

    /// Returns the largest entry of T V − V Λ and of VᵀV − 1.
    fn errors(matrix: &Tridiagonal, values: &[f64], vectors: &Mat<f64>) -> [f64; 2] {
        let image = dense(matrix) * vectors;
        let scaled = Mat::from_fn(vectors.nrows(), vectors.ncols(), |i, j| vectors[(i, j)] * values[j]);
        let identity = Mat::<f64>::identity(vectors.ncols(), vectors.ncols());
        [(image - scaled).norm_max(), (vectors.transpose() * vectors - identity).norm_max()]
    }

    fn lowest(matrix: &Tridiagonal, count: usize) -> (Vec<f64>, Mat<f64>) {
        let (values, vectors) = matrix.lowest(count, 1e-8).unwrap();
        let [residual, overlap] = errors(matrix, &values, &vectors);
        assert!(residual < 1e-13 && overlap < 1e-11, "{residual} {overlap}");
        (values, vectors)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_values_are_those_of_nalgebra(
            diagonal in prop::collection::vec(-1.0..1.0f64, 2..150),
            below in prop::collection::vec(0.01..1.0f64, 150),
            share in 0.01..1.0f64,
        ) {
            let n = diagonal.len();
            let matrix = Tridiagonal::new(diagonal, below[..n - 1].to_vec());
            let (values, vectors) = lowest(&matrix, ((n as f64 * share) as usize).max(1));
            prop_assert_eq!(values.len(), vectors.ncols());
            let matrix = dense(&matrix);
            let mut expected = nalgebra::DMatrix::from_fn(n, n, |i, j| matrix[(i, j)]).symmetric_eigenvalues();
            expected.as_mut_slice().sort_by(f64::total_cmp);
            for (value, expected) in values.iter().zip(&expected) {
                prop_assert!((value - expected).abs() < 1e-13, "{} {}", value, expected);
            }
        }
    }

    #[test]
    fn a_string_has_the_frequencies_of_a_string_and_no_more_than_asked_for() {
        let n = 480;
        let (values, vectors) = lowest(&Tridiagonal::new(vec![2.0; n], vec![-1.0; n - 1]), 257);
        assert_eq!((values.len(), vectors.ncols()), (257, 257)); // not by divide and conquer
        for (i, value) in values.iter().enumerate() {
            let half_angle = (i + 1) as f64 * std::f64::consts::PI / (2 * (n + 1)) as f64;
            assert!((value - 4.0 * half_angle.sin().powi(2)).abs() < 1e-14);
        }
    }

    #[test]
    fn equal_eigenvalues_are_left_to_divide_and_conquer() {
        // Wilkinson's matrix: no entry is small, and yet the pairs of large eigenvalues agree to
        // the last digit.
        let wilkinson =
            Tridiagonal::new((0..41).map(|i| -f64::abs(i as f64 - 20.0)).collect(), vec![1.0; 40]);
        // Two strings that do not touch.
        let strings = Tridiagonal::new(vec![2.0; 80], (1..80).map(|i| f64::from(i % 40 != 0)).collect());
        // The second and the third are equal; only the second is wanted.
        let at_the_end = Tridiagonal::new(vec![1.0, 2.0, 2.0, 3.0], vec![1e-9, 0.0, 1e-9]);
        for (matrix, count) in [(wilkinson, 10), (strings, 5), (at_the_end, 2)] {
            let (values, _) = lowest(&matrix, count);
            assert_eq!(values.len(), matrix.diagonal.len());
        }
    }

    #[test]
    fn close_eigenvalues_are_told_apart() {
        // Two equal strings that hardly touch.
        let strings =
            Tridiagonal::new(vec![2.0; 80], (1..80).map(|i| if i == 40 { 0.01 } else { 1.0 }).collect());
        let (values, _) = lowest(&strings, 10);
        assert_eq!(values.len(), 10);
        assert!(values[1] - values[0] < 1e-5, "{values:?}");
    }
}
