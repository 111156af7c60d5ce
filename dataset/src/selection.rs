//! What to read of a dataset, and how.

use crate::{CoordinateSystem, Error, Result};
use gdal::{Dataset, vector::LayerAccess};
use meshmark_core::options::join_list;

/// The most vertices a map may have: their numbers are 32 bits wide.
pub const MOST_VERTICES: usize = u32::MAX as usize;

/// Which attributes become labels. With labels come polylines: both are for registration.
#[derive(Debug, Clone, Copy)]
pub enum LabelFields<'a> {
    /// None, and no polylines: only the vertices are wanted.
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

/// Which CRS coordinates are read in.
#[derive(Debug, Clone, Copy)]
pub enum TargetCrs<'a> {
    /// Their own, which all chosen layers must share.
    Own,
    /// This one: layers in another CRS are reprojected.
    Crs(&'a CoordinateSystem),
    /// Whatever they are in: the numbers as they stand.
    Raw,
}

/// What to read of a dataset, and how.
#[derive(Clone, Copy)]
pub struct Selection<'a> {
    /// Layers that form the map; all when `None`.
    pub layers: Option<&'a [String]>,
    /// CRS of a source that has none.
    pub srs: Option<&'a str>,
    /// Attributes to take along.
    pub labels: LabelFields<'a>,
    /// Which CRS the coordinates shall be in.
    pub target: TargetCrs<'a>,
    /// Whether to keep what the geometries are made of.
    pub geometries: bool,
    /// Refuse a map of more vertices, duplicates included.
    pub most_vertices: usize,
    /// What GDAL's last failure was, if there was one since the walk began: drivers end a layer early on a
    /// read error, and only the process's error handler tells that from its end.
    pub last_failure: &'a dyn Fn() -> Option<String>,
}

/// The whole map, without attributes, in its own CRS.
impl Default for Selection<'_> {
    fn default() -> Self {
        Selection {
            layers: None,
            srs: None,
            labels: LabelFields::None,
            target: TargetCrs::Own,
            geometries: false,
            most_vertices: MOST_VERTICES,
            last_failure: &|| None,
        }
    }
}

/// Number and name of the chosen layers, in the dataset's order. Two layers may have one name.
pub(crate) fn chosen_layers(dataset: &Dataset, wanted: Option<&[String]>) -> Result<Vec<(usize, String)>> {
    let known: Vec<String> = dataset.layers().map(|layer| layer.name()).collect();
    if known.is_empty() {
        return Err(Error::NoLayers);
    }
    if let Some(name) = wanted.and_then(|wanted| wanted.iter().find(|name| !known.contains(name))) {
        return Err(Error::UnknownLayer { name: name.clone(), known: join_list(&known) });
    }
    let is_wanted = |name: &String| wanted.is_none_or(|wanted| wanted.contains(name));
    Ok(known.into_iter().enumerate().filter(|(_, name)| is_wanted(name)).collect())
}
