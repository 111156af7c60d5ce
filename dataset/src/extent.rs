//! The largest coordinates of a place: larger numbers are an accident, beside which all other
//! vertices would collapse.

use crate::{CoordinateSystem, Error, Result};

/// Beyond a thousand times the width of any map of the Earth a number is coarser than a tenth of a
/// millimetre.
const FURTHEST_M: f64 = 1e12;

/// Longitudes may continue past the date line, but not for ten turns.
const FURTHEST_DEGREES: f64 = 3600.0;

/// The largest coordinate of a map, CRS units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent(f64);

impl Extent {
    /// The extent of maps in an unknown CRS.
    pub(crate) const ANY: Extent = Extent(FURTHEST_M);

    /// Returns the extent of maps in a CRS. A map without one is in metres.
    pub(crate) fn in_crs(crs: Option<&CoordinateSystem>) -> Self {
        let Some(srs) = crs.map(CoordinateSystem::spatial_ref) else { return Extent(FURTHEST_M) };
        Extent(match srs.is_geographic() {
            true => FURTHEST_DEGREES / srs.angular_units().to_degrees(),
            false => FURTHEST_M / srs.linear_units(),
        })
    }

    /// Fails for a coordinate of a feature outside the extent.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::TooFar`].
    pub(crate) fn check(self, [x, y]: [f64; 2], layer: &str, fid: impl Fn() -> String) -> Result<()> {
        if !x.is_finite() || !y.is_finite() {
            return Err(Error::NotFinite { layer: layer.into(), fid: fid(), x, y });
        }
        match self.holds(&[x, y]) {
            true => Ok(()),
            false => Err(Error::TooFar { layer: layer.into(), fid: fid(), x, y }),
        }
    }

    /// Returns whether a coordinate is inside the extent.
    pub(crate) fn holds(self, [x, y]: &[f64; 2]) -> bool {
        x.abs() <= self.0 && y.abs() <= self.0
    }
}
