//! The evidence map as a GeoPackage, which appears completely or not at all.

use crate::{Cause, Error, Result};
use gdal::{
    Dataset, DriverManager,
    vector::{Feature, Geometry, Layer, LayerAccess, LayerOptions, OGRFieldType, OGRwkbGeometryType},
};
use meshmark_dataset::{CoordinateSystem, workplace::folder_of};
use meshmark_verification::report::{EvidenceMap, ExactDisplacement, FoundVertex};
use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};
use tempfile::{TempDir, TempPath};

/// A fixed time of the last change in the GeoPackage, so that equal evidence gives equal bytes.
const NO_TIME: &str = "1970-01-01T00:00:00.000Z";

/// A file that does not exist yet. Its creation checks, before a long verification, that the file
/// is writable, and leaves no file behind, as a verification may be stopped.
pub struct EvidenceMapFile {
    path: PathBuf,
}

impl EvidenceMapFile {
    /// Checks that the file can be written.
    ///
    /// # Errors
    /// Fails when the file exists, and when its folder is not writable.
    pub fn new(path: &Path) -> Result<Self> {
        let folder = folder_of(path);
        if !folder.is_dir() {
            return Err(Error::NoFolderFor { path: path.into() });
        }
        workplace(path)?;
        let target = EvidenceMapFile { path: path.into() };
        if target.path.symlink_metadata().is_ok() { Err(target.exists()) } else { Ok(target) }
    }

    /// Copies a complete map to the file.
    ///
    /// # Errors
    /// Fails when the file cannot be written, and when it exists by now.
    pub fn publish(&self, complete: &Path) -> Result<()> {
        let workplace = workplace(&self.path)?;
        let staged = workplace.path().join("map.gpkg");
        fs::copy(complete, &staged).map_err(|error| self.failed(error))?;
        let staged = TempPath::try_from_path(staged).map_err(|error| self.failed(error))?;
        staged.persist_noclobber(&self.path).map_err(|error| match error.error.kind() {
            ErrorKind::AlreadyExists => self.exists(),
            _ => self.failed(error.error),
        })
    }

    fn exists(&self) -> Error {
        Error::Exists { path: self.path.clone(), remedy: ": name another file for --evidence-map" }
    }

    fn failed(&self, source: impl Into<Cause>) -> Error {
        Error::unwritten(self.path.display(), source)
    }
}

/// Creates a private folder beside the file, for its construction.
fn workplace(path: &Path) -> Result<TempDir> {
    let workplace = tempfile::Builder::new().prefix(".meshmark-evidence-map-").tempdir_in(folder_of(path));
    workplace.map_err(|error| Error::unwritten(path.display(), error))
}

/// Writes a layer with every matched vertex and the layer `patches`. The vertices are the points of
/// `matched_vertices` or, with exact displacements, the lines of `vertex_displacements`. `crs` is that of the
/// reference.
///
/// # Errors
/// Fails when the file cannot be written.
pub fn write_evidence_map(map: &EvidenceMap, crs: Option<&CoordinateSystem>, path: &Path) -> Result<()> {
    write_layers((map, crs), path).map_err(|error| Error::unwritten(path.display(), error))
}

/// An evidence map and its CRS.
type Located<'a> = (&'a EvidenceMap, Option<&'a CoordinateSystem>);

fn write_layers((map, crs): Located, path: &Path) -> gdal::errors::Result<()> {
    gdal::config::set_thread_local_config_option("OGR_CURRENT_DATE", NO_TIME)?;
    let mut dataset = DriverManager::get_driver_by_name("GPKG")?.create_vector_only(path)?;
    match map.has_displacements {
        true => write_displacements((map, crs), &mut dataset)?,
        false => write_vertices((map, crs), &mut dataset)?,
    }
    write_patches((map, crs), &mut dataset)?;
    dataset.close()
}

fn write_vertices((map, crs): Located, dataset: &mut Dataset) -> gdal::errors::Result<()> {
    let fields = [("patch", OGRFieldType::OFTInteger), ("weight", OGRFieldType::OFTReal)];
    let (layer, rows) = (("matched_vertices", OGRwkbGeometryType::wkbPoint), map.vertices.iter());
    write_layer(dataset, crs, layer, &fields, rows, |vertex, feature| {
        feature.set_field_integer(0, vertex.patch as i32)?;
        feature.set_field_double(1, vertex.weight)?;
        point(vertex.at)
    })
}

