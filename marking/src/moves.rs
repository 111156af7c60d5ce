//! The movement of geometries with the vertices of their map.

use crate::wkb;
use meshmark_core::vertices::VertexTable;

/// The movement of the vertices of a map.
#[derive(Clone, Copy)]
pub struct Moves<'a> {
    /// The vertices.
    pub from: &'a VertexTable,
    /// The new place of each, in canonical order, CRS units.
    pub to: &'a [[f64; 2]],
}

impl Moves<'_> {
    /// Returns the new place of a vertex; `None` when it is no vertex of the map.
    pub fn destination(&self, point: [f64; 2]) -> Option<[f64; 2]> {
        self.from.index_of(point).map(|index| self.to[index])
    }

    /// Moves every coordinate of a WKB geometry and returns their number.
    ///
    /// # Errors
    /// Fails for a coordinate that is no vertex of the map and for bytes that are not a geometry.
    pub fn geometry(&self, bytes: &mut [u8]) -> std::result::Result<usize, NotMoved> {
        let mut count = 0;
        wkb::map_coordinates::<NotMoved>(bytes, &mut |_, point| {
            count += 1;
            self.destination(point).ok_or(NotMoved::UnknownVertex(point))
        })?;
        Ok(count)
    }
}

/// Why a geometry was not moved.
#[derive(Debug, thiserror::Error)]
pub enum NotMoved {
    /// Its coordinate is not in the table.
    #[error("({}, {}) was not there when the map was read", .0[0], .0[1])]
    UnknownVertex([f64; 2]),
    /// Its bytes are malformed.
    #[error(transparent)]
    Wkb(#[from] wkb::WkbError),
}
