//! The measurements of single geometries.

use crate::Outline;
use rstar::{AABB, Envelope};
use std::borrow::Cow;

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
    /// Its bounding box, inside out for an empty one.
    pub(super) bounds: AABB<[f64; 2]>,
}

impl Sight {
    pub(super) fn measure(outline: &Outline) -> Self {
        let mut bounds = AABB::new_empty();
        outline.chains.iter().flatten().for_each(|point| bounds.merge(&AABB::from_point(*point)));
        match outline.geometry() {
            Some(geometry) => {
                if !outline.is_plain() && !outline.chains.is_empty() {
                    let whole = geometry.envelope(); // with the bellies of arcs
                    bounds.merge(&AABB::from_corners([whole.MinX, whole.MinY], [whole.MaxX, whole.MaxY]));
                }
                Sight { is_valid: geometry.is_valid(), area: geometry.area(), bounds }
            }
            None => Sight { is_valid: false, area: 0.0, bounds },
        }
    }
}
