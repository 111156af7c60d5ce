//! What the steps find.

use faer::Mat;

/// Eigenvalues and eigenvectors, not proved yet.
pub struct Solution {
    /// Ascending.
    pub values: Vec<f64>,
    /// |A x − θ x| of each.
    pub residuals: Vec<f64>,
    /// The vectors as columns, of length one.
    pub vectors: Mat<f64>,
}

impl Solution {
    /// Makes room for `count` vectors of n entries.
    pub fn new(n: usize, count: usize) -> Self {
        Solution {
            values: vec![f64::NAN; count],
            residuals: vec![f64::INFINITY; count],
            vectors: Mat::zeros(n, count),
        }
    }
}
