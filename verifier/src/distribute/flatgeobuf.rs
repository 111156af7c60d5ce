//! FlatGeobuf as GDAL writes it: coordinates written over in place, with the boxes of the index and the header.
//!
//! A file is a header, an index and the features, each of header and features a FlatBuffer with its size before it
//! (flatgeobuf.org/src/fbs). The index is a packed R-tree: nodes of a box and a place, level by level, the root first.

use crate::{Error, Result, inputs::gdal_failures};
use gdal::{Dataset, vector::LayerAccess};
use meshmark_dataset::{marking::Moves, workplace::file_error};
use std::{fs, ops::Range, path::Path};

/// What a file begins with, whatever its version.
const MAGIC: &[u8] = b"fgb";
/// Where the header's size is.
const HEADER: usize = 8;
/// A box, least x and y, largest x and y, and a place, 64 bits each.
const NODE: usize = 40;
/// How many nodes a node has when the header does not say.
const DEFAULT_NODE_SIZE: u16 = 16;

/// Numbers of fields in tables of the schema.
mod field {
    pub const HEADER_ENVELOPE: usize = 1;
    pub const HEADER_FEATURES: usize = 8;
    pub const HEADER_NODE_SIZE: usize = 9;
    pub const FEATURE_GEOMETRY: usize = 0;
    pub const GEOMETRY_XY: usize = 1;
    pub const GEOMETRY_PARTS: usize = 7;
}

/// Least x and y, largest x and y.
type Bounds = [f64; 4];

const NOTHING: Bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];

/// Writes a copy of `plain` in which the vertices are where they go.
pub fn write(plain: &Path, file: &Path, moves: Moves) -> Result<()> {
    let mut bytes = fs::read(plain).map_err(|error| file_error("reading", plain, error))?;
    let parts = Parts::parse(&bytes).ok_or(Error::UnknownFlatGeobuf)?;
    let mut places = Vec::new();
    let mut at = parts.features.start;
    while at < parts.features.end {
        let feature = root(&bytes, at).ok_or(Error::UnknownFlatGeobuf)?;
        let geometry = indirect_field(&bytes, feature, field::FEATURE_GEOMETRY);
        geometry
            .map_or(Some(()), |geometry| coordinates(&bytes, geometry, 0, &mut places))
            .ok_or(Error::UnknownFlatGeobuf)?;
        at += 4 + u32_at(&bytes, at).ok_or(Error::UnknownFlatGeobuf)? as usize;
    }
    for place in places {
        let point = [place, place + 8].map(|at| f64_at(&bytes, at).unwrap_or(f64::NAN));
        let [x, y] = moves.destination(point).ok_or(Error::MapChanged)?;
        put(&mut bytes, place, &[x, y]);
    }
    fs::write(file, &bytes).map_err(|error| file_error("writing", file, error))?;
    let boxes = boxes(file)?;
    parts.fit(&mut bytes, &boxes).ok_or(Error::UnknownFlatGeobuf)?;
    Ok(fs::write(file, &bytes).map_err(|error| file_error("writing", file, error))?)
}

/// The boxes of all features in the order of the file. GDAL knows how far an arc reaches.
fn boxes(file: &Path) -> Result<Vec<Bounds>> {
    gdal_failures::forget_failure();
    let failed = |error: gdal::errors::GdalError| {
        let reason = gdal_failures::last_failure().unwrap_or_else(|| error.to_string());
        Error::NotWritten { what: "FlatGeobuf".into(), reason }
    };
    let dataset = Dataset::open(file).map_err(failed)?;
    let mut layer = dataset.layer(0).map_err(failed)?;
    let of_feature = |feature: gdal::vector::Feature| match feature.geometry_by_index(0) {
        Ok(geometry) if !geometry.is_empty() => {
            let found = geometry.envelope();
            [found.MinX, found.MinY, found.MaxX, found.MaxY]
        }
        _ => NOTHING,
    };
    Ok(layer.features().map(of_feature).collect())
}

/// Where the parts of a file are.
struct Parts {
    /// The box of the whole in the header, if there is one.
    envelope: Option<usize>,
    index: usize,
    /// How many nodes every level of the index has, the leaves first; none without an index.
    levels: Vec<usize>,
    node_size: usize,
    features: Range<usize>,
}

