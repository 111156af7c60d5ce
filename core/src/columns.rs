//! Columns: numbers of a large map that wait outside memory until all boxes are settled. A front end
//! brings the place where they wait, such as files.

use crate::Result;
use std::ops::Range;

/// Numbers in the order in which they are appended.
pub trait Column: Send + Sync {
    /// Appends numbers.
    ///
    /// # Errors
    /// Returns [`crate::Error::Column`] where there is no room for them.
    fn append(&mut self, numbers: &[f64]) -> Result<()>;

    /// Reads the numbers from the one at `first` on, as many as `numbers` has.
    ///
    /// # Errors
    /// Returns [`crate::Error::Column`] where they cannot be read.
    fn read(&self, first: usize, numbers: &mut [f64]) -> Result<()>;
}

/// What makes columns.
pub trait Columns: Sync {
    /// Makes an empty column.
    ///
    /// # Errors
    /// Returns [`crate::Error::Column`] where it cannot be made.
    fn column(&self) -> Result<Box<dyn Column>>;
}

/// Columns in memory.
pub struct InMemory;

impl Columns for InMemory {
    fn column(&self) -> Result<Box<dyn Column>> {
        Ok(Box::new(Vec::<f64>::new()))
    }
}

impl Column for Vec<f64> {
    fn append(&mut self, numbers: &[f64]) -> Result<()> {
        self.extend_from_slice(numbers);
        Ok(())
    }

    fn read(&self, first: usize, numbers: &mut [f64]) -> Result<()> {
        numbers.copy_from_slice(&self[first..first + numbers.len()]);
        Ok(())
    }
}

/// Numbers that all readers of a column hold in memory together.
const MOST_READ: usize = 1 << 20;

/// A reader of some numbers of a column, from the first to the last.
pub(crate) struct Reader<'a> {
    column: &'a dyn Column,
    /// What is not yet in memory.
    rest: Range<usize>,
    /// What is, the last one first.
    read: Vec<f64>,
    /// Numbers that are read at once.
    block: usize,
}

impl<'a> Reader<'a> {
    /// Creates one of so many readers that are used in turn.
    pub fn new(column: &'a dyn Column, numbers: Range<usize>, readers: usize) -> Self {
        Reader { column, rest: numbers, read: Vec::new(), block: (MOST_READ / readers.max(1)).max(64) }
    }

    /// Returns the next number, or nothing after the last one.
    pub fn next(&mut self) -> Result<Option<f64>> {
        if self.read.is_empty() && !self.rest.is_empty() {
            let first = self.rest.start;
            self.rest.start = self.rest.end.min(first + self.block);
            self.read.resize(self.rest.start - first, 0.0);
            self.column.read(first, &mut self.read)?;
            self.read.reverse();
        }
        Ok(self.read.pop())
    }
}
