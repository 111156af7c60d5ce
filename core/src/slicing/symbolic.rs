//! The symbolic factor: where the entries of L are, and which entries each step changes
//! (T. A. Davis, *Direct Methods for Sparse Linear Systems*, SIAM, 2006, chapter 4). All shifts of
//! a matrix share it.

use super::{matrix::SparseSymmetric, ordering::Ordering};

/// Columns of a panel, at most.
pub const WIDEST_PANEL: usize = 4;
/// A column joins the panel after it when it gets at most this many zeros.
const MOST_ZEROS: usize = 2;

/// Columns of L D that follow each other and have the same rows below the panel (a relaxed
/// supernode). Their products are subtracted together, which saves memory accesses.
///
/// A panel is a dense array of its rows, which are those of its columns and those below them. Its
/// diagonal holds D, and what is above the diagonal has no meaning.
#[derive(Debug, Clone)]
pub struct Panel {
    /// The first column.
    pub first: usize,
    /// The number of columns.
    pub width: usize,
    /// Where its array begins in the entries, and where it ends.
    pub entries: [usize; 2],
    /// Where the rows below it begin in the rows, and where they end.
    rows: [usize; 2],
}

/// The structure of the factor.
pub struct Symbolic {
    panels: Vec<Panel>,
    /// The rows below the panels, ascending in every panel.
    rows: Vec<u32>,
    /// The number of entries of all panels.
    entries: usize,
    /// Entries that each panel changes: for every pair of rows b <= a below it, in the order of b,
    /// then of a, the place of (a, b) in the entries.
    targets: Vec<u32>,
    /// The places of the diagonal.
    diagonal: Vec<u32>,
    /// The entries of the matrix below its diagonal: places and values.
    pub own: Vec<(u32, f64)>,
}

impl Symbolic {
    /// Prepares the factorisation of a matrix whose rows are in the order of elimination.
    pub fn new(matrix: &SparseSymmetric, ordering: &Ordering) -> Self {
        let mut symbolic = Symbolic {
            panels: Vec::new(),
            rows: Vec::new(),
            entries: 0,
            targets: Vec::new(),
            diagonal: Vec::new(),
            own: Vec::new(),
        };
        for [first, end] in panels(&ordering.columns) {
            symbolic.add_panel(first, end, &ordering.columns[end - 1]);
        }
        symbolic.find_places(matrix);
        symbolic
    }

    /// Returns the number of entries of all panels.
    pub fn entries(&self) -> usize {
        self.entries
    }

    /// Returns the panels, in the order of elimination.
    #[inline(always)]
    pub fn panels(&self) -> &[Panel] {
        &self.panels
    }

    /// Returns the rows below a panel.
    #[inline(always)]
    pub fn rows(&self, panel: &Panel) -> &[u32] {
        &self.rows[panel.rows[0]..panel.rows[1]]
    }

    /// Returns the entries that the panels change, one panel after the other.
    #[inline(always)]
    pub fn targets(&self) -> &[u32] {
        &self.targets
    }

    /// Returns the places of the diagonal.
    #[inline(always)]
    pub fn diagonal(&self) -> &[u32] {
        &self.diagonal
    }

    fn add_panel(&mut self, first: usize, end: usize, rows: &[u32]) {
        let (width, start) = (end - first, self.entries);
        self.entries += (width + rows.len()) * width;
        let first_row = self.rows.len();
        self.rows.extend(rows);
        let [entries, rows] = [[start, self.entries], [first_row, self.rows.len()]];
        self.diagonal.extend((0..width).map(|c| (start + c * (width + 1)) as u32));
        self.panels.push(Panel { first, width, entries, rows });
    }

    /// Finds the places of the targets and of the entries of the matrix. Those of a panel are
    /// looked up when the places of its rows are spread out.
    fn find_places(&mut self, matrix: &SparseSymmetric) {
        let mut count = 0;
        // For every row b below a panel: where its pairs begin in the targets, and the rows a.
        let mut of_row: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new(); matrix.size()];
        for panel in &self.panels {
            let [start, end] = panel.rows;
            for b in start..end {
                of_row[self.rows[b] as usize].push((count, b, end));
                count += end - b;
            }
        }
        self.targets.resize(count, 0);
        let mut place = vec![0; matrix.size()];
        for panel in &self.panels {
            let end = panel.first + panel.width;
            let below = self.rows[panel.rows[0]..panel.rows[1]].iter().map(|row| *row as usize);
            for (row, start) in (panel.first..end).chain(below).zip((panel.entries[0]..).step_by(panel.width))
            {
                place[row] = start;
            }
            for (c, column) in (panel.first..end).enumerate() {
                for &(first, start, end) in &of_row[column] {
                    for (target, row) in self.targets[first..].iter_mut().zip(&self.rows[start..end]) {
                        *target = (place[*row as usize] + c) as u32;
                    }
                }
                let lower = matrix.row(column).iter().filter(|(row, _)| *row as usize > column);
                self.own.extend(lower.map(|&(row, value)| ((place[row as usize] + c) as u32, value)));
            }
        }
    }
}

/// Cuts the columns into panels, and returns the first column of each and the one after its last.
/// What is below the first entry of a column is also in the column of that entry.
fn panels(columns: &[Vec<u32>]) -> Vec<[usize; 2]> {
    let mut panels = Vec::with_capacity(columns.len());
    let mut end = columns.len();
    while end > 0 {
        let last = end - 1;
        let mut first = last;
        while first > 0 && end - first < WIDEST_PANEL {
            let rows = &columns[first - 1];
            let length = end - first + columns[last].len();
            if rows.first() != Some(&(first as u32)) || length - rows.len() > MOST_ZEROS {
                break;
            }
            first -= 1;
        }
        panels.push([first, end]);
        end = first;
    }
    panels.reverse();
    panels
}
