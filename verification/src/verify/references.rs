//! Several references, such as the editions of a map: every record finds its own.

use super::{
    belonging::{check_reference, is_made_from},
    request::Request,
};
use crate::{Error, IfSuited, Maps, Stages, StatedCrs, Suited};
use meshmark_core::fingerprint_record::BaseEntry;
use meshmark_marking::{self as marking, Bases, KnownCrs, Lineage, Survey};

/// Reads a reference of a request.
///
/// # Errors
/// Fails when it cannot be read, and when the option SRS contradicts the record.
pub fn read_reference<M: Maps>(
    maps: &mut M,
    reference: usize,
    request: &Request,
    stages: &mut Stages,
) -> IfSuited<Survey<M::Crs>, M::Error> {
    stages.start("reading", 0);
    let crs = StatedCrs { srs: request.srs.as_deref(), recorded: request.recorded_crs.as_deref() };
    if let Some(value) = crs.srs
        && KnownCrs::<M::Crs>::parse(crs.srs, crs.recorded).is_ok_and(|known| known.is_contradiction())
    {
        return Err(Error::Contradiction { option: "SRS".into(), value: value.into() }.into());
    }
    let layers = request.layers.as_deref();
    match maps.reference(reference, layers, crs) {
        // In the CRS of another map's record the numbers may lie nowhere; its digest then refuses the record.
        Err(_) if crs.recorded.is_some() => {
            maps.reference(reference, layers, StatedCrs { recorded: None, ..crs })
        }
        read => read,
    }
}

/// Reads the only reference, or that of several from which the record of the request was made, and
/// returns it with its number.
///
/// # Errors
/// Fails when a reference is unreadable, when there is no record to choose by, and when the record
/// is of none of them.
pub fn read_own_reference<M: Maps>(
    maps: &mut M,
    request: &Request,
    stages: &mut Stages,
) -> IfSuited<(usize, Survey<M::Crs>), M::Error> {
    let references = maps.references();
    if references == 1 {
        let reference = match read_reference(maps, 0, request, stages)? {
            Suited::Yes(reference) => reference,
            Suited::No(error) => return Ok(Suited::No(error)),
        };
        if let Some(read) = &request.record {
            let digest = reference.data.vertices.digest();
            check_reference(&read.record, (&reference, maps.name(0)), &digest)?;
        }
        return Ok(Suited::Yes((0, reference)));
    }
    let Some(read) = &request.record else { return Err(Error::SeveralReferences.into()) };
    for number in 0..references {
        if let Suited::Yes(reference) = read_reference(maps, number, request, stages)?
            && is_made_from(&read.record, &reference.data.vertices.digest())
        {
            return Ok(Suited::Yes((number, reference)));
        }
    }
    Err(Error::NoReferenceOfRecord { references }.into())
}

/// Finds the editions that the record of a request rests on among the references, and takes its anchors.
/// Without one of them, the references do not suit the request.
///
/// # Errors
/// Fails when a reference is unreadable.
pub fn read_bases<M: Maps>(maps: &mut M, request: &Request) -> IfSuited<Bases, M::Error> {
    let Lineage { bases, anchors, .. } = request.lineage.clone();
    let part_size = Some(request.part_size).filter(|part_size| *part_size > 0);
    let references: Vec<usize> = (0..maps.references()).collect();
    let mut read =
        |reference: &usize, entry: &BaseEntry| maps.base(*reference, entry).map_err(NoBases::Unread);
    match Bases::find((bases, anchors), part_size, &references, &mut read) {
        Ok(bases) => Ok(Suited::Yes(bases)),
        Err(NoBases::Lost(error)) => Ok(Suited::No(error.into())),
        Err(NoBases::Unread(error)) => Err(error),
    }
}

/// Why there are no bases.
enum NoBases<E> {
    Lost(marking::Error),
    Unread(E),
}

impl<E> From<marking::Error> for NoBases<E> {
    fn from(error: marking::Error) -> Self {
        NoBases::Lost(error)
    }
}
