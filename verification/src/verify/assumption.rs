//! Assumptions about maps whose CRS is missing or wrong: the CRS that their coordinates may be in,
//! given the region of the earth where they should lie.

use meshmark_core::vertices::VertexTable;
use meshmark_marking::{Survey, TransformableCrs, degrees};

/// EPSG codes of projected CRS and their areas of use: code, west, south, east, north in degrees.
const PROJECTED_CRS: &str = include_str!("projected_crs.csv");
/// Places are compared this much beyond a region, degrees: datums differ by up to a kilometre.
const DATUM_DEGREES: f64 = 0.02;
/// A region is also extended by this share of its size, as a suspect may reach beyond the
/// reference.
const MARGIN: f64 = 0.1;
/// Areas of use are rounded, and maps reach a little beyond them.
const AREA_MARGIN_DEGREES: f64 = 0.5;
/// A map of which less than this share lies in the region is somewhere else.
const LEAST_SHARE: f64 = 0.1;
/// This many points of a map determine its region.
const SAMPLE: usize = 500;

/// An interpretation of the coordinates of a map.
#[derive(Debug, Clone)]
pub struct Assumption<C> {
    /// Their CRS.
    pub crs: C,
    /// Whether x and y are exchanged in the file.
    pub axes_swapped: bool,
}

/// A part of the earth, in degrees on the datum of some CRS.
struct Region {
    min: [f64; 2],
    max: [f64; 2],
}

impl Region {
    /// Returns the region of a map.
    fn covering<C: TransformableCrs>(crs: &C, table: &VertexTable) -> Option<Region> {
        let places: Vec<[f64; 2]> = degrees(crs, &sample(table)).into_iter().flatten().collect();
        let first = *places.first()?;
        let (min, max) = places.iter().fold((first, first), |(min, max), p| {
            ([min[0].min(p[0]), min[1].min(p[1])], [max[0].max(p[0]), max[1].max(p[1])])
        });
        Some(Region { min, max })
    }

    fn centre(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.min[axis] + self.max[axis]) / 2.0)
    }

    /// Returns the share of the places in the region or close to it.
    fn share(&self, places: &[Option<[f64; 2]>]) -> f64 {
        let near = |place: &&Option<[f64; 2]>| {
            place.is_some_and(|p| {
                [0, 1].iter().all(|&axis| {
                    let margin = DATUM_DEGREES + MARGIN * (self.max[axis] - self.min[axis]);
                    (self.min[axis] - margin..=self.max[axis] + margin).contains(&p[axis])
                })
            })
        };
        places.iter().filter(near).count() as f64 / places.len().max(1) as f64
    }
}

fn sample(table: &VertexTable) -> Vec<[f64; 2]> {
    table.coords().iter().step_by(table.len().div_ceil(SAMPLE).max(1)).copied().collect()
}

/// Returns whether a good part of the map lies in the region of the reference; both are in the CRS
/// of the reference.
pub fn overlaps<C: TransformableCrs>(map: &Survey<C>, reference: &Survey<C>) -> bool {
    let Some(crs) = &reference.crs else { return true };
    let Some(region) = Region::covering(crs, &reference.data.vertices) else { return true };
    region.share(&degrees(crs, &sample(&map.data.vertices))) >= LEAST_SHARE
}

/// Lists the assumptions under which a map of raw coordinates lies in the region of the reference,
/// the most usual first. `own` is the CRS that the map claims. Datums are not distinguished here.
pub fn likely_assumptions<C: TransformableCrs>(
    raw: &Survey<C>,
    own: Option<&C>,
    reference: &Survey<C>,
) -> Vec<Assumption<C>> {
    let Some(crs) = &reference.crs else { return Vec::new() };
    let Some(region) = Region::covering(crs, &reference.data.vertices) else { return Vec::new() };
    let numbers = sample(&raw.data.vertices);
    let swapped: Vec<[f64; 2]> = numbers.iter().map(|[x, y]| [*y, *x]).collect();
    let known = [Some(crs), own].into_iter().flatten().cloned();
    let codes = codes_at(region.centre()).into_iter();
    let mut likely: Vec<Assumption<C>> = Vec::new();
    for crs in known.chain(codes.filter_map(C::from_epsg)) {
        if likely.iter().any(|other| other.crs.is_same(&crs)) {
            continue;
        }
        for (axes_swapped, numbers) in [(false, &numbers), (true, &swapped)] {
            if region.share(&degrees(&crs, numbers)) >= LEAST_SHARE {
                likely.push(Assumption { crs: crs.clone(), axes_swapped });
            }
        }
    }
    likely
}

/// Lists the EPSG codes of the CRS in use at a place: degrees, web maps, UTM of its zone and the
/// neighbouring ones, on both sides of the equator, and the grids that cover it.
fn codes_at([longitude, latitude]: [f64; 2]) -> Vec<u32> {
    let mut codes = vec![4326, 3857];
    let zone = ((longitude + 180.0) / 6.0).floor() as i64;
    for zone in [zone, zone - 1, zone + 1].map(|zone| zone.rem_euclid(60) as u32 + 1) {
        codes.extend([32600 + zone, 32700 + zone]);
        // ETRS89 has UTM zones 28 to 38.
        if (28..=38).contains(&zone) && (32.0..85.0).contains(&latitude) {
            codes.push(25800 + zone);
        }
    }
    let grids = PROJECTED_CRS.lines().filter(|line| !line.starts_with('#')).filter_map(|line| {
        let (code, area) = line.split_once(',')?;
        let area: Vec<f64> = area.split(',').filter_map(|number| number.parse().ok()).collect();
        let &[west, south, east, north] = area.as_slice() else { return None };
        let turn = if west > east { 360.0 } else { 0.0 }; // across ±180°
        let within = |low: f64, at: f64, high: f64| {
            at >= low - AREA_MARGIN_DEGREES && at <= high + AREA_MARGIN_DEGREES
        };
        let inside = within(south, latitude, north)
            && (within(west, longitude, east + turn) || within(west - turn, longitude, east));
        if inside { code.parse().ok() } else { None }
    });
    let grids: Vec<u32> = grids.filter(|code| !codes.contains(code)).collect();
    codes.extend(grids);
    codes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_used_at_a_place_has_degrees_web_maps_utm_zones_and_its_national_grids() {
        let prague = codes_at([14.4, 50.1]);
        for code in [4326, 3857, 32633, 32632, 32733, 25833, 23033, 5514, 5513] {
            assert!(prague.contains(&code), "EPSG:{code}");
        }
        let tokyo = codes_at([139.7, 35.7]);
        assert!(tokyo.contains(&6677) && tokyo.contains(&30169) && !tokyo.contains(&25832));
        assert!(codes_at([179.5, -17.0]).contains(&3460), "Fiji, across ±180°");
    }

    #[test]
    fn every_line_of_the_table_is_a_code_and_an_area() {
        let lines: Vec<&str> = PROJECTED_CRS.lines().filter(|line| !line.starts_with('#')).collect();
        assert!(lines.len() > 4000);
        for line in lines {
            let numbers: Vec<f64> = line.split(',').map(|n| n.parse().expect(line)).collect();
            let &[code, west, south, east, north] = numbers.as_slice() else { panic!("{line}") };
            assert!(
                code.fract() == 0.0 && south <= north && west.abs() <= 180.0 && east.abs() <= 180.0,
                "{line}"
            );
        }
    }
}
