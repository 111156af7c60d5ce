//! The evidence for a verdict as a map: the places of matched vertices, and the score of each
//! patch.

use super::sketch::Scene;
use crate::{Error, Result};
use gdal::{
    Dataset, DriverManager,
    vector::{Feature, Geometry, Layer, LayerAccess, LayerOptions, OGRFieldType, OGRwkbGeometryType},
};
use meshmark_core::patches::Patch;
use meshmark_dataset::{CoordinateSystem, workplace::folder_of};
use std::{
    io::ErrorKind,
    path::{Path, PathBuf},
};
use tempfile::{TempDir, TempPath};

/// A fixed time of the last change in the GeoPackage, so that equal evidence gives equal bytes.
const NO_TIME: &str = "1970-01-01T00:00:00.000Z";

/// A matched vertex of the reference.
#[derive(Debug, Clone, Copy)]
pub struct FoundVertex {
    /// Its place in the reference, CRS units.
    pub at: [f64; 2],
    /// The number of its patch.
    pub patch: usize,
    /// Its place in the suspect after registration, CRS units.
    pub to: [f64; 2],
    /// The displacement between the two, metres on the ground.
    pub moved_m: [f64; 2],
    /// The weight: 1, or less where the displacement disagrees with the others.
    pub weight: f64,
}

/// The evidence of one patch.
#[derive(Debug, Clone)]
pub struct PatchEvidence {
    /// The vertices of the reference in the patch, CRS units.
    pub vertices: Vec<[f64; 2]>,
    /// Number of matched vertices.
    pub found: usize,
    /// The score in standard deviations of a random key; `None` where no vertex matches or no
    /// message is expected.
    pub score: Option<f64>,
}

/// The places of matched vertices, and the evidence of each patch.
#[derive(Debug, Clone)]
pub struct EvidenceMap {
    /// CRS of the reference.
    pub crs: Option<CoordinateSystem>,
    /// Matched vertices in canonical order.
    pub vertices: Vec<FoundVertex>,
    /// All patches, with or without matched vertices.
    pub patches: Vec<PatchEvidence>,
}

impl EvidenceMap {
    /// Creates the map from a demodulated scene; without demodulation it has patches alone. `crs`
    /// is that of the reference.
    pub fn new(scene: &Scene, crs: Option<&CoordinateSystem>) -> Self {
        let reference = scene.matched.reference;
        let (coords, ground) = (reference.data.vertices.coords(), &reference.ground);
        let patches = reference.patches.as_slice();
        let mut patch_of = vec![0; coords.len()];
        for (number, patch) in patches.iter().enumerate() {
            patch.vertices.iter().for_each(|&v| patch_of[v as usize] = number);
        }
        let of_patch = |patch: &Patch| PatchEvidence {
            vertices: patch.vertices.iter().map(|&v| coords[v as usize]).collect(),
            found: 0,
            score: None,
        };
        let patches = patches.iter().map(of_patch).collect();
        let mut map = EvidenceMap { crs: crs.cloned(), vertices: Vec::new(), patches };
        let moved_m = scene.matches.displacements_m(coords, &scene.matched.moved, ground);
        let weights = scene.demodulated.iter().flat_map(|demodulated| &demodulated.weights);
        for (v, &weight) in weights.enumerate() {
            let (Some(moved_m), at) = (moved_m[v], coords[v]) else { continue };
            let unit = ground.metres_per_unit(at);
            let to = [at[0] + moved_m[0] / unit[0], at[1] + moved_m[1] / unit[1]];
            map.vertices.push(FoundVertex { at, to, patch: patch_of[v], moved_m, weight });
            map.patches[patch_of[v]].found += 1;
        }
        map
    }

    /// Adds the score of every patch for the expected message; without scores the map stays
    /// unchanged.
    pub fn scored(mut self, scores: Vec<Option<f64>>) -> Self {
        self.patches.iter_mut().zip(scores).for_each(|(patch, score)| patch.score = score);
        self
    }

    /// Writes a GeoPackage with the layers `vertex_displacements`, a line for every matched vertex,
    /// and `patches`.
    ///
    /// # Errors
    /// Fails when the file cannot be written.
    pub fn write(&self, target: &EvidenceMapFile) -> Result<()> {
        let failed = |reason: String| target.failed(&reason);
        let workplace = workplace(&target.path)?;
        let staged = workplace.path().join("map.gpkg");
        self.write_layers(&staged).map_err(|error| failed(error.to_string()))?;
        let staged = TempPath::try_from_path(staged).map_err(|error| failed(error.to_string()))?;
        staged.persist_noclobber(&target.path).map_err(|error| match error.error.kind() {
            ErrorKind::AlreadyExists => target.exists(),
            _ => failed(error.error.to_string()),
        })
    }

