//! The walk over a dataset: every coordinate of every geometry of the chosen layers.

use crate::{CoordinateSystem, Error, Label, Result, Shape, crs, labels, parse_srs, shapes, wkb};
use gdal::{
    Dataset,
    vector::{Feature, Layer, LayerAccess},
};
use meshmark_core::{ground::Ground, vertices::VertexTable};

/// Which attributes become labels. With labels come shapes: both are for registration.
#[derive(Debug, Clone, Copy)]
pub enum LabelFields<'a> {
    /// None, and no shapes: only the vertices are wanted.
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
pub enum Target<'a> {
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
    pub target: Target<'a>,
    /// Refuse a map of more vertices, duplicates included.
    pub most_vertices: usize,
    /// What GDAL's last failure was, if there was one since the walk began: drivers end a layer early on a
    /// read error, and only the process's error handler tells that from its end.
    pub last_failure: &'a dyn Fn() -> Option<String>,
}

/// A map as the mark sees it.
#[derive(Debug)]
pub struct Survey {
    /// Its distinct vertices.
    pub vertices: VertexTable,
    /// Its CRS: the common one of its layers, or the one it was reprojected into.
    pub crs: Option<CoordinateSystem>,
    /// Metres per unit; `None` where the map has no CRS and could be in degrees.
    ground: Option<Ground>,
    /// Attribute texts and their places.
    pub labels: Vec<Label>,
    /// Rings and lines.
    pub shapes: Vec<Shape>,
}

impl Survey {
    /// Metres on the ground.
    ///
    /// # Errors
    /// [`Error::NoCrs`].
    pub fn ground(&self) -> Result<Ground> {
        self.ground.ok_or(Error::NoCrs)
    }
}

/// Reads the vertices, the CRS and the labels of a dataset.
///
/// # Errors
/// A layer that does not exist or cannot be read to its end, layers of different CRS, coordinates
/// that are not finite, a CRS in which metres mean nothing.
pub fn survey(dataset: &Dataset, selection: &Selection) -> Result<Survey> {
    let names = layer_names(dataset, selection.layers)?;
    let mut walk = Walk { selection, crs: None, coords: Vec::new(), labels: Vec::new(), shapes: Vec::new() };
    for name in &names {
        walk.layer(&mut dataset.layer_by_name(name)?, name)?;
    }
    let crs = match selection.target {
        Target::Crs(target) => Some(target.clone()),
        Target::Own | Target::Raw => walk.crs.and_then(|(_, crs)| crs),
    };
    let vertices = VertexTable::new(walk.coords)?;
    let ground = match crs::ground(crs.as_ref(), &vertices) {
        Ok(ground) => Some(ground),
        Err(Error::NoCrs) => None,
        Err(other) => return Err(other),
    };
    Ok(Survey { vertices, crs, ground, labels: walk.labels, shapes: walk.shapes })
}

/// The names of the chosen layers, in the dataset's order.
fn layer_names(dataset: &Dataset, wanted: Option<&[String]>) -> Result<Vec<String>> {
    let known: Vec<String> = dataset.layers().map(|layer| layer.name()).collect();
    if known.is_empty() {
        return Err(Error::NoLayers);
    }
    let Some(wanted) = wanted else { return Ok(known) };
    match wanted.iter().find(|name| !known.contains(name)) {
        Some(name) => Err(Error::UnknownLayer { name: name.clone(), known: known.join(", ") }),
        None => Ok(known.into_iter().filter(|name| wanted.contains(name)).collect()),
    }
}

struct Walk<'a> {
    selection: &'a Selection<'a>,
    /// The first layer with vertices, and its CRS.
    crs: Option<(String, Option<CoordinateSystem>)>,
    coords: Vec<[f64; 2]>,
    labels: Vec<Label>,
    shapes: Vec<Shape>,
}

