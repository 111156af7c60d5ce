//! What a damaged map has that nobody can place: it is left out, counted and named, so that one bad
//! feature does not hide all the others.

use crate::{Error, Result};

/// The number of faults that are named.
const MOST_NAMED: usize = 10;

/// A coordinate pair that is left out, before the chains are closed up.
pub const MISSING: [f64; 2] = [f64::NAN; 2];

/// Returns whether a coordinate pair is not [`MISSING`].
pub fn is_there(point: &[f64; 2]) -> bool {
    point[0].is_finite() && point[1].is_finite()
}

/// What was left out of a map.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Number of coordinate pairs outside all that a CRS can mean.
    pub coordinates: usize,
    /// Number of features that cannot be read, or not to their end.
    pub features: usize,
    /// The first faults, each with its layer.
    pub named: Vec<String>,
}

impl LeftOut {
    /// Returns whether the map is complete.
    pub fn is_nothing(&self) -> bool {
        self.coordinates == 0 && self.features == 0
    }

    /// Counts a coordinate pair, and names the fault of one of the first.
    pub fn coordinate(&mut self, fault: impl FnOnce() -> String) {
        self.coordinates += 1;
        self.name(fault);
    }

    /// Counts a feature, and names the fault of one of the first.
    pub fn feature(&mut self, fault: impl FnOnce() -> String) {
        self.features += 1;
        self.name(fault);
    }

    fn name(&mut self, fault: impl FnOnce() -> String) {
        if self.named.len() < MOST_NAMED {
            self.named.push(fault());
        }
    }
}

/// The treatment of faults while a map is read.
pub enum Faults<'a> {
    /// The first one is an error.
    Fail,
    /// All are left out.
    LeaveOut(&'a mut LeftOut),
}

impl Faults<'_> {
    /// Returns what takes the place of a coordinate pair with this fault.
    pub fn coordinate(&mut self, fault: Error) -> Result<[f64; 2]> {
        let Faults::LeaveOut(left_out) = self else { return Err(fault) };
        left_out.coordinate(|| fault.fault());
        Ok(MISSING)
    }

    /// Ends a feature with this fault.
    pub fn feature(&mut self, fault: Error) -> Result<()> {
        let Faults::LeaveOut(left_out) = self else { return Err(fault) };
        left_out.feature(|| fault.fault());
        Ok(())
    }
}