    fn write_layers(&self, path: &Path) -> gdal::errors::Result<()> {
        gdal::config::set_thread_local_config_option("OGR_CURRENT_DATE", NO_TIME)?;
        let mut dataset = DriverManager::get_driver_by_name("GPKG")?.create_vector_only(path)?;
        self.write_displacements(&mut dataset)?;
        self.write_patches(&mut dataset)?;
        dataset.close()
    }

    fn write_displacements(&self, dataset: &mut Dataset) -> gdal::errors::Result<()> {
        use OGRFieldType::{OFTInteger, OFTReal};
        let fields = [
            ("patch", OFTInteger),
            ("dx_m", OFTReal),
            ("dy_m", OFTReal),
            ("moved_m", OFTReal),
            ("weight", OFTReal),
        ];
        let (kind, rows) = (OGRwkbGeometryType::wkbLineString, self.vertices.iter());
        self.write_layer(dataset, ("vertex_displacements", kind), &fields, rows, |vertex, feature| {
            let [dx, dy] = vertex.moved_m;
            feature.set_field_integer(0, vertex.patch as i32)?;
            for (field, value) in (1..).zip([dx, dy, dx.hypot(dy), vertex.weight]) {
                feature.set_field_double(field, value)?;
            }
            let mut line = Geometry::empty(kind)?;
            [vertex.at, vertex.to].into_iter().for_each(|[x, y]| line.add_point_2d((x, y)));
            Ok(line)
        })
    }

    fn write_patches(&self, dataset: &mut Dataset) -> gdal::errors::Result<()> {
        use OGRFieldType::{OFTInteger, OFTReal};
        let fields =
            [("patch", OFTInteger), ("vertices", OFTInteger), ("found", OFTInteger), ("score", OFTReal)];
        let (kind, rows) = (OGRwkbGeometryType::wkbPolygon, self.patches.iter().enumerate());
        self.write_layer(dataset, ("patches", kind), &fields, rows, |(number, patch), feature| {
            for (field, value) in [number, patch.vertices.len(), patch.found].into_iter().enumerate() {
                feature.set_field_integer(field, value as i32)?;
            }
            if let Some(score) = patch.score {
                feature.set_field_double(3, score)?;
            }
            points(&patch.vertices)?.convex_hull()
        })
    }

    /// Writes one layer in one transaction; `fill` sets the fields of a row and returns its
    /// geometry.
    fn write_layer<Row>(
        &self,
        dataset: &mut Dataset,
        (name, ty): (&str, OGRwkbGeometryType::Type),
        fields: &[(&str, OGRFieldType::Type)],
        rows: impl Iterator<Item = Row>,
        fill: impl Fn(Row, &mut Feature) -> gdal::errors::Result<Geometry>,
    ) -> gdal::errors::Result<()> {
        let mut transaction = dataset.start_transaction()?;
        let srs = self.crs.as_ref().map(CoordinateSystem::spatial_ref);
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
}

fn points(places: &[[f64; 2]]) -> gdal::errors::Result<Geometry> {
    let mut geometry = Geometry::empty(OGRwkbGeometryType::wkbMultiPoint)?;
    for [x, y] in places {
        let mut point = Geometry::empty(OGRwkbGeometryType::wkbPoint)?;
        point.add_point_2d((*x, *y));
        geometry.add_geometry(point)?;
    }
    Ok(geometry)
}

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

    fn exists(&self) -> Error {
        Error::Exists { path: self.path.clone(), remedy: ": name another file for --evidence-map" }
    }

    fn failed(&self, reason: &str) -> Error {
        unwritable(&self.path, reason)
    }
}

/// Creates a private folder beside the file, for its construction.
fn workplace(path: &Path) -> Result<TempDir> {
    let workplace = tempfile::Builder::new().prefix(".meshmark-evidence-map-").tempdir_in(folder_of(path));
    workplace.map_err(|error| unwritable(path, &error.to_string()))
}

fn unwritable(path: &Path, reason: &str) -> Error {
    Error::NotWritten { what: path.display().to_string(), reason: reason.into() }
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
