//! Coordinate reference systems: metres per unit, labels, and the traditional axis order
//! everywhere.

use crate::{Result, crs_wkt as wkt};
use gdal::spatial_ref::{AxisMappingStrategy, CoordTransform, SpatialRef};
use meshmark_marking::{Crs, CrsKind, Fault, TransformableCrs};

/// Names of a CRS without a name.
const NO_NAMES: [&str; 3] = ["", "unknown", "unnamed"];

/// The CRS of a map.
#[derive(Debug, Clone)]
pub struct CoordinateSystem(SpatialRef);

impl CoordinateSystem {
    /// Wraps a CRS with the axes x = easting or longitude, y = northing or latitude.
    pub fn new(mut srs: SpatialRef) -> Self {
        srs.set_axis_mapping_strategy(AxisMappingStrategy::TraditionalGisOrder);
        CoordinateSystem(srs)
    }

    /// Creates the CRS of a layer; `None` where it is "undefined", as in GeoPackages that were
    /// written without one.
    pub fn of_layer(srs: SpatialRef) -> Option<Self> {
        let is_undefined = srs.name().is_some_and(|name| name.starts_with("Undefined "));
        (!is_undefined).then(|| Self::new(srs))
    }

    /// Returns the CRS of GDAL.
    pub fn spatial_ref(&self) -> &SpatialRef {
        &self.0
    }

    /// Returns the CRS of x and y alone, in this order.
    fn horizontal(&self) -> Option<SpatialRef> {
        let horizontal = SpatialRef::from_wkt(&wkt::horizontal(&self.0.to_wkt().ok()?)?).ok()?;
        Some(Self::new(horizontal).0)
    }

    /// Returns the transformation of coordinates from this CRS into `target`.
    pub(crate) fn transform_to(&self, target: &CoordinateSystem) -> gdal::errors::Result<CoordTransform> {
        CoordTransform::new(&self.0, &target.0)
    }
}

impl Crs for CoordinateSystem {
    fn kind(&self) -> CrsKind {
        let kinds = [
            (self.0.is_geocentric(), CrsKind::Geocentric),
            (self.0.is_geographic(), CrsKind::Geographic),
            (self.0.is_projected(), CrsKind::Projected),
        ];
        kinds.into_iter().find(|(is, _)| *is).map_or(CrsKind::Other, |(_, kind)| kind)
    }

    fn label(&self) -> String {
        self.0.authority().or_else(|_| self.0.to_wkt()).unwrap_or_else(|_| "unknown CRS".into())
    }

    fn brief_name(&self) -> String {
        let name = || self.0.name().filter(|name| !NO_NAMES.iter().any(|no| no.eq_ignore_ascii_case(name)));
        let or_name = self.0.authority().ok().or_else(name);
        or_name.or_else(|| self.0.to_proj4().ok()).unwrap_or_else(|| "unknown CRS".into())
    }

    fn linear_units_m(&self) -> f64 {
        self.0.linear_units()
    }

    fn radians_per_unit(&self) -> f64 {
        self.geographic().map_or(self.0.angular_units(), |geographic| geographic.0.angular_units())
    }

    fn ellipsoid_m(&self) -> Option<[f64; 2]> {
        let geographic = self.geographic()?;
        Some([geographic.0.semi_major().ok()?, geographic.0.semi_minor().ok()?])
    }

    fn to_geographic(&self, x: &mut [f64], y: &mut [f64]) -> bool {
        let transform = self.geographic().and_then(|geographic| self.transform_to(&geographic).ok());
        let Some(transform) = transform else { return false };
        // An error concerns some points only, which are then not finite.
        let _ = transform.transform_coords(x, y, &mut []);
        true
    }
}

impl TransformableCrs for CoordinateSystem {
    fn from_epsg(code: u32) -> Option<Self> {
        SpatialRef::from_epsg(code).ok().map(CoordinateSystem::new)
    }

    fn parse(text: &str) -> meshmark_marking::Result<Self> {
        let srs = SpatialRef::from_definition(text)
            .map_err(|_| meshmark_marking::Error::UnknownSrs(text.into()))?;
        Ok(CoordinateSystem::new(srs))
    }

