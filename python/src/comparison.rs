//! The comparison of a map with its marked copy.

use crate::{
    errors::VerificationError, geos::PyGeos, layered_maps::LayeredMap, notebook::framed, waiting::run,
};
use meshmark_marking as marking;
use meshmark_verification::{
    compare::{self as comparison, Details},
    html,
};
use pyo3::prelude::*;

/// The effect of marking on a map: text with str(), a page in a notebook.
#[pyclass(module = "meshmark", frozen)]
pub struct Comparison(comparison::Comparison);

/// How maps are compared, a dict.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    precision: Option<f64>,
    exact_displacements: bool,
    threads: Option<usize>,
}

/// Compare a map with its marked copy, of the package's class `_layers.Map`; `geos` is its module `_geos`.
#[pyfunction]
pub fn compare(
    py: Python,
    reference: LayeredMap,
    marked: LayeredMap,
    geos: Py<PyModule>,
    settings: Settings,
) -> PyResult<Comparison> {
    let Settings { precision, exact_displacements, threads } = settings;
    let details = if exact_displacements { Details::Displacements } else { Details::Places };
    let geos = &PyGeos(geos);
    run(py, None, threads, |_| {
        let ground = reference.ground().map_err(|error| of_map("the reference", error))?;
        let before = reference.geometries().map_err(|error| of_map("the reference", error))?;
        let after = marked.geometries().map_err(|error| of_map("the marked map", error))?;
        let compared = comparison::compare(before, after, (&ground, geos), precision, details);
        Ok(Comparison(compared.map_err(VerificationError::from)?))
    })
}

fn of_map(name: &str, source: marking::Error) -> VerificationError {
    // A comparison has no arguments that choose a CRS or layers.
    let reason = match source {
        marking::Error::NoCrs => "it has no CRS and all its coordinates could be degrees: give it its CRS",
        marking::Error::MixedCrs { .. } => "its layers are not in the same CRS: compare them one by one",
        _ => "",
    };
    if !reason.is_empty() {
        return VerificationError::Uncompared { name: name.into(), reason };
    }
    VerificationError::Map { name: Some(name.into()), source }
}

#[pymethods]
impl Comparison {
    /// The comparison as JSON, that of `meshmark compare --report` without the files.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// The comparison as a dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.0.to_json(),))
    }

    /// The comparison as a page of HTML that needs no network.
    fn to_html(&self) -> String {
        html::comparison(&self.0)
    }

    /// The page, for a notebook.
    fn _repr_html_(&self, py: Python) -> PyResult<String> {
        framed(py, &self.to_html())
    }

    /// Root mean square of the displacements of all vertices, metres.
    #[getter]
    fn rms_m(&self) -> f64 {
        self.0.displacement.rms_m
    }

    /// The largest displacement of a vertex, metres.
    #[getter]
    fn max_m(&self) -> f64 {
        self.0.displacement.max_m
    }

    fn __str__(&self) -> String {
        self.0.to_text()
    }

    fn __repr__(&self) -> String {
        format!("<meshmark.Comparison {:.3} m RMS, at most {:.3} m>", self.rms_m(), self.max_m())
    }
}
