//! Chains of coordinates in reading order: rings, lines and points, one after the other.

use crate::{
    Error, Result,
    extent::Extent,
    wkb::{self, GeometryFault, Step},
};
use gdal::vector::Feature;
use meshmark_core::map_data::ChainKind;
use std::collections::BTreeMap;

/// Coordinates of rings, lines and points, one after the other.
#[derive(Clone, Default)]
pub(crate) struct Chains {
    pub(crate) coords: Vec<[f64; 2]>,
    /// The index in `coords` where each chain starts, ascending.
    pub(crate) starts: Vec<u32>,
    /// The kind of each chain.
    pub(crate) kinds: Vec<Step>,
    /// The number of the first chain of each geometry, ascending.
    pub(crate) firsts: Vec<u32>,
    /// The geometries that their chains do not describe completely, by number.
    pub(crate) others: BTreeMap<u32, Vec<u8>>,
}

impl Chains {
    /// Returns the role of each chain in polygons.
    pub(crate) fn chain_kinds(&self) -> impl Iterator<Item = ChainKind> {
        self.kinds.iter().map(|step| match step {
            Step::Shell => ChainKind::Shell,
            Step::Hole => ChainKind::Hole,
            Step::First | Step::Next => ChainKind::Line,
        })
    }

    fn begin_geometry(&mut self) {
        self.firsts.push(self.starts.len() as u32);
    }

    fn push(&mut self, step: Step, point: [f64; 2]) {
        if step != Step::Next {
            self.starts.push(self.coords.len() as u32);
            self.kinds.push(step);
        }
        self.coords.push(point);
    }

    pub(crate) fn append(&mut self, other: &mut Chains) {
        let (of_starts, offset) = (self.starts.len() as u32, self.coords.len() as u32);
        let geometries = self.firsts.len() as u32;
        let others = std::mem::take(&mut other.others);
        self.others.extend(others.into_iter().map(|(number, wkb)| (number + geometries, wkb)));
        self.firsts.extend(other.firsts.drain(..).map(|first| first + of_starts));
        self.starts.extend(other.starts.drain(..).map(|start| start + offset));
        self.coords.append(&mut other.coords);
        self.kinds.append(&mut other.kinds);
    }
}

/// Appends the coordinates of one geometry of a feature.
pub(crate) fn read_geometry(
    feature: &Feature,
    column: usize,
    layer: &str,
    (keeps_geometries, extent): (bool, Extent),
    chains: &mut Chains,
) -> Result<()> {
    let Ok(geometry) = feature.geometry_by_index(column) else { return Ok(()) }; // a null geometry
    let fid = || feature.fid().map_or("without id".into(), |fid| fid.to_string());
    let failed = |source: GeometryFault| Error::Geometry { layer: layer.into(), fid: fid(), source };
    let mut bytes = geometry.iso_wkb().map_err(|error| failed(error.into()))?;
    if keeps_geometries && !wkb::is_plain(&bytes) {
        chains.others.insert(chains.firsts.len() as u32, bytes.clone());
    }
    chains.begin_geometry();
    let mut visit = |step, point: [f64; 2]| {
        extent.check(point, layer, fid)?;
        chains.push(step, point);
        Ok(point)
    };
    match wkb::map_coordinates::<Visit>(&mut bytes, &mut |step, point| {
        visit(step, point).map_err(Visit::Ours)
    }) {
        Ok(()) => Ok(()),
        Err(Visit::Ours(error)) => Err(error),
        Err(Visit::Wkb(error)) => Err(failed(error.into())),
    }
}

enum Visit {
    Ours(Error),
    Wkb(wkb::WkbError),
}

impl From<wkb::WkbError> for Visit {
    fn from(error: wkb::WkbError) -> Self {
        Visit::Wkb(error)
    }
}
