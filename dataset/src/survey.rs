//! The walk over a dataset: every coordinate of every geometry of the chosen layers.

use crate::{
    CoordinateSystem, Error, Result,
    crs::as_crs,
    read_geometry::read_geometry,
    selection::{LabelFields, Selection, chosen_layers},
    turns::turn,
};
use gdal::{
    Dataset,
    vector::{Feature, FieldValue, Layer, LayerAccess},
};
use meshmark_marking::{
    self as marking, Chains, Content, Crs, CrsSource, Extent, Faults, KnownCrs, TransformableCrs,
};

/// A map that GDAL read.
pub type Survey = marking::Survey<CoordinateSystem>;

/// The numbers of a dataset before they are brought into one CRS.
pub type Numbers = marking::Numbers<CoordinateSystem>;

/// Reads the vertices, the CRS and the labels of a dataset whose layers share one CRS.
///
/// # Errors
/// Fails on a layer that does not exist or cannot be read to its end, layers of different CRS,
/// coordinates that are not finite, and a CRS without a metric.
pub fn survey(dataset: &Dataset, selection: &Selection) -> Result<Survey> {
    let Walk { found, crs, crs_source, .. } = Walk::over(dataset, selection, true)?;
    let mut survey = found.survey(crs.and_then(|(_, crs)| crs), selection.geometries)?;
    survey.crs_source = crs_source;
    Ok(survey)
}

/// Reads the vertices and the labels of a dataset, whose layers may be in any CRS. Coordinates that
/// no CRS can mean and features that cannot be read are left out.
///
/// # Errors
/// Fails on a layer that does not exist or cannot be read to its end.
pub fn numbers(dataset: &Dataset, selection: &Selection) -> Result<Numbers> {
    Ok(Walk::over(dataset, selection, false)?.found.into_numbers())
}

struct Walk<'a> {
    selection: &'a Selection<'a>,
    /// Whether the layers must share one CRS, and their coordinates lie in its extent.
    in_one_crs: bool,
    /// The first layer with vertices, and its CRS.
    crs: Option<(String, Option<CoordinateSystem>)>,
    /// Where this CRS comes from.
    crs_source: CrsSource,
    found: Content<CoordinateSystem>,
}

impl<'a> Walk<'a> {
    fn over(dataset: &Dataset, selection: &'a Selection<'a>, in_one_crs: bool) -> Result<Self> {
        let keeps_areas = !matches!(selection.labels, LabelFields::None);
        let found = Content::new(keeps_areas);
        let mut walk = Walk { selection, in_one_crs, crs: None, crs_source: CrsSource::Map, found };
        for (index, name) in &chosen_layers(dataset, selection.layers)? {
            let _turn = turn(dataset, name)?;
            let features = walk.layer(&mut dataset.layer(*index)?, name)?;
            walk.found.features.insert(*index, features);
        }
        Ok(walk)
    }

    /// Reads a layer and returns its number of features.
    fn layer(&mut self, layer: &mut Layer, name: &str) -> Result<u64> {
        let (columns, sources): (Vec<_>, Vec<_>) = self.columns(layer)?.into_iter().unzip();
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
        for ((crs, source), chains) in columns.iter().zip(sources).zip(&of_column) {
            if self.in_one_crs && !chains.coords.is_empty() {
                self.check_crs(name, crs)?;
                if self.crs_source == CrsSource::Map {
                    self.crs_source = source;
                }
            }
        }
        self.found.end_layer(name, columns.into_iter().zip(of_column));
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
        let wanted = feature.fields().filter(|(name, _)| self.selection.labels.wants(name));
        self.found.describe(wanted.filter_map(|(_, value)| text(value?)).collect(), &geometry);
    }

    /// Returns the CRS of every geometry column of a layer, and where it comes from.
    fn columns(&self, layer: &Layer) -> Result<Vec<(Option<CoordinateSystem>, CrsSource)>> {
        let known = KnownCrs::parse(self.selection.srs, self.selection.recorded_crs)?;
        let own = layer.defn().geom_fields().map(|field| field.spatial_ref().ok());
        own.map(|own| Ok(known.of_layer(own.and_then(CoordinateSystem::of_layer))?)).collect()
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

/// Returns the text of an attribute that may be a label.
fn text(value: FieldValue) -> Option<String> {
    match value {
        FieldValue::StringValue(text) => Some(text),
        FieldValue::IntegerValue(number) => Some(number.to_string()),
        FieldValue::Integer64Value(number) => Some(number.to_string()),
        _ => None,
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
        let map = numbers.in_crs(&crate::parse_srs("EPSG:3857").unwrap()).unwrap();
        let [a, b] = map.data.vertices.coords() else { panic!("{:?}", map.data.vertices.coords()) };
        assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3, "{a:?} {b:?}");
        let raw = numbers.raw().unwrap();
        assert_eq!(raw.data.vertices.coords(), [[10.0, 50.0], [1113194.9079, 6446275.841]]);
        assert!(raw.crs.is_none());
    }
}
