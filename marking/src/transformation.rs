//! Coordinates in one CRS become coordinates in another.

use crate::{
    Crs, CrsKind, Error, Result,
    error::Fault,
    left_out::{MISSING, is_there},
};

/// The furthest coordinates that mean a place, in turns around the Earth: maps continue past the date
/// line, and eastings may begin with the number of their zone.
const FURTHEST_TURNS: f64 = 10.0;
const EQUATOR_M: f64 = 40_075_017.0;

/// A CRS between whose coordinates and those of another one the library of the front end transforms.
pub trait TransformableCrs: Crs + Clone {
    /// Returns the CRS of this EPSG code; `None` where the library lacks it.
    fn from_epsg(code: u32) -> Option<Self>;

    /// Returns the CRS of a text: a code such as "EPSG:3067", WKT or PROJ.
    ///
    /// # Errors
    /// [`Error::UnknownSrs`].
    fn parse(text: &str) -> Result<Self>;

    /// Returns whether both have the same x and y; heights do not matter to a map.
    fn is_same(&self, other: &Self) -> bool;

    /// Returns the names of two different CRS for messages: brief names, with their definitions
    /// where those are equal.
    fn names_apart(&self, other: &Self) -> [String; 2];

    /// Transforms points that can mean a place, x and y, into another CRS; those without a place there
    /// are then not finite.
    ///
    /// # Errors
    /// Fails where there is no such transformation.
    fn transform(&self, x: &mut [f64], y: &mut [f64], target: &Self) -> std::result::Result<(), Fault>;

    /// Returns the CRS of longitudes and latitudes on its own datum.
    fn geographic(&self) -> Option<Self>;

    /// Returns degrees from Greenwich to its prime meridian.
    fn prime_meridian_degrees(&self) -> f64;
}

/// Reprojects coordinates into `target`; those of a layer without a CRS are assumed to be in it.
/// Those without a place there are then [`MISSING`], and are returned as they were.
///
/// # Errors
/// [`Error::Reprojection`].
pub fn reproject<C: TransformableCrs>(
    coords: &mut [[f64; 2]],
    from: Option<&C>,
    target: &C,
    layer: &str,
) -> Result<Vec<[f64; 2]>> {
    let given = coords.to_vec();
    if let Some(from) = from.filter(|from| !from.is_same(target)) {
        let failed = |source| Error::Reprojection { layer: layer.into(), source };
        transform(from, coords, target).map_err(failed)?;
    }
    coords.iter_mut().filter(|point| !can_mean(target, point)).for_each(|point| *point = MISSING);
    let lost = given.iter().zip(&*coords).filter(|(given, now)| is_there(given) && !is_there(now));
    Ok(lost.map(|(given, _)| *given).collect())
}

/// Converts points to degrees east of Greenwich and north, on the datum of their CRS; `None` where it
/// has no such place.
pub fn degrees<C: TransformableCrs>(crs: &C, points: &[[f64; 2]]) -> Vec<Option<[f64; 2]>> {
    let mut places = points.to_vec();
    let Some(geographic) = crs.geographic() else { return vec![None; points.len()] };
    if crs.kind() != CrsKind::Geographic && transform(crs, &mut places, &geographic).is_err() {
        return vec![None; points.len()];
    }
    let prime_meridian = geographic.prime_meridian_degrees();
    let unit = geographic.radians_per_unit().to_degrees();
    let place = |[x, y]: [f64; 2]| {
        let place = [x * unit + prime_meridian, y * unit];
        (place[0].is_finite() && place[1].abs() <= 90.0).then_some(place)
    };
    places.into_iter().map(place).collect()
}

/// Transforms points into another CRS; those without a place in both are then [`MISSING`].
fn transform<C: TransformableCrs>(
    from: &C,
    points: &mut [[f64; 2]],
    target: &C,
) -> std::result::Result<(), Fault> {
    let there: Vec<usize> = (0..points.len()).filter(|&i| can_mean(from, &points[i])).collect();
    let (mut x, mut y): (Vec<f64>, Vec<f64>) = there.iter().map(|&i| (points[i][0], points[i][1])).unzip();
    from.transform(&mut x, &mut y, target)?;
    points.fill(MISSING);
    there.into_iter().zip(x.into_iter().zip(y)).for_each(|(i, (x, y))| points[i] = [x, y]);
    Ok(())
}

/// Returns whether coordinates can mean a place in a CRS, and GDAL can transform them: it subtracts turn
/// after turn from a longitude, without end where a turn is less than the precision of the number.
fn can_mean(crs: &dyn Crs, [x, y]: &[f64; 2]) -> bool {
    let [most_x, most_y] = match crs.kind() {
        CrsKind::Geographic => {
            [FURTHEST_TURNS * 360.0, 90.0].map(|degrees| degrees / crs.radians_per_unit().to_degrees())
        }
        _ => [FURTHEST_TURNS * EQUATOR_M / crs.linear_units_m(); 2],
    };
    x.abs() <= most_x && y.abs() <= most_y
}
