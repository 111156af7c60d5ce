//! Geometries of GeoPackages: the bounding box holds all vertices, and a broken geometry is an
//! error.
#![no_main]

use gdal::vector::Geometry;
use libfuzzer_sys::fuzz_target;
use meshmark_dataset::geopackage::{map_coordinates, safe_layer_name};
use meshmark_marking::wkb::{self, WkbError};

fuzz_target!(|bytes: &[u8]| {
    let mut blob = bytes.to_vec();
    let mut places = Vec::new();
    let bounds = map_coordinates::<WkbError>(&mut blob, &mut |[x, y]| {
        places.push([x + 1.0, y - 1.0]);
        Ok([x + 1.0, y - 1.0])
    });
    assert_eq!(blob.len(), bytes.len());
    if let Ok(bounds) = bounds {
        assert_eq!(bounds.is_none(), places.is_empty());
        // Far beyond all maps, the box that GDAL computes of an arc is off by its size.
        let is_near = places.as_flattened().iter().all(|value| value.abs() < 1e12);
        let is_alike = || is_near && read_by_gdal(&blob).is_some_and(|read| read == places);
        if let (Some([x0, x1, y0, y1]), true) = (bounds, is_alike()) {
            // GDAL computes the box of arcs, from rounded centres.
            let slack =
                1e-6 * [x0, x1, y0, y1].into_iter().fold(1.0, |most: f64, value| most.max(value.abs()));
            let is_inside = |[x, y]: &[f64; 2]| {
                x0 - slack <= *x && *x <= x1 + slack && y0 - slack <= *y && *y <= y1 + slack
            };
            assert!(places.iter().all(is_inside), "a vertex outside of {bounds:?}");
        }
        let mut again = blob.clone();
        let second = map_coordinates::<WkbError>(&mut again, &mut Ok).expect("it was a geometry");
        let bits = |bounds: Option<[f64; 4]>| bounds.map(|bounds| bounds.map(f64::to_bits));
        assert_eq!(bits(second), bits(bounds));
        assert!(again == blob, "a second walk changes nothing");
    }
    if let Ok(name) = std::str::from_utf8(bytes) {
        let safe = safe_layer_name(name);
        assert_eq!(safe_layer_name(&safe), safe, "a safe name is safe");
    }
});

/// Returns the places that GDAL reads; none for geometries that it does not know, as those with a
/// reference system of their own.
fn read_by_gdal(blob: &[u8]) -> Option<Vec<[f64; 2]>> {
    let numbers = [0, 4, 6, 6, 8][usize::from(blob[3] >> 1 & 7)];
    let mut wkb = Geometry::from_wkb(&blob[8 + 8 * numbers..]).ok()?.iso_wkb().ok()?;
    let mut places = Vec::new();
    let walked = wkb::map_coordinates::<WkbError>(&mut wkb, &mut |_, place| {
        places.push(place);
        Ok(place)
    });
    walked.ok().map(|()| places)
}
