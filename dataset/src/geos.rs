//! GEOS of GDAL.

use gdal::vector::Geometry;
use meshmark_marking::{
    Outline,
    quality::{Geos, Neighbours},
};
use rayon::prelude::*;
use rstar::{AABB, Envelope};
use std::borrow::Cow;

/// The GEOS that GDAL is built with. An error handler may show its messages about invalid geometries.
pub struct GeosOfGdal;

impl Geos for GeosOfGdal {
    fn are_valid(&self, outlines: &[Cow<Outline>]) -> Vec<bool> {
        let is_valid = |outline: &Cow<Outline>| geometry(outline).is_some_and(|geometry| geometry.is_valid());
        outlines.par_iter().map(is_valid).collect()
    }

    fn extents(&self, outline: &Outline) -> (f64, AABB<[f64; 2]>) {
        let Some(geometry) = geometry(outline) else { return (0.0, AABB::new_empty()) };
        let whole = geometry.envelope();
        (geometry.area(), AABB::from_corners([whole.MinX, whole.MinY], [whole.MaxX, whole.MaxY]))
    }

    fn common_areas(&self, groups: &[Neighbours]) -> Vec<Vec<f64>> {
        let of_group = |(polygon, others): &Neighbours| {
            let polygon = geometry(polygon);
            let common = |other: &Cow<Outline>| {
                let common = polygon.as_ref()?.intersection(&geometry(other)?)?;
                Some(common.area())
            };
            others.iter().map(|other| common(other).unwrap_or(0.0)).collect()
        };
        groups.par_iter().map(of_group).collect()
    }
}

/// Returns the geometry of GDAL; `None` when GDAL cannot make one.
fn geometry(outline: &Outline) -> Option<Geometry> {
    Geometry::from_wkb(&outline.wkb()).ok()
}
