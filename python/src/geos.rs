//! The GEOS of shapely.

use crate::waiting::Cancelled;
use meshmark_marking::{
    Outline,
    quality::{Geos, Neighbours},
};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyList},
};
use rstar::{AABB, Envelope};
use std::borrow::Cow;

/// The package's module `_geos`.
pub struct PyGeos(pub Py<PyModule>);

impl PyGeos {
    /// Calls a function of the module with a list of geometries for each of its arguments. An exception
    /// ends the job.
    fn call<T>(
        &self,
        name: &str,
        arguments: &[Vec<&Outline>],
        result: impl FnOnce(&Bound<PyAny>) -> PyResult<T>,
    ) -> T {
        let called = Python::attach(|py| {
            let list = |outlines: &Vec<&Outline>| {
                PyList::new(py, outlines.iter().map(|outline| PyBytes::new(py, &outline.wkb())))
            };
            let lists = arguments.iter().map(list).collect::<PyResult<Vec<_>>>()?;
            let function = self.0.bind(py).getattr(name)?;
            result(&function.call(pyo3::types::PyTuple::new(py, lists)?, None)?)
        });
        called.unwrap_or_else(|error| Cancelled::with(error))
    }
}

impl Geos for PyGeos {
    fn are_valid(&self, outlines: &[Cow<Outline>]) -> Vec<bool> {
        let all = outlines.iter().map(|outline| &**outline).collect();
        self.call("are_valid", &[all], |found| found.extract())
    }

    /// Shapely has no arcs, so that the chains of a collection describe its area.
    fn extents(&self, outline: &Outline) -> (f64, AABB<[f64; 2]>) {
        (outline.area(), AABB::new_empty())
    }

    fn common_areas(&self, groups: &[Neighbours]) -> Vec<Vec<f64>> {
        let pairs = groups
            .iter()
            .flat_map(|(polygon, others)| others.iter().map(move |other| (&**polygon, &**other)));
        let (ones, others): (Vec<&Outline>, Vec<&Outline>) = pairs.unzip();
        let common: Vec<Option<Vec<u8>>> =
            self.call("intersections", &[ones, others], |found| found.extract());
        let area = |wkb: Option<Vec<u8>>| {
            wkb.and_then(|wkb| Outline::of_wkb(wkb).ok()).map_or(0.0, |outline| outline.area())
        };
        let mut areas = common.into_iter().map(area);
        groups.iter().map(|(_, others)| areas.by_ref().take(others.len()).collect()).collect()
    }
}
