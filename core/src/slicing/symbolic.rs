//! The symbolic factor: where the entries of L are, and which entries each step changes
//! (T. A. Davis, *Direct Methods for Sparse Linear Systems*, SIAM, 2006, chapter 4). All shifts of
//! a matrix share it.

use super::{matrix::SparseSymmetric, ordering::Ordering};

/// Columns of a panel, at most.
pub const WIDEST_PANEL: usize = 4;

/// Columns of L that follow each other and have the same rows below the panel (a part of a
/// fundamental supernode). Their products are subtracted together, which saves memory accesses.
#[derive(Debug, Clone, Copy)]
pub struct Panel {
    /// The first column.
    pub first: usize,
    /// The number of columns.
    pub width: usize,
}

/// The structure of L, by columns, without its diagonal of ones.
pub struct Symbolic {
    /// Where each column begins in the entries, and where the last one ends.
    starts: Vec<u32>,
    /// The rows of the entries, ascending in every column.
    rows: Vec<u32>,
    panels: Vec<Panel>,
    /// Entries that each panel changes: for every pair of rows b < a below it, in the order of b,
    /// then of a, the place of (a, b) in the entries.
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
        let panels = panels(&ordering.columns);
        let rows = ordering.columns.concat();
        let targets = targets(&starts, &rows, &panels);
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
        Symbolic { starts, rows, panels, targets, own }
    }

    /// Returns the number of entries below the diagonal of L.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }

    /// Returns where a column begins in the entries, and its rows.
    #[inline(always)]
    pub fn column(&self, column: usize) -> (usize, &[u32]) {
        let [start, end] = [self.starts[column] as usize, self.starts[column + 1] as usize];
        (start, &self.rows[start..end])
    }

    /// Returns the number of entries of the longest column.
    pub fn longest_column(&self) -> usize {
        self.starts.windows(2).map(|ends| (ends[1] - ends[0]) as usize).max().unwrap_or(0)
    }

    /// Returns the panels, in the order of elimination.
    #[inline(always)]
    pub fn panels(&self) -> &[Panel] {
        &self.panels
    }

    /// Returns the entries that the panels change, one panel after the other.
    #[inline(always)]
    pub fn targets(&self) -> &[u32] {
        &self.targets
    }
}

/// Cuts the columns into panels. The rows below a column that has an entry in the next one are all
/// in the next one, so it is enough to compare their numbers.
fn panels(columns: &[Vec<u32>]) -> Vec<Panel> {
    let mut panels: Vec<Panel> = Vec::with_capacity(columns.len());
    for (column, rows) in columns.iter().enumerate() {
        let continues = column > 0 && {
            let before = &columns[column - 1];
            before.first() == Some(&(column as u32)) && before.len() == rows.len() + 1
        };
        match panels.last_mut() {
            Some(panel) if continues && panel.width < WIDEST_PANEL => panel.width += 1,
            _ => panels.push(Panel { first: column, width: 1 }),
        }
    }
    panels
}

/// Returns [`Symbolic::targets`]. Entry (a, b) is looked up when column b is spread out.
fn targets(starts: &[u32], rows: &[u32], panels: &[Panel]) -> Vec<u32> {
    let n = starts.len() - 1;
    let mut count = 0;
    // The entries of L in row b: where the pairs of b begin in the targets, and the rows a there.
    let mut of_row: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new(); n];
    for panel in panels {
        let last = panel.first + panel.width - 1;
        let [start, end] = [starts[last] as usize, starts[last + 1] as usize];
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
