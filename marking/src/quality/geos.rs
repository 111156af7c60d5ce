//! What GEOS decides, as the front end has it.

use crate::Outline;
use rstar::AABB;
use std::borrow::Cow;

/// A polygon, and others that it may overlap.
pub type Neighbours<'a> = (Cow<'a, Outline>, Vec<Cow<'a, Outline>>);

/// The library GEOS. It works on many geometries at once, as calls may be slow.
pub trait Geos: Sync {
    /// Returns which geometries are valid.
    fn are_valid(&self, outlines: &[Cow<Outline>]) -> Vec<bool>;

    /// Returns the area and the bounding box of a geometry that its chains do not describe.
    fn extents(&self, outline: &Outline) -> (f64, AABB<[f64; 2]>);

    /// Returns the common area, CRS units squared, of each polygon with each of its neighbours; 0 where
    /// there is none.
    fn common_areas(&self, groups: &[Neighbours]) -> Vec<Vec<f64>>;
}
