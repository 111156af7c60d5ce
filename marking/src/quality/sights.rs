//! The measurements of single geometries.

use super::geos::Geos;
use crate::Outline;
use rayon::prelude::*;
use rstar::{AABB, Envelope};
use std::borrow::Cow;

/// Geometries that GEOS measures at once.
const BATCH: usize = 4096;

/// The geometries of a map, numbered; the same numbers before and after.
#[derive(Clone, Copy)]
pub struct Outlines<'a> {
    /// Their number.
    pub count: usize,
    /// Returns one of them.
    pub get: &'a (dyn Fn(usize) -> Cow<'a, Outline> + Sync),
}

/// A geometry, measured by GEOS.
pub(super) struct Sight {
    pub(super) is_valid: bool,
    /// Its area, CRS units squared; 0 without one.
    pub(super) area: f64,
}

/// The bounding box of a geometry, inside out for an empty one.
pub(super) type Bounds = AABB<[f64; 2]>;

impl Sight {
    /// Measures all geometries; returns their bounding boxes, too.
    pub(super) fn measure_all(outlines: Outlines, geos: &dyn Geos) -> (Vec<Self>, Vec<Bounds>) {
        let (mut sights, mut bounds) =
            (Vec::with_capacity(outlines.count), Vec::with_capacity(outlines.count));
        for first in (0..outlines.count).step_by(BATCH) {
            let numbers = first..outlines.count.min(first + BATCH);
            let batch: Vec<Cow<Outline>> =
                numbers.into_par_iter().map(|number| (outlines.get)(number)).collect();
            let are_valid = geos.are_valid(&batch);
            let measure =
                |(outline, is_valid): (&Cow<Outline>, bool)| Sight::measure(outline, is_valid, geos);
            let measured: Vec<(Sight, Bounds)> = batch.par_iter().zip(are_valid).map(measure).collect();
            for (sight, of_sight) in measured {
                sights.push(sight);
                bounds.push(of_sight);
            }
        }
        (sights, bounds)
    }

    fn measure(outline: &Outline, is_valid: bool, geos: &dyn Geos) -> (Self, Bounds) {
        let mut bounds = AABB::new_empty();
        outline.chains.iter().flatten().for_each(|point| bounds.merge(&AABB::from_point(*point)));
        if outline.is_plain() || outline.chains.is_empty() {
            return (Sight { is_valid, area: outline.area() }, bounds);
        }
        let (area, whole) = geos.extents(outline); // with the bellies of arcs
        bounds.merge(&whole);
        (Sight { is_valid, area }, bounds)
    }
}
