//! The examination of a suspect: registration, matching, evidence.

use super::{
    crs_search::{self, Registered},
    drawing,
    evidence::{self, FingerprintEvidence, Found, MessageEvidence, Surroundings},
    request::{Request, Sought},
};
use crate::{
    Error, Result,
    inputs::{
        maps::{self, Reading},
        suspects::{self, Suspect},
    },
    progress::Progress,
    report::{EvidenceMap, VertexCounts, sketch::Sketch},
};
use meshmark_core::{fingerprint_record::PartEntry, map::Map};
use meshmark_dataset::{Bases, CoordinateSystem, Survey};
use meshmark_detection::{
    Matched, Observations, Reference,
    decision::{Decision, Expected, decide_among},
    maps_of_features,
    matching::{LEAST_MATCHED, Radius},
    registration::{Registrar, Registration, Start},
};
use meshmark_marking::{Crs, LeftOut};

/// The evidence of a suspect.
pub struct Examination {
    /// The registration of the suspect.
    pub registration: Registration,
    /// Numbers of vertices of the two maps.
    pub vertices: VertexCounts,
    /// What the suspect has that was left out.
    pub left_out: LeftOut,
    /// Digest of the vertices of the reference.
    pub reference_digest: String,
    /// CRS of the reference.
    pub crs: Option<String>,
    /// CRS of the layers of the suspect.
    pub suspect_crs: Vec<String>,
    /// The matching radius.
    pub radius: Radius,
    /// The evidence about the mark, or the reason why there is none.
    pub found: std::result::Result<Found, String>,
    /// What the displacements were observed on, where there is evidence.
    pub observations: Option<Observations>,
    /// The drawing data of a report file, if requested.
    pub sketch: Option<Sketch>,
    /// The evidence map, if requested.
    pub evidence_map: Option<EvidenceMap>,
}

/// Reads the reference of a request.
///
/// # Errors
/// Fails when it cannot be read.
pub fn read_reference(request: &Request, progress: &mut Progress) -> Result<Suited<Survey>> {
    progress.start("reading", 0);
    let (layers, srs) = (request.layers.as_deref(), request.srs.as_deref());
    let reading = Reading { layers, srs, landmarks: request.landmarks(), geometries: false };
    match maps::reference(&request.reference, &reading) {
        Ok(reference) => Ok(Suited::Yes(reference)),
        Err(error) if error.is_about_options() => Ok(Suited::No(error)),
        Err(error) => Err(error),
    }
}

/// A value, if the reference is suited to the request.
pub enum Suited<T> {
    /// A map made from the reference may carry the mark of the request.
    Yes(T),
    /// The reference does not allow the mark; the error holds the reason.
    No(Error),
}

impl Examination {
    /// Returns the evidence about a message, if one is sought and there is any.
    pub fn message(&self) -> Option<&MessageEvidence> {
        match &self.found {
            Ok(Found::Message(evidence)) => Some(evidence),
            _ => None,
        }
    }

    /// Returns the evidence about a fingerprint, if one is sought and there is any.
    pub fn fingerprint(&self) -> Option<&FingerprintEvidence> {
        match &self.found {
            Ok(Found::Fingerprint(evidence)) => Some(evidence),
            _ => None,
        }
    }

    /// Decides on an expected message, one of the `tried`.
    pub fn decide(&self, expected: &Expected, tried: usize, significance: f64) -> Decision {
        match &self.found {
            Ok(Found::Message(MessageEvidence { demodulation, power, .. })) => {
                decide_among(demodulation, *power, expected, tried, significance)
            }
            Ok(Found::Fingerprint(_)) => unreachable!("a message is sought"),
            Err(reason) => Decision::inconclusive(reason.clone()),
        }
    }
}

impl<T> Suited<T> {
    /// Returns the value, for a request that names this very reference.
    ///
    /// # Errors
    /// Fails when the reference does not fit.
    pub fn or_fail(self) -> Result<T> {
        match self {
            Suited::Yes(found) => Ok(found),
            Suited::No(error) => Err(error),
        }
    }
}

/// Registers and matches the suspect of a request, and collects the evidence about its mark.
///
/// # Errors
/// Fails when the suspect is unreadable.
pub fn examine(
    request: &Request,
    (reference, bases): (&Survey, &Bases),
    progress: &mut Progress,
) -> Result<Suited<Examination>> {
    let unfit =
        |source| Suited::No(Error::Unfit { path: request.reference.clone(), source: Box::new(source) });
    let map = match reference.map(&request.parameters) {
        Ok(map) => map,
        Err(error) => return Ok(unfit(error)),
    };
    let suspect = read_suspect(request, reference, progress)?;
    let suspect_crs = suspect.layer_crs.clone();
    progress.start("patches", 0);
    let digest = reference.data.vertices.digest();
    let united = (!bases.are_none()).then(|| bases.united(reference)).transpose()?;
    let reference = united.as_ref().unwrap_or(reference);
    let compared = match compared(request, map, (reference, bases)) {
        Ok(compared) => compared,
        Err(error) => return Ok(unfit(error)), // this comes before the search for the map
    };
    let recorded = &request.lineage.divided.parts;
    if !recorded.is_empty() && !has_parts(&compared, recorded) {
        return Ok(Suited::No(Error::OtherPartsOfBases { parts: recorded.len() }));
    }
    let Registered { map: suspect, registration } =
        register(request, (reference, &compared), suspect, progress)?;
    progress.start("matching", 0);
    let matched = Matched::new(&compared, &suspect.data, &registration, request.radius);
    let evidence = match evidence::collect(request, &matched, progress) {
        Ok(evidence) => evidence,
        Err(error) => return Ok(unfit(error.into())),
    };
    let crs = reference.crs.as_ref();
    let seen = seen(request, (&matched, evidence), registration, crs);
    let left_out = suspect.left_out;
    Ok(Suited::Yes(Examination { suspect_crs, left_out, reference_digest: digest, ..seen }))
}

