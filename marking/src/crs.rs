//! Metres on the ground at the vertices of a map in a CRS.

use crate::{Error, Result};
use meshmark_core::{
    ground::Ground,
    map::Map,
    map_data::MapData,
    options::{AmplitudeOf, Parameters},
    scale::{Scale, ScaleLattice},
    vertices::VertexTable,
};
use std::sync::Arc;

/// What the coordinates of a CRS are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrsKind {
    /// Longitudes and latitudes.
    Geographic,
    /// Eastings and northings of a projection.
    Projected,
    /// Axes from the centre of the Earth.
    Geocentric,
    /// Another kind, such as that of a building site.
    Other,
}

/// A CRS as the library of the front end has it: x is the easting or longitude, y the northing or
/// latitude.
pub trait Crs {
    /// Returns what its coordinates are.
    fn kind(&self) -> CrsKind;
    /// Returns the code, such as "EPSG:3067", or WKT without one.
    fn label(&self) -> String;
    /// Returns the name for messages.
    fn brief_name(&self) -> String;
    /// Returns metres per unit of length.
    fn linear_units_m(&self) -> f64;
    /// Returns radians per unit of longitude and latitude, its own or those of the geographic CRS that
    /// it is a projection of.
    fn radians_per_unit(&self) -> f64;
    /// Returns the semi-axes of its ellipsoid, the longer one first; `None` without one.
    fn ellipsoid_m(&self) -> Option<[f64; 2]>;
    /// Transforms projected coordinates into longitudes and latitudes on its own datum. Those without
    /// a place are then not finite. Returns whether there is such a transformation.
    fn to_geographic(&self, x: &mut [f64], y: &mut [f64]) -> bool;
}

/// Metres on the ground at the vertices of a map.
#[derive(Debug, Clone)]
pub struct Metric {
    /// Metres per unit; `None` where the map has no CRS and its units may be degrees.
    ground: Option<Ground>,
    /// Metres per unit at the place of a vertex, where they vary over a projected map.
    uneven: Option<Ground>,
}

impl Metric {
    /// Measures the ground of a map.
    ///
    /// # Errors
    /// [`Error::Geocentric`].
    pub fn measure(crs: Option<&dyn Crs>, vertices: &VertexTable) -> Result<Self> {
        let ground = match ground(crs, vertices) {
            Ok(ground) => Some(ground),
            Err(Error::NoCrs) => None,
            Err(other) => return Err(other),
        };
        let uneven = crs.zip(ground.as_ref()).and_then(|(crs, ground)| uneven(crs, vertices, ground));
        Ok(Metric { ground, uneven })
    }

    /// Returns metres on the ground at the place of a vertex.
    ///
    /// # Errors
    /// Fails with [`Error::NoCrs`].
    pub fn local(&self) -> Result<&Ground> {
        self.uneven.as_ref().or(self.ground.as_ref()).ok_or(Error::NoCrs)
    }

    /// Returns a map as input of the algorithm. Marks of messages have one scale for a projected
    /// map; fingerprints follow its ground.
    ///
    /// # Errors
    /// Fails with [`Error::NoCrs`].
    pub fn map<'a>(&'a self, data: &'a MapData, parameters: &Parameters) -> Result<Map<'a>> {
        let measure = self.local()?;
        let ground = match parameters.amplitude_of {
            AmplitudeOf::Coefficient => self.ground.as_ref().ok_or(Error::NoCrs)?,
            AmplitudeOf::Displacement => measure,
        };
        Ok(data.on(ground, measure))
    }
}

/// Returns metres on the ground for a map, by its CRS; without one a unit is a metre, unless every
/// coordinate could be a degree.
///
/// # Errors
/// [`Error::NoCrs`], [`Error::Geocentric`].
pub fn ground(crs: Option<&dyn Crs>, table: &VertexTable) -> Result<Ground> {
    if let Some(crs) = crs {
        return of_crs(crs, table);
    }
    let (min, max) = table.bounds();
    let degrees = min[0] >= -180.0 && max[0] <= 180.0 && min[1] >= -90.0 && max[1] <= 90.0;
    if degrees && !table.is_empty() {
        return Err(Error::NoCrs);
    }
    Ok(Ground::METRES)
}

fn of_crs(crs: &dyn Crs, table: &VertexTable) -> Result<Ground> {
    match crs.kind() {
        CrsKind::Geocentric => Err(Error::Geocentric(crs.brief_name())),
        CrsKind::Geographic => Ok(ellipsoid(crs).unwrap_or(Ground::WGS84)),
        // The linear unit is that of an engineering CRS, or of a place outside the projection.
        CrsKind::Projected | CrsKind::Other => Ok(Ground::Plane {
            metres_per_unit: measured_metres_per_unit(crs, table.centre()).unwrap_or(crs.linear_units_m()),
        }),
    }
}

