//! Verification from files to a report.

use crate::{
    Error, Result,
    crs_search::{self, Registered, side},
    decision::{Decision, Expected, decide_among},
    decoys::Decoys,
    evidence_map::EvidenceMap,
    joined::Graph,
    matching::{Matcher, Matches},
    progress::Progress,
    reading::{self, Reading},
    registration::{LEAST_MATCHED, OUT_OF_PLACE, Registrar, Registration, Start, TIMES_CHANCE},
    report::{Report, VertexCounts},
    sketch::{Scene, Sketch},
};
use meshmark_core::{
    carrier::Carrier,
    deformation::{Deformation, Observed, Prediction, mark_deviation_m},
    demodulation::{self, Demodulation},
    ground::Ground,
    key::SecretKey,
    options::{Parameters, Spelling, Subject},
    patches::Patches,
    record::Record,
};
use meshmark_dataset::{LabelFields, Survey};
use std::path::PathBuf;

/// Which of core's demodulators to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Demodulator {
    /// The detector of Ohbuchi, Ueda and Endoh.
    Paper,
    /// Least squares over the vertices that were found.
    Joint,
}

/// What to verify, and against what.
#[derive(Clone)]
pub struct Request {
    /// The secret key.
    pub key: SecretKey,
    /// The map before it was marked.
    pub reference: PathBuf,
    /// The map in question.
    pub suspect: PathBuf,
    /// What the driver wrote when it marked.
    pub record: Option<Record>,
    /// What the mark should say, if it is known.
    pub subject: Option<Subject>,
    /// Bits of the message.
    pub bits: usize,
    /// The numbers that shaped the mark.
    pub parameters: Parameters,
    /// Layers that were marked; all when `None`.
    pub layers: Option<Vec<String>>,
    /// CRS of the reference when it has none.
    pub srs: Option<String>,
    /// Fields of the reference to use as landmarks; all when empty. Those of the suspect may have other names.
    pub landmarks: Vec<String>,
    /// Where to start the registration.
    pub registration: Start,
    /// How to demodulate.
    pub demodulator: Demodulator,
    /// Matching radius t, metres.
    pub radius_m: f64,
    /// p-values below this are a match.
    pub significance: f64,
    /// Whether to keep what a report file draws.
    pub sketch: bool,
    /// Whether to keep what a GIS draws.
    pub evidence_map: bool,
}

impl Request {
    /// The bits that the code should carry, if they are known.
    pub fn expected(&self) -> Option<Expected> {
        self.subject.as_ref().map(|subject| Expected::new(subject, &self.key))
    }

    /// The recipient that the message is made from.
    pub fn recipient(&self) -> Option<&str> {
        self.subject.as_ref().and_then(Subject::recipient)
    }

    /// What the mark may say: without a record, a message may be of the time before whitening.
    fn subjects(&self) -> Vec<Subject> {
        match (&self.record, &self.subject) {
            (None, Some(Subject::Message(message))) => {
                vec![Subject::Message(message.clone()), Subject::Unwhitened(message.clone())]
            }
            (_, subject) => subject.iter().cloned().collect(),
        }
    }

    fn landmarks(&self) -> LabelFields<'_> {
        match self.landmarks.as_slice() {
            [] => LabelFields::All,
            names => LabelFields::Named(names),
        }
    }
}

/// What a suspect shows before it is compared with any message.
pub struct Examination {
    /// How the suspect was brought onto the reference.
    pub registration: Registration,
    /// Vertices of the two maps.
    pub vertices: VertexCounts,
    /// Digest of the vertices of the reference.
    pub reference_digest: String,
    /// CRS of the reference.
    pub crs: Option<String>,
    /// CRS of the suspect's layers.
    pub suspect_crs: Vec<String>,
    /// What was demodulated, or why nothing was.
    pub found: std::result::Result<Demodulation, String>,
    /// How decoy keys score.
    pub decoys: Option<Decoys>,
    /// What a report file draws, when that was asked for.
    pub sketch: Option<Sketch>,
    /// What a GIS draws, when that was asked for.
    pub evidence_map: Option<EvidenceMap>,
}

