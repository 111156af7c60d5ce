//! A map in memory, the input and output of attacks: layers, attributes and feature ids of any GDAL
//! dataset, geometries in the plane (without Z and M).

use crate::Result;
use gdal::{
    Dataset, DriverManager,
    spatial_ref::SpatialRef,
    vector::{
        self, FieldDefn, FieldValue, LayerAccess, LayerOptions, OGRFieldType, OGRwkbGeometryType, ToGdal,
    },
};
use geo::{Coord, CoordsIter, Geometry, MapCoords};
use meshmark_core::vertices::VertexTable;
use std::{cell::RefCell, convert::Infallible, path::Path};

/// All layers of a dataset.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    pub layers: Vec<Layer>,
}

/// One layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    pub name: String,
    /// Well-known text of the CRS, if it is known.
    pub crs: Option<String>,
    pub geometry_type: OGRwkbGeometryType::Type,
    pub fields: Vec<Field>,
    pub features: Vec<Feature>,
}

/// A column of attributes.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub name: String,
    pub kind: OGRFieldType::Type,
}

/// One feature; `values` are in the order of the layer's fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Feature {
    pub fid: Option<u64>,
    pub values: Vec<Option<FieldValue>>,
    pub geometry: Option<Geometry>,
}

/// The column of feature ids that GDAL gives a GeoPackage.
const FID_COLUMN: &str = "fid";

impl Map {
    /// Reads all layers of a dataset.
    ///
    /// # Errors
    /// Fails with the message of GDAL, and on curves and surfaces, which plane geometries cannot
    /// hold.
    pub fn read(path: &Path) -> Result<Map> {
        let failed = |error: Box<dyn std::error::Error + Send + Sync>| format!("{}: {error}", path.display());
        let dataset = Dataset::open(path).map_err(|error| failed(error.into()))?;
        let layers = dataset.layers().map(|mut layer| read_layer(&mut layer));
        Ok(Map { layers: layers.collect::<Result<_>>().map_err(failed)? })
    }

    /// Writes a GeoPackage, with its feature ids.
    ///
    /// # Errors
    /// Fails with the message of GDAL.
    pub fn write(&self, path: &Path) -> Result<()> {
        let driver = DriverManager::get_driver_by_name("GPKG")?;
        let mut dataset = driver.create_vector_only(path)?;
        let mut transaction = dataset.start_transaction()?;
        for layer in &self.layers {
            write_layer(&mut transaction, layer)?;
        }
        transaction.commit()?;
        dataset.close()?;
        Ok(())
    }

    /// Returns all features.
    pub fn features(&self) -> impl Iterator<Item = &Feature> {
        self.layers.iter().flat_map(|layer| &layer.features)
    }

    /// Returns all geometries that there are.
    pub fn geometries(&self) -> impl Iterator<Item = &Geometry> {
        self.features().filter_map(|feature| feature.geometry.as_ref())
    }

    /// Returns every coordinate of every geometry, in the order of the file.
    pub fn coords(&self) -> impl Iterator<Item = [f64; 2]> {
        self.geometries().flat_map(coords)
    }

    /// Returns the distinct vertices.
    ///
    /// # Errors
    /// Fails on coordinates that are not finite.
    pub fn vertices(&self) -> Result<VertexTable> {
        Ok(VertexTable::new(self.coords().collect())?)
    }

    /// Returns the same map with every coordinate, in the order of [`Map::coords`], moved by `f`.
    pub fn map_coords(&self, f: impl FnMut([f64; 2]) -> [f64; 2]) -> Map {
        let f = RefCell::new(f); // geo wants a function without a state
        let moved = |c: Coord| Coord::from((f.borrow_mut())([c.x, c.y]));
        let mut map = self.clone();
        for feature in map.layers.iter_mut().flat_map(|layer| &mut layer.features) {
            feature.geometry = feature.geometry.take().map(|geometry| geometry.map_coords(moved));
        }
        map
    }

    /// Returns the same map with layers that hold geometries of all types.
    pub fn of_any_type(mut self) -> Map {
        for layer in &mut self.layers {
            layer.geometry_type = OGRwkbGeometryType::wkbUnknown;
        }
        self
    }

    /// Returns the same map with every geometry replaced; a feature whose geometry becomes `None`
    /// is dropped.
    pub fn map_geometries(&self, mut f: impl FnMut(&Geometry) -> Option<Geometry>) -> Map {
        let Ok(map) = self.try_map_geometries::<Infallible>(|geometry| Ok(f(geometry)));
        map
    }

    /// Replaces geometries like [`Map::map_geometries`] with an `f` that may fail.
    ///
    /// # Errors
    /// Returns the first error of `f`.
    pub fn try_map_geometries<E>(
        &self,
        mut f: impl FnMut(&Geometry) -> std::result::Result<Option<Geometry>, E>,
    ) -> std::result::Result<Map, E> {
        let mut map = self.clone();
        for layer in &mut map.layers {
            let mut kept = Vec::with_capacity(layer.features.len());
            for mut feature in layer.features.drain(..) {
                if let Some(geometry) = &feature.geometry {
                    let Some(replaced) = f(geometry)? else { continue };
                    feature.geometry = Some(replaced);
                }
                kept.push(feature);
            }
            layer.features = kept;
        }
        Ok(map)
    }
}

