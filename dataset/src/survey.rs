//! The walk over a dataset: every coordinate of every geometry of the chosen layers.

use crate::{
    CoordinateSystem, Error, Geometries, Label, Result, Shape,
    chains::Chains,
    crs::{self, reproject},
    extent::Extent,
    labels, parse_srs,
    selection::{LabelFields, Selection, TargetCrs, chosen_layers},
    shapes,
    turns::turn,
    wkb,
};
use gdal::{
    Dataset,
    vector::{Feature, Layer, LayerAccess},
};
use meshmark_core::{
    disjoint_sets::DisjointSets, ground::Ground, map::Map, scale::ScaleLattice, vertices::VertexTable,
};
use std::collections::BTreeMap;

/// A map as the mark sees it.
#[derive(Debug)]
pub struct Survey {
    /// Its distinct vertices.
    pub vertices: VertexTable,
    /// The vertices that rings and lines join, as canonical indices [a, b] with a < b, sorted, each pair once.
    pub segments: Vec<[u32; 2]>,
    /// Of every vertex the first vertex of its polygon group, the polygons that shared vertices join; itself when it is in
    /// none.
    pub polygon_roots: Vec<u32>,
    /// Its CRS: the common one of its layers, or the one it was reprojected into.
    pub crs: Option<CoordinateSystem>,
    /// Metres per unit; `None` where the map has no CRS and could be in degrees.
    ground: Option<Ground>,
    /// Metres per unit where a vertex is, when they are others.
    lattice: Option<ScaleLattice>,
    /// Attribute texts and their places.
    pub labels: Vec<Label>,
    /// Rings and lines.
    pub shapes: Vec<Shape>,
    /// The geometries in the order they were read, if they were asked for.
    pub geometries: Option<Geometries>,
    /// How many features each layer that was read has, by the layer's number in the dataset.
    pub features: BTreeMap<usize, u64>,
}

impl Survey {
    /// The same map with all its coordinates taken into another CRS by `bring`.
    ///
    /// # Errors
    /// Those of `bring`, and a CRS in which metres mean nothing.
    pub(crate) fn brought(
        &self,
        crs: &CoordinateSystem,
        bring: impl Fn(Vec<[f64; 2]>) -> Result<Vec<[f64; 2]>>,
    ) -> Result<Survey> {
        let (vertices, indices) = VertexTable::indexed(bring(self.vertices.coords().to_vec())?)?;
        let moved = |segment: &[u32; 2]| segment.map(|v| indices[v as usize]);
        let mut segments: Vec<[u32; 2]> = self
            .segments
            .iter()
            .map(moved)
            .filter(|[a, b]| a != b)
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        segments.sort_unstable();
        segments.dedup();
        let mut joined = DisjointSets::new(vertices.len());
        indices
            .iter()
            .zip(&self.polygon_roots)
            .for_each(|(&v, &first)| joined.join(v, indices[first as usize]));
        let polygon_roots = joined.roots();
        let places = bring(self.labels.iter().map(|label| label.point).collect())?;
        let in_shapes = bring(self.shapes.iter().flat_map(|shape| shape.vertices.iter().copied()).collect())?;
        let (mut labels, mut shapes) = (self.labels.clone(), self.shapes.clone());
        labels.iter_mut().zip(places).for_each(|(label, place)| label.point = place);
        let of_shapes = shapes.iter_mut().flat_map(|shape| &mut shape.vertices);
        of_shapes.zip(in_shapes).for_each(|(vertex, place)| *vertex = place);
        let ground = crs::ground(Some(crs), &vertices)?;
        let lattice = crs.lattice(&vertices, &ground);
        Ok(Survey {
            vertices,
            segments,
            polygon_roots,
            crs: Some(crs.clone()),
            ground: Some(ground),
            lattice,
            labels,
            shapes,
            geometries: None,
            features: self.features.clone(),
        })
    }

    /// Metres on the ground.
    ///
    /// # Errors
    /// [`Error::NoCrs`].
    pub fn ground(&self) -> Result<Ground> {
        self.ground.ok_or(Error::NoCrs)
    }

    /// What a map is measured with, when it is no longer needed itself.
    ///
    /// # Errors
    /// [`Error::NoCrs`].
    pub fn into_scales(self) -> Result<(Ground, Option<ScaleLattice>)> {
        Ok((self.ground()?, self.lattice))
    }

    /// The map as the algorithm sees it.
    ///
    /// # Errors
    /// [`Error::NoCrs`].
    pub fn map(&self) -> Result<Map<'_>> {
        let Survey { vertices, segments, polygon_roots, .. } = self;
        let lattice = self.lattice.as_ref();
        Ok(Map { vertices, segments, polygon_roots, ground: self.ground()?, lattice })
    }
}

