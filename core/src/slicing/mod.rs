//! The lowest eigenvalues and eigenvectors of a sparse symmetric matrix, by spectrum slicing.
//!
//! The Laplacian of a patch is that of a planar graph, so its factor L D Lᵀ has few entries:
//! 3 700 for 480 vertices. A factorisation for one shift costs a thousandth of a dense
//! tridiagonalisation, and 16 shifts are factorised at a time ([`lanes`]). The steps are:
//!
//! 1. [`ordering`] and [`symbolic`]: once for a matrix;
//! 2. [`isolation`]: shifts between which there is one eigenvalue each, by inertia ([`factor`]);
//! 3. [`interpolation`]: guesses of eigenvalues from the determinants at these shifts;
//! 4. [`iteration`]: eigenvectors;
//! 5. [`proof`]: the result is verified, not trusted. It depends on no step before it.
//!
//! What is not proved is left to another solver: repeated eigenvalues, above all.
#![expect(clippy::needless_range_loop)] // one lane of several arrays at a time

mod factor;
mod interpolation;
mod isolation;
mod iteration;
mod lanes;
mod matrix;
mod ordering;
mod proof;
mod slicer;
mod solution;
mod symbolic;

pub use matrix::SparseSymmetric;

use crate::tridiagonal::orthogonalise;
use faer::Mat;
use slicer::Slicer;

/// Smaller matrices are not worth the effort.
const LEAST_SIZE: usize = 32;
/// Guesses are evaluated and improved at most this often.
const REFINEMENTS: usize = 5;
/// Vectors of eigenvalues closer than this are made orthogonal.
const CLOSE: f64 = 1e-3;

/// Returns the `count` lowest eigenvalues, ascending, and their eigenvectors as columns. They are
/// proved to be the lowest, and any two of the lowest `count + 1` differ by more than `least_gap`.
///
/// It is `None` when this cannot be proved.
pub fn lowest(matrix: &SparseSymmetric, count: usize, least_gap: f64) -> Option<(Vec<f64>, Mat<f64>)> {
    if matrix.size() < LEAST_SIZE || count == 0 || count > matrix.size() {
        return None;
    }
    let mut slicer = Slicer::new(matrix)?;
    let nodes = isolation::isolate(slicer.range(), [count, matrix.size()], |queries| slicer.nodes(queries))?;
    let mut nodes = nodes;
    let mut brackets = isolation::brackets(&nodes, count)?;
    for _ in 0..REFINEMENTS {
        let queries = interpolation::queries(&nodes, &brackets, slicer.norm());
        if queries.is_empty() {
            break;
        }
        nodes = isolation::merged(nodes, slicer.nodes(&queries));
        brackets = isolation::brackets(&nodes, count)?;
    }
    let mut solution = slicer.solve(&nodes, &brackets);
    let above = nodes.get(brackets[count - 1] + 2).or(nodes.last())?.shift;
    if !slicer.proves(&solution, above, least_gap) {
        return None;
    }
    orthogonalise(&solution.values, &mut solution.vectors, CLOSE * slicer.norm());
    Some((solution.values, solution.vectors))
}