/// Verifies one suspect.
///
/// # Errors
/// Unreadable input, parameters that do not fit the reference, a record of another reference.
pub fn verify(request: &Request, progress: &mut Progress) -> Result<Report> {
    let reference = read_reference(request, progress)?;
    if let Some(record) = &request.record {
        check_reference(record, request, &reference, &reference.vertices.digest())?;
    }
    let seen = examine(request, &reference, progress)?;
    let (subject, decision) = match &seen.found {
        Ok(found) => decide_subjects(request, found),
        Err(reason) => (request.subject.clone(), Decision::inconclusive(reason.clone())),
    };
    let request = Request { subject, ..request.clone() };
    Ok(Report::new(&request, &seen, decision, progress.finish()))
}

/// The best of what the mark may say, and the decision on it.
fn decide_subjects(request: &Request, found: &Demodulation) -> (Option<Subject>, Decision) {
    let subjects = request.subjects();
    let tried = subjects.len();
    let decide = |subject: Subject| {
        let expected = Expected::new(&subject, &request.key);
        (Some(subject), decide_among(found, &expected, tried, request.significance))
    };
    let p = |decision: &Decision| decision.p_value_log10().unwrap_or(f64::INFINITY);
    let decisions = subjects.into_iter().map(decide);
    let best = decisions.min_by(|(_, a), (_, b)| p(a).total_cmp(&p(b)));
    best.unwrap_or_else(|| (None, Decision::without_message()))
}

/// Reads the reference of a request.
///
/// # Errors
/// It cannot be read, or has not what the request names.
pub fn read_reference(request: &Request, progress: &mut Progress) -> Result<Survey> {
    progress.start("reading", 0);
    let (layers, srs) = (request.layers.as_deref(), request.srs.as_deref());
    reading::reference(
        &request.reference,
        &Reading { layers, srs, landmarks: request.landmarks(), geometries: false },
    )
}

/// Registers, matches and demodulates the suspect of a request.
///
/// # Errors
/// An unreadable suspect, parameters that do not fit the reference.
pub fn examine(request: &Request, reference: &Survey, progress: &mut Progress) -> Result<Examination> {
    let map = reference.map().map_err(|error| of_reference(request, error))?;
    let ground = map.ground;
    progress.start("reading", 0);
    let plain = Reading { layers: None, srs: None, landmarks: LabelFields::All, geometries: false };
    let suspect = reading::suspect(&request.suspect, &plain, reference)?;
    let suspect_crs = suspect.layer_crs.clone();

    progress.start("patches", 0);
    let patches = Patches::new(&map, &request.parameters);
    let patches = patches.map_err(|error| of_reference(request, error))?;
    let carriers = patches.carriers(request.bits, &request.parameters); // before the map is searched for
    carriers.map_err(|error| of_reference(request, error))?;

    progress.start("registration", 0);
    let (radius_m, start) = (request.radius_m, request.registration);
    let registrar = Registrar::new(side(reference), &ground, radius_m);
    let file = (request.suspect.as_path(), &plain);
    let Registered { map: suspect, registration } =
        crs_search::register(&registrar, reference, suspect, file, start)?;

    progress.start("matching", 0);
    let moved = registration.apply(suspect.vertices.coords());
    let matcher = Matcher::new(reference.vertices.coords(), &ground, reference.vertices.centre());
    let matches = matcher.all(&moved, request.radius_m);
    let chance = by_chance(&matcher, &moved, &ground, reference.vertices.centre(), request.radius_m);

    let vertices = VertexCounts {
        reference: reference.vertices.len(),
        suspect: suspect.vertices.len(),
        matched: matches.count,
    };
    let mut seen = Examination {
        registration,
        vertices,
        reference_digest: reference.vertices.digest(),
        crs: reference.crs.as_ref().map(|crs| crs.brief_name()),
        suspect_crs,
        found: Err(unregistered(&vertices, chance, start)),
        decoys: None,
        sketch: None,
        evidence_map: None,
    };
    let mut scene = Scene {
        reference,
        suspect: &suspect,
        moved: &moved,
        ground: &ground,
        patches: &patches,
        matches,
        deformation: None,
        weights: None,
    };
    if scene.matches.count >= LEAST_MATCHED && scene.matches.count >= TIMES_CHANCE * chance {
        let graphs = [reference, &suspect].map(|map| Graph::new(map.vertices.len(), &map.segments));
        let tracking = Tracking { reference, moved: &moved, ground: &ground, patches: &patches, graphs };
        let found = demodulate(request, &tracking, &mut scene, progress);
        let found = found.map_err(|error| of_reference(request, error))?;
        seen.vertices.matched = scene.matches.count;
        seen.decoys = Decoys::new(&found, &suspect.vertices, &reference.vertices);
        seen.found = Ok(found);
    }
    seen.sketch = request.sketch.then(|| scene.sketch(&seen.registration));
    seen.evidence_map = request.evidence_map.then(|| EvidenceMap::new(&scene));
    Ok(seen)
}

