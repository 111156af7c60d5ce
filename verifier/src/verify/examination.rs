//! The examination of a suspect: registration, matching, demodulation. No message is involved.

use super::{
    crs_search::{self, Registered},
    request::Request,
};
use crate::{
    Error, ExitCode, Result,
    inputs::{maps, maps::Reading, suspects},
    progress::Progress,
    report::{
        EvidenceMap, VertexCounts,
        sketch::{Scene, Sketch},
    },
};
use meshmark_core::demodulation::Demodulation;
use meshmark_dataset::{Error as MapError, LabelFields, Survey};
use meshmark_detection::{
    Demodulated, Matched, Reference,
    decision::Decoys,
    matching::LEAST_MATCHED,
    registration::{Registrar, Registration, Start},
};

/// The evidence of a suspect before the comparison with a message.
pub struct Examination {
    /// The registration of the suspect.
    pub registration: Registration,
    /// Numbers of vertices of the two maps.
    pub vertices: VertexCounts,
    /// Digest of the vertices of the reference.
    pub reference_digest: String,
    /// CRS of the reference.
    pub crs: Option<String>,
    /// CRS of the layers of the suspect.
    pub suspect_crs: Vec<String>,
    /// The demodulated evidence, or the reason why there is none.
    pub found: std::result::Result<Demodulation, String>,
    /// Scores of decoy keys.
    pub decoys: Option<Decoys>,
    /// The drawing data of a report file, if requested.
    pub sketch: Option<Sketch>,
    /// The evidence map, if requested.
    pub evidence_map: Option<EvidenceMap>,
}

/// Reads the reference of a request.
///
/// # Errors
/// Fails when it cannot be read.
pub fn read_reference(request: &Request, progress: &mut Progress) -> Result<Fit<Survey>> {
    progress.start("reading", 0);
    let (layers, srs) = (request.layers.as_deref(), request.srs.as_deref());
    let reading = Reading { layers, srs, landmarks: request.landmarks(), geometries: false };
    match maps::reference(&request.reference, &reading) {
        Ok(reference) => Ok(Fit::Fits(reference)),
        Err(error) if error.exit_code() == ExitCode::Usage => Ok(Fit::Unfit(error)),
        Err(error) => Err(error),
    }
}

/// The fit of a reference to a request.
pub enum Fit<T> {
    /// A map made from the reference may carry the mark of the request.
    Fits(T),
    /// The reference does not allow the mark; the error holds the reason.
    Unfit(Error),
}

impl<T> Fit<T> {
    /// Returns the value, for a request that names this very reference.
    ///
    /// # Errors
    /// Fails when the reference does not fit.
    pub fn or_fail(self) -> Result<T> {
        match self {
            Fit::Fits(found) => Ok(found),
            Fit::Unfit(error) => Err(error),
        }
    }
}

/// Registers, matches and demodulates the suspect of a request.
///
/// # Errors
/// Fails when the suspect is unreadable.
pub fn examine(request: &Request, reference: &Survey, progress: &mut Progress) -> Result<Fit<Examination>> {
    let unfit = |source: MapError| Fit::Unfit(Error::Unfit { path: request.reference.clone(), source });
    let map = match reference.map() {
        Ok(map) => map,
        Err(error) => return Ok(unfit(error)),
    };
    progress.start("reading", 0);
    let plain = Reading { layers: None, srs: None, landmarks: LabelFields::All, geometries: false };
    let suspect = suspects::suspect(&request.suspect, &plain, reference)?;
    let suspect_crs = suspect.layer_crs.clone();

    progress.start("patches", 0);
    let compared = Reference::new(&reference.data, &map, request.bits, &request.parameters);
    let compared = match compared {
        Ok(compared) => compared,
        Err(error) => return Ok(unfit(error.into())), // this comes before the search for the map
    };

    progress.start("registration", 0);
    let registrar = Registrar::new(&reference.data, &compared.ground, request.radius_m);
    let file = (request.suspect.as_path(), &plain);
    let Registered { map: suspect, registration } =
        crs_search::register(&registrar, reference, suspect, file, request.registration)?;

    progress.start("matching", 0);
    let matched = Matched::new(&compared, &suspect.data, &registration, request.radius_m);
    let mark = (request.mark(), request.demodulator);
    let demodulated = match matched.is_chance() {
        true => None,
        false => {
            let found =
                progress.listen(|listener| matched.demodulate(mark.0, mark.1, request.radius_m, listener));
            match found {
                Ok(found) => Some(found),
                Err(error) => return Ok(unfit(error.into())),
            }
        }
    };
    let matches = demodulated.as_ref().map_or(&matched.matches, |demodulated| &demodulated.matches);
    let vertices = VertexCounts {
        reference: reference.data.vertices.len(),
        suspect: suspect.data.vertices.len(),
        matched: matches.count,
    };
    let scene = Scene { matched: &matched, matches, demodulated: demodulated.as_ref() };
    let sketch = request.sketch.then(|| scene.sketch(&registration));
    let evidence_map = request.evidence_map.then(|| EvidenceMap::new(&scene, reference.crs.as_ref()));
    let (found, decoys) = match demodulated {
        Some(Demodulated { found, decoys, .. }) => (Ok(found), decoys),
        None => (Err(unregistered(&vertices, matched.by_chance, request.registration)), None),
    };
    Ok(Fit::Fits(Examination {
        registration,
        vertices,
        reference_digest: reference.data.vertices.digest(),
        crs: reference.crs.as_ref().map(|crs| crs.brief_name()),
        suspect_crs,
        found,
        decoys,
        sketch,
        evidence_map,
    }))
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