impl Parts {
    fn parse(bytes: &[u8]) -> Option<Self> {
        bytes.starts_with(MAGIC).then_some(())?;
        let header = root(bytes, HEADER)?;
        let index = HEADER + 4 + u32_at(bytes, HEADER)? as usize;
        let number = |field| entry(bytes, header, field);
        let node_size = number(field::HEADER_NODE_SIZE)
            .map_or(Some(DEFAULT_NODE_SIZE), |at| Some(u16::from_le_bytes(array(bytes, at)?)))?;
        let count = number(field::HEADER_FEATURES)
            .map_or(Some(0), |at| Some(u64::from_le_bytes(array(bytes, at)?)))?;
        let (node_size, count) = (usize::from(node_size), usize::try_from(count).ok()?);
        let levels = if node_size > 1 && count > 0 { levels(count, node_size) } else { Vec::new() };
        let envelope = indirect_field(bytes, header, field::HEADER_ENVELOPE);
        let envelope = envelope.filter(|at| u32_at(bytes, *at) == Some(4)).map(|at| at + 4);
        let features = index + NODE * levels.iter().sum::<usize>()..bytes.len();
        (features.start <= bytes.len()).then_some(Parts { envelope, index, levels, node_size, features })
    }

    /// Makes header and index fit features of these boxes.
    fn fit(&self, bytes: &mut [u8], boxes: &[Bounds]) -> Option<()> {
        if let Some(envelope) = self.envelope {
            put(bytes, envelope, &boxes.iter().copied().fold(NOTHING, around));
        }
        // From the leaves, which are last and one a feature in the order of the file, to the root.
        let mut first = self.levels.iter().sum::<usize>();
        let mut below = boxes.to_vec();
        for (number, &count) in self.levels.iter().enumerate() {
            if number > 0 {
                below = below
                    .chunks(self.node_size)
                    .map(|part| part.iter().copied().fold(NOTHING, around))
                    .collect();
            }
            (below.len() == count).then_some(())?;
            first -= count;
            for (node, bounds) in below.iter().enumerate() {
                put(bytes, self.index + NODE * (first + node), bounds);
            }
        }
        Some(())
    }
}

fn levels(count: usize, node_size: usize) -> Vec<usize> {
    let mut levels = vec![count];
    loop {
        let above = levels.last().expect("there is one").div_ceil(node_size);
        levels.push(above);
        if above == 1 {
            return levels;
        }
    }
}

fn around(a: Bounds, b: Bounds) -> Bounds {
    [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]
}

/// Where every coordinate pair of a geometry is.
fn coordinates(bytes: &[u8], geometry: usize, depth: usize, places: &mut Vec<usize>) -> Option<()> {
    (depth < 64).then_some(())?;
    if let Some(xy) = indirect_field(bytes, geometry, field::GEOMETRY_XY) {
        let count = u32_at(bytes, xy)? as usize / 2;
        bytes.get(xy + 4..xy + 4 + 16 * count)?;
        // An empty point has none.
        let is_point = |at: &usize| f64_at(bytes, *at).is_some_and(|x| !x.is_nan());
        places.extend((0..count).map(|pair| xy + 4 + 16 * pair).filter(is_point));
    }
    let Some(parts) = indirect_field(bytes, geometry, field::GEOMETRY_PARTS) else { return Some(()) };
    let count = u32_at(bytes, parts)? as usize;
    (0..count).try_for_each(|part| {
        let part = indirect(bytes, parts + 4 + 4 * part)?;
        coordinates(bytes, part, depth + 1, places)
    })
}

/// The table of a FlatBuffer with its size before it.
fn root(bytes: &[u8], at: usize) -> Option<usize> {
    indirect(bytes, at + 4)
}

/// What an offset leads to.
fn indirect(bytes: &[u8], at: usize) -> Option<usize> {
    Some(at + u32_at(bytes, at)? as usize)
}

/// Where a field of a table is, when the table has it.
fn entry(bytes: &[u8], table: usize, field: usize) -> Option<usize> {
    let vtable = table.checked_add_signed(-(i32::from_le_bytes(array(bytes, table)?) as isize))?;
    let size = usize::from(u16::from_le_bytes(array(bytes, vtable)?));
    let place = 4 + 2 * field;
    let offset = if place < size { u16::from_le_bytes(array(bytes, vtable + place)?) } else { 0 };
    (offset > 0).then_some(table + usize::from(offset))
}

/// What a field that is an offset leads to.
fn indirect_field(bytes: &[u8], table: usize, field: usize) -> Option<usize> {
    indirect(bytes, entry(bytes, table, field)?)
}

fn put(bytes: &mut [u8], at: usize, values: &[f64]) {
    let places = bytes[at..].chunks_exact_mut(8);
    places.zip(values).for_each(|(place, value)| place.copy_from_slice(&value.to_le_bytes()));
}

fn f64_at(bytes: &[u8], at: usize) -> Option<f64> {
    array(bytes, at).map(f64::from_le_bytes)
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    array(bytes, at).map(u32::from_le_bytes)
}

fn array<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}
