//! The walk over a dataset: every coordinate of every geometry of the chosen layers.

use crate::{
    CoordinateSystem, Error, Geometries, Result,
    chains::{Chains, read_geometry},
    crs::{self, reproject},
    extent::Extent,
    labels, parse_srs, polylines,
    selection::{LabelFields, Selection, TargetCrs, chosen_layers},
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
    scale::ScaleLattice,
};
use std::collections::BTreeMap;

/// A map as marking and verification read it.
#[derive(Debug)]
pub struct Survey {
    /// The data of the map.
    pub data: MapData,
    /// The CRS: the common one of the layers, or the target of a reprojection.
    pub crs: Option<CoordinateSystem>,
    /// Metres per unit; `None` where the map has no CRS and its units may be degrees.
    ground: Option<Ground>,
    /// Metres per unit at the place of a vertex, where they vary.
    lattice: Option<ScaleLattice>,
    /// The geometries in the order of reading, if they were requested.
    pub geometries: Option<Geometries>,
    /// The number of features of each layer read, by the number of the layer in the dataset.
    pub features: BTreeMap<usize, u64>,
}

impl Survey {
    /// Returns the same map with all coordinates transformed into another CRS by `bring`.
    ///
    /// # Errors
    /// Returns the errors of `bring`, and fails on a CRS without a metric.
    pub(crate) fn brought(
        &self,
        crs: &CoordinateSystem,
        bring: impl Fn(Vec<[f64; 2]>) -> Result<Vec<[f64; 2]>>,
    ) -> Result<Survey> {
        let data = self.data.moved(bring)?;
        let ground = crs::ground(Some(crs), &data.vertices)?;
        let lattice = crs.lattice(&data.vertices, &ground);
        let (crs, ground, features) = (Some(crs.clone()), Some(ground), self.features.clone());
        Ok(Survey { data, crs, ground, lattice, geometries: None, features })
    }

    /// Returns the ground metric.
    ///
    /// # Errors
    /// Fails with [`Error::NoCrs`].
    pub fn ground(&self) -> Result<Ground> {
        self.ground.ok_or(Error::NoCrs)
    }

    /// Returns the metric of a map whose data are no longer needed.
    ///
    /// # Errors
    /// Fails with [`Error::NoCrs`].
    pub fn into_scales(self) -> Result<(Ground, Option<ScaleLattice>)> {
        Ok((self.ground()?, self.lattice))
    }

    /// Returns the map as input of the algorithm.
    ///
    /// # Errors
    /// Fails with [`Error::NoCrs`].
    pub fn map(&self) -> Result<Map<'_>> {
        Ok(self.data.on(self.ground()?, self.lattice.as_ref()))
    }
}

/// Reads the vertices, the CRS and the labels of a dataset.
///
/// # Errors
/// Fails on a layer that does not exist or cannot be read to its end, layers of different CRS,
/// coordinates that are not finite, and a CRS without a metric.
pub fn survey(dataset: &Dataset, selection: &Selection) -> Result<Survey> {
    let chosen = chosen_layers(dataset, selection.layers)?;
    let mut walk =
        Walk { selection, crs: None, chains: Chains::default(), labels: Vec::new(), polylines: Vec::new() };
    let mut features = BTreeMap::new();
    for (index, name) in &chosen {
        let _turn = turn(dataset, name)?;
        features.insert(*index, walk.layer(&mut dataset.layer(*index)?, name)?);
    }
    let crs = match selection.target {
        TargetCrs::Crs(target) => Some(target.clone()),
        TargetCrs::Own | TargetCrs::Raw => walk.crs.and_then(|(_, crs)| crs),
    };
    let mut chains = walk.chains;
    let coords = std::mem::take(&mut chains.coords);
    let (data, indices) = MapData::from_chains(coords, &chains.starts, chains.chain_kinds())?;
    let areas = match selection.labels {
        LabelFields::None => Areas::default(),
        LabelFields::All | LabelFields::Named(_) => {
            Areas::new(&indices, &chains.starts, chains.chain_kinds(), &chains.firsts)
        }
    };
    let data = MapData { areas, labels: walk.labels, polylines: walk.polylines, ..data };
    let ground = match crs::ground(crs.as_ref(), &data.vertices) {
        Ok(ground) => Some(ground),
        Err(Error::NoCrs) => None,
        Err(other) => return Err(other),
    };
    let lattice =
        crs.as_ref().zip(ground.as_ref()).and_then(|(crs, ground)| crs.lattice(&data.vertices, ground));
    let geometries = selection.geometries.then(|| Geometries::new(indices, chains));
    Ok(Survey { data, crs, ground, lattice, geometries, features })
}

