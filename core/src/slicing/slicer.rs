//! The steps on one matrix, in the precision that each shift needs.

use super::{
    factor::Factor,
    interpolation,
    isolation::{Node, Query},
    iteration::{Batch, SMALL_RESIDUAL},
    lanes::{LANES, Real, spread},
    matrix::SparseSymmetric,
    ordering::Ordering,
    proof,
    solution::Solution,
    symbolic::Symbolic,
};

/// L has at most so many entries in a row, on average; a matrix with more is not sparse.
const MOST_ENTRIES: usize = 48;
/// Shifts keep this distance from a diagonal entry that all rows share: the pivots of all rows that
/// are eliminated first would be near 0. Sizes are relative to the norm of the matrix.
const LEAST_PIVOT: f64 = 1e-5;
/// Shifts as near as this to such an entry are factorised in double precision.
const DELICATE: f64 = 0.005;
/// A vector with a residual larger than this is iterated again, in double precision.
const LARGE_RESIDUAL: f64 = 2.0 * SMALL_RESIDUAL;
/// A value with a residual smaller than this is a better guess than that by interpolation.
const SETTLED: f64 = 1e-7;
/// An eigenvalue may lie outside of the shifts around it by this much.
const ROUNDING: f64 = 1e-5;
/// Improvements of a vector in single precision: what needs more is iterated in double precision.
const SINGLE_STEPS: usize = 4;
/// Improvements of a vector in double precision.
const DOUBLE_STEPS: usize = 12;
/// Halvings of the distance of the shifts around an eigenvalue before its second iteration.
const HALVINGS: usize = 10;

/// A matrix and its factors.
pub struct Slicer {
    problem: Problem,
    single: Factor<f32>,
    double: Factor<f64>,
}

/// A matrix in the order of elimination.
struct Problem {
    matrix: SparseSymmetric,
    /// The row of the original matrix of every row.
    order: Vec<u32>,
    symbolic: Symbolic,
    norm: f64,
    /// The diagonal entry that all rows share.
    common_diagonal: Option<f64>,
}

/// An eigenvalue to be found.
#[derive(Clone, Copy)]
struct Target {
    /// Its number.
    number: usize,
    /// The shifts around it.
    bracket: [f64; 2],
    guess: f64,
}

impl Slicer {
    /// Orders a matrix. It is `None` when the factor would not be sparse.
    pub fn new(matrix: &SparseSymmetric) -> Option<Self> {
        let n = matrix.size();
        let ordering = Ordering::of_minimum_degree(matrix, MOST_ENTRIES * n)?;
        let permuted = matrix.permuted(&ordering.order);
        let symbolic = Symbolic::new(&permuted, &ordering);
        let [low, high] = matrix.range();
        let first = permuted.diagonal()[0];
        let is_common = permuted.diagonal().iter().all(|entry| *entry == first);
        let (single, double) = (Factor::new(&symbolic, n), Factor::new(&symbolic, n));
        let problem = Problem {
            matrix: permuted,
            order: ordering.order,
            symbolic,
            norm: low.abs().max(high.abs()),
            common_diagonal: is_common.then_some(first),
        };
        Some(Slicer { problem, single, double })
    }

    /// Returns the norm of the matrix, or a little more.
    pub fn norm(&self) -> f64 {
        self.problem.norm
    }

    /// Returns a range that holds all eigenvalues of a Laplacian, which are not negative.
    pub fn range(&self) -> [f64; 2] {
        let [low, high] = self.problem.matrix.range();
        let margin = 0.01 * self.problem.norm;
        [low.max(0.0) - margin, high + margin]
    }

    /// Returns the nodes of shifts, ascending.
    pub fn nodes(&mut self, queries: &[Query]) -> Vec<Node> {
        let Slicer { problem, single, double } = self;
        let mut nodes = Vec::with_capacity(queries.len());
        let is_double = |query: &Query| query.is_precise || problem.is_delicate(query.shift);
        let (precise, rough): (Vec<Query>, Vec<Query>) = queries.iter().partition(|query| is_double(query));
        problem.add_nodes(single, &rough, &mut nodes);
        problem.add_nodes(double, &precise, &mut nodes);
        nodes.sort_by(|a, b| a.shift.total_cmp(&b.shift));
        nodes
    }