/// What does not fit the reference: its options are flags here.
fn of_reference(request: &Request, error: impl Into<meshmark_dataset::Error>) -> Error {
    Error::Usage(format!(
        "the reference {}: {}",
        request.reference.display(),
        error.into().text(Spelling::Flag)
    ))
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

/// The paper's demodulator takes the matches as they are; the joint one follows a deformation first, which changes
/// the matches of the scene.
fn demodulate(
    request: &Request,
    tracking: &Tracking,
    scene: &mut Scene,
    progress: &mut Progress,
) -> meshmark_core::Result<Demodulation> {
    let (bits, parameters, patches) = (request.bits, &request.parameters, tracking.patches);
    let (carrier, steps) = (Carrier::new(&request.key), patches.as_slice().len() as u64);
    if request.demodulator == Demodulator::Paper {
        progress.start("demodulation", steps);
        let matched = tracking.displacements(&scene.matches);
        scene.weights = Some(vec![1.0; matched.len()]);
        return demodulation::paper(patches, &carrier, &matched, bits, parameters, &progress.stepper());
    }
    progress.start("deformation", 0);
    let carriers = patches.carriers(bits, parameters)?;
    let Followed { matches, observed, disturbance } = tracking.follow(carriers, request)?;
    scene.matches = matches;
    scene.deformation = Some(disturbance.deformation);
    progress.start("demodulation", steps);
    let step = progress.stepper();
    let found = demodulation::joint(patches, &carrier, &observed, bits, parameters, &disturbance, &step)?;
    scene.weights = Some(disturbance.weights);
    Ok(found)
}

/// The record must be of this key, and its message what key and recipient give.
///
/// # Errors
/// It is of another key, or was changed.
pub fn check_key(record: &Record, key: &SecretKey) -> Result<()> {
    if record.key_id != key.id() {
        return Err(Error::DoesNotBelong(format!(
            "the record was made with key {}, and this is key {}: give the key it was made with",
            record.key_id,
            key.id()
        )));
    }
    if record.subject()?.message(key) != record.message()? {
        return Err(Error::DoesNotBelong(
            "the record's message is not that of its recipient under this key: the record was changed".into(),
        ));
    }
    Ok(())
}

/// The record must be of this very reference, whose vertices have this digest: the mesh of any other differs.
///
/// # Errors
/// It is of another one.
pub fn check_reference(record: &Record, request: &Request, reference: &Survey, digest: &str) -> Result<()> {
    if record.reference.vertices_sha256 == digest {
        return Ok(());
    }
    Err(Error::DoesNotBelong(format!(
        "the record was made from another reference ({} vertices) than {} ({} vertices): give the file that was \
         marked, unchanged",
        record.reference.vertices,
        request.reference.display(),
        reference.vertices.len()
    )))
}

/// How many vertices match a suspect that is certainly not in place: shifted by several radii.
fn by_chance(
    matcher: &Matcher,
    moved: &[[f64; 2]],
    ground: &Ground,
    centre: [f64; 2],
    radius_m: f64,
) -> usize {
    let unit = ground.metres_per_unit(centre);
    let shift = [0, 1].map(|axis| OUT_OF_PLACE[axis] * radius_m / unit[axis].max(f64::MIN_POSITIVE));
    let shifted: Vec<[f64; 2]> = moved.iter().map(|p| [p[0] + shift[0], p[1] + shift[1]]).collect();
    matcher.all(&shifted, radius_m).count
}

/// How often vertices are matched again around the predicted deformation.
const ROUNDS: usize = 3;

/// Follows a deformation that moved vertices out of the matching radius: matches give a deformation, the
/// deformation says where to look for more matches. It never looks at the key, so decoys see the same.
struct Tracking<'a> {
    reference: &'a Survey,
    moved: &'a [[f64; 2]],
    ground: &'a Ground,
    patches: &'a Patches,
    /// Of the reference and of the suspect.
    graphs: [Graph; 2],
}

