//! The order of elimination: exact minimum degree.
//!
//! Every step eliminates a vertex with the fewest neighbours and joins these (A. George,
//! J. W. H. Liu, *The Evolution of the Minimum Degree Ordering Algorithm*, SIAM Review 31, 1989).
//! The neighbours at that moment are the rows of its column of L (T. A. Davis, *Direct Methods for
//! Sparse Linear Systems*, SIAM, 2006, chapter 7). The matrices are so small that the elimination
//! graph is kept as bits, and degrees are exact.

use super::matrix::SparseSymmetric;
use pulp::{Arch, Simd, WithSimd};

/// The number of a vertex has 16 bits, and so has the number of its neighbours.
const MOST_VERTICES: usize = 1 << 16;

/// An order of elimination, and what it fills in.
pub struct Ordering {
    /// The row of the matrix that is eliminated in each step.
    pub order: Vec<u32>,
    /// For every step the later steps in its column of L, ascending.
    pub columns: Vec<Vec<u32>>,
}

impl Ordering {
    /// Orders a matrix. It is `None` when L has more than `most_entries` below its diagonal.
    pub fn of_minimum_degree(matrix: &SparseSymmetric, most_entries: usize) -> Option<Self> {
        let n = matrix.size();
        if n > MOST_VERTICES {
            return None;
        }
        let (order, columns) = Arch::new().dispatch(Elimination { matrix, most_entries })?;
        let (order, mut columns) = in_postorder(order, columns);
        let mut step = vec![0; n];
        (0..).zip(&order).for_each(|(number, &vertex)| step[vertex as usize] = number);
        for column in &mut columns {
            column.iter_mut().for_each(|vertex| *vertex = step[*vertex as usize]);
            column.sort_unstable();
        }
        Some(Ordering { order, columns })
    }
}

/// The steps of an elimination: vertices, and the neighbours of each at its step.
type Steps = (Vec<u32>, Vec<Vec<u32>>);

/// An elimination, compiled for every instruction set.
struct Elimination<'a> {
    matrix: &'a SparseSymmetric,
    most_entries: usize,
}

impl WithSimd for Elimination<'_> {
    type Output = Option<Steps>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let n = self.matrix.size();
        let mut graph = EliminationGraph::new(self.matrix);
        let mut order = Vec::with_capacity(n);
        let mut columns = Vec::with_capacity(n);
        let mut entries = 0;
        for _ in 0..n {
            let vertex = graph.least_connected();
            let neighbours = graph.eliminate(vertex);
            entries += neighbours.len();
            if entries > self.most_entries {
                return None;
            }
            order.push(vertex as u32);
            columns.push(neighbours);
        }
        Some((order, columns))
    }
}

/// Brings the steps into an order in which every one follows those of its subtree of the
/// elimination tree: this changes no column, and columns that are alike follow each other.
fn in_postorder(order: Vec<u32>, columns: Vec<Vec<u32>>) -> Steps {
    let n = order.len();
    let mut step = vec![0; n];
    order.iter().enumerate().for_each(|(number, &vertex)| step[vertex as usize] = number);
    let parent = |column: &Vec<u32>| column.iter().map(|&vertex| step[vertex as usize]).min();
    let parents: Vec<Option<usize>> = columns.iter().map(parent).collect();
    let mut sizes = vec![1; n];
    for step in 0..n {
        if let Some(parent) = parents[step] {
            sizes[parent] += sizes[step];
        }
    }
    // The place after the subtree of each step; a subtree is filled from its end.
    let mut ends = vec![0; n];
    let mut free = n;
    let mut frees = sizes.clone();
    for step in (0..n).rev() {
        let end = match parents[step] {
            Some(parent) => {
                frees[parent] -= sizes[step];
                ends[parent] - sizes[parent] + frees[parent] + sizes[step] - 1
            }
            None => {
                free -= sizes[step];
                free + sizes[step]
            }
        };
        ends[step] = end;
    }
    let mut sorted: Vec<(usize, u32, Vec<u32>)> = ends
        .into_iter()
        .zip(order)
        .zip(columns)
        .map(|((end, vertex), column)| (end, vertex, column))
        .collect();
    sorted.sort_unstable_by_key(|(end, ..)| *end);
    sorted.into_iter().map(|(_, vertex, column)| (vertex, column)).unzip()
}

/// The graph of what is not eliminated yet.
struct EliminationGraph {
    /// A bit for every pair of vertices, `words` for each vertex.
    bits: Vec<u64>,
    words: usize,
    /// The number of neighbours of every vertex, followed by 16 bits with its own number;
    /// `u32::MAX` when it is eliminated.
    degrees: Vec<u32>,
    /// The bits of the vertex in work.
    own: Vec<u64>,
}

impl EliminationGraph {
    #[inline(always)]
    fn new(matrix: &SparseSymmetric) -> Self {
        let n = matrix.size();
        let words = n.div_ceil(64);
        let mut bits = vec![0; n * words];
        for vertex in 0..n {
            for &(other, _) in matrix.row(vertex) {
                bits[vertex * words + other as usize / 64] |= 1 << (other % 64);
            }
        }
        let degrees = (0..n).map(|vertex| degree(&bits[vertex * words..][..words], vertex)).collect();
        EliminationGraph { bits, words, degrees, own: vec![0; words] }
    }

