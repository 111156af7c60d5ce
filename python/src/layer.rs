//! Layers as the Python package hands them over, and the map that they are.

use crate::crs::PyCrs;
use meshmark_marking::{
    self as marking, Chains, Content, Crs, CrsSource, Extent, Faults, KnownCrs, Moves, NotMoved, Numbers,
    Outline, Survey, TransformableCrs,
};
use pyo3::{prelude::*, pybacked::PyBackedBytes};

/// A geometry column of a layer; the package's class `_layers.Column`.
pub struct Layer {
    object: Py<PyAny>,
    /// The name of the layer.
    pub name: String,
    /// The geometries, well-known binary; `None` for a missing one.
    geometries: Vec<Option<PyBackedBytes>>,
    /// Texts and integers of each feature, of the first geometry column of a layer.
    attributes: Option<Vec<Vec<String>>>,
    crs: Option<PyCrs>,
}

impl<'py> FromPyObject<'_, 'py> for Layer {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(Layer {
            name: object.getattr("name")?.extract()?,
            geometries: object.getattr("geometries")?.extract()?,
            attributes: object.getattr("attributes")?.extract()?,
            crs: object.getattr("crs")?.extract()?,
            object: object.to_owned().unbind(),
        })
    }
}

impl Layer {
    /// Returns the name of a feature for messages: its index in the frame.
    pub fn fid(&self, number: usize) -> String {
        let fid = Python::attach(|py| self.object.bind(py).call_method1("fid", (number,))?.extract());
        fid.unwrap_or_else(|_| number.to_string())
    }

    /// Returns its own CRS.
    pub fn crs(&self) -> Option<&PyCrs> {
        self.crs.as_ref()
    }

    /// Returns its geometries that are there, with their numbers.
    pub fn geometries(&self) -> impl Iterator<Item = (usize, &PyBackedBytes)> {
        self.geometries.iter().enumerate().filter_map(|(number, wkb)| Some((number, wkb.as_ref()?)))
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

    /// Adds its attributes with the places of the features, and the rings and lines of these.
    fn describe(&self, content: &mut Content<PyCrs>) {
        let Some(attributes) = &self.attributes else { return };
        for (number, wkb) in self.geometries() {
            // What cannot be read is left out, or was refused before.
            let Ok(outline) = Outline::of_wkb(wkb.to_vec()) else { continue };
            if !outline.chains.is_empty() {
                content.describe(attributes[number].clone(), &outline.to_collection());
            }
        }
    }
}

/// What of a map is read besides its vertices.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Besides {
    /// Its vertices alone.
    Nothing,
    /// The geometries, which a marking moves.
    Geometries,
    /// Attributes, rings, lines and areas, by which a verification finds places.
    Description,
}

/// Reads layers, which share one CRS, of which this is known beside them.
///
/// # Errors
/// Fails on layers of several CRS, and on geometries that are malformed or not finite.
pub fn survey(
    layers: &[&Layer],
    known: &KnownCrs<PyCrs>,
    besides: Besides,
) -> marking::Result<Survey<PyCrs>> {
    let of_layer = layers.iter().map(|layer| known.of_layer(layer.crs.clone()));
    let of_layer = of_layer.collect::<marking::Result<Vec<_>>>()?;
    let (of_layer, sources): (Vec<_>, Vec<_>) = of_layer.into_iter().unzip();
    let of_filled = layers.iter().zip(sources).filter(|(layer, _)| layer.geometries().next().is_some());
    let mut crs_sources = of_filled.map(|(_, source)| source);
    let crs_source = crs_sources.find(|source| *source != CrsSource::Map).unwrap_or_default();
    let crs = common_crs(layers, &of_layer)?;
    let mut content = Content::new(besides == Besides::Description);
    for (layer, own) in layers.iter().zip(of_layer) {
        let extent = Extent::in_crs(own.as_ref().map(|crs| crs as &dyn Crs));
        let mut chains = Chains::default();
        for (number, wkb) in layer.geometries() {
            let fid = || layer.fid(number);
            let how = (besides == Besides::Geometries, extent);
            chains.read(wkb.to_vec(), (&layer.name, &fid), how, Faults::Fail)?;
        }
        if besides == Besides::Description {
            layer.describe(&mut content);
        }
        content.end_layer(&layer.name, [(own, chains)]);
    }
    let mut survey = content.survey(crs, besides == Besides::Geometries)?;
    survey.crs_source = crs_source;
    Ok(survey)
}

/// Reads layers in any CRS, without what nobody can place.
pub fn numbers(layers: &[Layer]) -> marking::Result<Numbers<PyCrs>> {
    let mut content = Content::new(true);
    for layer in layers {
        let mut chains = Chains::default();
        for (number, wkb) in layer.geometries() {
            let fid = || layer.fid(number);
            let faults = Faults::LeaveOut(&mut content.left_out);
            chains.read(wkb.to_vec(), (&layer.name, &fid), (false, Extent::ANY), faults)?;
        }
        layer.describe(&mut content);
        content.end_layer(&layer.name, [(layer.crs.clone(), chains)]);
    }
    Ok(content.into_numbers())
}

/// Returns the CRS of layers with geometries, as one mesh needs one.
fn common_crs(layers: &[&Layer], crs: &[Option<PyCrs>]) -> marking::Result<Option<PyCrs>> {
    let mut filled = layers.iter().zip(crs).filter(|(layer, _)| layer.geometries().next().is_some());
    let Some((first, first_crs)) = filled.next() else { return Ok(None) };
    for (layer, other) in filled {
        let is_same = match (first_crs, other) {
            (Some(a), Some(b)) => a.is_same(b),
            (a, b) => a.is_none() && b.is_none(),
        };
        if !is_same {
            let name = |crs: &Option<PyCrs>| crs.as_ref().map_or("no CRS".into(), Crs::brief_name);
            return Err(marking::Error::MixedCrs {
                first: first.name.clone(),
                first_crs: name(first_crs),
                second: layer.name.clone(),
                second_crs: name(other),
            });
        }
    }
    Ok(first_crs.clone())
}