fn write_displacements((map, crs): Located, dataset: &mut Dataset) -> gdal::errors::Result<()> {
    use OGRFieldType::{OFTInteger, OFTReal};
    let fields = [
        ("patch", OFTInteger),
        ("dx_m", OFTReal),
        ("dy_m", OFTReal),
        ("moved_m", OFTReal),
        ("weight", OFTReal),
    ];
    let displaced = |vertex: &FoundVertex| vertex.displacement.map(|displacement| (*vertex, displacement));
    let (kind, rows) = (OGRwkbGeometryType::wkbLineString, map.vertices.iter().filter_map(displaced));
    write_layer(
        dataset,
        crs,
        ("vertex_displacements", kind),
        &fields,
        rows,
        |(vertex, ExactDisplacement { to, moved_m: [dx, dy] }), feature| {
            feature.set_field_integer(0, vertex.patch as i32)?;
            for (field, value) in (1..).zip([dx, dy, dx.hypot(dy), vertex.weight]) {
                feature.set_field_double(field, value)?;
            }
            let mut line = Geometry::empty(kind)?;
            [vertex.at, to].into_iter().for_each(|[x, y]| line.add_point_2d((x, y)));
            Ok(line)
        },
    )
}

fn write_patches((map, crs): Located, dataset: &mut Dataset) -> gdal::errors::Result<()> {
    use OGRFieldType::{OFTInteger, OFTReal, OFTString};
    let fields = [
        ("patch", OFTInteger),
        ("vertices", OFTInteger),
        ("found", OFTInteger),
        ("score", OFTReal),
        ("recipient", OFTString),
    ];
    let (kind, rows) = (OGRwkbGeometryType::wkbPolygon, map.patches.iter().enumerate());
    write_layer(dataset, crs, ("patches", kind), &fields, rows, |(number, patch), feature| {
        for (field, value) in [number, patch.vertices.len(), patch.found].into_iter().enumerate() {
            feature.set_field_integer(field, value as i32)?;
        }
        if let Some(score) = patch.score {
            feature.set_field_double(3, score)?;
        }
        if let Some(recipient) = &patch.recipient {
            feature.set_field_string(4, recipient)?;
        }
        points(&patch.vertices)?.convex_hull()
    })
}

/// Writes one layer in one transaction; `fill` sets the fields of a row and returns its
/// geometry.
fn write_layer<Row>(
    dataset: &mut Dataset,
    crs: Option<&CoordinateSystem>,
    (name, ty): (&str, OGRwkbGeometryType::Type),
    fields: &[(&str, OGRFieldType::Type)],
    rows: impl Iterator<Item = Row>,
    fill: impl Fn(Row, &mut Feature) -> gdal::errors::Result<Geometry>,
) -> gdal::errors::Result<()> {
    let mut transaction = dataset.start_transaction()?;
    let srs = crs.map(CoordinateSystem::spatial_ref);
    let layer: Layer = transaction.create_layer(LayerOptions { name, srs, ty, options: None })?;
    layer.create_defn_fields(fields)?;
    for row in rows {
        let mut feature = Feature::new(layer.defn())?;
        let geometry = fill(row, &mut feature)?;
        feature.set_geometry(geometry)?;
        feature.create(&layer)?;
    }
    transaction.commit()
}

fn points(places: &[[f64; 2]]) -> gdal::errors::Result<Geometry> {
    let mut geometry = Geometry::empty(OGRwkbGeometryType::wkbMultiPoint)?;
    for place in places {
        geometry.add_geometry(point(*place)?)?;
    }
    Ok(geometry)
}

fn point([x, y]: [f64; 2]) -> gdal::errors::Result<Geometry> {
    let mut point = Geometry::empty(OGRwkbGeometryType::wkbPoint)?;
    point.add_point_2d((x, y));
    Ok(point)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_left_where_a_verification_is_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let _target = EvidenceMapFile::new(&folder.path().join("map.gpkg")).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