impl Walk<'_> {
    fn layer(&mut self, layer: &mut Layer, name: &str) -> Result<()> {
        let columns = self.columns(layer)?;
        let (first_label, first_shape) = (self.labels.len(), self.shapes.len());
        let mut of_column: Vec<Vec<[f64; 2]>> = vec![Vec::new(); columns.len()];
        for feature in layer.features() {
            for (column, coords) in of_column.iter_mut().enumerate() {
                read_geometry(&feature, column, name, coords)?;
            }
            let vertices = self.coords.len() + of_column.iter().map(Vec::len).sum::<usize>();
            if vertices > self.selection.most_vertices {
                return Err(Error::TooLarge { most: self.selection.most_vertices });
            }
            self.describe(&feature);
        }
        if let Some(reason) = (self.selection.last_failure)() {
            return Err(Error::Unreadable { layer: name.into(), reason });
        }
        for (crs, coords) in columns.iter().zip(&mut of_column) {
            match self.selection.target {
                Target::Crs(target) => reproject(coords, crs.as_ref(), target, name)?,
                Target::Own if !coords.is_empty() => self.check_crs(name, crs)?,
                Target::Own | Target::Raw => {}
            }
            self.coords.append(coords);
        }
        if let (Target::Crs(target), Some(crs)) = (self.selection.target, columns.first()) {
            let labels = &mut self.labels[first_label..];
            let mut points: Vec<[f64; 2]> = labels.iter().map(|label| label.point).collect();
            reproject(&mut points, crs.as_ref(), target, name)?;
            labels.iter_mut().zip(points).for_each(|(label, point)| label.point = point);
            for shape in &mut self.shapes[first_shape..] {
                reproject(&mut shape.vertices, crs.as_ref(), target, name)?;
            }
        }
        Ok(())
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
                Err(Error::ContradictingSrs { crs: own.label(), srs: given.label() })
            }
            (Some(own), _) => Ok(Some(own)),
            (None, given) => Ok(given.clone()),
        };
        let fields = layer.defn().geom_fields();
        fields.map(|field| crs(field.spatial_ref().ok().map(CoordinateSystem::new))).collect()
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
        let label = |crs: &Option<CoordinateSystem>| crs.as_ref().map_or("no CRS".into(), |c| c.label());
        if same {
            return Ok(());
        }
        Err(Error::MixedCrs {
            first: first.clone(),
            first_crs: label(first_crs),
            second: layer.into(),
            second_crs: label(crs),
        })
    }
}

/// Appends the coordinates of one geometry of a feature.
fn read_geometry(feature: &Feature, column: usize, layer: &str, coords: &mut Vec<[f64; 2]>) -> Result<()> {
    let Ok(geometry) = feature.geometry_by_index(column) else { return Ok(()) }; // a null geometry
    let fid = || feature.fid().map_or("without id".into(), |fid| fid.to_string());
    let mut visit = |[x, y]: [f64; 2]| {
        if !x.is_finite() || !y.is_finite() {
            return Err(Error::NotFinite { layer: layer.into(), fid: fid(), x, y });
        }
        coords.push([x, y]);
        Ok([x, y])
    };
    let failed = |reason: String| Error::Geometry { layer: layer.into(), fid: fid(), reason };
    let mut bytes = geometry.iso_wkb().map_err(|error| failed(error.to_string()))?;
    match wkb::map_coordinates::<Visit>(&mut bytes, &mut |point| visit(point).map_err(Visit::Ours)) {
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

/// Brings coordinates into `target`; those of a layer without a CRS are taken to be in it.
fn reproject(
    coords: &mut [[f64; 2]],
    from: Option<&CoordinateSystem>,
    target: &CoordinateSystem,
    layer: &str,
) -> Result<()> {
    let Some(from) = from.filter(|from| !from.is_same(target) && !coords.is_empty()) else { return Ok(()) };
    let failed = |error: gdal::errors::GdalError| Error::Reprojection {
        layer: layer.into(),
        reason: error.to_string(),
    };
    let (mut x, mut y): (Vec<f64>, Vec<f64>) = coords.iter().map(|p| (p[0], p[1])).unzip();
    let transform = from.transform_to(target).map_err(failed)?;
    transform.transform_coords(&mut x, &mut y, &mut []).map_err(failed)?;
    coords.iter_mut().zip(x.into_iter().zip(y)).for_each(|(p, (x, y))| *p = [x, y]);
    Ok(())
}
