//! The walk over a dataset: every coordinate of every geometry of the chosen layers.

use crate::{
    CoordinateSystem, Error, Result,
    crs::{as_crs, reproject},
    labels, parse_srs, polylines,
    read_geometry::read_geometry,
    selection::{LabelFields, Selection, chosen_layers},
    turns::turn,
};
use gdal::{
    Dataset,
    vector::{Feature, Layer, LayerAccess},
};
use meshmark_core::{
    areas::Areas,
    ground::Ground,
    map::Map,
    map_data::{Label, MapData, Polyline},
    options::Parameters,
};
use meshmark_marking::{
    self as marking, Chains, Crs, Extent, Faults, Geometries, LeftOut, Metric,
    left_out::{MISSING, is_there},
};
use std::{collections::BTreeMap, ops::Range};

/// Coordinates of which more than this share has no place in a CRS are in another one.
const MOST_LOST: f64 = 0.1;

/// A map as marking and verification read it.
#[derive(Debug, Clone)]
pub struct Survey {
    /// The data of the map.
    pub data: MapData,
    /// The CRS: the common one of the layers, or the target of a reprojection.
    pub crs: Option<CoordinateSystem>,
    metric: Metric,
    /// The geometries in the order of reading, if they were requested.
    pub geometries: Option<Geometries>,
    /// The number of features of each layer read, by the number of the layer in the dataset.
    pub features: BTreeMap<usize, u64>,
    /// What is not in the data, of a map that is read with its faults.
    pub left_out: LeftOut,
}

impl Survey {
    /// Returns metres on the ground at the place of a vertex.
    ///
    /// # Errors
    /// Fails with [`marking::Error::NoCrs`].
    pub fn measure(&self) -> Result<&Ground> {
        Ok(self.metric.local()?)
    }

    /// Returns its CRS as marking takes it.
    pub fn crs(&self) -> Option<&dyn Crs> {
        as_crs(&self.crs)
    }

    /// Returns the map as input of the algorithm. Marks of messages have one scale for a projected
    /// map; fingerprints follow its ground.
    ///
    /// # Errors
    /// Fails with [`marking::Error::NoCrs`].
    pub fn map(&self, parameters: &Parameters) -> Result<Map<'_>> {
        Ok(self.metric.map(&self.data, parameters)?)
    }
}

/// Reads the vertices, the CRS and the labels of a dataset whose layers share one CRS.
///
/// # Errors
/// Fails on a layer that does not exist or cannot be read to its end, layers of different CRS,
/// coordinates that are not finite, and a CRS without a metric.
pub fn survey(dataset: &Dataset, selection: &Selection) -> Result<Survey> {
    let Walk { found, crs, .. } = Walk::over(dataset, selection, true)?;
    found.survey(crs.and_then(|(_, crs)| crs), selection.geometries)
}

/// Reads the vertices and the labels of a dataset, whose layers may be in any CRS. Coordinates that
/// no CRS can mean and features that cannot be read are left out.
///
/// # Errors
/// Fails on a layer that does not exist or cannot be read to its end.
pub fn numbers(dataset: &Dataset, selection: &Selection) -> Result<Numbers> {
    let Walk { mut found, parts, .. } = Walk::over(dataset, selection, false)?;
    let points = found.labels.iter_mut().map(|label| &mut label.point);
    let points = points.chain(found.polylines.iter_mut().flat_map(|line| &mut line.vertices));
    points.filter(|point| !Extent::ANY.holds(point)).for_each(|point| *point = MISSING);
    Ok(Numbers { found, parts })
}

/// The numbers of a dataset before they are brought into one CRS.
#[derive(Clone)]
pub struct Numbers {
    found: Found,
    parts: Vec<Part>,
}

impl Numbers {
    /// Returns the map in this CRS; layers without a CRS are assumed to be in it. Coordinates
    /// without a place there are left out.
    ///
    /// # Errors
    /// Fails where most coordinates cannot be reprojected, and on a CRS without a metric.
    pub fn in_crs(&self, target: &CoordinateSystem) -> Result<Survey> {
        self.brought(target, None)
    }

    /// Returns the map in the CRS `target` as [`Numbers::in_crs`] does, with all numbers in another
    /// CRS than the layers have, whose axes may be swapped.
    ///
    /// # Errors
    /// Returns the errors of [`Numbers::in_crs`].
    pub fn assumed(
        &self,
        (crs, axes_swapped): (&CoordinateSystem, bool),
        target: &CoordinateSystem,
    ) -> Result<Survey> {
        self.brought(target, Some((crs, axes_swapped)))
    }

