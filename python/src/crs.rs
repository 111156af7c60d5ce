//! The CRS of pyproj.

use meshmark_marking::{Crs, CrsKind};
use pyo3::{
    exceptions::PyValueError,
    prelude::*,
    types::{PyList, PyString},
};

/// A CRS; the package's class `_crs.Crs` has its properties.
pub struct PyCrs {
    object: Py<PyAny>,
    kind: CrsKind,
    label: String,
    name: String,
    linear_units_m: f64,
    radians_per_unit: f64,
    ellipsoid_m: Option<[f64; 2]>,
}

impl PyCrs {
    /// Returns whether two have the same x and y.
    pub fn is_same(&self, py: Python, other: &PyCrs) -> PyResult<bool> {
        self.object.bind(py).call_method1("is_same", (&other.object,))?.extract()
    }

    fn transformed(&self, x: &[f64], y: &[f64]) -> PyResult<[Vec<f64>; 2]> {
        Python::attach(|py| {
            let lists = (PyList::new(py, x)?, PyList::new(py, y)?);
            let (lon, lat) = self.object.bind(py).call_method1("to_geographic", lists)?.extract()?;
            Ok([lon, lat])
        })
    }
}

impl<'py> FromPyObject<'_, 'py> for PyCrs {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let get = |name: &str| object.getattr(PyString::new(object.py(), name));
        let kind = match get("kind")?.extract::<String>()?.as_str() {
            "geographic" => CrsKind::Geographic,
            "projected" => CrsKind::Projected,
            "geocentric" => CrsKind::Geocentric,
            "other" => CrsKind::Other,
            unknown => return Err(PyValueError::new_err(format!("{unknown} is no kind of a CRS"))),
        };
        Ok(PyCrs {
            kind,
            label: get("label")?.extract()?,
            name: get("name")?.extract()?,
            linear_units_m: get("linear_units_m")?.extract()?,
            radians_per_unit: get("radians_per_unit")?.extract()?,
            ellipsoid_m: get("ellipsoid_m")?.extract()?,
            object: object.to_owned().unbind(),
        })
    }
}

impl Crs for PyCrs {
    fn kind(&self) -> CrsKind {
        self.kind
    }

    fn label(&self) -> String {
        self.label.clone()
    }

    fn brief_name(&self) -> String {
        self.name.clone()
    }

    fn linear_units_m(&self) -> f64 {
        self.linear_units_m
    }

    fn radians_per_unit(&self) -> f64 {
        self.radians_per_unit
    }

    fn ellipsoid_m(&self) -> Option<[f64; 2]> {
        self.ellipsoid_m
    }

    fn to_geographic(&self, x: &mut [f64], y: &mut [f64]) -> bool {
        let Ok([lon, lat]) = self.transformed(x, y) else { return false };
        x.copy_from_slice(&lon);
        y.copy_from_slice(&lat);
        true
    }
}