    /// Solves for the eigenvalues after the nodes `brackets`: in single precision, and in double
    /// precision for what is not accurate then.
    pub fn solve(&mut self, nodes: &[Node], brackets: &[usize]) -> Solution {
        let Slicer { problem, single, double } = self;
        let mut solution = Solution::new(problem.matrix.size(), brackets.len());
        let guesses = interpolation::guesses(nodes, brackets);
        let target = |((number, &first), guess): ((usize, &usize), f64)| Target {
            number,
            bracket: [nodes[first].shift, nodes[first + 1].shift],
            guess: problem.clear(guess),
        };
        let targets = brackets.iter().enumerate().zip(guesses).map(target);
        let (mut rest, plain): (Vec<Target>, Vec<Target>) =
            targets.partition(|target| problem.is_delicate(target.guess));
        problem.iterate(single, &plain, SINGLE_STEPS, &mut solution);
        let inaccurate = plain.iter().filter(|target| !problem.is_accurate(target, &solution));
        rest.extend(inaccurate.map(|target| problem.improved(target, &solution)));
        problem.iterate(double, &rest, DOUBLE_STEPS, &mut solution);
        rest.retain(|target| !problem.is_accurate(target, &solution));
        problem.halve(double, &mut rest);
        problem.iterate(double, &rest, DOUBLE_STEPS, &mut solution);
        solution
    }

    /// Returns whether a solution is proved to be the lowest part of the spectrum; `above` is a
    /// shift above it.
    pub fn proves(&mut self, solution: &Solution, above: f64, least_gap: f64) -> bool {
        let Problem { matrix, symbolic, norm, .. } = &self.problem;
        let Some(highest) = proof::disjoint(solution, least_gap, *norm) else { return false };
        if solution.values.len() == matrix.size() {
            return true;
        }
        let step = (above - highest) / LANES as f64;
        let shifts = std::array::from_fn(|lane| highest + step * (lane + 1) as f64);
        let inertias = self.double.evaluate(matrix, symbolic, &shifts);
        let bounds = self.double.error_bounds(symbolic);
        (0..LANES).any(|lane| {
            inertias[lane].below == solution.values.len() && shifts[lane] - bounds[lane] > highest + least_gap
        })
    }
}

impl Problem {
    /// Returns how far a shift lies above the common diagonal entry.
    fn above_diagonal(&self, shift: f64) -> f64 {
        self.common_diagonal.map_or(f64::INFINITY, |diagonal| shift - diagonal)
    }

    /// Moves a shift away from the common diagonal entry.
    fn clear(&self, shift: f64) -> f64 {
        let least = LEAST_PIVOT * self.norm;
        match self.above_diagonal(shift) {
            above if above.abs() >= least => shift,
            above if above < 0.0 => shift - above - least,
            above => shift - above + least,
        }
    }

    fn is_delicate(&self, shift: f64) -> bool {
        self.above_diagonal(shift).abs() < DELICATE * self.norm
    }

    fn is_accurate(&self, target: &Target, solution: &Solution) -> bool {
        self.is_found(target, solution, LARGE_RESIDUAL)
    }

    /// Returns whether the solution has the eigenvalue between the shifts around it, with a residual
    /// smaller than `residual`.
    fn is_found(&self, target: &Target, solution: &Solution, residual: f64) -> bool {
        let [low, high] = target.bracket;
        let (value, margin) = (solution.values[target.number], ROUNDING * self.norm);
        let is_inside = low - margin < value && value < high + margin;
        is_inside && solution.residuals[target.number] < residual * self.norm
    }

    /// Returns a target with the value found as its guess, when that is close to the eigenvalue.
    fn improved(&self, target: &Target, solution: &Solution) -> Target {
        match self.is_found(target, solution, SETTLED) {
            true => Target { guess: self.clear(solution.values[target.number]), ..*target },
            false => *target,
        }
    }

    fn add_nodes<T: Real>(&self, factor: &mut Factor<T>, queries: &[Query], nodes: &mut Vec<Node>) {
        for batch in queries.chunks(LANES) {
            let shifts = spread(batch, |query| self.clear(query.shift));
            let inertias = factor.evaluate(&self.matrix, &self.symbolic, &shifts);
            let found = shifts.into_iter().zip(inertias).take(batch.len());
            nodes.extend(found.map(|(shift, inertia)| Node { shift, inertia }));
        }
    }