struct Walk<'a> {
    selection: &'a Selection<'a>,
    /// The first layer with vertices, and its CRS.
    crs: Option<(String, Option<CoordinateSystem>)>,
    chains: Chains,
    labels: Vec<Label>,
    polylines: Vec<Polyline>,
}

impl Walk<'_> {
    /// Reads a layer and returns its number of features.
    fn layer(&mut self, layer: &mut Layer, name: &str) -> Result<u64> {
        let columns = self.columns(layer)?;
        let (first_label, first_polyline) = (self.labels.len(), self.polylines.len());
        let mut of_column = vec![Chains::default(); columns.len()];
        let mut features = 0;
        for feature in layer.features() {
            features += 1;
            for (column, chains) in of_column.iter_mut().enumerate() {
                let extent = match self.selection.target {
                    TargetCrs::Own => Extent::in_crs(columns[column].as_ref()),
                    TargetCrs::Crs(_) | TargetCrs::Raw => Extent::ANY, // its true CRS may differ
                };
                read_geometry(&feature, column, name, (self.selection.geometries, extent), chains)?;
            }
            let vertices =
                self.chains.coords.len() + of_column.iter().map(|chains| chains.coords.len()).sum::<usize>();
            if vertices > self.selection.most_vertices {
                return Err(Error::TooLarge { most: self.selection.most_vertices });
            }
            self.describe(&feature);
        }
        if let Some(reason) = (self.selection.last_failure)() {
            return Err(Error::Unreadable { layer: name.into(), reason });
        }
        for (crs, chains) in columns.iter().zip(&mut of_column) {
            match self.selection.target {
                TargetCrs::Crs(target) => reproject(&mut chains.coords, crs.as_ref(), target, name)?,
                TargetCrs::Own if !chains.coords.is_empty() => self.check_crs(name, crs)?,
                TargetCrs::Own | TargetCrs::Raw => {}
            }
            self.chains.append(chains);
        }
        if let (TargetCrs::Crs(target), Some(crs)) = (self.selection.target, columns.first()) {
            let labels = &mut self.labels[first_label..];
            let mut points: Vec<[f64; 2]> = labels.iter().map(|label| label.point).collect();
            reproject(&mut points, crs.as_ref(), target, name)?;
            labels.iter_mut().zip(points).for_each(|(label, point)| label.point = point);
            let polylines = &mut self.polylines[first_polyline..];
            let mut vertices: Vec<_> = polylines.iter().flat_map(|line| &line.vertices).copied().collect();
            reproject(&mut vertices, crs.as_ref(), target, name)?;
            let places = polylines.iter_mut().flat_map(|line| &mut line.vertices);
            places.zip(vertices).for_each(|(place, vertex)| *place = vertex);
        }
        Ok(features)
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
        labels::of_feature(feature, &geometry, &self.selection.labels, &mut self.labels);
        polylines::of_geometry(&geometry, &mut self.polylines);
    }

    /// Returns the CRS of every geometry column of a layer.
    fn columns(&self, layer: &Layer) -> Result<Vec<Option<CoordinateSystem>>> {
        let given = self.selection.srs.map(parse_srs).transpose()?;
        let crs = |own: Option<CoordinateSystem>| match (own, &given) {
            (Some(own), Some(given)) if !own.is_same(given) => {
                let [crs, srs] = own.names_apart(given);
                Err(Error::ContradictingSrs { crs, srs })
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
        Err(Error::MixedCrs { first: first.clone(), first_crs, second: layer.into(), second_crs })
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
}
