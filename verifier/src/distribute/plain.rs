//! The unmarked map as plain `ogr2ogr` writes it in the format of the copies. A copy differs from
//! it only in coordinates, so names, values and ids of fields never pass through a GeoPackage,
//! which cannot hold all of them.

use super::{flatgeobuf, geojson, moving, ogr2ogr, staged::Staged};
use crate::{Error, Result};
use meshmark_core::options::Options;
use meshmark_dataset::{
    Action, Survey, file_error,
    formats::Format,
    traces::{ForeignSearch, Trace},
};
use meshmark_marking::Moves;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// The files of a Shapefile that hold geometries; all others come from the plain copy.
const GEOMETRY_FILES: [&str; 2] = ["shp", "shx"];

/// The plain copy.
pub struct Plain {
    path: PathBuf,
    driver: &'static str,
}

impl Plain {
    /// Copies the single layer of a map into an empty folder; `warn` receives the warnings of
    /// `ogr2ogr`.
    pub fn new(
        map: &Path,
        folder: &Path,
        format: &'static Format,
        warn: &mut dyn FnMut(&str),
    ) -> Result<Self> {
        let path = folder.join("map").with_extension(&format.ending()[1..]);
        ogr2ogr::copy(format.driver, map, &path, &[])?.iter().for_each(|text| warn(text));
        Ok(Plain { path, driver: format.driver })
    }

    /// Returns the traces in foreign members of GeoJSON.
    pub fn search_traces(&self, map: &Survey, options: &Options, layer: &str) -> Result<Option<Trace>> {
        let mut search = ForeignSearch::new(map, options)?;
        geojson::for_each_feature(&self.path, |feature| search.add(feature))?;
        Ok(search.trace(layer))
    }

    /// Writes a copy with moved vertices and returns the warnings of `ogr2ogr`; `work` is a folder
    /// for temporary files.
    pub fn write(&self, staged: &Staged, work: &Path, file: &Path, moves: Moves) -> Result<Vec<String>> {
        if self.driver == "FlatGeobuf" {
            flatgeobuf::write(&self.path, file, moves)?;
            return Ok(Vec::new());
        }
        let marked = work.join("marked.gpkg");
        moving::write(staged, &marked, moves.to)?;
        let (part, is_json) = (work.join("geometries"), self.driver != "ESRI Shapefile");
        let part = part.with_extension(self.path.extension().expect("it was given one"));
        let options = if self.driver == "GeoJSON" { &["-lco", "WRITE_BBOX=YES"][..] } else { &[] };
        let warnings = ogr2ogr::copy(self.driver, &marked, &part, options)?;
        match is_json {
            true => geojson::write(&self.path, &part, file)?,
            false => self.write_shapefile(&part, file)?,
        }
        Ok(warnings)
    }

    fn write_shapefile(&self, geometries: &Path, file: &Path) -> Result<()> {
        let size = |path: &Path| {
            let path = path.with_extension("shx");
            path.metadata()
                .map(|metadata| metadata.len())
                .map_err(|error| file_error(Action::Reading, &path, error))
        };
        if size(&self.path)? != size(geometries)? {
            return Err(Error::MapChanged);
        }
        let folder = self.path.parent().expect("it is in a folder");
        let entries = fs::read_dir(folder).map_err(|error| file_error(Action::Reading, folder, error))?;
        for entry in entries.flatten() {
            let path = entry.path();
            let extension = path.extension().unwrap_or_default();
            let from = match GEOMETRY_FILES.iter().any(|name| extension == *name) {
                true => geometries.with_extension(extension),
                false => path.clone(),
            };
            let to = file.with_extension(extension);
            fs::copy(&from, &to).map_err(|error| file_error(Action::Writing, &to, error))?;
        }
        Ok(())
    }
}
