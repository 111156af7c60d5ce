//! The files of a verification as its maps.

use super::{
    maps::{self, Reading, failed},
    private_copy::PrivateCopy,
    suspects,
};
use crate::{Error, Result};
use meshmark_core::fingerprint_record::BaseEntry;
use meshmark_dataset::{CoordinateSystem, LabelFields, Survey};
use meshmark_marking as marking;
use meshmark_verification::{IfSuited, Maps, StatedCrs, Suited, Suspect};
use std::path::PathBuf;

/// References and a suspect.
pub struct MapFiles {
    /// The maps before marking.
    pub references: Vec<PathBuf>,
    /// The suspect map.
    pub suspect: PrivateCopy,
    /// Fields of the references that become landmarks; all when empty. Fields of the suspect may have
    /// other names.
    pub landmarks: Vec<String>,
}

impl Maps for MapFiles {
    type Crs = CoordinateSystem;
    type Error = Error;

    fn references(&self) -> usize {
        self.references.len()
    }

    fn name(&self, reference: usize) -> Option<String> {
        Some(self.references[reference].display().to_string())
    }

    fn reference(
        &mut self,
        reference: usize,
        layers: Option<&[String]>,
        crs: StatedCrs,
    ) -> IfSuited<Survey, Error> {
        let landmarks = match self.landmarks.as_slice() {
            [] => LabelFields::All,
            names => LabelFields::Named(names),
        };
        let StatedCrs { srs, recorded: recorded_crs } = crs;
        let reading = Reading { layers, srs, recorded_crs, landmarks, geometries: false };
        match maps::reference(&self.references[reference], &reading) {
            Ok(reference) => Ok(Suited::Yes(reference)),
            Err(error) if error.is_about_options() => Ok(Suited::No(error)),
            Err(error) => Err(error),
        }
    }

    fn base(&mut self, reference: usize, entry: &BaseEntry) -> Result<Option<Survey>> {
        maps::base_reference(&self.references[reference], entry)
    }

    fn suspect(&mut self) -> Result<Suspect<CoordinateSystem>> {
        suspects::suspect(&self.suspect)
    }

    fn of_suspect(&self, error: marking::Error) -> Error {
        failed("suspect", self.suspect.original(), error)
    }
}
