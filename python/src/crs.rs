//! The CRS of pyproj.

use crate::waiting::call_waiting;
use meshmark_marking::{self as marking, Crs, CrsKind, Error, Fault, TransformableCrs};
use pyo3::{
    exceptions::PyValueError,
    prelude::*,
    types::{PyList, PyString},
};
use std::sync::Arc;

/// A CRS; the package's class `_crs.Crs` has its properties.
#[derive(Clone)]
pub struct PyCrs(Arc<Properties>);

struct Properties {
    object: Py<PyAny>,
    kind: CrsKind,
    label: String,
    name: String,
    linear_units_m: f64,
    radians_per_unit: f64,
    ellipsoid_m: Option<[f64; 2]>,
}

impl PyCrs {
    /// Returns what `f` returns for the object of Python.
    fn ask<T: Send + 'static>(
        &self,
        f: impl FnOnce(&Bound<PyAny>) -> PyResult<T> + Send + 'static,
    ) -> PyResult<T> {
        let own = self.clone();
        call_waiting(move |py| f(own.0.object.bind(py)))
    }

    /// Returns the object of Python.
    pub fn object<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.0.object.bind(py).clone()
    }

    fn transformed(&self, x: &[f64], y: &[f64], target: Option<&PyCrs>) -> PyResult<[Vec<f64>; 2]> {
        let (x, y, target) = (x.to_vec(), y.to_vec(), target.cloned());
        self.ask(move |object| {
            let lists = (PyList::new(object.py(), x)?, PyList::new(object.py(), y)?);
            let found = match target {
                None => object.call_method1("to_geographic", lists)?,
                Some(target) => object.call_method1("transform", (lists.0, lists.1, &target.0.object))?,
            };
            let (x, y) = found.extract()?;
            Ok([x, y])
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
        Ok(PyCrs(Arc::new(Properties {
            kind,
            label: get("label")?.extract()?,
            name: get("name")?.extract()?,
            linear_units_m: get("linear_units_m")?.extract()?,
            radians_per_unit: get("radians_per_unit")?.extract()?,
            ellipsoid_m: get("ellipsoid_m")?.extract()?,
            object: object.to_owned().unbind(),
        })))
    }
}

impl Crs for PyCrs {
    fn kind(&self) -> CrsKind {
        self.0.kind
    }

    fn label(&self) -> String {
        self.0.label.clone()
    }

    fn brief_name(&self) -> String {
        self.0.name.clone()
    }

    fn linear_units_m(&self) -> f64 {
        self.0.linear_units_m
    }

    fn radians_per_unit(&self) -> f64 {
        self.0.radians_per_unit
    }

    fn ellipsoid_m(&self) -> Option<[f64; 2]> {
        self.0.ellipsoid_m
    }

    fn to_geographic(&self, x: &mut [f64], y: &mut [f64]) -> bool {
        let Ok([lon, lat]) = self.transformed(x, y, None) else { return false };
        x.copy_from_slice(&lon);
        y.copy_from_slice(&lat);
        true
    }
}

impl TransformableCrs for PyCrs {
    fn from_epsg(code: u32) -> Option<Self> {
        PyCrs::parse(&format!("EPSG:{code}")).ok()
    }

    fn parse(text: &str) -> marking::Result<Self> {
        let owned = text.to_owned();
        let parsed = call_waiting(|py| {
            py.import("meshmark._crs")?.call_method1("parse", (owned,))?.extract::<Option<PyCrs>>()
        });
        parsed.ok().flatten().ok_or_else(|| Error::UnknownSrs(text.into()))
    }

    fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || {
            let other = other.clone();
            let same = self.ask(move |own| own.call_method1("is_same", (&other.0.object,))?.extract());
            same.unwrap_or(false)
        }
    }

    fn names_apart(&self, other: &Self) -> [String; 2] {
        let names = [self, other].map(Crs::brief_name);
        if names[0] != names[1] {
            return names;
        }
        [self, other].map(|crs| format!("{}, {}", names[0], crs.label()))
    }

    fn transform(&self, x: &mut [f64], y: &mut [f64], target: &Self) -> Result<(), Fault> {
        let [to_x, to_y] = self.transformed(x, y, Some(target))?;
        x.copy_from_slice(&to_x);
        y.copy_from_slice(&to_y);
        Ok(())
    }

    fn geographic(&self) -> Option<Self> {
        if self.kind() == CrsKind::Geographic {
            return Some(self.clone());
        }
        self.ask(|own| own.getattr("geographic")?.extract()).ok().flatten()
    }

    fn prime_meridian_degrees(&self) -> f64 {
        self.ask(|own| own.getattr("prime_meridian_degrees")?.extract()).unwrap_or(0.0)
    }
}
