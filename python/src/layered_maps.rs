//! Layers as the maps of a verification.

use crate::{
    crs::PyCrs,
    errors::VerificationError,
    layer::{Besides, Layer, numbers, survey},
};
use meshmark_core::{fingerprint_record::BaseEntry, ground::Ground, options::join_list};
use meshmark_marking::{self as marking, Crs, Extent, FeatureGeometry, KnownCrs, Outline, Survey};
use meshmark_verification::{
    IfSuited, Maps, StatedCrs, Suited, Suspect, compare::Compared, words::printable,
};
use pyo3::prelude::*;
use std::collections::BTreeSet;

/// References and a suspect.
pub struct LayeredMaps {
    references: Vec<LayeredMap>,
    suspect: Vec<Layer>,
}

/// The layers of a map. Without names of its own, the only layer is whichever was marked.
#[derive(FromPyObject)]
pub struct LayeredMap {
    layers: Vec<Layer>,
    is_named: bool,
}

impl LayeredMaps {
    /// Takes the package's maps, of its class `_layers.Map`.
    pub fn new(references: &[Bound<PyAny>], suspect: &Bound<PyAny>) -> PyResult<Self> {
        let references = references.iter().map(|reference| reference.extract()).collect::<PyResult<_>>()?;
        Ok(LayeredMaps { references, suspect: suspect.extract::<LayeredMap>()?.layers })
    }

    fn read(
        &self,
        reference: usize,
        layers: Option<&[String]>,
        crs: StatedCrs,
        besides: Besides,
    ) -> marking::Result<Survey<PyCrs>> {
        let known = KnownCrs::parse(crs.srs, crs.recorded)?;
        survey(&self.references[reference].chosen(layers)?, &known, besides)
    }

    fn of_reference(&self, reference: usize, source: marking::Error) -> VerificationError {
        let name = match self.name(reference) {
            Some(name) => format!("the reference {name}"),
            None => "the reference".into(),
        };
        VerificationError::Map { name: Some(name), source }
    }
}

impl LayeredMap {
    /// Returns its metric, metres on the ground.
    pub fn ground(&self) -> marking::Result<Ground> {
        let known = KnownCrs::parse(None, None)?;
        survey(&self.chosen(None)?, &known, Besides::Nothing)?.measure().cloned()
    }

    /// Returns its geometries in order, and the first CRS of a layer.
    pub fn geometries(&self) -> marking::Result<Compared<PyCrs>> {
        let mut all = Vec::new();
        for layer in &self.layers {
            let extent = Extent::in_crs(layer.crs().map(|crs| crs as &dyn Crs));
            for (number, wkb) in layer.geometries() {
                let fid = || layer.fid(number);
                let outline = Outline::of_wkb(wkb.to_vec());
                let outline = outline.map_err(|fault| marking::Error::geometry(&layer.name, fid(), fault))?;
                let mut places = outline.chains.iter().flatten();
                places.try_for_each(|&place| extent.check(place, &layer.name, fid))?;
                all.push(FeatureGeometry { layer: layer.name.clone(), fid: fid(), outline });
            }
        }
        Ok((all, self.layers.iter().find_map(Layer::crs).cloned()))
    }

    fn chosen(&self, wanted: Option<&[String]>) -> marking::Result<Vec<&Layer>> {
        let Some(wanted) = wanted.filter(|_| self.is_named) else { return Ok(self.layers.iter().collect()) };
        let is_known = |name: &&String| self.layers.iter().any(|layer| layer.name == **name);
        if let Some(name) = wanted.iter().find(|name| !is_known(name)) {
            let known: Vec<String> = self.layers.iter().map(|layer| layer.name.clone()).collect();
            return Err(marking::Error::UnknownLayer { name: name.clone(), known: join_list(&known) });
        }
        Ok(self.layers.iter().filter(|layer| wanted.contains(&layer.name)).collect())
    }
}

impl Maps for LayeredMaps {
    type Crs = PyCrs;
    type Error = VerificationError;

    fn references(&self) -> usize {
        self.references.len()
    }

    fn name(&self, reference: usize) -> Option<String> {
        (self.references.len() > 1).then(|| format!("number {}", reference + 1))
    }

    fn reference(
        &mut self,
        reference: usize,
        layers: Option<&[String]>,
        crs: StatedCrs,
    ) -> IfSuited<Survey<PyCrs>, VerificationError> {
        match self.read(reference, layers, crs, Besides::Description) {
            Ok(survey) => Ok(Suited::Yes(survey)),
            Err(error) if error.is_about_options() => Ok(Suited::No(self.of_reference(reference, error))),
            Err(error) => Err(self.of_reference(reference, error)),
        }
    }

    fn base(
        &mut self,
        reference: usize,
        entry: &BaseEntry,
    ) -> Result<Option<Survey<PyCrs>>, VerificationError> {
        let crs = StatedCrs { srs: entry.srs.as_deref(), recorded: None };
        match self.read(reference, entry.layers.as_deref(), crs, Besides::Nothing) {
            Ok(survey) => Ok(Some(survey)),
            Err(error) if error.is_of_other_layers() => Ok(None),
            Err(error) => Err(self.of_reference(reference, error)),
        }
    }

    fn suspect(&mut self) -> Result<Suspect<PyCrs>, VerificationError> {
        let numbers = numbers(&self.suspect).map_err(|error| self.of_suspect(error))?;
        let name = |layer: &Layer| match layer.crs() {
            Some(crs) => printable(&crs.brief_name()),
            None => "no CRS".into(),
        };
        let layer_crs: BTreeSet<String> = self.suspect.iter().map(name).collect();
        let crs = self.suspect.iter().find_map(Layer::crs).cloned();
        Ok(Suspect { numbers, layer_crs: layer_crs.into_iter().collect(), crs })
    }

    fn of_suspect(&self, source: marking::Error) -> VerificationError {
        VerificationError::Map { name: Some("the suspect".into()), source }
    }
}
