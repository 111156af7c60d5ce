//! Reading back: this module checks that a written file holds what was meant, and that the mark
//! can be read from its vertices.

use crate::{
    error::{Error, Result},
    ffi_errors::Collector,
    ffi_source::View,
    marking::MarkingRequest,
};
use gdal::{Dataset, DatasetOptions, GdalOpenFlags};
use meshmark_dataset::{
    formats::Format,
    read_back::{Difference, ReadBack},
};
use std::path::Path;

/// A file that was written.
pub struct Written<'a> {
    /// Its path.
    pub path: &'a Path,
    /// Its format.
    pub format: &'static Format,
    /// Its layers.
    pub layers: Vec<WrittenLayer>,
}

/// A layer that was written.
pub struct WrittenLayer {
    /// Its name in the source of the marking.
    pub staged: String,
    /// Its name in the file.
    pub name: String,
    /// Its creation options.
    pub options: Vec<(String, String)>,
}

/// Fails unless the file holds the features of the marked map, within the precision of its format,
/// and the mark.
pub fn check(written: &Written, view: &View, request: &MarkingRequest, threads: usize) -> Result<()> {
    let file = open(written)?;
    let meant = view.dataset();
    let mut vertices = Vec::new();
    for layer in &written.layers {
        let digits = written.format.digits(&layer.options);
        let keep = view.marking().marks_layer(&layer.staged).then_some(&mut vertices);
        let collector = Collector::new();
        let last_failure = || collector.first_failure();
        let comparison = ReadBack { digits, place: &Some, last_failure: &last_failure };
        // The only layer of a file may have the name of the file.
        let in_file = match written.format.many_layers {
            true => file.layer_by_name(&layer.name),
            false => file.layer(0),
        };
        let compared = comparison.layers(meant.layer_by_name(&layer.staged), in_file, keep);
        compared.map_err(|difference| not_kept(written, layer, difference))?;
    }
    // A format with decimals holds one layer.
    let digits = written.format.digits(&written.layers[0].options);
    let found = digits.find_all(view.marking().moved(), vertices);
    let found = found
        .ok_or_else(|| not_kept(written, &written.layers[0], "a vertex is missing".to_string().into()))?;
    view.marking().check_mark(request, &found, digits, threads)
}

fn not_kept(written: &Written, layer: &WrittenLayer, difference: Difference) -> Error {
    let (driver, layer) = (written.format.driver, layer.name.clone());
    meshmark_dataset::Error::NotKept { driver, layer, difference }.into()
}

fn open(written: &Written) -> Result<Dataset> {
    let collector = Collector::new();
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_VECTOR | GdalOpenFlags::GDAL_OF_INTERNAL,
        allowed_drivers: Some(&[written.format.driver]),
        ..DatasetOptions::default()
    };
    Dataset::open_ex(written.path, options).map_err(|error| {
        let reason = collector.first_failure().unwrap_or_else(|| error.to_string());
        Error::Writing { what: "opening it again".into(), reason }
    })
}