    /// Returns the first of the vertices with the fewest neighbours.
    #[inline(always)]
    fn least_connected(&self) -> usize {
        let least = self.degrees.iter().fold(u32::MAX, |least, degree| least.min(*degree));
        least as usize % MOST_VERTICES
    }

    /// Removes a vertex, joins its neighbours and returns them.
    #[inline(always)]
    fn eliminate(&mut self, vertex: usize) -> Vec<u32> {
        let words = self.words;
        self.own.copy_from_slice(&self.bits[vertex * words..][..words]);
        let mut neighbours = Vec::with_capacity(degree(&self.own, 0) as usize / MOST_VERTICES);
        for (number, &word) in self.own.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                neighbours.push(64 * number as u32 + rest.trailing_zeros());
                rest &= rest - 1;
            }
        }
        for &other in &neighbours {
            let row = &mut self.bits[other as usize * words..][..words];
            row.iter_mut().zip(&self.own).for_each(|(to, from)| *to |= from);
            for gone in [vertex, other as usize] {
                row[gone / 64] &= !(1 << (gone % 64));
            }
            self.degrees[other as usize] = degree(row, other as usize);
        }
        self.degrees[vertex] = u32::MAX;
        neighbours
    }
}

/// Returns an entry of [`EliminationGraph::degrees`].
#[inline(always)]
fn degree(bits: &[u64], vertex: usize) -> u32 {
    let count: u32 = bits.iter().map(|word| word.count_ones()).sum();
    count * MOST_VERTICES as u32 + vertex as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Edges = std::collections::BTreeSet<(u32, u32)>;

    fn edges() -> impl Strategy<Value = Edges> {
        let sorted = |(a, b): (u32, u32)| (a.min(b), a.max(b));
        prop::collection::btree_set((0..70u32, 0..70u32), 0..200)
            .prop_map(move |edges| edges.into_iter().filter(|(a, b)| a != b).map(sorted).collect())
    }

    fn matrix(edges: &Edges) -> SparseSymmetric {
        SparseSymmetric::new(vec![1.0; 70], edges.iter().map(|&(a, b)| ([a, b], -1.0)))
    }

    /// Eliminates the vertices in an order, and returns the neighbours of each at its step.
    fn eliminated(edges: &Edges, order: &[u32]) -> Vec<Vec<usize>> {
        let mut filled = vec![[false; 70]; 70];
        for &(a, b) in edges {
            (filled[a as usize][b as usize], filled[b as usize][a as usize]) = (true, true);
        }
        let mut columns = Vec::new();
        for &vertex in order {
            let own: Vec<usize> = (0..70).filter(|&other| filled[vertex as usize][other]).collect();
            for &a in &own {
                own.iter().filter(|&&b| a != b).for_each(|&b| filled[a][b] = true);
                filled[a][vertex as usize] = false;
            }
            columns.push(own);
        }
        columns
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn every_step_eliminates_a_vertex_with_the_fewest_neighbours(edges in edges()) {
            let elimination = Elimination { matrix: &matrix(&edges), most_entries: usize::MAX };
            let (order, columns) = Arch::new().dispatch(elimination).unwrap();
            for step in 0..70 {
                let neighbours_with = |vertex: u32| {
                    let mut order = order[..step].to_vec();
                    order.push(vertex);
                    eliminated(&edges, &order).pop().unwrap().len()
                };
                let fewest = order[step..].iter().map(|&vertex| neighbours_with(vertex)).min();
                prop_assert_eq!(Some(columns[step].len()), fewest);
            }
        }

        #[test]
        fn columns_are_what_elimination_fills_in(edges in edges()) {
            let Ordering { order, columns } = Ordering::of_minimum_degree(&matrix(&edges), usize::MAX).unwrap();
            for (column, expected) in columns.iter().zip(eliminated(&edges, &order)) {
                let mut rows: Vec<usize> = column.iter().map(|&step| order[step as usize] as usize).collect();
                rows.sort_unstable();
                prop_assert_eq!(rows, expected);
            }
        }

        #[test]
        fn a_subtree_of_the_elimination_tree_is_a_range_of_steps(edges in edges()) {
            let Ordering { columns, .. } = Ordering::of_minimum_degree(&matrix(&edges), usize::MAX).unwrap();
            for step in 0..70 {
                let subtree: Vec<usize> = (0..=step).filter(|&from| is_below(&columns, from, step)).collect();
                prop_assert_eq!(subtree[0] + subtree.len(), step + 1);
            }
        }
    }

    /// Returns whether the parents of a step lead to another one.
    fn is_below(columns: &[Vec<u32>], mut step: usize, other: usize) -> bool {
        while step < other {
            match columns[step].first() {
                Some(&parent) => step = parent as usize,
                None => return false,
            }
        }
        step == other
    }

    #[test]
    fn a_matrix_without_zeros_is_not_sparse() {
        let all = (1..50u32).flat_map(|a| (0..a).map(move |b| ([b, a], 1.0)));
        assert!(Ordering::of_minimum_degree(&SparseSymmetric::new(vec![1.0; 50], all), 1000).is_none());
    }
}