/// What came of it.
struct Followed {
    matches: Matches,
    /// What to demodulate: displacements, their noise shaped.
    observed: Vec<Option<[f64; 2]>>,
    disturbance: Prediction,
}

impl Tracking<'_> {
    fn follow(&self, carriers: usize, request: &Request) -> meshmark_core::Result<Followed> {
        let coords = self.reference.vertices.coords();
        let mut matches = self.match_joined(coords, request.radius_m);
        let mut observed = self.displacements(&matches);
        let amplitude_m = request.parameters.amplitude_m;
        let mark_m = mark_deviation_m(self.patches, carriers, amplitude_m);
        let fit = |observed: &Observed| {
            let deformation = Deformation::estimate(self.patches, observed, carriers, &request.parameters)?;
            Ok(deformation.predict(self.patches, observed, carriers, amplitude_m))
        };
        let mut round = 1;
        loop {
            let mut prediction = fit(&observed)?;
            if prediction.deformation.deviation_m == 0.0 || round == ROUNDS {
                let kept = prediction.without_outliers(&observed, mark_m);
                if kept != observed {
                    prediction = fit(&kept)?;
                    matches.keep(|vertex| kept[vertex].is_some());
                    observed = kept;
                }
                let (shaped, prediction) =
                    prediction.shape_noise(self.patches, &observed, carriers, amplitude_m);
                return Ok(Followed { matches, observed: shaped, disturbance: prediction });
            }
            matches = self.match_around(&prediction, request.radius_m);
            observed = self.displacements(&matches);
            round += 1;
        }
    }

    fn match_around(&self, prediction: &Prediction, radius_m: f64) -> Matches {
        let shifted = |(p, d): (&[f64; 2], &[f64; 2])| {
            let unit = self.ground.metres_per_unit(*p);
            [p[0] + d[0] / unit[0], p[1] + d[1] / unit[1]]
        };
        let coords = self.reference.vertices.coords().iter();
        let expected: Vec<[f64; 2]> = coords.zip(&prediction.displacement_m).map(shifted).collect();
        self.match_joined(&expected, radius_m)
    }

    /// `expected`: where the reference vertices should be found.
    fn match_joined(&self, expected: &[[f64; 2]], radius_m: f64) -> Matches {
        let matcher = Matcher::new(expected, self.ground, self.reference.vertices.centre());
        matcher.joined(self.moved, radius_m, self.graphs.each_ref())
    }

    /// The displacement of every reference vertex, metres; `None` where no suspect vertex matches.
    fn displacements(&self, matches: &Matches) -> Vec<Option<[f64; 2]>> {
        matches.displacements_m(self.reference.vertices.coords(), self.moved, self.ground)
    }
}
