//! How far away a place can be: further numbers are an accident, and would leave nothing of the other vertices.

use crate::{CoordinateSystem, Error, Result};
use meshmark_core::vertices::WIDEST;

/// Past a thousand times the width of any map of the Earth a number is coarser than a tenth of a millimetre.
const FURTHEST_M: f64 = 1e12;

/// Longitudes may count on past the date line, but nobody turns so often.
const FURTHEST_DEGREES: f64 = 3600.0;

/// The largest coordinate of a map, CRS units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent(f64);

impl Extent {
    /// Whatever is not wider than a mesh can be.
    pub(crate) const ANY: Extent = Extent(WIDEST / 2.0);

    /// Of maps in a CRS. A map without one is in metres.
    pub(crate) fn in_crs(crs: Option<&CoordinateSystem>) -> Self {
        let Some(srs) = crs.map(CoordinateSystem::spatial_ref) else { return Extent(FURTHEST_M) };
        Extent(match srs.is_geographic() {
            true => FURTHEST_DEGREES / srs.angular_units().to_degrees(),
            false => FURTHEST_M / srs.linear_units(),
        })
    }

    /// Fails for a coordinate of a feature that is no place in it.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::TooFar`].
    pub(crate) fn check(self, [x, y]: [f64; 2], layer: &str, fid: impl Fn() -> String) -> Result<()> {
        if !x.is_finite() || !y.is_finite() {
            return Err(Error::NotFinite { layer: layer.into(), fid: fid(), x, y });
        }
        match x.abs().max(y.abs()) > self.0 {
            true => Err(Error::TooFar { layer: layer.into(), fid: fid(), x, y }),
            false => Ok(()),
        }
    }
}
