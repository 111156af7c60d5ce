//! Pages in the cells of a notebook.

use pyo3::prelude::*;

/// Returns a frame that shows a page apart from the styles of the notebook.
pub fn framed(py: Python, page: &str) -> PyResult<String> {
    let escaped: String = py.import("html")?.call_method1("escape", (page,))?.extract()?;
    let style = "width: 100%; height: 48em; border: 1px solid #ccc";
    Ok(format!("<iframe srcdoc=\"{escaped}\" sandbox style=\"{style}\"></iframe>"))
}
