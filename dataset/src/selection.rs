//! The selection: the parts of a dataset to read, and the way to read them.

use crate::{Error, Result};
use gdal::{Dataset, vector::LayerAccess};
use meshmark_core::options::join_list;
use meshmark_marking as marking;

/// The open options for any map. CSV files hold their coordinates as text, which would otherwise
/// stay an attribute, and unmarked; layers of OpenStreetMap files must be read one at a time,
/// whatever the configuration. With @ an option concerns only drivers that have it.
pub const OPEN_OPTIONS: [&str; 2] = ["@KEEP_GEOM_COLUMNS=NO", "@INTERLEAVED_READING=NO"];

/// The most vertices a map may have: their numbers are 32 bits wide.
pub const MOST_VERTICES: usize = u32::MAX as usize;

/// Which attributes become labels. With labels come polylines, both for registration, and areas for
/// detection.
#[derive(Debug, Clone, Copy)]
pub enum LabelFields<'a> {
    /// None, no polylines and no areas: only the vertices are wanted.
    None,
    /// Every string and integer field.
    All,
    /// The fields of these names.
    Named(&'a [String]),
}

impl LabelFields<'_> {
    pub(crate) fn wants(&self, field: &str) -> bool {
        match self {
            LabelFields::None => false,
            LabelFields::All => true,
            LabelFields::Named(names) => names.iter().any(|name| name.eq_ignore_ascii_case(field)),
        }
    }
}

/// The parts of a dataset to read, and the way to read them.
#[derive(Clone, Copy)]
pub struct Selection<'a> {
    /// Layers that form the map; all when `None`.
    pub layers: Option<&'a [String]>,
    /// CRS of a source that has none.
    pub srs: Option<&'a str>,
    /// CRS in which a source was marked, from its record.
    pub recorded_crs: Option<&'a str>,
    /// Attributes that become labels.
    pub labels: LabelFields<'a>,
    /// Whether to keep the geometries.
    pub geometries: bool,
    /// A map of more vertices, duplicates included, is refused.
    pub most_vertices: usize,
    /// Returns GDAL's last failure since the walk began or the last call: drivers end a layer
    /// early on a read error, and only the error handler of the process distinguishes that from the
    /// end of the layer.
    pub last_failure: &'a dyn Fn() -> Option<String>,
}

/// Selects the whole map, without attributes, in its own CRS.
impl Default for Selection<'_> {
    fn default() -> Self {
        Selection {
            layers: None,
            srs: None,
            recorded_crs: None,
            labels: LabelFields::None,
            geometries: false,
            most_vertices: MOST_VERTICES,
            last_failure: &|| None,
        }
    }
}

/// Returns number and name of the chosen layers, in the order of the dataset. Two layers may have
/// one name.
pub(crate) fn chosen_layers(dataset: &Dataset, wanted: Option<&[String]>) -> Result<Vec<(usize, String)>> {
    let known: Vec<String> = dataset.layers().map(|layer| layer.name()).collect();
    if known.is_empty() {
        return Err(Error::NoLayers);
    }
    if let Some(name) = wanted.and_then(|wanted| wanted.iter().find(|name| !known.contains(name))) {
        return Err(marking::Error::UnknownLayer { name: name.clone(), known: join_list(&known) }.into());
    }
    let is_wanted = |name: &String| wanted.is_none_or(|wanted| wanted.contains(name));
    Ok(known.into_iter().enumerate().filter(|(_, name)| is_wanted(name)).collect())
}
