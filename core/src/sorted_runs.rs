//! The spread of more numbers than memory holds: they are sorted run by run, and the runs merged.

use crate::{
    Result,
    columns::{Column, Columns, Reader},
    distortion::{Spread, SpreadOfSorted},
};
use std::{cmp::Reverse, collections::BinaryHeap};

/// Numbers that are not negative, in sorted runs.
pub(crate) struct SortedRuns {
    column: Box<dyn Column>,
    /// The index after the last number of each run, ascending.
    ends: Vec<usize>,
}

impl SortedRuns {
    pub fn new(columns: &dyn Columns) -> Result<Self> {
        Ok(SortedRuns { column: columns.column()?, ends: Vec::new() })
    }

    /// Returns how many numbers there are.
    pub fn len(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
    }

    /// Adds numbers.
    pub fn add(&mut self, mut numbers: Vec<f64>) -> Result<()> {
        numbers.sort_unstable_by(f64::total_cmp);
        self.column.append(&numbers)?;
        self.ends.push(self.len() + numbers.len());
        Ok(())
    }

    /// Returns the spread of all numbers, as [`Spread::summarise`] does.
    pub fn spread(&self) -> Result<Spread> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        let reader = |(start, &end)| Reader::new(&*self.column, start..end, self.ends.len());
        let mut runs: Vec<Reader> = starts.zip(&self.ends).map(reader).collect();
        // The bits of numbers that are not negative are in the order of the numbers.
        let mut least = BinaryHeap::new();
        for (run, reader) in runs.iter_mut().enumerate() {
            least.extend(reader.next()?.map(|number| Reverse((number.to_bits(), run))));
        }
        let mut spread = SpreadOfSorted::new(self.len());
        while let Some(Reverse((bits, run))) = least.pop() {
            spread.add(f64::from_bits(bits));
            least.extend(runs[run].next()?.map(|number| Reverse((number.to_bits(), run))));
        }
        Ok(spread.spread())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::InMemory;

    #[test]
    fn runs_have_the_spread_of_all_their_numbers_to_the_last_bit() {
        let numbers: Vec<f64> = (0..5000u64).map(|i| ((i * 7919 % 5003) as f64).sqrt() / 7.0).collect();
        for runs in [1, 2, 7, 100, 5000] {
            let mut sorted = SortedRuns::new(&InMemory).unwrap();
            numbers.chunks(5000 / runs).for_each(|run| sorted.add(run.to_vec()).unwrap());
            sorted.add(Vec::new()).unwrap();
            assert_eq!(sorted.spread().unwrap(), Spread::summarise(numbers.clone()), "{runs}");
        }
        let none = SortedRuns::new(&InMemory).unwrap().spread().unwrap();
        assert_eq!(none, Spread::summarise(Vec::new()));
    }
}
