//! Well-known binary geometries (OGC 06-103r4, ISO 13249-3): this module changes coordinate pairs
//! of all geometry types in place and leaves Z and M unchanged.

/// The errors of the bytes of a geometry.
#[derive(Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // the messages are the documentation
pub enum WkbError {
    #[error("the geometry ends in the middle of a coordinate")]
    Truncated,
    #[error("geometry type {0} is not known")]
    UnknownType(u32),
    #[error(
        "the geometry has a reference system of its own (EWKB); write it without one, as ST_AsBinary does"
    )]
    OwnSrid,
    #[error("{0} bytes follow the geometry")]
    BytesAfter(usize),
    #[error("the geometry is nested more than {MOST_NESTED} deep")]
    TooDeep,
    #[error("the geometry does not begin as those of a GeoPackage do")]
    NoHeader,
}

const MOST_NESTED: usize = 64;

/// The flag of a type code that a reference system follows.
const OF_SRID: u32 = 0x2000_0000;

/// The role of a coordinate pair: it begins a sequence (ring, line, point) or is joined to the pair
/// before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The first pair of a line, or a point.
    First,
    /// The first pair of a polygon's first ring.
    Shell,
    /// The first pair of a further ring of the same polygon.
    Hole,
    /// A segment leads here from the pair before. Arcs count as the chords of their control points.
    Next,
}

/// Calls `f` with every coordinate pair of a geometry and writes the result back. An empty point
/// (NaN NaN) has none.
///
/// # Errors
/// [`WkbError`] for bytes that are not a geometry, the error of `f` when it fails.
pub fn map_coordinates<E: From<WkbError>>(
    wkb: &mut [u8],
    f: &mut impl FnMut(Step, [f64; 2]) -> Result<[f64; 2], E>,
) -> Result<(), E> {
    let mut cursor = Cursor { bytes: wkb, at: 0 };
    cursor.geometry(f, 0)?;
    match cursor.bytes.len() - cursor.at {
        0 => Ok(()),
        after => Err(WkbError::BytesAfter(after).into()),
    }
}

/// Encodes a geometry of these chains, each with the kind of its first step: polygons with their
/// holes, lines, and points for chains of one vertex; several form a multi-geometry or a
/// collection.
pub fn of_chains(chains: &[Vec<[f64; 2]>], kinds: &[Step]) -> Vec<u8> {
    let mut parts: Vec<(u32, Vec<u8>)> = Vec::new();
    let mut rest = chains.iter().zip(kinds).peekable();
    while let Some((chain, kind)) = rest.next() {
        match kind {
            Step::Shell => {
                let mut rings = vec![chain];
                while let Some((hole, _)) = rest.next_if(|(_, kind)| **kind == Step::Hole) {
                    rings.push(hole);
                }
                let mut polygon = count_bytes(rings.len());
                rings.iter().for_each(|ring| polygon.extend(sequence_bytes(ring)));
                parts.push((3, polygon));
            }
            _ if chain.len() == 1 => parts.push((1, sequence_bytes(chain).split_off(4))),
            _ => parts.push((2, sequence_bytes(chain))),
        }
    }
    let mut bytes = Vec::new();
    if parts.len() != 1 {
        let first = parts.first().map_or(7, |part| part.0);
        let is_multi = !parts.is_empty() && parts.iter().all(|part| part.0 == first);
        bytes.extend(head(if is_multi { first + 3 } else { 7 }));
        bytes.extend(count_bytes(parts.len()));
    }
    for (kind, part) in parts {
        bytes.extend(head(kind));
        bytes.extend(part);
    }
    bytes
}

fn head(kind: u32) -> Vec<u8> {
    [&[1][..], &kind.to_le_bytes()].concat()
}

fn count_bytes(count: usize) -> Vec<u8> {
    (count as u32).to_le_bytes().into()
}

fn sequence_bytes(chain: &[[f64; 2]]) -> Vec<u8> {
    let mut bytes = count_bytes(chain.len());
    chain.iter().flatten().for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

/// Returns whether a legal geometry consists of points, lines or polygons. All others may have
/// arcs, which coordinates alone do not describe.
pub fn is_plain(wkb: &[u8]) -> bool {
    let code = wkb.get(1..5).and_then(|code| code.try_into().ok()).unwrap_or_default();
    let code = if wkb.first() == Some(&1) { u32::from_le_bytes(code) } else { u32::from_be_bytes(code) };
    matches!(decode_type(code).0, 1..=6)
}

struct Cursor<'a> {
    bytes: &'a mut [u8],
    at: usize,
}

