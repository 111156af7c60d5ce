//! A map as it was read.

use crate::{Crs, CrsSource, Geometries, LeftOut, Metric, Result};
use meshmark_core::{ground::Ground, map::Map, map_data::MapData, options::Parameters};
use std::collections::BTreeMap;

/// A map as marking and verification read it.
#[derive(Debug, Clone)]
pub struct Survey<C> {
    /// The data of the map.
    pub data: MapData,
    /// The CRS: the common one of the layers, or the target of a reprojection.
    pub crs: Option<C>,
    /// Where it comes from.
    pub crs_source: CrsSource,
    pub(crate) metric: Metric,
    /// The geometries in the order of reading, if they were requested.
    pub geometries: Option<Geometries>,
    /// The number of features of each layer read, by the number of the layer.
    pub features: BTreeMap<usize, u64>,
    /// What is not in the data, of a map that is read with its faults.
    pub left_out: LeftOut,
}

impl<C: Crs> Survey<C> {
    /// Returns metres on the ground at the place of a vertex.
    ///
    /// # Errors
    /// Fails with [`Error::NoCrs`](crate::Error::NoCrs).
    pub fn measure(&self) -> Result<&Ground> {
        self.metric.local()
    }

    /// Returns its CRS.
    pub fn crs(&self) -> Option<&dyn Crs> {
        self.crs.as_ref().map(|crs| crs as &dyn Crs)
    }

    /// Returns the map as input of the algorithm. Marks of messages have one scale for a projected
    /// map; fingerprints follow its ground.
    ///
    /// # Errors
    /// Fails with [`Error::NoCrs`](crate::Error::NoCrs).
    pub fn map(&self, parameters: &Parameters) -> Result<Map<'_>> {
        self.metric.map(&self.data, parameters)
    }
}