    fn is_same(&self, other: &CoordinateSystem) -> bool {
        self.0 == other.0 || self.horizontal().is_some_and(|own| Some(own) == other.horizontal())
    }

    fn names_apart(&self, other: &CoordinateSystem) -> [String; 2] {
        let names = [self, other].map(CoordinateSystem::brief_name);
        if names[0] != names[1] {
            return names;
        }
        [self, other].map(|crs| format!("{}, {}", names[0], crs.0.to_proj4().unwrap_or_default().trim()))
    }

    fn transform(&self, x: &mut [f64], y: &mut [f64], target: &Self) -> std::result::Result<(), Fault> {
        // An error concerns some points only, which are then not finite.
        let _ = self.transform_to(target)?.transform_coords(x, y, &mut []);
        Ok(())
    }

    fn geographic(&self) -> Option<Self> {
        match self.0.is_geographic() {
            true => Some(self.clone()),
            false => self.0.geog_cs().ok().map(CoordinateSystem::new),
        }
    }

    fn prime_meridian_degrees(&self) -> f64 {
        let prime_meridian = self.0.get_attr_value("PRIMEM", 1).ok().flatten();
        prime_meridian.and_then(|text| text.parse().ok()).unwrap_or(0.0)
    }
}

/// Returns the CRS of a map as marking takes it.
pub fn as_crs(crs: &Option<CoordinateSystem>) -> Option<&dyn Crs> {
    crs.as_ref().map(|crs| crs as &dyn Crs)
}