/// Returns every coordinate of a geometry, the first one of a ring also at its end.
pub fn coords(geometry: &Geometry) -> impl Iterator<Item = [f64; 2]> {
    geometry.coords_iter().map(|c| [c.x, c.y])
}

fn read_layer(layer: &mut vector::Layer) -> Result<Layer> {
    let name = layer.name();
    let fields: Vec<Field> = layer
        .defn()
        .fields()
        .map(|field| Field { name: field.name(), kind: readable(field.field_type()) })
        .collect();
    let geometry_type = vector::geometry_type_flatten(layer.defn().geometry_type());
    let crs = layer.spatial_ref().map(|crs| crs.to_wkt()).transpose()?;
    let features = layer.features().map(|feature| read_feature(&feature, &fields));
    let features = features.collect::<Result<_>>().map_err(|error| format!("layer \"{name}\": {error}"))?;
    Ok(Layer { name, crs, geometry_type, fields, features })
}

/// Returns the kind itself where the bindings read it, otherwise that of texts.
fn readable(kind: OGRFieldType::Type) -> OGRFieldType::Type {
    match kind {
        OGRFieldType::OFTTime | OGRFieldType::OFTBinary => OGRFieldType::OFTString,
        kind => kind,
    }
}

fn read_feature(feature: &vector::Feature, fields: &[Field]) -> Result<Feature> {
    let value = |(i, field): (usize, &Field)| match field.kind {
        OGRFieldType::OFTString => Ok(feature.field_as_string(i)?.map(FieldValue::StringValue)),
        // The bindings fail on dates that were never set, which KML has.
        OGRFieldType::OFTDate | OGRFieldType::OFTDateTime => Ok(feature.field(i).unwrap_or(None)),
        _ => Ok(feature.field(i)?),
    };
    let values = fields.iter().enumerate().map(value).collect::<Result<_>>()?;
    let geometry = feature.geometry().filter(|geometry| geometry.has_gdal_ptr() && !geometry.is_empty());
    let geometry = geometry.map(|geometry| {
        let mut flat = geometry.clone();
        flat.flatten_to_2d();
        flat.to_geo()
    });
    Ok(Feature { fid: feature.fid(), values, geometry: geometry.transpose()? })
}

fn write_layer(dataset: &mut Dataset, layer: &Layer) -> Result<()> {
    let crs = layer.crs.as_deref().map(SpatialRef::from_wkt).transpose()?;
    let created = dataset.create_layer(LayerOptions {
        name: &layer.name,
        srs: crs.as_ref(),
        ty: layer.geometry_type,
        options: Some(&[&format!("FID={FID_COLUMN}")]),
    })?;
    // The bindings cannot set a feature's id, but the driver takes it from a field of the column's
    // name.
    FieldDefn::new(FID_COLUMN, OGRFieldType::OFTInteger64)?.add_to_layer(&created)?;
    let is_attribute = |field: &Field| !field.name.eq_ignore_ascii_case(FID_COLUMN);
    for field in layer.fields.iter().filter(|field| is_attribute(field)) {
        FieldDefn::new(&field.name, field.kind)?.add_to_layer(&created)?;
    }
    for feature in &layer.features {
        let mut out = vector::Feature::new(created.defn())?;
        if let Some(fid) = feature.fid {
            out.set_field_integer64(0, i64::try_from(fid)?)?;
        }
        let values = layer.fields.iter().zip(&feature.values).filter(|(field, _)| is_attribute(field));
        for (i, (_, value)) in values.enumerate() {
            match value {
                Some(value) => out.set_field(i + 1, value)?,
                None => out.set_field_null(i + 1)?,
            }
        }
        if let Some(geometry) = &feature.geometry {
            out.set_geometry(geometry.to_gdal()?)?;
        }
        out.create(&created)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory};

    #[test]
    fn a_map_reads_back_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("copy.gpkg");
        let map = fixture("helsinki.gpkg");
        map.write(&path).unwrap();
        assert_eq!(Map::read(&path).unwrap(), map);
    }

    #[test]
    fn feature_ids_with_gaps_and_null_values_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("gaps.gpkg");
        let mut map = in_memory(&["POINT (1 2)", "LINESTRING (0 0,1 1)"]);
        map.layers[0].features[0].fid = Some(7);
        map.layers[0].features[1].fid = Some(3);
        map.layers[0].features[1].values[0] = None;
        map.write(&path).unwrap();
        let read = Map::read(&path).unwrap();
        let mut fids: Vec<_> = read.features().map(|f| (f.fid, f.values[0].is_none())).collect();
        fids.sort();
        assert_eq!(fids, [(Some(3), true), (Some(7), false)]);
    }
}