/// Reads the vertices, the CRS and the labels of a dataset.
///
/// # Errors
/// A layer that does not exist or cannot be read to its end, layers of different CRS, coordinates
/// that are not finite, a CRS in which metres mean nothing.
pub fn survey(dataset: &Dataset, selection: &Selection) -> Result<Survey> {
    let chosen = chosen_layers(dataset, selection.layers)?;
    let mut walk =
        Walk { selection, crs: None, chains: Chains::default(), labels: Vec::new(), shapes: Vec::new() };
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
    let (vertices, indices) = VertexTable::indexed(std::mem::take(&mut chains.coords))?;
    let segments = chains.segments(&indices);
    let polygon_roots = chains.polygon_roots(&indices, vertices.len());
    let ground = match crs::ground(crs.as_ref(), &vertices) {
        Ok(ground) => Some(ground),
        Err(Error::NoCrs) => None,
        Err(other) => return Err(other),
    };
    let lattice = crs.as_ref().zip(ground.as_ref()).and_then(|(crs, ground)| crs.lattice(&vertices, ground));
    let geometries = selection.geometries.then(|| Geometries::new(indices, chains));
    let (labels, shapes) = (walk.labels, walk.shapes);
    Ok(Survey {
        vertices,
        segments,
        polygon_roots,
        crs,
        ground,
        lattice,
        labels,
        shapes,
        geometries,
        features,
    })
}

struct Walk<'a> {
    selection: &'a Selection<'a>,
    /// The first layer with vertices, and its CRS.
    crs: Option<(String, Option<CoordinateSystem>)>,
    chains: Chains,
    labels: Vec<Label>,
    shapes: Vec<Shape>,
}

impl Walk<'_> {
    /// Reads a layer; how many features it has.
    fn layer(&mut self, layer: &mut Layer, name: &str) -> Result<u64> {
        let columns = self.columns(layer)?;
        let (first_label, first_shape) = (self.labels.len(), self.shapes.len());
        let mut of_column = vec![Chains::default(); columns.len()];
        let mut features = 0;
        for feature in layer.features() {
            features += 1;
            for (column, chains) in of_column.iter_mut().enumerate() {
                let extent = match self.selection.target {
                    TargetCrs::Own => Extent::in_crs(columns[column].as_ref()),
                    TargetCrs::Crs(_) | TargetCrs::Raw => Extent::ANY, // its CRS may be another than it says
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
            let shapes = &mut self.shapes[first_shape..];
            let mut vertices: Vec<_> = shapes.iter().flat_map(|shape| &shape.vertices).copied().collect();
            reproject(&mut vertices, crs.as_ref(), target, name)?;
            let places = shapes.iter_mut().flat_map(|shape| &mut shape.vertices);
            places.zip(vertices).for_each(|(place, vertex)| *place = vertex);
        }
        Ok(features)
    }

    /// Labels and shapes of a feature. Curves have no counterpart in geo and give none.
    fn describe(&mut self, feature: &Feature) {
        if matches!(self.selection.labels, LabelFields::None) {
            return;
        }
        // A null geometry is an error here; `Feature::geometry` would hand out a null pointer.
        let Ok(geometry) = feature.geometry_by_index(0) else { return };
        if geometry.is_empty() {
            return;
        }
        let Ok(geometry) = geometry.to_geo() else { return };
        labels::of_feature(feature, &geometry, &self.selection.labels, &mut self.labels);
        shapes::of_geometry(&geometry, &mut self.shapes);
    }

    /// The CRS of every geometry column of a layer.
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

    /// Layers that share one mesh share one CRS.
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

/// Appends the coordinates of one geometry of a feature.
fn read_geometry(
    feature: &Feature,
    column: usize,
    layer: &str,
    (keeps_geometries, extent): (bool, Extent),
    chains: &mut Chains,
) -> Result<()> {
    let Ok(geometry) = feature.geometry_by_index(column) else { return Ok(()) }; // a null geometry
    let fid = || feature.fid().map_or("without id".into(), |fid| fid.to_string());
    let failed = |reason: String| Error::Geometry { layer: layer.into(), fid: fid(), reason };
    let mut bytes = geometry.iso_wkb().map_err(|error| failed(error.to_string()))?;
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
        Err(Visit::Wkb(error)) => Err(failed(error.to_string())),
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
            assert_eq!(map.vertices.coords(), [[1000.0, 1.0], [2000.0, 2.0]]);
        }
    }
}