    fn iterate<T: Real>(
        &self,
        factor: &mut Factor<T>,
        targets: &[Target],
        steps: usize,
        solution: &mut Solution,
    ) {
        if targets.is_empty() {
            return;
        }
        let mut batch = Batch::new(self.matrix.size());
        for targets in targets.chunks(LANES) {
            let guesses = spread(targets, |target| target.guess);
            batch.iterate((&self.matrix, self.norm), &self.symbolic, factor, &guesses, steps);
            for (lane, target) in targets.iter().enumerate() {
                solution.values[target.number] = batch.values[lane];
                solution.residuals[target.number] = batch.residuals[lane];
                batch.copy_vector(lane, &self.order, solution.vectors.col_as_slice_mut(target.number));
            }
        }
    }

    /// Guesses eigenvalues anew, by bisection.
    fn halve(&self, factor: &mut Factor<f64>, targets: &mut [Target]) {
        for targets in targets.chunks_mut(LANES) {
            for _ in 0..HALVINGS {
                let middles =
                    spread(targets, |target| self.clear((target.bracket[0] + target.bracket[1]) / 2.0));
                let inertias = factor.evaluate(&self.matrix, &self.symbolic, &middles);
                for (lane, (target, inertia)) in targets.iter_mut().zip(inertias).enumerate() {
                    target.bracket[usize::from(inertia.below > target.number)] = middles[lane];
                    target.guess = middles[lane];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A string of 40 beads, whose eigenvalues are known.
    fn string() -> (SparseSymmetric, Vec<f64>) {
        let matrix = SparseSymmetric::new(vec![2.0; 40], (1..40).map(|row| ([row - 1, row], -1.0)));
        let value = |i: usize| 2.0 - 2.0 * (std::f64::consts::PI * (i + 1) as f64 / 41.0).cos();
        (matrix, (0..40).map(value).collect())
    }

    fn solution(numbers: &[usize]) -> (Slicer, Solution) {
        let (matrix, values) = string();
        let mut slicer = Slicer::new(&matrix).unwrap();
        let mut solution = Solution::new(40, numbers.len());
        let Slicer { problem, double, .. } = &mut slicer;
        let target = |(number, &i): (usize, &usize)| Target {
            number,
            bracket: [values[i] - 1e-3, values[i] + 1e-3],
            guess: values[i] + 1e-6,
        };
        let targets: Vec<Target> = numbers.iter().enumerate().map(target).collect();
        problem.iterate(double, &targets, DOUBLE_STEPS, &mut solution);
        (slicer, solution)
    }

    #[test]
    fn the_lowest_eigenvalues_are_proved_and_others_are_not() {
        let (_, values) = string();
        for (numbers, is_lowest) in
            [(vec![0, 1, 2, 3], true), (vec![0, 1, 3, 4], false), (vec![1, 2], false), (vec![0, 1, 1], false)]
        {
            let (mut slicer, solution) = solution(&numbers);
            let above = values[numbers[numbers.len() - 1] + 1];
            assert_eq!(slicer.proves(&solution, above, 1e-8), is_lowest, "{numbers:?}");
        }
    }

    #[test]
    fn an_inaccurate_vector_is_not_proved() {
        let (mut slicer, mut solution) = solution(&[0, 1, 2]);
        solution.residuals[1] = 1e-12;
        assert!(!slicer.proves(&solution, string().1[3], 1e-8));
    }

    #[test]
    fn a_shift_at_the_common_diagonal_entry_is_moved() {
        let (slicer, _) = solution(&[0]);
        let moved = [1.9, 2.0 - 1e-9, 2.0, 2.0 + 1e-9, 2.1].map(|shift| slicer.problem.clear(shift));
        assert_eq!([moved[0], moved[4]], [1.9, 2.1]);
        assert!(moved[1] < 2.0 - 1e-5 && moved[2] > 2.0 + 1e-5 && moved[3] > 2.0 + 1e-5, "{moved:?}");
    }
}