fn ellipsoid(crs: &dyn Crs) -> Option<Ground> {
    let [semi_major_m, semi_minor_m] = crs.ellipsoid_m()?;
    Some(Ground::Ellipsoid { semi_major_m, semi_minor_m, radians_per_unit: crs.radians_per_unit() })
}

/// Measures the ground at many places of a map for which `ground` is not exact everywhere.
fn uneven(crs: &dyn Crs, table: &VertexTable, ground: &Ground) -> Option<Ground> {
    let Ground::Plane { metres_per_unit } = *ground else { return None };
    let local = Local::new(crs)?;
    let lattice = ScaleLattice::measure(table, metres_per_unit, NEGLIGIBLE, |places| local.scales(places));
    lattice.map(|lattice| Ground::Uneven(Arc::new(lattice)))
}

/// Measures metres per unit at a place, the square root of the areal scale, by differences of
/// 100 units of length in longitude and latitude. An EPSG:3857 unit is half a metre at
/// Helsinki.
fn measured_metres_per_unit(crs: &dyn Crs, place: [f64; 2]) -> Option<f64> {
    let local = Local::new(crs)?;
    let [lon, lat] = local.around(&[place]);
    let [m_lon, m_lat] = local.ellipsoid.metres_per_unit([lon[4], lat[4]]);
    let side = |a: usize, b: usize| [(lon[b] - lon[a]) * m_lon, (lat[b] - lat[a]) * m_lat];
    let (along_x, along_y) = (side(0, 1), side(2, 3));
    let area = (along_x[0] * along_y[1] - along_x[1] * along_y[0]).abs();
    let measured = area.sqrt() / (2.0 * local.step);
    let measured = (measured.is_finite() && measured > 0.0).then_some(measured)?;
    // Across the 180th meridian and near a pole, differences of longitudes are not lengths.
    let in_space = local.scales(&[place]).pop().flatten().map(|scale| {
        let [least, largest] = scale.extremes;
        (least * largest).sqrt()
    });
    Some(in_space.filter(|true_scale| (measured / true_scale - 1.0).abs() > NEGLIGIBLE).unwrap_or(measured))
}

/// An error of the scale below this share is negligible.
const NEGLIGIBLE: f64 = 1e-3;

/// Number of points around a place, itself included.
const POINTS: usize = 5;

/// The scales of a projected CRS, measured by differences of 100 metres.
struct Local<'a> {
    crs: &'a dyn Crs,
    ellipsoid: Ground,
    /// Half a difference, CRS units.
    step: f64,
}

impl<'a> Local<'a> {
    fn new(crs: &'a dyn Crs) -> Option<Self> {
        let is_projected = crs.kind() == CrsKind::Projected && crs.to_geographic(&mut [], &mut []);
        is_projected.then_some(())?;
        Some(Local { crs, ellipsoid: ellipsoid(crs)?, step: 50.0 / crs.linear_units_m() })
    }

    /// Returns longitudes and latitudes of the points left, right, below and above each place, and
    /// of the place itself; they are not finite where the projection has no such place.
    fn around(&self, places: &[[f64; 2]]) -> [Vec<f64>; 2] {
        let s = self.step;
        let around =
            places.iter().flat_map(|[x, y]| [[x - s, *y], [x + s, *y], [*x, y - s], [*x, y + s], [*x, *y]]);
        let (mut lon, mut lat): (Vec<f64>, Vec<f64>) = around.map(|[x, y]| (x, y)).unzip();
        self.crs.to_geographic(&mut lon, &mut lat);
        [lon, lat]
    }

    fn scales(&self, places: &[[f64; 2]]) -> Vec<Option<Scale>> {
        let [lon, lat] = self.around(places);
        let scale = |(lon, lat): (&[f64], &[f64])| {
            let in_space = |i: usize| self.ellipsoid.in_space([lon[i], lat[i]]);
            let unit = |a: usize, b: usize| {
                let (from, to) = (in_space(a)?, in_space(b)?);
                Some([0, 1, 2].map(|axis| (to[axis] - from[axis]) / (2.0 * self.step)))
            };
            let scale = Scale::new(unit(0, 1)?, unit(2, 3)?);
            let [least, largest] = scale.extremes;
            (least > 0.0 && largest.is_finite()).then_some(scale)
        };
        lon.chunks(POINTS).zip(lat.chunks(POINTS)).map(scale).collect()
    }
}
