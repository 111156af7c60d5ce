//! Sparse symmetric matrices.

use super::lanes::{LANES, Lanes};
use faer::Mat;

/// A symmetric matrix, n × n, by rows.
#[derive(Debug, Clone)]
pub struct SparseSymmetric {
    diagonal: Vec<f64>,
    /// Where each row begins in the entries off the diagonal, and where the last one ends.
    starts: Vec<u32>,
    /// The columns of these entries and their values.
    entries: Vec<(u32, f64)>,
}

impl SparseSymmetric {
    /// Creates the matrix from its diagonal and from one of every two equal entries off it.
    pub fn new(diagonal: Vec<f64>, off_diagonal: impl Iterator<Item = ([u32; 2], f64)> + Clone) -> Self {
        let mut starts = vec![0; diagonal.len() + 1];
        off_diagonal.clone().flat_map(|(ends, _)| ends).for_each(|row| starts[row as usize + 1] += 1);
        (1..starts.len()).for_each(|row| starts[row] += starts[row - 1]);
        let mut next = starts.clone();
        let mut entries = vec![(0, 0.0); starts[diagonal.len()] as usize];
        for ([a, b], value) in off_diagonal {
            for [row, column] in [[a, b], [b, a]] {
                entries[next[row as usize] as usize] = (column, value);
                next[row as usize] += 1;
            }
        }
        SparseSymmetric { diagonal, starts, entries }
    }

    /// Returns n.
    pub fn size(&self) -> usize {
        self.diagonal.len()
    }

    /// Returns the diagonal.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// Returns columns and values of a row, without the diagonal.
    #[inline(always)]
    pub fn row(&self, row: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Returns the full matrix.
    pub fn to_dense(&self) -> Mat<f64> {
        let mut dense = Mat::zeros(self.size(), self.size());
        for row in 0..self.size() {
            dense[(row, row)] = self.diagonal[row];
            self.row(row).iter().for_each(|&(column, value)| dense[(row, column as usize)] = value);
        }
        dense
    }

    /// Returns the matrix whose row and column i are those of number `order[i]`.
    pub fn permuted(&self, order: &[u32]) -> Self {
        let mut place = vec![0; self.size()];
        (0..).zip(order).for_each(|(new, &old)| place[old as usize] = new);
        let mut starts = Vec::with_capacity(self.starts.len());
        let mut entries = Vec::with_capacity(self.entries.len());
        starts.push(0);
        for &old in order {
            let start = entries.len();
            entries.extend(
                self.row(old as usize).iter().map(|&(column, value)| (place[column as usize], value)),
            );
            entries[start..].sort_unstable_by_key(|(column, _)| *column);
            starts.push(entries.len() as u32);
        }
        let diagonal = order.iter().map(|&old| self.diagonal[old as usize]).collect();
        SparseSymmetric { diagonal, starts, entries }
    }

    /// Returns a range that holds all eigenvalues (Gershgorin).
    pub fn range(&self) -> [f64; 2] {
        let disc = |row: usize| {
            let radius: f64 = self.row(row).iter().map(|(_, value)| value.abs()).sum();
            [self.diagonal[row] - radius, self.diagonal[row] + radius]
        };
        let discs = (0..self.size()).map(disc);
        discs.fold([f64::INFINITY, f64::NEG_INFINITY], |all, one| [all[0].min(one[0]), all[1].max(one[1])])
    }

    /// Multiplies by vectors, `image` = A x, and returns the products xᵀ A x.
    #[inline(always)]
    pub fn multiply(&self, vectors: &[Lanes<f64>], image: &mut [Lanes<f64>]) -> Lanes<f64> {
        let mut products = [0.0; LANES];
        for (row, (own, image)) in vectors.iter().zip(image).enumerate() {
            let mut sum = [0.0; LANES];
            for lane in 0..LANES {
                sum[lane] = self.diagonal[row] * own[lane];
            }
            for &(column, value) in self.row(row) {
                let other = &vectors[column as usize];
                for lane in 0..LANES {
                    sum[lane] += value * other[lane];
                }
            }
            for lane in 0..LANES {
                products[lane] += own[lane] * sum[lane];
            }
            *image = sum;
        }
        products
    }
}
