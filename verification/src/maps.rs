//! The maps of a verification, which a front end reads.

use crate::error::Error;
use meshmark_core::fingerprint_record::BaseEntry;
use meshmark_marking::{self as marking, Numbers, Survey, TransformableCrs};
use std::fmt::Display;

/// The maps of a verification, as a front end has them: references, by number, and one suspect.
pub trait Maps {
    /// The CRS of the front end's library.
    type Crs: TransformableCrs;
    /// The error of a map that cannot be read, and of a verification.
    type Error: From<Error> + From<marking::Error> + Display;

    /// Returns how many references there are.
    fn references(&self) -> usize;

    /// Returns the name of a reference for messages; `None` for the only one of a front end without
    /// files.
    fn name(&self, reference: usize) -> Option<String>;

    /// Reads these layers of a reference (all without names), of which this is known beside the map
    /// ([`KnownCrs`](marking::KnownCrs)).
    ///
    /// # Errors
    /// Fails when it cannot be read.
    fn reference(
        &mut self,
        reference: usize,
        layers: Option<&[String]>,
        crs: StatedCrs,
    ) -> IfSuited<Survey<Self::Crs>, Self::Error>;

    /// Reads the vertices of a reference as an edition describes it; nothing where a map lacks its layers.
    ///
    /// # Errors
    /// Fails when it cannot be read.
    fn base(&mut self, reference: usize, entry: &BaseEntry)
    -> Result<Option<Survey<Self::Crs>>, Self::Error>;

    /// Reads the suspect whole, with all its attributes.
    ///
    /// # Errors
    /// Fails when it cannot be read.
    fn suspect(&mut self) -> Result<Suspect<Self::Crs>, Self::Error>;

    /// Returns the error of a suspect that was read and cannot be compared.
    fn of_suspect(&self, error: marking::Error) -> Self::Error;
}

/// The CRS of a reference, as option and record state it.
#[derive(Debug, Clone, Copy)]
pub struct StatedCrs<'a> {
    /// That of a reference that has none.
    pub srs: Option<&'a str>,
    /// That in which it was marked.
    pub recorded: Option<&'a str>,
}

/// A value, if the reference is suited to the request.
pub enum Suited<T, E> {
    /// A map made from the reference may carry the mark of the request.
    Yes(T),
    /// The reference does not allow the mark; the error holds the reason.
    No(E),
}

/// A value, where the reference is suited to the request, or the error of a map that cannot be read.
pub type IfSuited<T, E> = Result<Suited<T, E>, E>;

impl<T, E> Suited<T, E> {
    /// Returns the value, for a request that names this very reference.
    ///
    /// # Errors
    /// Fails when the reference does not fit.
    pub fn or_fail(self) -> Result<T, E> {
        match self {
            Suited::Yes(found) => Ok(found),
            Suited::No(error) => Err(error),
        }
    }
}

/// A suspect before it is brought into the CRS of a reference.
#[derive(Clone)]
pub struct Suspect<C> {
    /// Its numbers.
    pub numbers: Numbers<C>,
    /// Names of the CRS of its layers, each once, sorted.
    pub layer_crs: Vec<String>,
    /// The first CRS of a layer.
    pub crs: Option<C>,
}