    fn brought(
        &self,
        target: &CoordinateSystem,
        assumed: Option<(&CoordinateSystem, bool)>,
    ) -> Result<Survey> {
        let mut found = self.found.clone();
        for Part { layer, crs, coords, labels, polylines } in &self.parts {
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
    pub fn raw(self) -> Result<Survey> {
        self.found.survey(None, false)
    }
}

/// A geometry column of a layer. The labels and polylines of a layer belong to its first column.
#[derive(Clone)]
struct Part {
    layer: String,
    crs: Option<CoordinateSystem>,
    coords: Range<usize>,
    labels: Range<usize>,
    polylines: Range<usize>,
}

/// The content of a dataset in the order of reading.
#[derive(Clone, Default)]
struct Found {
    chains: Chains,
    labels: Vec<Label>,
    polylines: Vec<Polyline>,
    features: BTreeMap<usize, u64>,
    left_out: LeftOut,
    /// Whether polygons are kept feature by feature.
    keeps_areas: bool,
}

impl Found {
    fn survey(self, crs: Option<CoordinateSystem>, keeps_geometries: bool) -> Result<Survey> {
        let Found { mut chains, mut labels, mut polylines, features, left_out, keeps_areas } = self;
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
        let metric = Metric::measure(as_crs(&crs), &data.vertices)?;
        let geometries = keeps_geometries.then(|| Geometries::new(indices, chains));
        Ok(Survey { data, crs, metric, geometries, features, left_out })
    }
}

struct Walk<'a> {
    selection: &'a Selection<'a>,
    /// Whether the layers must share one CRS, and their coordinates lie in its extent.
    in_one_crs: bool,
    /// The first layer with vertices, and its CRS.
    crs: Option<(String, Option<CoordinateSystem>)>,
    found: Found,
    parts: Vec<Part>,
}

impl<'a> Walk<'a> {
    fn over(dataset: &Dataset, selection: &'a Selection<'a>, in_one_crs: bool) -> Result<Self> {
        let keeps_areas = !matches!(selection.labels, LabelFields::None);
        let found = Found { keeps_areas, ..Found::default() };
        let mut walk = Walk { selection, in_one_crs, crs: None, found, parts: Vec::new() };
        for (index, name) in &chosen_layers(dataset, selection.layers)? {
            let _turn = turn(dataset, name)?;
            let features = walk.layer(&mut dataset.layer(*index)?, name)?;
            walk.found.features.insert(*index, features);
        }
        Ok(walk)
    }

    /// Reads a layer and returns its number of features.
    fn layer(&mut self, layer: &mut Layer, name: &str) -> Result<u64> {
        let columns = self.columns(layer)?;
        let (mut first_label, mut first_polyline) = (self.found.labels.len(), self.found.polylines.len());
        let mut of_column = vec![Chains::default(); columns.len()];
        let mut features = 0;
        for feature in layer.features() {
            features += 1;
            for (column, chains) in of_column.iter_mut().enumerate() {
                let extent = match self.in_one_crs {
                    true => Extent::in_crs(as_crs(&columns[column])),
                    false => Extent::ANY, // its true CRS may differ
                };
                let faults = match self.in_one_crs {
                    true => Faults::Fail,
                    false => Faults::LeaveOut(&mut self.found.left_out),
                };
                read_geometry(&feature, column, name, (self.selection.geometries, extent), faults, chains)?;
            }
            let vertices = self.found.chains.coords.len()
                + of_column.iter().map(|chains| chains.coords.len()).sum::<usize>();
            if vertices > self.selection.most_vertices {
                return Err(marking::Error::TooLarge { most: self.selection.most_vertices }.into());
            }
            self.describe(&feature);
            if !self.in_one_crs {
                self.leave_out(&feature, name);
            }
        }
        if let Some(reason) = (self.selection.last_failure)() {
            return Err(Error::Unreadable { layer: name.into(), reason });
        }
        for (crs, mut chains) in columns.into_iter().zip(of_column) {
            if self.in_one_crs && !chains.coords.is_empty() {
                self.check_crs(name, &crs)?;
            }
            let start = self.found.chains.coords.len();
            self.found.chains.append(&mut chains);
            self.parts.push(Part {
                layer: name.into(),
                crs,
                coords: start..self.found.chains.coords.len(),
                labels: first_label..self.found.labels.len(),
                polylines: first_polyline..self.found.polylines.len(),
            });
            (first_label, first_polyline) = (self.found.labels.len(), self.found.polylines.len());
        }
        Ok(features)
    }

    /// Leaves out what GDAL could not read of a feature.
    fn leave_out(&mut self, feature: &Feature, layer: &str) {
        let Some(reason) = (self.selection.last_failure)() else { return };
        let fid = feature.fid().map_or("without id".into(), |fid| fid.to_string());
        self.found.left_out.feature(|| format!("layer \"{layer}\", feature {fid}: {reason}"));
    }

