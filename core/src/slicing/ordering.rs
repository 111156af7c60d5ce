//! The order of elimination: exact minimum degree.
//!
//! Every step eliminates a vertex with the fewest neighbours and joins these (A. George,
//! J. W. H. Liu, *The Evolution of the Minimum Degree Ordering Algorithm*, SIAM Review 31, 1989).
//! The neighbours at that moment are the rows of its column of L (T. A. Davis, *Direct Methods for
//! Sparse Linear Systems*, SIAM, 2006, chapter 7). The matrices are so small that the elimination
//! graph is kept as bits, and degrees are exact.

use super::matrix::SparseSymmetric;

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
        let mut graph = EliminationGraph::new(matrix);
        let mut order = Vec::with_capacity(n);
        let mut columns = Vec::with_capacity(n);
        let mut entries = 0;
        for _ in 0..n {
            let vertex = graph.least_connected();
            let neighbours = graph.eliminate(vertex);
            entries += neighbours.len();
            if entries > most_entries {
                return None;
            }
            order.push(vertex as u32);
            columns.push(neighbours);
        }
        let mut step = vec![0; n];
        (0..).zip(&order).for_each(|(number, &vertex)| step[vertex as usize] = number);
        for column in &mut columns {
            column.iter_mut().for_each(|vertex| *vertex = step[*vertex as usize]);
            column.sort_unstable();
        }
        Some(Ordering { order, columns })
    }
}

/// The graph of what is not eliminated yet.
struct EliminationGraph {
    /// A bit for every pair of vertices, `words` for each vertex.
    bits: Vec<u64>,
    words: usize,
    /// The number of neighbours; `u32::MAX` when eliminated.
    degrees: Vec<u32>,
}

impl EliminationGraph {
    fn new(matrix: &SparseSymmetric) -> Self {
        let n = matrix.size();
        let words = n.div_ceil(64);
        let mut bits = vec![0; n * words];
        for vertex in 0..n {
            for &(other, _) in matrix.row(vertex) {
                bits[vertex * words + other as usize / 64] |= 1 << (other % 64);
            }
        }
        let degree = |vertex: usize| ones(&bits[vertex * words..][..words]);
        let degrees = (0..n).map(degree).collect();
        EliminationGraph { bits, words, degrees }
    }

    /// Returns the first of the vertices with the fewest neighbours.
    fn least_connected(&self) -> usize {
        let least = self.degrees.iter().min().expect("a vertex is left");
        self.degrees.iter().position(|degree| degree == least).expect("it is one of them")
    }

    /// Removes a vertex, joins its neighbours and returns them.
    fn eliminate(&mut self, vertex: usize) -> Vec<u32> {
        let words = self.words;
        let own = self.bits[vertex * words..][..words].to_vec();
        let neighbours: Vec<u32> = positions(&own).collect();
        for &other in &neighbours {
            let row = &mut self.bits[other as usize * words..][..words];
            row.iter_mut().zip(&own).for_each(|(to, from)| *to |= from);
            for gone in [vertex, other as usize] {
                row[gone / 64] &= !(1 << (gone % 64));
            }
            self.degrees[other as usize] = ones(row);
        }
        self.degrees[vertex] = u32::MAX;
        neighbours
    }
}

fn ones(bits: &[u64]) -> u32 {
    bits.iter().map(|word| word.count_ones()).sum()
}

/// Returns the positions of the bits that are set.
fn positions(bits: &[u64]) -> impl Iterator<Item = u32> {
    (0..).zip(bits).flat_map(|(number, &word)| {
        let rest = std::iter::successors(Some(word), |rest| Some(rest & (rest - 1)));
        rest.take_while(|rest| *rest != 0).map(move |rest| 64 * number + rest.trailing_zeros())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn columns_are_what_elimination_fills_in(edges in prop::collection::btree_set((0..70u32, 0..70u32), 0..200)) {
            let edges: std::collections::BTreeSet<[u32; 2]> =
                edges.into_iter().filter(|(a, b)| a != b).map(|(a, b)| [a.min(b), a.max(b)]).collect();
            let matrix = SparseSymmetric::new(vec![1.0; 70], edges.iter().map(|edge| (*edge, -1.0)));
            let Ordering { order, columns } = Ordering::of_minimum_degree(&matrix, usize::MAX).unwrap();
            let mut filled = vec![[false; 70]; 70];
            for [a, b] in edges {
                (filled[a as usize][b as usize], filled[b as usize][a as usize]) = (true, true);
            }
            let mut is_left = [true; 70];
            for (vertex, column) in order.iter().zip(columns) {
                let neighbours = |filled: &[[bool; 70]], of: usize| -> Vec<usize> {
                    (0..70).filter(|&other| filled[of][other] && is_left[other]).collect()
                };
                let own = neighbours(&filled, *vertex as usize);
                let fewest = (0..70).filter(|&v| is_left[v]).map(|v| neighbours(&filled, v).len()).min();
                prop_assert_eq!(Some(own.len()), fewest);
                let mut rows: Vec<usize> = column.iter().map(|&step| order[step as usize] as usize).collect();
                rows.sort_unstable();
                prop_assert_eq!(&rows, &own);
                own.iter().for_each(|&a| own.iter().filter(|&&b| a != b).for_each(|&b| filled[a][b] = true));
                is_left[*vertex as usize] = false;
            }
        }
    }

    #[test]
    fn a_matrix_without_zeros_is_not_sparse() {
        let all = (1..50u32).flat_map(|a| (0..a).map(move |b| ([b, a], 1.0)));
        assert!(Ordering::of_minimum_degree(&SparseSymmetric::new(vec![1.0; 50], all), 1000).is_none());
    }
}