/// Byte order and number of ordinates, from the head of a geometry.
struct Layout {
    little_endian: bool,
    ordinates: usize,
}

impl Cursor<'_> {
    fn geometry<E: From<WkbError>>(
        &mut self,
        f: &mut impl FnMut(Step, [f64; 2]) -> Result<[f64; 2], E>,
        depth: usize,
    ) -> Result<(), E> {
        if depth > MOST_NESTED {
            return Err(WkbError::TooDeep.into());
        }
        let little_endian = self.take::<1>()? == [1];
        let code = self.count(little_endian)?;
        let (kind, ordinates) = decode_type(code);
        let layout = Layout { little_endian, ordinates };
        match kind {
            1 => self.point(&layout, f, Step::First, true),
            2 | 8 => self.sequence(&layout, f, Step::First), // LineString, CircularString
            3 | 17 => {
                // Polygon, Triangle
                for ring in 0..self.count(little_endian)? {
                    self.sequence(&layout, f, if ring == 0 { Step::Shell } else { Step::Hole })?;
                }
                Ok(())
            }
            // Multi*, collections, CompoundCurve, CurvePolygon, PolyhedralSurface, TIN
            4..=7 | 9..=12 | 15 | 16 => {
                for _ in 0..self.count(little_endian)? {
                    self.geometry(f, depth + 1)?;
                }
                Ok(())
            }
            _ if matches!(decode_type(code & !OF_SRID).0, 1..=17) => Err(WkbError::OwnSrid.into()),
            _ => Err(WkbError::UnknownType(code).into()),
        }
    }

    fn sequence<E: From<WkbError>>(
        &mut self,
        layout: &Layout,
        f: &mut impl FnMut(Step, [f64; 2]) -> Result<[f64; 2], E>,
        first: Step,
    ) -> Result<(), E> {
        for place in 0..self.count(layout.little_endian)? {
            let step = if place == 0 { first } else { Step::Next };
            self.point(layout, f, step, false)?;
        }
        Ok(())
    }

    fn point<E: From<WkbError>>(
        &mut self,
        layout: &Layout,
        f: &mut impl FnMut(Step, [f64; 2]) -> Result<[f64; 2], E>,
        step: Step,
        may_be_empty: bool,
    ) -> Result<(), E> {
        let start = self.at;
        let mut read = || Ok::<f64, WkbError>(layout.decode(self.take::<8>()?));
        let (x, y) = (read()?, read()?);
        for _ in 2..layout.ordinates {
            read()?;
        }
        if may_be_empty && x.is_nan() && y.is_nan() {
            return Ok(());
        }
        for (axis, value) in f(step, [x, y])?.into_iter().enumerate() {
            let at = start + 8 * axis;
            self.bytes[at..at + 8].copy_from_slice(&layout.encode(value));
        }
        Ok(())
    }

    fn count(&mut self, little_endian: bool) -> Result<u32, WkbError> {
        let bytes = self.take::<4>()?;
        Ok(if little_endian { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], WkbError> {
        let bytes = self.bytes.get(self.at..self.at + N).ok_or(WkbError::Truncated)?;
        self.at += N;
        Ok(bytes.try_into().expect("N bytes"))
    }
}

impl Layout {
    fn decode(&self, bytes: [u8; 8]) -> f64 {
        if self.little_endian { f64::from_le_bytes(bytes) } else { f64::from_be_bytes(bytes) }
    }

    fn encode(&self, value: f64) -> [u8; 8] {
        if self.little_endian { value.to_le_bytes() } else { value.to_be_bytes() }
    }
}

/// Returns the flat type and the number of ordinates of an ISO or extended type code; 0 for a code
/// of neither.
fn decode_type(code: u32) -> (u32, usize) {
    let flags = usize::from(code & 0x8000_0000 != 0) + usize::from(code & 0x4000_0000 != 0);
    let iso = code & 0x3fff_ffff;
    let thousands = match iso / 1000 {
        0 => 0,
        1 | 2 => 1,
        3 => 2,
        _ => return (0, 2),
    };
    (iso % 1000, 2 + thousands.max(flags))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gdal::vector::Geometry;

    fn shifted(wkt: &str) -> (String, usize) {
        let mut wkb = Geometry::from_wkt(wkt).unwrap().iso_wkb().unwrap();
        let mut seen = 0;
        map_coordinates::<WkbError>(&mut wkb, &mut |_, [x, y]| {
            seen += 1;
            Ok([x + 100.0, y + 1000.0])
        })
        .unwrap();
        (Geometry::from_wkb(&wkb).unwrap().iso_wkt().unwrap(), seen)
    }

    #[test]
    fn every_geometry_type_is_walked_and_z_and_m_stay() {
        for (wkt, moved) in [
            ("POINT (1 2)", "POINT (101 1002)"),
            ("POINT Z (1 2 3)", "POINT Z (101 1002 3)"),
            ("POINT M (1 2 4)", "POINT M (101 1002 4)"),
            ("LINESTRING ZM (1 2 3 4,5 6 7 8)", "LINESTRING ZM (101 1002 3 4,105 1006 7 8)"),
            ("MULTIPOINT ((1 2),(3 4))", "MULTIPOINT ((101 1002),(103 1004))"),
            (
                "POLYGON ((0 0,9 0,9 9,0 0),(6 2,7 2,7 3,6 2))",
                "POLYGON ((100 1000,109 1000,109 1009,100 1000),(106 1002,107 1002,107 1003,106 1002))",
            ),
            (
                "GEOMETRYCOLLECTION (POINT EMPTY,MULTILINESTRING ((1 2,3 4)))",
                "GEOMETRYCOLLECTION (POINT EMPTY,MULTILINESTRING ((101 1002,103 1004)))",
            ),
            (
                "CURVEPOLYGON (COMPOUNDCURVE (CIRCULARSTRING (0 0,1 1,2 0),(2 0,0 0)))",
                "CURVEPOLYGON (COMPOUNDCURVE (CIRCULARSTRING (100 1000,101 1001,102 1000),(102 1000,100 1000)))",
            ),
            ("MULTICURVE ((1 2,3 4))", "MULTICURVE ((101 1002,103 1004))"),
            ("MULTISURFACE (((0 0,9 0,9 9,0 0)))", "MULTISURFACE (((100 1000,109 1000,109 1009,100 1000)))"),
            (
                "POLYHEDRALSURFACE Z (((0 0 5,9 0 5,9 9 5,0 0 5)))",
                "POLYHEDRALSURFACE Z (((100 1000 5,109 1000 5,109 1009 5,100 1000 5)))",
            ),
            (
                "TIN Z (((0 0 5,9 0 5,9 9 5,0 0 5)))",
                "TIN Z (((100 1000 5,109 1000 5,109 1009 5,100 1000 5)))",
            ),
            ("TRIANGLE ((0 0,9 0,9 9,0 0))", "TRIANGLE ((100 1000,109 1000,109 1009,100 1000))"),
        ] {
            assert_eq!(shifted(wkt).0, moved);
        }
        assert_eq!(shifted("POINT EMPTY").1, 0);
    }

    #[test]
    fn broken_bytes_are_an_error_and_not_a_panic() {
        let wkb = Geometry::from_wkt("LINESTRING (1 2,3 4)").unwrap().iso_wkb().unwrap();
        for end in 0..wkb.len() {
            let mut cut = wkb[..end].to_vec();
            let result = map_coordinates::<WkbError>(&mut cut, &mut |_, p| Ok(p));
            assert_eq!(result, Err(WkbError::Truncated), "{end} bytes");
        }
        let mut unknown = vec![1, 99, 0, 0, 0];
        let result = map_coordinates::<WkbError>(&mut unknown, &mut |_, p| Ok(p));
        assert_eq!(result, Err(WkbError::UnknownType(99)));
        // GDAL reads the last byte of such a code alone.
        for code in [4001u32, 0xcf09, 0x0fff_ffff, 0x1000_0001] {
            let mut beyond = [&[1][..], &code.to_le_bytes(), &[0; 32]].concat();
            let result = map_coordinates::<WkbError>(&mut beyond, &mut |_, p| Ok(p));
            assert_eq!(result, Err(WkbError::UnknownType(code)));
        }
        for code in [0x2000_0001u32, 0xa000_0003, 0x2000_0007] {
            let mut extended = [&[1][..], &code.to_le_bytes(), &[0; 32]].concat();
            let result = map_coordinates::<WkbError>(&mut extended, &mut |_, p| Ok(p));
            assert_eq!(result, Err(WkbError::OwnSrid));
        }
        let mut followed = [&wkb[..], b"hidden"].concat();
        let result = map_coordinates::<WkbError>(&mut followed, &mut |_, p| Ok(p));
        assert_eq!(result, Err(WkbError::BytesAfter(6)));
        let mut nested: Vec<u8> = [1, 7, 0, 0, 0, 1, 0, 0, 0].repeat(1000);
        let result = map_coordinates::<WkbError>(&mut nested, &mut |_, p| Ok(p));
        assert_eq!(result, Err(WkbError::TooDeep));
    }
}
