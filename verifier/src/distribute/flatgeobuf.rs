//! FlatGeobuf as GDAL writes it: this module overwrites coordinates in place, with the bounding
//! boxes of index and header.
//!
//! A file has a header, an index and features. The header and each feature are FlatBuffers with a
//! size prefix (flatgeobuf.org/src/fbs). The index is a packed R-tree: nodes of a bounding box and
//! an offset, level by level, the root first.

use super::opening::open;
use crate::{Error, Result, inputs::gdal_failures::GdalFailure};
use gdal::vector::LayerAccess;
use meshmark_dataset::{Action, file_error};
use meshmark_marking::Moves;
use std::{fs, ops::Range, path::Path};

/// The first bytes of a file of any version.
const MAGIC: &[u8] = b"fgb";
/// Offset of the size of the header.
const HEADER: usize = 8;
/// Size of a node: a bounding box (least x and y, largest x and y) and an offset, 64 bits each.
const NODE: usize = 40;
/// Number of children of a node when the header gives none.
const DEFAULT_NODE_SIZE: u16 = 16;

/// Numbers of fields in the tables of the schema.
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

/// Writes a copy of `plain` with moved vertices.
pub fn write(plain: &Path, file: &Path, moves: Moves) -> Result<()> {
    let mut bytes = fs::read(plain).map_err(|error| file_error(Action::Reading, plain, error))?;
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
    fs::write(file, &bytes).map_err(|error| file_error(Action::Writing, file, error))?;
    let boxes = boxes(file)?;
    parts.fit(&mut bytes, &boxes).ok_or(Error::UnknownFlatGeobuf)?;
    Ok(fs::write(file, &bytes).map_err(|error| file_error(Action::Writing, file, error))?)
}

/// Returns the bounding boxes of all features in the order of the file. GDAL computes the extent of
/// arcs.
fn boxes(file: &Path) -> Result<Vec<Bounds>> {
    let failed = |error| Error::unwritten("FlatGeobuf", GdalFailure::new(error));
    let dataset = open(file, "FlatGeobuf")?;
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

/// Offsets of the parts of a file.
struct Parts {
    /// The bounding box of the whole map in the header, if there is one.
    envelope: Option<usize>,
    index: usize,
    /// Number of nodes of every level of the index, the leaves first; empty without an index.
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

    /// Adapts header and index to features with these bounding boxes.
    fn fit(&self, bytes: &mut [u8], boxes: &[Bounds]) -> Option<()> {
        if let Some(envelope) = self.envelope {
            put(bytes, envelope, &boxes.iter().copied().fold(NOTHING, around));
        }
        // The update goes from the leaves to the root. The leaves are last, one for each feature in
        // file order.
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

/// Collects the offsets of the coordinate pairs of a geometry.
fn coordinates(bytes: &[u8], geometry: usize, depth: usize, places: &mut Vec<usize>) -> Option<()> {
    (depth < 64).then_some(())?;
    if let Some(xy) = indirect_field(bytes, geometry, field::GEOMETRY_XY) {
        let count = u32_at(bytes, xy)? as usize / 2;
        bytes.get(xy + 4..xy + 4 + 16 * count)?;
        // An empty point has no coordinates.
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

/// Returns the offset of the table of a size-prefixed FlatBuffer.
fn root(bytes: &[u8], at: usize) -> Option<usize> {
    indirect(bytes, at + 4)
}

/// Returns the target of an offset.
fn indirect(bytes: &[u8], at: usize) -> Option<usize> {
    Some(at + u32_at(bytes, at)? as usize)
}

/// Returns the offset of a field of a table, if the table has it.
fn entry(bytes: &[u8], table: usize, field: usize) -> Option<usize> {
    let vtable = table.checked_add_signed(-(i32::from_le_bytes(array(bytes, table)?) as isize))?;
    let size = usize::from(u16::from_le_bytes(array(bytes, vtable)?));
    let place = 4 + 2 * field;
    let offset = if place < size { u16::from_le_bytes(array(bytes, vtable + place)?) } else { 0 };
    (offset > 0).then_some(table + usize::from(offset))
}

/// Returns the target of a field that holds an offset.
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
