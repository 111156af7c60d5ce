//! The spatial index of a layer: an R-tree in tables, whose nodes have the layout of SQLite's
//! rtree.c.
//!
//! After shifts of a metre at most the tree stays efficient, once its boxes are adapted from the
//! leaves up. This takes a small part of the time of a new tree.

use super::staged::{Done, Layer};
use crate::Cause;
use meshmark_dataset::geopackage::Bounds;
use rusqlite::{Connection, blob::Blob};

/// The root node; its first two bytes hold the number of levels below it.
const ROOT: i64 = 1;
/// Size of the header of a node: the number of levels and the number of cells, 16 bits each.
const HEADER: usize = 4;
/// Size of a cell: a feature id or node number of 64 bits, and a box of four 32-bit values.
const CELL: usize = 24;

/// A stored box: least x, largest x, least y, largest y.
type Stored = [f32; 4];

const NOTHING: Stored = [f32::INFINITY, f32::NEG_INFINITY, f32::INFINITY, f32::NEG_INFINITY];

/// Adapts the boxes to moved features. `bounds` has all features of the index, ascending by feature
/// id.
pub fn fit(connection: &Connection, layer: &Layer, bounds: &[(i64, Bounds)]) -> Done<()> {
    let table = format!("rtree_{}_{}_node", layer.name, layer.column);
    let mut nodes = connection.blob_open(c"main", table.as_str(), "data", ROOT, false)?;
    let mut levels = [0; 2];
    nodes.read_at_exact(&mut levels, 0)?;
    fit_node(&mut nodes, ROOT, u16::from_be_bytes(levels), bounds)?;
    nodes.close()?;
    Ok(())
}

/// Adapts a node that has this many levels below it, and returns the box around it.
fn fit_node(nodes: &mut Blob, number: i64, levels: u16, bounds: &[(i64, Bounds)]) -> Done<Stored> {
    nodes.reopen(number)?;
    let mut bytes = vec![0; nodes.len()];
    nodes.read_at_exact(&mut bytes, 0)?;
    let (header, cells) = bytes
        .split_first_chunk_mut::<HEADER>()
        .ok_or(Cause::SpatialIndex("a node of the index is cut short"))?;
    let count = u16::from_be_bytes([header[2], header[3]]);
    let mut whole = NOTHING;
    for cell in cells.chunks_exact_mut(CELL).take(usize::from(count)) {
        let (id, stored) = cell.split_first_chunk_mut::<8>().expect("a cell begins with its id");
        let id = i64::from_be_bytes(*id);
        let fitted = match levels {
            0 => outward(
                of_feature(bounds, id)
                    .ok_or(Cause::SpatialIndex("the index has a feature without geometry"))?,
            ),
            _ => fit_node(nodes, id, levels - 1, bounds)?,
        };
        stored.copy_from_slice(fitted.map(f32::to_be_bytes).as_flattened());
        whole = around(whole, fitted);
    }
    nodes.reopen(number)?;
    nodes.write_all_at(&bytes, 0)?;
    Ok(whole)
}

fn of_feature(bounds: &[(i64, Bounds)], id: i64) -> Option<Bounds> {
    bounds.binary_search_by_key(&id, |(fid, _)| *fid).ok().map(|place| bounds[place].1)
}

/// Rounds a box outwards to 32 bits, so that it contains the original one.
fn outward(bounds: Bounds) -> Stored {
    let rounded = bounds.map(|value| value as f32);
    std::array::from_fn(|side| match f64::from(rounded[side]) {
        value if side % 2 == 0 && value > bounds[side] => rounded[side].next_down(),
        value if side % 2 == 1 && value < bounds[side] => rounded[side].next_up(),
        _ => rounded[side],
    })
}

fn around(a: Stored, b: Stored) -> Stored {
    [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_goes_outward_and_no_further_than_it_must() {
        let bounds = [0.1, 0.1, -0.1, -0.1];
        let stored = outward(bounds);
        for (side, (value, exact)) in stored.into_iter().zip(bounds).enumerate() {
            let (out, back) = if side % 2 == 0 { (-1.0, value.next_up()) } else { (1.0, value.next_down()) };
            assert!((f64::from(value) - exact) * out > 0.0 && (f64::from(back) - exact) * out < 0.0);
        }
        assert_eq!(outward([0.5, 2.0, -4.0, 0.0]), [0.5, 2.0, -4.0, 0.0]);
    }
}
