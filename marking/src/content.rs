//! The content of a map in the order of reading, and the map that it becomes.

use crate::{
    Chains, Crs, CrsSource, Error, Extent, Geometries, LeftOut, Metric, Result, TransformableCrs, labels,
    left_out::{MISSING, is_there},
    polylines, reproject,
    survey::Survey,
};
use geo::Geometry;
use meshmark_core::{
    areas::Areas,
    map_data::{Label, MapData, Polyline},
};
use std::{collections::BTreeMap, ops::Range};

/// Coordinates of which more than this share has no place in a CRS are in another one.
const MOST_LOST: f64 = 0.1;

/// What was read of a map so far.
#[derive(Debug, Clone)]
pub struct Content<C> {
    /// The coordinates.
    pub chains: Chains,
    /// The number of features of each layer read, by the number of the layer.
    pub features: BTreeMap<usize, u64>,
    /// What is not in the chains, of a map that is read with its faults.
    pub left_out: LeftOut,
    labels: Vec<Label>,
    polylines: Vec<Polyline>,
    /// Whether polygons are kept feature by feature.
    keeps_areas: bool,
    columns: Vec<Column<C>>,
}

/// A geometry column of a layer. The labels and polylines of a layer belong to its first column.
#[derive(Debug, Clone)]
struct Column<C> {
    layer: String,
    crs: Option<C>,
    coords: Range<usize>,
    labels: Range<usize>,
    polylines: Range<usize>,
}

impl<C: Crs + Clone> Content<C> {
    /// Creates the content before the first layer. Areas are needed where labels are.
    pub fn new(keeps_areas: bool) -> Self {
        Content {
            chains: Chains::default(),
            features: BTreeMap::new(),
            left_out: LeftOut::default(),
            labels: Vec::new(),
            polylines: Vec::new(),
            keeps_areas,
            columns: Vec::new(),
        }
    }

    /// Adds the labels, for these attribute texts, and the polylines of a feature.
    pub fn describe(&mut self, values: Vec<String>, geometry: &Geometry) {
        labels::append(values, geometry, &mut self.labels);
        polylines::append(geometry, &mut self.polylines);
    }

    /// Adds a layer of which all features are described: its geometry columns, each with its CRS.
    pub fn end_layer(&mut self, layer: &str, columns: impl IntoIterator<Item = (Option<C>, Chains)>) {
        let last = self.columns.last();
        let mut described = last.map_or((0, 0), |last| (last.labels.end, last.polylines.end));
        for (crs, mut chains) in columns {
            let start = self.chains.coords.len();
            self.chains.append(&mut chains);
            self.columns.push(Column {
                layer: layer.into(),
                crs,
                coords: start..self.chains.coords.len(),
                labels: described.0..self.labels.len(),
                polylines: described.1..self.polylines.len(),
            });
            described = (self.labels.len(), self.polylines.len());
        }
    }

    /// Returns the map, which is in this CRS.
    ///
    /// # Errors
    /// Fails on too many coordinates, and on a CRS without a metric.
    pub fn survey(self, crs: Option<C>, keeps_geometries: bool) -> Result<Survey<C>> {
        let Content { mut chains, mut labels, mut polylines, features, left_out, keeps_areas, .. } = self;
        chains.close_up();
        labels.retain(|label| is_there(&label.point));
        polylines.retain(|line| line.vertices.iter().all(is_there));
        let coords = std::mem::take(&mut chains.coords);
        let (data, indices) = MapData::from_chains(coords, &chains.starts, chains.chain_kinds())?;
        let areas = match keeps_areas {
            true => Areas::new(&indices, &chains.starts, chains.chain_kinds(), &chains.firsts),
            false => Areas::default(),
        };
        let data = MapData { areas, labels, polylines, ..data };
        let metric = Metric::measure(crs.as_ref().map(|crs| crs as &dyn Crs), &data.vertices)?;
        let geometries = keeps_geometries.then(|| Geometries::new(indices, chains));
        Ok(Survey { data, crs, crs_source: CrsSource::Map, metric, geometries, features, left_out })
    }

    /// Returns the numbers, without labels and polylines at places that no CRS can mean.
    pub fn into_numbers(mut self) -> Numbers<C> {
        let points = self.labels.iter_mut().map(|label| &mut label.point);
        let points = points.chain(self.polylines.iter_mut().flat_map(|line| &mut line.vertices));
        points.filter(|point| !Extent::ANY.holds(point)).for_each(|point| *point = MISSING);
        Numbers(self)
    }
}

/// The numbers of a map before they are brought into one CRS.
#[derive(Debug, Clone)]
pub struct Numbers<C>(Content<C>);

impl<C: TransformableCrs> Numbers<C> {
    /// Returns the map in this CRS; layers without a CRS are assumed to be in it. Coordinates
    /// without a place there are left out.
    ///
    /// # Errors
    /// Fails where most coordinates cannot be reprojected, and on a CRS without a metric.
    pub fn in_crs(&self, target: &C) -> Result<Survey<C>> {
        self.brought(target, None)
    }

    /// Returns the map in the CRS `target` as [`Numbers::in_crs`] does, with all numbers in another
    /// CRS than the layers have, whose axes may be swapped.
    ///
    /// # Errors
    /// Returns the errors of [`Numbers::in_crs`].
    pub fn assumed(&self, assumed: (&C, bool), target: &C) -> Result<Survey<C>> {
        self.brought(target, Some(assumed))
    }

    fn brought(&self, target: &C, assumed: Option<(&C, bool)>) -> Result<Survey<C>> {
        let mut found = self.0.clone();
        for Column { layer, crs, coords, labels, polylines } in &self.0.columns {
            let crs = assumed.map(|(crs, _)| crs).or(crs.as_ref());
            let bring = |points: &mut [[f64; 2]]| {
                if assumed.is_some_and(|(_, axes_swapped)| axes_swapped) {
                    points.iter_mut().for_each(|point| point.swap(0, 1));
                }
                reproject(points, crs, target, layer)
            };
            let lost = bring(&mut found.chains.coords[coords.clone()])?;
            let crs = || crs.unwrap_or(target).brief_name();
            if lost.len() as f64 > MOST_LOST * coords.len() as f64 {
                return Err(Error::FewPlaces { layer: layer.clone(), crs: crs() });
            }
            for point in lost {
                found
                    .left_out
                    .coordinate(|| format!("layer \"{layer}\": {point:?} is no place in {}", crs()));
            }
            let labels = &mut found.labels[labels.clone()];
            let mut points: Vec<[f64; 2]> = labels.iter().map(|label| label.point).collect();
            bring(&mut points)?;
            labels.iter_mut().zip(points).for_each(|(label, point)| label.point = point);
            let polylines = &mut found.polylines[polylines.clone()];
            let mut vertices: Vec<_> = polylines.iter().flat_map(|line| &line.vertices).copied().collect();
            bring(&mut vertices)?;
            let places = polylines.iter_mut().flat_map(|line| &mut line.vertices);
            places.zip(vertices).for_each(|(place, vertex)| *place = vertex);
        }
        found.survey(Some(target.clone()), false)
    }

    /// Returns the map with its numbers unchanged and without a CRS.
    ///
    /// # Errors
    /// Fails on too many coordinates.
    pub fn raw(self) -> Result<Survey<C>> {
        self.0.survey(None, false)
    }
}
