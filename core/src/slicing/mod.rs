//! The lowest eigenvalues and eigenvectors of a sparse symmetric matrix, by spectrum slicing.
//!
//! The Laplacian of a patch is that of a planar graph, so its factor L D Lᵀ has few entries:
//! 3 700 for 480 vertices. A factorisation for one shift costs a thousandth of a dense
//! tridiagonalisation, and 16 shifts are factorised at a time (`lanes`). The steps are:
//!
//! 1. `ordering` and `symbolic`: once for a matrix;
//! 2. `isolation` finds shifts between which there is one eigenvalue each, by inertia (`factor`);
//! 3. `interpolation` makes guesses of eigenvalues from the determinants at these shifts;
//! 4. `iteration`: eigenvectors;
//! 5. `proof`: the result is verified, not trusted. It depends on no step before it.
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
    let sizes = [count, matrix.size()];
    let mut nodes = isolation::isolate(slicer.range(), sizes, |queries| slicer.nodes(queries))?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::tridiagonalise_and_solve;
    use proptest::prelude::*;

    /// A grid of `side`² vertices, every cell with one of its diagonals, with these weights.
    fn mesh(side: u32, weights: &[f64]) -> SparseSymmetric {
        let at = |x: u32, y: u32| y * side + x;
        let mut edges = Vec::new();
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            let right = (x + 1 < side).then(|| [at(x, y), at(x + 1, y)]);
            let up = (y + 1 < side).then(|| [at(x, y), at(x, y + 1)]);
            let across = (x + 1 < side && y + 1 < side).then(|| [at(x, y), at(x + 1, y + 1)]);
            edges.extend([right, up, across].into_iter().flatten());
        }
        let weighted = || edges.iter().zip(weights.iter().cycle());
        let mut diagonal = vec![0.0; (side * side) as usize];
        for ([a, b], weight) in weighted() {
            diagonal[*a as usize] += weight;
            diagonal[*b as usize] += weight;
        }
        SparseSymmetric::new(diagonal, weighted().map(|(&edge, &weight)| (edge, -weight)))
    }

    fn values_of_nalgebra(matrix: &SparseSymmetric) -> Vec<f64> {
        let (n, dense) = (matrix.size(), matrix.to_dense());
        let mut values = nalgebra::DMatrix::from_fn(n, n, |i, j| dense[(i, j)]).symmetric_eigenvalues();
        values.as_mut_slice().sort_by(f64::total_cmp);
        values.as_slice().to_vec()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn values_are_those_of_nalgebra_and_vectors_are_orthonormal(
            side in 6..14u32,
            weights in prop::collection::vec(0.2..1.0f64, 97),
            share in 0.01..=1.0f64,
        ) {
            let matrix = mesh(side, &weights);
            let count = ((matrix.size() as f64 * share) as usize).max(1);
            let expected = values_of_nalgebra(&matrix);
            // What is not proved is solved by the other solver, and the law is the same.
            let other = || tridiagonalise_and_solve(matrix.to_dense(), count);
            let (values, mut vectors) = lowest(&matrix, count, 1e-8).or_else(other).unwrap();
            prop_assert!(values.len() >= count && vectors.ncols() >= count);
            vectors.truncate(matrix.size(), count);
            for (value, expected) in values[..count].iter().zip(&expected) {
                prop_assert!((value - expected).abs() < 1e-12, "{} {}", value, expected);
            }
            let dense = matrix.to_dense();
            let scaled = Mat::from_fn(matrix.size(), count, |i, j| vectors[(i, j)] * values[j]);
            prop_assert!((dense * &vectors - scaled).norm_max() < 1e-12);
            let overlaps = vectors.transpose() * &vectors - Mat::<f64>::identity(count, count);
            prop_assert!(overlaps.norm_max() < 1e-9);
        }
    }

    #[test]
    fn hardly_any_mesh_is_left_to_another_solver() {
        for (side, share) in [(8, 1), (12, 1), (12, 2), (22, 2), (22, 4)] {
            let solved = (0..8).filter(|seed| {
                let hash = |i: u32| (seed * 97 + i).wrapping_mul(0x9e37_79b9).rotate_left(13) % 1009;
                let weights: Vec<f64> = (0..89).map(|i| 0.2 + 0.8 * f64::from(hash(i)) / 1009.0).collect();
                lowest(&mesh(side, &weights), (side * side / share) as usize, 1e-8).is_some()
            });
            assert!(solved.count() >= 6, "{side} {share}");
        }
    }

    #[test]
    fn repeated_eigenvalues_are_left_to_another_solver() {
        // A ring: all eigenvalues but the first and the last occur twice.
        let ring = SparseSymmetric::new(vec![2.0; 36], (0..36).map(|i| ([i, (i + 1) % 36], -1.0)));
        assert!(lowest(&ring, 10, 1e-8).is_none());
        // The second and the third are equal; only the second is wanted.
        assert!(lowest(&ring, 2, 1e-8).is_none());
    }
}
