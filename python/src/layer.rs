//! Layers as the Python package hands them over.

use crate::crs::PyCrs;
use meshmark_core::map_data::MapData;
use meshmark_marking::{self as marking, Chains, Crs, Extent, Faults, Geometries, Metric, Moves, NotMoved};
use pyo3::{prelude::*, pybacked::PyBackedBytes};

/// A geometry column of a layer; the package's class `_layers.Column`.
pub struct Layer {
    object: Py<PyAny>,
    name: String,
    /// The geometries, well-known binary; `None` for a missing one.
    geometries: Vec<Option<PyBackedBytes>>,
    crs: Option<PyCrs>,
}

impl<'py> FromPyObject<'_, 'py> for Layer {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(Layer {
            name: object.getattr("name")?.extract()?,
            geometries: object.getattr("geometries")?.extract()?,
            crs: object.getattr("crs")?.extract()?,
            object: object.to_owned().unbind(),
        })
    }
}

impl Layer {
    /// Returns the name of a feature for messages: its index in the frame.
    fn fid(&self, number: usize) -> String {
        let fid = Python::attach(|py| self.object.bind(py).call_method1("fid", (number,))?.extract());
        fid.unwrap_or_else(|_| number.to_string())
    }

    fn crs(&self) -> Option<&dyn Crs> {
        as_crs(self.crs.as_ref())
    }

    /// Returns its geometries with moved vertices.
    pub fn moved(&self, moves: &Moves) -> marking::Result<Vec<Option<Vec<u8>>>> {
        let moved = |(number, wkb): (usize, &Option<PyBackedBytes>)| {
            let Some(wkb) = wkb else { return Ok(None) };
            let mut wkb = wkb.to_vec();
            match moves.geometry(&mut wkb) {
                Ok(_) => Ok(Some(wkb)),
                Err(NotMoved::Wkb(fault)) => {
                    Err(marking::Error::geometry(&self.name, self.fid(number), fault))
                }
                Err(NotMoved::UnknownVertex(_)) => unreachable!("the map has all vertices of its layers"),
            }
        };
        self.geometries.iter().enumerate().map(moved).collect()
    }
}

/// The map of all layers.
pub struct LayeredMap<'a> {
    pub data: MapData,
    pub geometries: Geometries,
    pub metric: Metric,
    crs: Option<&'a PyCrs>,
}

impl<'a> LayeredMap<'a> {
    pub fn crs(&self) -> Option<&dyn Crs> {
        as_crs(self.crs)
    }

    /// Reads layers, which share one CRS.
    pub fn read(py: Python, layers: &'a [Layer]) -> PyResult<Result<Self, marking::Error>> {
        if let Some(mixed) = mixed_crs(py, layers)? {
            return Ok(Err(mixed));
        }
        Ok(Self::of_one_crs(layers))
    }

    fn of_one_crs(layers: &'a [Layer]) -> marking::Result<Self> {
        let crs = layers.iter().find(|layer| layer.has_any()).and_then(|layer| layer.crs.as_ref());
        let mut chains = Chains::default();
        for layer in layers {
            for (number, wkb) in layer.geometries.iter().enumerate() {
                let Some(wkb) = wkb else { continue };
                let fid = || layer.fid(number);
                let how = (true, Extent::in_crs(layer.crs()));
                chains.read(wkb.to_vec(), (&layer.name, &fid), how, Faults::Fail)?;
            }
        }
        let coords = std::mem::take(&mut chains.coords);
        let (data, indices) = MapData::from_chains(coords, &chains.starts, chains.chain_kinds())?;
        let metric = Metric::measure(as_crs(crs), &data.vertices)?;
        Ok(LayeredMap { data, geometries: Geometries::new(indices, chains), metric, crs })
    }
}

fn as_crs(crs: Option<&PyCrs>) -> Option<&dyn Crs> {
    crs.map(|crs| crs as &dyn Crs)
}

impl Layer {
    fn has_any(&self) -> bool {
        self.geometries.iter().any(Option::is_some)
    }
}

/// Gives layers without a CRS that of the option `srs`.
pub fn assign_crs(py: Python, layers: &mut [Layer], srs: &Bound<PyAny>) -> PyResult<marking::Result<()>> {
    for layer in layers {
        let given: PyCrs = srs.extract()?;
        match &layer.crs {
            Some(own) if !own.is_same(py, &given)? => {
                let (crs, srs) = (own.brief_name(), given.brief_name());
                return Ok(Err(marking::Error::ContradictingSrs { crs, srs }));
            }
            Some(_) => {}
            None => layer.crs = Some(given),
        }
    }
    Ok(Ok(()))
}

/// Returns the error of layers with geometries whose CRS differ, as one mesh needs one.
fn mixed_crs(py: Python, layers: &[Layer]) -> PyResult<Option<marking::Error>> {
    let mut layers = layers.iter().filter(|layer| layer.has_any());
    let Some(first) = layers.next() else { return Ok(None) };
    for layer in layers {
        let is_same = match (&first.crs, &layer.crs) {
            (Some(a), Some(b)) => a.is_same(py, b)?,
            (a, b) => a.is_none() && b.is_none(),
        };
        if !is_same {
            let name = |layer: &Layer| layer.crs().map_or("no CRS".into(), |crs| crs.brief_name());
            return Ok(Some(marking::Error::MixedCrs {
                first: first.name.clone(),
                first_crs: name(first),
                second: layer.name.clone(),
                second_crs: name(layer),
            }));
        }
    }
    Ok(None)
}
