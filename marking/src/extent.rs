//! The largest coordinates of a place: larger numbers are an accident, beside which all other
//! vertices would collapse.

use crate::{Crs, CrsKind, Error, Result};

/// Beyond a thousand times the width of any map of the Earth a number is coarser than a tenth of a
/// millimetre.
const FURTHEST_M: f64 = 1e12;

/// Longitudes may continue past the date line, but not for ten turns.
const FURTHEST_DEGREES: f64 = 3600.0;

/// The largest coordinate of a map, CRS units.
#[derive(Debug, Clone, Copy)]
pub struct Extent(f64);

impl Extent {
    /// The extent of maps in an unknown CRS.
    pub const ANY: Extent = Extent(FURTHEST_M);

    /// Returns the extent of maps in a CRS. A map without one is in metres.
    pub fn in_crs(crs: Option<&dyn Crs>) -> Self {
        let Some(crs) = crs else { return Extent(FURTHEST_M) };
        Extent(match crs.kind() {
            CrsKind::Geographic => FURTHEST_DEGREES / crs.radians_per_unit().to_degrees(),
            _ => FURTHEST_M / crs.linear_units_m(),
        })
    }

    /// Fails for a coordinate of a feature outside the extent.
    ///
    /// # Errors
    /// [`Error::NotFinite`], [`Error::TooFar`].
    pub fn check(self, [x, y]: [f64; 2], layer: &str, fid: impl Fn() -> String) -> Result<()> {
        if !x.is_finite() || !y.is_finite() {
            return Err(Error::NotFinite { layer: layer.into(), fid: fid(), x, y });
        }
        match self.holds(&[x, y]) {
            true => Ok(()),
            false => Err(Error::TooFar { layer: layer.into(), fid: fid(), x, y }),
        }
    }

    /// Returns whether a coordinate is inside the extent.
    pub fn holds(self, [x, y]: &[f64; 2]) -> bool {
        x.abs() <= self.0 && y.abs() <= self.0
    }
}
