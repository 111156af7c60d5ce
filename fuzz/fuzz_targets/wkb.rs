//! Well-known binary: walking is linear, changes nothing by itself, and sees what GDAL sees.
#![no_main]

use gdal::vector::Geometry;
use libfuzzer_sys::fuzz_target;
use meshmark_marking::{
    Outline,
    wkb::{Step, WkbError, map_coordinates, of_chains},
};

fuzz_target!(|bytes: &[u8]| {
    let mut walked = bytes.to_vec();
    let mut places = Vec::new();
    let result = map_coordinates::<WkbError>(&mut walked, &mut |_, place| {
        places.push(place);
        Ok(place)
    });
    assert!(walked == bytes, "a walk without a change changed bytes");
    let outline = Outline::of_wkb(bytes.to_vec());
    assert_eq!(outline.as_ref().err(), result.as_ref().err());
    let Ok(outline) = outline else { return };
    assert_eq!(outline.chains.len(), outline.kinds.len());
    assert!(outline.kinds.iter().all(|kind| *kind != Step::Next));
    let in_chains: Vec<[f64; 2]> = outline.chains.iter().flatten().copied().collect();
    assert!(same(&in_chains, &places));
    let mut made_again = of_chains(&outline.chains, &outline.kinds);
    let again = walk(&mut made_again).expect("what is made of chains is a geometry");
    if places.iter().all(|place| !place[0].is_nan() || !place[1].is_nan()) {
        assert!(same(&again, &places), "chains lost a vertex");
    }
    // GDAL refuses more than we do; what it takes, it writes with the same coordinates.
    let Ok(geometry) = Geometry::from_wkb(bytes) else { return };
    let mut written = geometry.iso_wkb().expect("GDAL writes what it has read");
    walk(&mut written).expect("what GDAL writes is a geometry");
});

fn walk(wkb: &mut [u8]) -> Result<Vec<[f64; 2]>, WkbError> {
    let mut places = Vec::new();
    map_coordinates::<WkbError>(wkb, &mut |_, place| {
        places.push(place);
        Ok(place)
    })?;
    Ok(places)
}

fn same(a: &[[f64; 2]], b: &[[f64; 2]]) -> bool {
    let bits = |places: &[[f64; 2]]| places.iter().map(|place| place.map(f64::to_bits)).collect::<Vec<_>>();
    bits(a) == bits(b)
}
