//! The staged GeoPackage: the unmarked map that all copies start from, with the vertex of every
//! coordinate.

use crate::{Cause, Error, Result};
use meshmark_core::vertices::VertexTable;
use meshmark_dataset::{geojson_text::without_places, geopackage};
use meshmark_marking::NotMoved;
use rusqlite::{Connection, OpenFlags};
use std::path::{Path, PathBuf};

/// The result of a step in which SQLite or a geometry can fail.
pub type Done<T> = std::result::Result<T, Cause>;

/// A GeoPackage made by `ogr2ogr`.
pub struct Staged {
    /// The path of the file.
    pub path: PathBuf,
    /// The layers whose geometries move.
    pub layers: Vec<Layer>,
}

/// A layer whose geometries move.
pub struct Layer {
    /// The name of the layer and of its table.
    pub name: String,
    /// The column of the geometries.
    pub column: String,
    /// Whether the layer has a spatial index.
    pub has_index: bool,
    /// The ids of the features that have a geometry, ascending.
    pub fids: Vec<i64>,
    /// The vertex index of every coordinate, feature by feature.
    vertices: Vec<u32>,
}

impl Staged {
    /// Reads the vertex of every coordinate in the layers that `marked` selects.
    pub fn read(path: PathBuf, vertices: &VertexTable, marked: impl Fn(&str) -> bool) -> Result<Self> {
        let layers = || -> Done<Vec<Layer>> {
            let connection = open(&path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
            let mut names =
                connection.prepare("SELECT table_name, column_name FROM gpkg_geometry_columns")?;
            let names = names.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
            let names: Vec<(String, String)> = names.collect::<rusqlite::Result<_>>()?;
            let names = names.into_iter().filter(|(name, _)| marked(name));
            names.map(|(name, column)| Layer::read(&connection, name, column, vertices)).collect()
        };
        clear_native_data(&path).map_err(|cause| Error::unwritten(path.display(), cause))?;
        let layers = layers().map_err(|source| Error::StagedUnread { source })?;
        Ok(Staged { layers, path })
    }

    /// Returns the layer of this name, if its geometries move.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }
}

impl Layer {
    fn read(connection: &Connection, name: String, column: String, table: &VertexTable) -> Done<Self> {
        let key = "SELECT name FROM pragma_table_info(?1) WHERE pk = 1";
        let key: String = connection.query_row(key, [&name], |row| row.get(0))?;
        let [id, geometry, from] =
            [&key, &column, &name].map(|name| format!("\"{}\"", name.replace('"', "\"\"")));
        let sql = format!("SELECT {id}, {geometry} FROM {from} WHERE {geometry} NOT NULL ORDER BY {id}");
        let mut select = connection.prepare(&sql)?;
        let mut rows = select.query([])?;
        let (mut fids, mut vertices, mut bytes) = (Vec::new(), Vec::new(), Vec::new());
        while let Some(row) = rows.next()? {
            fids.push(row.get(0)?);
            bytes.clear();
            bytes.extend_from_slice(row.get_ref(1)?.as_blob().map_err(rusqlite::Error::from)?);
            geopackage::map_coordinates::<NotMoved>(&mut bytes, &mut |point| {
                let vertex = table.index_of(point).ok_or(NotMoved::UnknownVertex(point))?;
                vertices.push(vertex as u32);
                Ok(point)
            })?;
        }
        fids.shrink_to_fit();
        vertices.shrink_to_fit();
        let has_index = connection.table_exists(None, format!("rtree_{name}_{column}").as_str())?;
        Ok(Layer { name, column, has_index, fids, vertices })
    }

    /// Returns the new place of every coordinate, feature by feature; `to` are the new places of
    /// the vertices.
    pub fn places<'a>(&'a self, to: &'a [[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + 'a {
        self.vertices.iter().map(|&vertex| to[vertex as usize])
    }
}

/// Removes places from the native data of a GeoJSON source, which otherwise reveal the unmarked
/// extent.
fn clear_native_data(path: &Path) -> Done<()> {
    const BEGIN: &str = "<MDI key=\"NATIVE_DATA\">";
    const END: &str = "</MDI>";
    const ESCAPES: [(&str, &str); 4] = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&amp;", "&")];
    let connection = open(path, OpenFlags::SQLITE_OPEN_READ_WRITE)?;
    if !connection.table_exists(None, "gpkg_metadata")? {
        return Ok(());
    }
    let mut texts = connection.prepare("SELECT id, metadata FROM gpkg_metadata")?;
    let texts = texts.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
    for text in texts.collect::<rusqlite::Result<Vec<(i64, String)>>>()? {
        let (id, text) = text;
        let Some((before, rest)) = text.split_once(BEGIN) else { continue };
        let (words, after) = rest.split_once(END).unwrap_or((rest, ""));
        let words = ESCAPES.iter().fold(words.to_string(), |words, (name, sign)| words.replace(name, sign));
        let kept = String::from_utf8(without_places(words.as_bytes(), false).unwrap_or_default())?;
        let kept = ESCAPES.iter().rev().fold(kept, |kept, (name, sign)| kept.replace(sign, name));
        let update = "UPDATE gpkg_metadata SET metadata = ?2 WHERE id = ?1";
        connection.execute(update, (id, format!("{before}{BEGIN}{kept}{END}{after}")))?;
    }
    Ok(())
}

/// Opens a GeoPackage without GDAL.
pub fn open(path: &Path, access: OpenFlags) -> rusqlite::Result<Connection> {
    Connection::open_with_flags(path, access | OpenFlags::SQLITE_OPEN_NO_MUTEX)
}
