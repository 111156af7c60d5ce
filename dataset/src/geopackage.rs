//! Geometries in GeoPackages (OGC 12-128r18, 2.1.3): a header, usually with the bounding box,
//! followed by well-known binary.

use gdal::vector::Geometry;
use meshmark_marking::wkb::{self, WkbError};
use std::borrow::Cow;

/// Prefixes of the tables of the standard, of SQLite and of spatial indexes.
const RESERVED: [&str; 3] = ["gpkg", "sqlite_", "rtree_"];

/// Characters that GDAL refuses at the beginning of the name of a GeoPackage layer.
const NO_BEGINNING: &str = "`~!@#$%^&*()+-={}|[]\\:\";'<>?,./";

/// Returns a name that a GeoPackage accepts for a layer of this name; other formats allow more
/// names.
pub fn safe_layer_name(name: &str) -> Cow<'_, str> {
    let begins = |start: &&str| name.get(..start.len()).is_some_and(|n| n.eq_ignore_ascii_case(start));
    match name.is_empty() || name.starts_with(|c| NO_BEGINNING.contains(c)) || RESERVED.iter().any(begins) {
        true => format!("layer_{name}").into(),
        false => name.into(),
    }
}

/// A bounding box in the order of GeoPackages: least x, largest x, least y, largest y.
pub type Bounds = [f64; 4];

/// The offset of the bounding box, if there is one.
const BOUNDS: usize = 8;
/// The number of numbers at the end of the header, for every kind of bounding box.
const NUMBERS: [usize; 5] = [0, 4, 6, 6, 8];

/// Calls `f` with every coordinate pair, writes the result back and fits the bounding box along x
/// and y. Returns the box, or `None` for a geometry without coordinates.
///
/// # Errors
/// [`WkbError`] for bytes that are not such a geometry, the error of `f` when it fails.
pub fn map_coordinates<E: From<WkbError>>(
    blob: &mut [u8],
    f: &mut impl FnMut([f64; 2]) -> Result<[f64; 2], E>,
) -> Result<Option<Bounds>, E> {
    let &[b'G', b'P', _, flags, ..] = &*blob else { return Err(WkbError::NoHeader.into()) };
    let numbers = *NUMBERS.get(usize::from(flags >> 1 & 7)).ok_or(WkbError::NoHeader)?;
    let (header, wkb) = blob.split_at_mut_checked(BOUNDS + 8 * numbers).ok_or(WkbError::Truncated)?;
    let mut bounds: Option<Bounds> = None;
    wkb::map_coordinates::<E>(wkb, &mut |_, point| {
        let [x, y] = f(point)?;
        let [x0, x1, y0, y1] = bounds.unwrap_or([x, x, y, y]);
        bounds = Some([x0.min(x), x1.max(x), y0.min(y), y1.max(y)]);
        Ok([x, y])
    })?;
    if bounds.is_some() && !wkb::is_plain(wkb) {
        let whole = Geometry::from_wkb(wkb).map_err(|_| WkbError::Truncated)?.envelope();
        bounds = Some([whole.MinX, whole.MaxX, whole.MinY, whole.MaxY]);
    }
    for (place, value) in header[BOUNDS..].chunks_exact_mut(8).zip(bounds.into_iter().flatten()) {
        let is_little_endian = flags & 1 == 1;
        place.copy_from_slice(&if is_little_endian { value.to_le_bytes() } else { value.to_be_bytes() });
    }
    Ok(bounds)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a geometry whose header has that kind of bounding box, all zeros, and the WKB of a
    /// text.
    fn blob(kind: u8, wkt: &str) -> Vec<u8> {
        let mut blob = vec![b'G', b'P', 0, kind << 1 | 1, 0, 0, 0, 0];
        blob.resize(BOUNDS + 8 * NUMBERS[usize::from(kind)], 0);
        blob.extend(Geometry::from_wkt(wkt).unwrap().iso_wkb().unwrap());
        blob
    }

    fn moved(kind: u8, wkt: &str) -> (Vec<u8>, Option<Bounds>) {
        let mut blob = blob(kind, wkt);
        let bounds = map_coordinates::<WkbError>(&mut blob, &mut |[x, y]| Ok([x + 10.0, y - 10.0])).unwrap();
        (blob, bounds)
    }

    #[test]
    fn reserved_names_of_layers_get_another_beginning() {
        for (name, safe) in [
            ("gpkg_a", "layer_gpkg_a"),
            ("SQLite_a", "layer_SQLite_a"),
            ("", "layer_"),
            ("[a]", "layer_[a]"),
            ("ägpkg", "ägpkg"),
        ] {
            assert_eq!(safe_layer_name(name), safe);
        }
    }

    #[test]
    fn coordinates_and_the_bounding_box_move_and_heights_stay() {
        let (found, bounds) = moved(2, "LINESTRING Z (1 2 3,5 0 7)");
        assert_eq!(bounds, Some([11.0, 15.0, -10.0, -8.0]));
        let mut expected = blob(2, "LINESTRING Z (11 -8 3,15 -10 7)");
        let numbers = [11.0f64, 15.0, -10.0, -8.0].map(f64::to_le_bytes);
        expected[BOUNDS..BOUNDS + 32].copy_from_slice(numbers.as_flattened());
        assert_eq!(found, expected);
    }

    #[test]
    fn the_box_of_an_arc_holds_its_belly_and_what_is_empty_has_none() {
        let (_, bounds) = moved(1, "CIRCULARSTRING (0 0,1 1,2 0)");
        assert_eq!(bounds, Some([10.0, 12.0, -10.0, -9.0]));
        let (_, bounds) = moved(1, "CIRCULARSTRING (0 0,0.2 0.6,2 0)");
        assert!(bounds.is_some_and(|[.., top]| top > -9.0), "{bounds:?}");
        assert_eq!(moved(0, "POINT (1 2)").1, Some([11.0, 11.0, -8.0, -8.0]));
        assert_eq!(moved(0, "POLYGON EMPTY").1, None);
    }

    #[test]
    fn other_bytes_are_an_error_and_not_a_panic() {
        let whole = blob(1, "LINESTRING (1 2,3 4)");
        let walk = |mut bytes: Vec<u8>| map_coordinates::<WkbError>(&mut bytes, &mut Ok);
        for end in 0..whole.len() {
            assert!(walk(whole[..end].to_vec()).is_err(), "{end} bytes");
        }
        assert_eq!(walk(whole[BOUNDS + 32..].to_vec()), Err(WkbError::NoHeader));
        assert_eq!(walk([&b"GP\0\x0b"[..], &[0; 90]].concat()), Err(WkbError::NoHeader));
    }
}
