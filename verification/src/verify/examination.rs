//! The examination of a suspect: registration, matching, evidence.

use super::{
    crs_search::{self, Placed, Registered},
    drawing,
    evidence::{self, FingerprintEvidence, Found, MessageEvidence, Surroundings},
    request::{Request, Sought},
};
use crate::{
    Error, IfSuited, Maps, Stages, Suited,
    report::{EvidenceMap, VertexCounts, sketch::Sketch},
};
use meshmark_core::{fingerprint_record::PartEntry, map::Map};
use meshmark_detection::{
    Matched, Observations, Reference,
    decision::{Decision, Expected, decide_among},
    maps_of_features,
    matching::{LEAST_MATCHED, Radius},
    registration::{Registrar, Registration, Start},
};
use meshmark_marking::{self as marking, Bases, Crs, CrsSource, LeftOut, Survey, TransformableCrs};

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
    /// Where it comes from.
    pub crs_source: CrsSource,
    /// CRS of the layers of the suspect.
    pub suspect_crs: Vec<String>,
    /// The matching radius.
    pub radius: Radius,
    /// The evidence about the mark, or the reason why there is none.
    pub found: Result<Found, String>,
    /// What the displacements were observed on, where there is evidence.
    pub observations: Option<Observations>,
    /// The drawing data of a report file, if requested.
    pub sketch: Option<Sketch>,
    /// The evidence map, if requested.
    pub evidence_map: Option<EvidenceMap>,
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

/// Registers and matches the suspect against a reference, which has a name for messages, and collects the
/// evidence about the mark of a request.
///
/// # Errors
/// Fails when the suspect is unreadable.
pub fn examine<M: Maps>(
    maps: &mut M,
    request: &Request,
    (reference, name, bases): (&Survey<M::Crs>, Option<String>, &Bases),
    stages: &mut Stages,
) -> IfSuited<Examination, M::Error> {
    let unfit =
        |source| Suited::No(Error::Unfit { reference: name.clone(), source: Box::new(source) }.into());
    let map = match reference.map(&request.parameters) {
        Ok(map) => map,
        Err(error) => return Ok(unfit(error)),
    };
    stages.start("reading", 0);
    let suspect = maps.suspect()?;
    let suspect_crs = suspect.layer_crs.clone();
    let suspect = Placed::new(suspect, reference).map_err(|error| maps.of_suspect(error))?;
    stages.start("patches", 0);
    let digest = reference.data.vertices.digest();
    let united = (!bases.are_none()).then(|| bases.united(reference)).transpose()?;
    let reference = united.as_ref().unwrap_or(reference);
    let compared = match compared(request, map, (reference, bases)) {
        Ok(compared) => compared,
        Err(error) => return Ok(unfit(error)), // this comes before the search for the map
    };
    let recorded = &request.lineage.divided.parts;
    if !recorded.is_empty() && !has_parts(&compared, recorded) {
        return Ok(Suited::No(Error::OtherPartsOfBases { parts: recorded.len() }.into()));
    }
    let registered = register(request, (reference, &compared), suspect, stages);
    let Registered { map: suspect, registration } = registered.map_err(|error| maps.of_suspect(error))?;
    stages.start("matching", 0);
    let matched = Matched::new(&compared, &suspect.data, &registration, request.settings.radius);
    let evidence = match evidence::collect(request, &matched, stages) {
        Ok(evidence) => evidence,
        Err(error) => return Ok(unfit(error.into())),
    };
    let seen = seen(request, (&matched, evidence), registration);
    let (left_out, crs) = (suspect.left_out, reference.crs().map(|crs| crs.brief_name()));
    let crs_source = reference.crs_source.clone();
    Ok(Suited::Yes(Examination { suspect_crs, left_out, crs, crs_source, reference_digest: digest, ..seen }))
}

/// Meshes the reference, which has the vertices of its bases, too; `newest` has its own alone.
fn compared<'a, C: Crs>(
    request: &Request,
    newest: Map,
    (reference, bases): (&'a Survey<C>, &Bases),
) -> marking::Result<Reference<'a>> {
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

/// Registers a suspect on the vertices of its reference, or on the points of its features where it
/// consists of such points.
fn register<C: TransformableCrs>(
    request: &Request,
    (reference, compared): (&Survey<C>, &Reference),
    suspect: Placed<C>,
    stages: &mut Stages,
) -> marking::Result<Registered<C>> {
    stages.start("registration", 0);
    let registrar_of = |map| Registrar::new(map, &compared.ground, request.settings.radius.least_m());
    let onto = |map, suspect: Placed<C>| {
        crs_search::register(&registrar_of(map), reference, suspect, request.settings.registration)
    };
    let maps_of_features = maps_of_features(&reference.data, &compared.ground, &suspect.map.data)?;
    if request.settings.registration == Start::Auto && !suspect.is_raw {
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

/// Returns what was seen of a suspect that was matched, without what its reading says.
fn seen(
    request: &Request,
    (matched, evidence): (&Matched, Option<(Found, Surroundings)>),
    registration: Registration,
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
    let exact_displacements = request.settings.exact_displacements;
    let scene = drawing::Scene { matched, matches, deformation, weights, exact_displacements };
    let sketch = request.settings.sketch.then(|| drawing::sketch(&scene, &registration));
    let evidence_map = request.settings.evidence_map.then(|| drawing::evidence_map(&scene));
    let observations = around.map(|around| around.observations);
    let found =
        found.ok_or_else(|| unregistered(&vertices, matched.by_chance, request.settings.registration));
    Examination {
        registration,
        vertices,
        reference_digest: reference.digest(),
        crs: None,
        crs_source: CrsSource::Map,
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
