//! The plan of the sheets of a map, by which they are marked apart and fit together.
//!
//! Every sheet is read twice, one at a time: the first reading finds where it has something, the second
//! what of it is near other sheets. So memory holds one sheet and the borders of all.

use crate::{
    Error, Result,
    inputs::maps::{self, Reading},
    progress::Progress,
};
use meshmark_core::{
    anchors::Anchors,
    borders::{Border, Coverage, Disagreement, anchors},
    options::Options,
    sheet_plan::{PlannedSheet, SheetPlan, VERSION},
};
use meshmark_dataset::{CoordinateSystem, LabelFields, Survey, formats::Format};
use meshmark_marking::{Crs, TransformableCrs};
use meshmark_verification::words::printable;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// A sheet that was read once.
struct Known {
    path: PathBuf,
    vertices: usize,
    digest: String,
    crs: Option<CoordinateSystem>,
    /// `None` of a sheet without vertices.
    coverage: Option<Coverage>,
}

/// Plans the sheets of folders and files; `options` have their layers, their CRS and the tolerance of
/// the mark.
///
/// # Errors
/// Fails on a sheet that is unreadable, and on sheets that do not belong together.
pub fn plan(
    options: &Options,
    named: &[PathBuf],
    progress: &Progress,
    warn: &mut dyn FnMut(&str),
) -> Result<SheetPlan> {
    let files = files(named, warn)?;
    if let [only] = files.as_slice() {
        return Err(Error::OneSheet { path: only.clone() });
    }
    progress.start("reading sheets", 2 * files.len() as u64);
    let step = |steps| progress.step(steps);
    let mut sheets: Vec<Known> = Vec::new();
    for path in files {
        let sheet = Known::read(path, options)?;
        sheets.iter().try_for_each(|earlier| sheet.check_beside(earlier))?;
        sheets.push(sheet);
        step(1);
    }
    let mut borders = Vec::new();
    for number in 0..sheets.len() {
        borders.push(border(&sheets, number, options)?);
        step(1);
    }
    let tolerance_m = options.parameters.tolerance_m;
    let anchors = anchors(&borders, tolerance_m).map_err(|found| disagreement(&sheets, found))?;
    progress.finish();
    let crs = sheets.iter().find_map(|sheet| sheet.crs.as_ref()).map(CoordinateSystem::label);
    let planned = |(sheet, anchors): (Known, Anchors)| PlannedSheet {
        file: name(&sheet.path),
        vertices: sheet.vertices,
        vertices_sha256: sheet.digest,
        anchors,
    };
    Ok(SheetPlan {
        meshmark_plan: VERSION,
        software: concat!("meshmark ", env!("CARGO_PKG_VERSION")).into(),
        tolerance_m,
        crs,
        sheets: sheets.into_iter().zip(anchors).map(planned).collect(),
    })
}

impl Known {
    fn read(path: PathBuf, options: &Options) -> Result<Self> {
        let survey = read(&path, options)?;
        let vertices = survey.data.vertices.len();
        let coverage = match vertices {
            0 => None,
            _ => Some(Coverage::new(&map(&path, &survey, options)?)),
        };
        Ok(Known { path, vertices, digest: survey.data.vertices.digest(), crs: survey.crs, coverage })
    }

    /// Checks that two sheets may be parts of one map.
    fn check_beside(&self, earlier: &Known) -> Result<()> {
        if self.vertices == 0 || earlier.vertices == 0 {
            return Ok(());
        }
        let paths = || [earlier.path.clone(), self.path.clone()];
        let [label, own_label] = [earlier, self].map(|sheet| sheet.crs.as_ref().map(|crs| crs.label()));
        if label != own_label {
            let names = match (&earlier.crs, &self.crs) {
                (Some(a), Some(b)) => a.names_apart(b),
                _ => [label, own_label].map(|label| label.unwrap_or_else(|| "no CRS".into())),
            };
            return Err(Error::SheetsOfOtherCrs { paths: paths(), names });
        }
        match self.digest == earlier.digest {
            true => Err(Error::SameSheet { paths: paths() }),
            false => Ok(()),
        }
    }
}

/// Reads a sheet again and returns what of it may be near others.
fn border(sheets: &[Known], number: usize, options: &Options) -> Result<Border> {
    let Known { path, digest, .. } = &sheets[number];
    let survey = read(path, options)?;
    if survey.data.vertices.digest() != *digest {
        return Err(Error::SheetChanged { path: path.clone() });
    }
    let others = sheets.iter().enumerate().filter(|(other, _)| *other != number);
    let others: Vec<&Coverage> = others.filter_map(|(_, sheet)| sheet.coverage.as_ref()).collect();
    match survey.data.vertices.is_empty() {
        true => Ok(Border::default()),
        false => Ok(Border::new(&map(path, &survey, options)?, options.parameters.tolerance_m, &others)),
    }
}

fn read(path: &Path, options: &Options) -> Result<Survey> {
    let (layers, srs) = (options.layers.as_deref(), options.srs.as_deref());
    let landmarks = LabelFields::None;
    maps::sheet(path, &Reading { layers, srs, recorded_crs: None, landmarks, geometries: false })
}

fn map<'a>(path: &Path, survey: &'a Survey, options: &Options) -> Result<meshmark_core::map::Map<'a>> {
    survey.map(&options.parameters).map_err(|error| maps::failed("sheet", path, error))
}

fn disagreement(sheets: &[Known], found: Disagreement) -> Error {
    let Disagreement { sheets: numbers, places, vertices } = found;
    Error::SheetsDisagree { paths: numbers.map(|number| sheets[number].path.clone()), places, vertices }
}

/// Returns the files of sheets, those of folders among them, in the order of their names. Warns of what a
/// folder has besides.
fn files(named: &[PathBuf], warn: &mut dyn FnMut(&str)) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let unread = |source| Error::FolderUnread { path: path.clone(), source };
        let before = files.len();
        for entry in fs::read_dir(path).map_err(unread)? {
            let path = entry.map_err(unread)?.path();
            // A name that ends in .json is that of a record, or of the plan itself.
            let name = name(&path);
            let is_json = name.to_ascii_lowercase().ends_with(".json");
            if Format::stem(&name).is_some() && !is_json && path.is_file() {
                files.push(path);
            } else if !is_of_a_sheet(&path) {
                warn(&format!(
                    "{} is not planned: if it is a sheet, name it as one",
                    printable(&path.display().to_string())
                ));
            }
        }
        if files.len() == before {
            return Err(Error::NoSheet { folder: path.clone() });
        }
    }
    files.sort();
    files.dedup();
    Ok(files)
}

/// Returns whether a file may belong to a sheet without being one, such as a .dbf.
fn is_of_a_sheet(path: &Path) -> bool {
    let sidecars = ["dbf", "shx", "prj", "cpg", "qix", "gpkg-wal", "gpkg-shm"];
    let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
    path.is_file() && extension.is_some_and(|extension| sidecars.contains(&extension.as_str()))
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
