//! The module `meshmark._meshmark`, on which the Python package `meshmark` rests: layers as lists of
//! well-known binary in; marked layers and a record out, or a report, or a comparison. The package
//! brings the CRS of pyproj and the GEOS of shapely; there is no GDAL.
#![deny(unsafe_code)]

mod comparison;
mod crs;
mod errors;
mod geos;
mod key;
mod layer;
mod layered_maps;
mod marking;
mod notebook;
mod record;
mod report;
mod verification;
mod waiting;

use meshmark_core::options::creation_option_list_xml;
use pyo3::prelude::*;

/// Return the options of the driver with their types, bounds, defaults and help, as the XML that GDAL has
/// for them (DMD_CREATIONOPTIONLIST): dialogs are made from it, with or without the driver.
#[pyfunction]
fn creation_option_list() -> String {
    creation_option_list_xml()
}

#[pymodule]
fn _meshmark(module: &Bound<PyModule>) -> PyResult<()> {
    errors::add(module)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<key::Key>()?;
    module.add_class::<record::Record>()?;
    module.add_class::<report::Report>()?;
    module.add_class::<comparison::Comparison>()?;
    module.add_function(wrap_pyfunction!(creation_option_list, module)?)?;
    module.add_function(wrap_pyfunction!(marking::mark, module)?)?;
    module.add_function(wrap_pyfunction!(marking::check_recipients, module)?)?;
    module.add_function(wrap_pyfunction!(verification::verify, module)?)?;
    module.add_function(wrap_pyfunction!(comparison::compare, module)?)
}
