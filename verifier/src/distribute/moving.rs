//! Copies of the staged GeoPackage with moved geometries. No geometry changes its length, so their
//! bytes are overwritten in place, while rows and attributes stay untouched.

use super::{
    spatial_index,
    staged::{Done, Layer, Staged, open},
};
use crate::{Error, Result};
use meshmark_dataset::{
    Action, file_error,
    geopackage::{self, Bounds},
};
use meshmark_marking::wkb::WkbError;
use rusqlite::{Connection, OpenFlags, params};
use std::{fs, path::Path};

/// The file is private until it is synced and published, so it needs no journal.
const BEGIN: &str = "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; BEGIN";

/// Writes a copy whose vertices are at the places `to`, CRS units.
pub fn write(staged: &Staged, path: &Path, to: &[[f64; 2]]) -> Result<()> {
    fs::copy(&staged.path, path).map_err(|error| file_error(Action::Writing, path, error))?;
    let moved = || -> Done<()> {
        let connection = open(path, OpenFlags::SQLITE_OPEN_READ_WRITE)?;
        connection.execute_batch(BEGIN)?;
        for layer in &staged.layers {
            let bounds = move_geometries(&connection, layer, to)?;
            if layer.has_index {
                spatial_index::fit(&connection, layer, &bounds)?;
            }
            set_extent(&connection, layer, &bounds)?;
        }
        connection.execute_batch("COMMIT")?;
        connection.close().map_err(|(_, error)| error.into())
    };
    moved().map_err(|cause| Error::unwritten("a copy", cause))
}

/// Moves the geometries of a layer. Returns the bounding boxes of the features that have one,
/// ascending by feature id.
fn move_geometries(connection: &Connection, layer: &Layer, to: &[[f64; 2]]) -> Done<Vec<(i64, Bounds)>> {
    let Some(&first) = layer.fids.first() else { return Ok(Vec::new()) };
    let mut places = layer.places(to);
    let mut place = |_| Ok(places.next().expect("the copy has the coordinates of the staged map"));
    let (mut bounds, mut bytes) = (Vec::with_capacity(layer.fids.len()), Vec::new());
    let mut blob = connection.blob_open(c"main", layer.name.as_str(), layer.column.as_str(), first, false)?;
    for &fid in &layer.fids {
        blob.reopen(fid)?;
        bytes.resize(blob.len(), 0);
        blob.read_at_exact(&mut bytes, 0)?;
        let moved = geopackage::map_coordinates::<WkbError>(&mut bytes, &mut place)?;
        blob.write_all_at(&bytes, 0)?;
        bounds.extend(moved.map(|moved| (fid, moved)));
    }
    blob.close()?;
    Ok(bounds)
}

fn set_extent(connection: &Connection, layer: &Layer, bounds: &[(i64, Bounds)]) -> Done<()> {
    let whole = bounds.iter().map(|(_, bounds)| *bounds);
    let larger = |a: Bounds, b: Bounds| [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])];
    let Some([x0, x1, y0, y1]) = whole.reduce(larger) else { return Ok(()) };
    let sql = "UPDATE gpkg_contents SET min_x = ?1, max_x = ?2, min_y = ?3, max_y = ?4 WHERE table_name = ?5";
    connection.execute(sql, params![x0, x1, y0, y1, layer.name])?;
    Ok(())
}