/// Parses a CRS given by the user: EPSG:…, WKT, PROJ.
///
/// # Errors
/// [`meshmark_marking::Error::UnknownSrs`].
pub fn parse_srs(text: &str) -> Result<CoordinateSystem> {
    Ok(CoordinateSystem::parse(text)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshmark_core::{ground::Ground, vertices::VertexTable};
    use meshmark_marking::{Error, degrees, ground};

    fn metres_per_unit(srs: &str, at: [f64; 2]) -> [f64; 2] {
        let table = VertexTable::new(vec![at]).unwrap();
        ground(Some(&parse_srs(srs).unwrap()), &table).unwrap().metres_per_unit(at)
    }

    #[test]
    fn a_web_mercator_unit_is_half_a_metre_at_helsinki() {
        let [x, y] = metres_per_unit("EPSG:3857", [2_776_000.0, 8_438_000.0]);
        assert!((x - 0.4985).abs() < 0.003 && x == y, "{x}");
    }

    #[test]
    fn projected_and_geographic_units_are_measured_on_the_ground() {
        let [x, _] = metres_per_unit("EPSG:3067", [500_000.0, 6_700_000.0]);
        assert!((x - 1.0 / 0.9996).abs() < 1e-5, "UTM central meridian: {x}");
        let [x, _] = metres_per_unit("EPSG:2263", [1_000_000.0, 200_000.0]);
        assert!((x - 0.3048).abs() < 1e-4, "New York, US survey feet: {x}");
        let [x, y] = metres_per_unit("EPSG:4326", [25.0, 60.0]);
        assert!((x - 55_800.0).abs() < 10.0 && (y - 111_412.0).abs() < 10.0, "{x} {y}");
    }

    #[test]
    fn neither_the_180th_meridian_nor_a_pole_spoils_the_scale() {
        let [x, _] = metres_per_unit("EPSG:32601", [386_000.0, 7_770_000.0]);
        for east in (385_000..388_000).step_by(10) {
            let [there, _] = metres_per_unit("EPSG:32601", [f64::from(east), 7_770_000.0]);
            assert!((there / x - 1.0).abs() < 1e-3, "{east}: {there} {x}");
        }
        let crs = parse_srs("EPSG:32601").unwrap();
        let seam = parse_srs("EPSG:4326").unwrap().transform_to(&crs).unwrap();
        let (mut lon, mut lat) = ([180.0], [70.0]);
        seam.transform_coords(&mut lon, &mut lat, &mut []).unwrap();
        let [at_seam, _] = metres_per_unit("EPSG:32601", [lon[0], lat[0]]);
        assert!((at_seam - 1.0).abs() < 0.01, "{at_seam}");
        let [pole, _] = metres_per_unit("EPSG:3995", [1.0, 2.0]);
        let [beside, _] = metres_per_unit("EPSG:3995", [100_000.0, 2.0]);
        assert!((pole / beside - 1.0).abs() < 1e-3, "{pole} {beside}");
    }

    #[test]
    fn degrees_without_a_crs_are_refused_and_metres_without_one_are_not() {
        let table = |x| VertexTable::new(vec![[x, 60.0]]).unwrap();
        assert!(matches!(ground(None, &table(25.0)), Err(Error::NoCrs)));
        assert_eq!(ground(None, &table(2500.0)).unwrap(), Ground::METRES);
    }

    #[test]
    fn what_differs_in_heights_or_in_the_order_of_its_axes_is_the_same_and_the_rest_is_not() {
        let same = |a: &str, b: &str| parse_srs(a).unwrap().is_same(&parse_srs(b).unwrap());
        for horizontal in ["EPSG:3067", "EPSG:5048"] {
            for other in ["EPSG:3067", "EPSG:5048", "EPSG:3067+3900", "EPSG:3067+5717", "EPSG:3903"] {
                assert!(same(horizontal, other) && same(other, horizontal), "{horizontal} {other}");
            }
        }
        for other in ["EPSG:4979", "EPSG:9518", "EPSG:4326+5773", "OGC:CRS84"] {
            assert!(same("EPSG:4326", other) && same(other, "EPSG:4979"), "{other}");
        }
        for (a, b) in [
            ("EPSG:3067+3900", "EPSG:3857"),
            ("EPSG:3903", "EPSG:25836"),
            ("EPSG:4979", "EPSG:4937"),
            ("EPSG:9518", "EPSG:4258"),
            ("EPSG:2393", "EPSG:3067"),
            ("EPSG:2053", "EPSG:2054"),
        ] {
            assert!(!same(a, b) && !same(b, a), "{a} {b}");
        }
    }

    #[test]
    fn a_compound_crs_is_measured_like_its_horizontal_part() {
        let at = |srs| metres_per_unit(srs, [500_000.0, 6_700_000.0]);
        assert_eq!(at("EPSG:3067+3900"), at("EPSG:3067"));
        assert_eq!(at("EPSG:3903"), at("EPSG:3067"));
        let at = |srs| metres_per_unit(srs, [25.0, 60.0]);
        assert_eq!(at("EPSG:9518"), at("EPSG:4326"));
        let places = |srs| degrees(&parse_srs(srs).unwrap(), &[[385_000.0, 6_672_000.0]])[0].unwrap();
        let ([a, b], [c, d]) = (places("EPSG:3903"), places("EPSG:3067"));
        assert!((a - c).abs() < 1e-9 && (b - d).abs() < 1e-9, "{a} {b} {c} {d}");
    }

    #[test]
    fn messages_name_a_crs_by_its_code_or_its_name_and_tell_those_of_one_name_apart() {
        let crs = |text: &str| parse_srs(text).unwrap();
        assert_eq!(crs("EPSG:3903").brief_name(), "EPSG:3903");
        // Versions of PROJ name this CRS after different datums.
        let compound = crs("EPSG:3067+3900").brief_name();
        assert!(compound.ends_with(" / TM35FIN(E,N) + N2000 height"), "{compound}");
        let [utm35, utm36] = ["+proj=utm +zone=35 +ellps=GRS80", "+proj=utm +zone=36 +ellps=GRS80"].map(crs);
        assert!(utm35.brief_name().contains("+zone=35"), "{}", utm35.brief_name());
        let named = |zone: &CoordinateSystem| crs(&zone.label().replacen("\"unknown\"", "\"Town grid\"", 1));
        let [a, b] = named(&utm35).names_apart(&named(&utm36));
        assert!(a.starts_with("Town grid, ") && a.contains("+zone=35") && b.contains("+zone=36"), "{a} {b}");
    }

    #[test]
    fn an_unknown_srs_is_named() {
        assert!(parse_srs("EPSG:nowhere").unwrap_err().to_string().contains("SRS=EPSG:nowhere"));
    }
}
