//! The symbolic factor: where the entries of L are, and which entries each step changes
//! (T. A. Davis, *Direct Methods for Sparse Linear Systems*, SIAM, 2006, chapter 4). All shifts of
//! a matrix share it.

use super::{matrix::SparseSymmetric, ordering::Ordering};

/// The structure of L, by columns, without its diagonal of ones.
pub struct Symbolic {
    /// Where each column begins in the entries, and where the last one ends.
    starts: Vec<u32>,
    /// The rows of the entries, ascending in every column.
    rows: Vec<u32>,
    /// Entries below the diagonal that a step changes: for its column, and every pair of its rows
    /// b < a, in the order of b, then of a, the place of (a, b) in the entries.
    targets: Vec<u32>,
    /// The entries of the matrix itself: places and values.
    pub own: Vec<(u32, f64)>,
}

impl Symbolic {
    /// Prepares the factorisation of a matrix whose rows are in the order of elimination.
    pub fn new(matrix: &SparseSymmetric, ordering: &Ordering) -> Self {
        let mut starts = vec![0];
        for column in &ordering.columns {
            starts.push(starts[starts.len() - 1] + column.len() as u32);
        }
        let rows = ordering.columns.concat();
        let targets = targets(&starts, &rows);
        let place = |row: usize, column: usize| {
            let start = starts[column] as usize;
            let found = rows[start..starts[column + 1] as usize].binary_search(&(row as u32));
            (start + found.expect("L has all entries of the matrix")) as u32
        };
        let lower = |column: usize| {
            let below = matrix.row(column).iter().filter(move |(row, _)| *row as usize > column);
            below.map(move |&(row, value)| (place(row as usize, column), value))
        };
        let own = (0..matrix.size()).flat_map(lower).collect();
        Symbolic { starts, rows, targets, own }
    }

    /// Returns the number of entries below the diagonal of L.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }

    /// Returns for every column where it begins in the entries, and its rows.
    #[inline(always)]
    pub fn columns(&self) -> impl DoubleEndedIterator<Item = (usize, &[u32])> + ExactSizeIterator {
        self.starts.windows(2).map(|ends| {
            let [start, end] = [ends[0] as usize, ends[1] as usize];
            (start, &self.rows[start..end])
        })
    }

    /// Returns the entries that the steps change, one step after the other.
    #[inline(always)]
    pub fn targets(&self) -> &[u32] {
        &self.targets
    }
}

/// Returns [`Symbolic::targets`]. Entry (a, b) is looked up when column b is spread out.
fn targets(starts: &[u32], rows: &[u32]) -> Vec<u32> {
    let n = starts.len() - 1;
    let mut from = Vec::with_capacity(n);
    let mut count = 0;
    // The entries of L in row b: where the pairs of b begin in the targets, and the rows a there.
    let mut of_row: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new(); n];
    for column in 0..n {
        let [start, end] = [starts[column] as usize, starts[column + 1] as usize];
        from.push(count);
        for entry in start..end {
            of_row[rows[entry] as usize].push((count, entry + 1, end));
            count += end - entry - 1;
        }
    }
    let mut targets = vec![0; count];
    let mut place = vec![0; n];
    for column in 0..n {
        for entry in starts[column]..starts[column + 1] {
            place[rows[entry as usize] as usize] = entry;
        }
        for &(first, start, end) in &of_row[column] {
            for (target, row) in targets[first..].iter_mut().zip(&rows[start..end]) {
                *target = place[*row as usize];
            }
        }
    }
    targets
}
