//! Opening of written files by the driver that wrote them. Drivers of rasters recognise some texts.

use crate::{
    Error, Result,
    inputs::gdal_failures::{GdalFailure, forget_failure},
};
use gdal::{Dataset, DatasetOptions, GdalOpenFlags};
use std::path::Path;

/// Opens a file by this driver alone.
pub fn open(path: &Path, driver: &str) -> Result<Dataset> {
    let options = DatasetOptions {
        open_flags: GdalOpenFlags::GDAL_OF_READONLY | GdalOpenFlags::GDAL_OF_VECTOR,
        allowed_drivers: Some(&[driver]),
        ..DatasetOptions::default()
    };
    forget_failure();
    Dataset::open_ex(path, options).map_err(|error| Error::unwritten(path.display(), GdalFailure::new(error)))
}
