//! The quality of marked geometries: areas, Hausdorff distances, validity and overlaps.
//!
//! GEOS decides validity and computes areas of intersections, but only of geometries that may
//! overlap. An error handler may show its messages about invalid geometries.

mod geos;
mod linework;
mod overlaps;
mod sights;

pub use geos::{Geos, Neighbours};
pub use sights::Outlines;

use crate::Outline;
use meshmark_core::{
    distortion::{Areas, Hausdorff, Overlaps, Spread, Validity},
    ground::Ground,
};
use rayon::prelude::*;
use sights::Sight;

/// The state of a map, measured by GEOS.
pub struct State {
    /// The measurements of every geometry.
    sights: Vec<Sight>,
    /// The common areas of pairs of valid polygons.
    common: overlaps::CommonAreas,
}

impl State {
    /// Measures all geometries.
    pub fn measure(outlines: Outlines, geos: &dyn Geos) -> Self {
        let (sights, bounds) = Sight::measure_all(outlines, geos);
        let common = overlaps::common_areas(outlines, (&sights, bounds), geos);
        State { sights, common }
    }
}

/// What differs between two states of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Areas of polygons.
    pub areas: Areas,
    /// Hausdorff distances between features before and after.
    pub hausdorff: Hausdorff,
    /// Validity by GEOS.
    pub validity: Validity,
    /// Polygons that overlap, by GEOS.
    pub overlaps: Overlaps,
    /// Geometries that became invalid.
    pub newly_invalid: Vec<u32>,
    /// Pairs of polygons that overlap only now.
    pub newly_overlapping: Vec<[u32; 2]>,
}

/// A map before and after.
pub struct BeforeAfter<'a> {
    /// The geometries before, and their state.
    pub before: (Outlines<'a>, &'a State),
    /// The geometries after, and their state.
    pub after: (Outlines<'a>, &'a State),
    /// Metres per unit.
    pub measure: &'a Ground,
    /// The grid of the map after, CRS units; 0 without one. Overlaps up to a cell of it are
    /// slivers.
    pub grid: f64,
}

impl BeforeAfter<'_> {
    /// Compares the two states.
    pub fn quality(&self) -> Quality {
        let (validity, newly_invalid) = self.validity();
        let (overlaps, newly_overlapping) = self.overlaps();
        let (areas, hausdorff) = (self.areas(), self.hausdorff());
        Quality { areas, hausdorff, validity, overlaps, newly_invalid, newly_overlapping }
    }

    fn sights(&self) -> impl Iterator<Item = (&Sight, &Sight)> {
        self.before.1.sights.iter().zip(&self.after.1.sights)
    }

    fn validity(&self) -> (Validity, Vec<u32>) {
        let invalid = |state: &State| state.sights.iter().filter(|sight| !sight.is_valid).count();
        let new = (0..).zip(self.sights()).filter(|(_, (a, b))| a.is_valid && !b.is_valid);
        let new: Vec<u32> = new.map(|(number, _)| number).collect();
        let (invalid_before, invalid_after) = (invalid(self.before.1), invalid(self.after.1));
        (Validity { invalid_before, invalid_after, newly_invalid: new.len() }, new)
    }

    fn overlaps(&self) -> (Overlaps, Vec<[u32; 2]>) {
        let [before, after] = [self.before.1, self.after.1];
        let is_valid =
            |number: u32| [before, after].iter().all(|state| state.sights[number as usize].is_valid);
        let scale = |number: u32| self.scale(&(self.before.0.get)(number as usize));
        overlaps::compare([&before.common, &after.common], is_valid, scale, self.grid)
    }

    fn areas(&self) -> Areas {
        let polygons = self.sights().filter(|(before, _)| before.area > 0.0);
        let changes: Vec<f64> = polygons.map(|(a, b)| (b.area - a.area).abs() / a.area).collect();
        let polygons = changes.len();
        let spread = Spread::summarise(changes);
        Areas { polygons, mean_change: spread.mean, p99_change: spread.p99, max_change: spread.max }
    }

    fn hausdorff(&self) -> Hausdorff {
        let each = |number: usize| {
            let (before, after) = ((self.before.0.get)(number), (self.after.0.get)(number));
            linework::hausdorff(&before, &after, self.scale(&before))
        };
        let spread = Spread::summarise((0..self.before.0.count).into_par_iter().map(each).collect());
        Hausdorff { p99_m: spread.p99, max_m: spread.max }
    }

    /// Returns metres per unit at a geometry.
    fn scale(&self, outline: &Outline) -> [f64; 2] {
        self.measure.metres_per_unit(outline.first().unwrap_or_default())
    }
}