/// Meshes the reference, which has the vertices of its bases, too; `newest` has its own alone.
fn compared<'a>(
    request: &Request,
    newest: Map,
    (reference, bases): (&'a Survey, &Bases),
) -> meshmark_dataset::Result<Reference<'a>> {
    let parameters = &request.parameters;
    let map = reference.map(parameters)?;
    Ok(match &request.sought {
        Sought::Message { bits } => Reference::new(&reference.data, &map, *bits, parameters)?,
        Sought::Fingerprint { coefficients, .. } => {
            let series = bases.series(newest, parameters)?;
            Reference::for_fingerprints(&reference.data, &map, &series, *coefficients)?
        }
    })
}

fn has_parts(reference: &Reference, recorded: &[PartEntry]) -> bool {
    reference.parts.as_slice().iter().map(|part| part.digest).eq(recorded.iter().map(|part| part.sha256))
}

fn read_suspect(request: &Request, reference: &Survey, progress: &mut Progress) -> Result<Suspect> {
    progress.start("reading", 0);
    suspects::suspect(&request.suspect, reference)
}

/// Registers a suspect on the vertices of its reference, or on the points of its features where it
/// consists of such points.
fn register(
    request: &Request,
    (reference, compared): (&Survey, &Reference),
    suspect: Suspect,
    progress: &mut Progress,
) -> Result<Registered> {
    progress.start("registration", 0);
    let registrar_of = |map| Registrar::new(map, &compared.ground, request.radius.least_m());
    let onto = |map, suspect: Suspect| {
        let registered = crs_search::register(&registrar_of(map), reference, suspect, request.registration);
        registered.map_err(|error| maps::failed("suspect", request.suspect.original(), error))
    };
    let maps_of_features = maps_of_features(&reference.data, &compared.ground, &suspect.map.data)?;
    if request.registration == Start::Auto && !suspect.is_raw {
        let in_place = |map| registrar_of(map).refine_in_place(&suspect.map.data);
        if let Some(registration) = maps_of_features.iter().map(in_place).find(Registration::agrees) {
            return Ok(Registered { map: suspect.map, registration });
        }
    }
    let again = (!maps_of_features.is_empty()).then(|| suspect.clone());
    let mut best = onto(&reference.data, suspect)?;
    for (map, suspect) in maps_of_features.iter().zip(again.iter().cycle()) {
        if !best.registration.agrees() {
            let next = onto(map, suspect.clone())?;
            best = if next.registration.share > best.registration.share { next } else { best };
        }
    }
    Ok(best)
}

/// Returns the examination of a suspect that was matched. `crs` is that of the reference.
fn seen(
    request: &Request,
    (matched, evidence): (&Matched, Option<(Found, Surroundings)>),
    registration: Registration,
    crs: Option<&CoordinateSystem>,
) -> Examination {
    let (found, around) = evidence.unzip();
    let around = around.as_ref();
    // A CRS is only found where the suspect is.
    let read_as = registration.read_as.clone().filter(|_| found.is_some());
    let registration = Registration { read_as, ..registration };
    let matches = around.map_or(&matched.matches, |around| &around.matches);
    let radius = around.map_or(matched.radius, |around| around.radius);
    let reference = &matched.reference.data.vertices;
    let suspect = matched.suspect.vertices.len();
    let vertices = VertexCounts { reference: reference.len(), suspect, matched: matches.count };
    let deformation = around.and_then(|around| around.deformation);
    let weights = around.map_or(&[][..], |around| &around.weights);
    let exact_displacements = request.exact_displacements;
    let scene = drawing::Scene { matched, matches, deformation, weights, exact_displacements };
    let sketch = request.sketch.then(|| drawing::sketch(&scene, &registration));
    let evidence_map = request.evidence_map.then(|| drawing::evidence_map(&scene, crs));
    let observations = around.map(|around| around.observations);
    let found = found.ok_or_else(|| unregistered(&vertices, matched.by_chance, request.registration));
    Examination {
        registration,
        vertices,
        reference_digest: reference.digest(),
        crs: crs.map(|crs| crs.brief_name()),
        suspect_crs: Vec::new(),
        left_out: LeftOut::default(),
        radius,
        found,
        observations,
        sketch,
        evidence_map,
    }
}

fn unregistered(vertices: &VertexCounts, chance: usize, start: Start) -> String {
    if vertices.suspect == 0 {
        return "the suspect has no vertices, so there is nothing to compare".into();
    }
    let remedy = match start {
        Start::Auto => "",
        Start::Landmarks => "; only landmarks were tried, --registration auto tries all that is known",
        Start::Geometry => {
            "; only geometry was tried, for which too few features may have a shape of their own: --registration auto \
             tries landmarks too"
        }
        Start::None => "; it was taken as it stands, --registration auto looks for its place",
    };
    format!(
        "only {} of {} reference vertices match, where {LEAST_MATCHED} are needed and {chance} match by chance: the suspect is \
         too small a piece, another map, or could not be brought onto the reference{remedy}",
        vertices.matched, vertices.reference
    )
}