    /// Adds labels and polylines of a feature. Curves have no counterpart in geo and add none.
    fn describe(&mut self, feature: &Feature) {
        if matches!(self.selection.labels, LabelFields::None) {
            return;
        }
        // A null geometry is an error here; `Feature::geometry` would return a null pointer.
        let Ok(geometry) = feature.geometry_by_index(0) else { return };
        if geometry.is_empty() {
            return;
        }
        let Ok(geometry) = geometry.to_geo() else { return };
        labels::of_feature(feature, &geometry, &self.selection.labels, &mut self.found.labels);
        polylines::of_geometry(&geometry, &mut self.found.polylines);
    }

    /// Returns the CRS of every geometry column of a layer.
    fn columns(&self, layer: &Layer) -> Result<Vec<Option<CoordinateSystem>>> {
        let given = self.selection.srs.map(parse_srs).transpose()?;
        let crs = |own: Option<CoordinateSystem>| match (own, &given) {
            (Some(own), Some(given)) if !own.is_same(given) => {
                let [crs, srs] = own.names_apart(given);
                Err(marking::Error::ContradictingSrs { crs, srs }.into())
            }
            (Some(own), _) => Ok(Some(own)),
            (None, given) => Ok(given.clone()),
        };
        let fields = layer.defn().geom_fields();
        fields.map(|field| crs(field.spatial_ref().ok().and_then(CoordinateSystem::of_layer))).collect()
    }

    /// Checks that the layers, which share one mesh, share one CRS.
    fn check_crs(&mut self, layer: &str, crs: &Option<CoordinateSystem>) -> Result<()> {
        let Some((first, first_crs)) = &self.crs else {
            self.crs = Some((layer.into(), crs.clone()));
            return Ok(());
        };
        let same = match (first_crs, crs) {
            (Some(a), Some(b)) => a.is_same(b),
            (None, None) => true,
            _ => false,
        };
        if same {
            return Ok(());
        }
        let name = |crs: &Option<CoordinateSystem>| crs.as_ref().map_or("no CRS".into(), |c| c.brief_name());
        let [first_crs, second_crs] = match (first_crs, crs) {
            (Some(a), Some(b)) => a.names_apart(b),
            _ => [name(first_crs), name(crs)],
        };
        let first = first.clone();
        Err(marking::Error::MixedCrs { first, first_crs, second: layer.into(), second_crs }.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gdal::{
        DriverManager,
        vector::{Geometry, LayerOptions, OGRwkbGeometryType},
    };

    #[test]
    fn two_layers_of_one_name_are_both_read() {
        let mut dataset =
            DriverManager::get_driver_by_name("Memory").unwrap().create_vector_only("").unwrap();
        for place in ["POINT (1000 1)", "POINT (2000 2)"] {
            let ty = OGRwkbGeometryType::wkbPoint;
            let options = LayerOptions { name: "roads", ty, ..Default::default() };
            let mut layer = dataset.create_layer(options).unwrap();
            layer.create_feature(Geometry::from_wkt(place).unwrap()).unwrap();
        }
        let layers = ["roads".to_string()];
        for layers in [None, Some(&layers[..])] {
            let selection = Selection { layers, most_vertices: 10, ..Selection::default() };
            let map = survey(&dataset, &selection).unwrap();
            assert_eq!(map.data.vertices.coords(), [[1000.0, 1.0], [2000.0, 2.0]]);
        }
    }

    #[test]
    fn every_layer_is_brought_from_its_own_crs_and_the_numbers_stay() {
        let mut dataset =
            DriverManager::get_driver_by_name("Memory").unwrap().create_vector_only("").unwrap();
        for (epsg, place) in [(4326, "POINT (10 50)"), (3857, "POINT (1113194.9079 6446275.8410)")] {
            let srs = gdal::spatial_ref::SpatialRef::from_epsg(epsg).unwrap();
            let ty = OGRwkbGeometryType::wkbPoint;
            let options = LayerOptions { name: "places", ty, srs: Some(&srs), ..Default::default() };
            let mut layer = dataset.create_layer(options).unwrap();
            layer.create_feature(Geometry::from_wkt(place).unwrap()).unwrap();
        }
        assert!(survey(&dataset, &Selection::default()).is_err(), "the layers share no CRS");
        let numbers = numbers(&dataset, &Selection::default()).unwrap();
        let map = numbers.in_crs(&parse_srs("EPSG:3857").unwrap()).unwrap();
        let [a, b] = map.data.vertices.coords() else { panic!("{:?}", map.data.vertices.coords()) };
        assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3, "{a:?} {b:?}");
        let raw = numbers.raw().unwrap();
        assert_eq!(raw.data.vertices.coords(), [[10.0, 50.0], [1113194.9079, 6446275.841]]);
        assert!(raw.crs.is_none());
    }
}
