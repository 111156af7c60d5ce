//! The experiment: it rounds and marks maps, attacks copies and verifies suspects.

pub mod cases;

use crate::{
    Result,
    attacks::{Map, OtherMaps, collusion::Mixture, noise, similarity},
    product::{Asked, Marking, Product, Profile, Report, write_key},
};
use cases::{Case, INNOCENTS, Table, all};
use meshmark_dataset::{Selection, survey};
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};

/// The paper's maps have integer coordinates in units of 10 cm.
const PRECISION_M: f64 = 0.1;

/// The choice of the cases that run with a profile.
pub type Wanted = dyn Fn(&Case, Profile) -> bool;

/// The parts of the experiment to run.
pub struct Plan {
    pub maps: Vec<PathBuf>,
    pub profiles: Vec<Profile>,
    /// Selects the cases that run with a profile.
    pub wanted: Box<Wanted>,
    pub seed: u64,
    /// Number of processes at a time.
    pub workers: usize,
    /// The folder that keeps references, copies, records, keys and suspects, so that a verdict can
    /// be examined afterwards.
    pub keep: Option<PathBuf>,
}

/// The answer to one question about one suspect.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    pub table: Table,
    pub map: String,
    #[serde(flatten)]
    pub profile: Profile,
    pub case: String,
    pub title: String,
    pub strength: Option<f64>,
    /// Seed of the attack.
    pub seed: u64,
    pub demodulator: &'static str,
    /// The recipient of the question.
    pub asked: String,
    /// Whether the right answer is yes.
    pub guilty: bool,
    /// `None` when the command gave no verdict; `reason` is its output then.
    pub verdict: Option<String>,
    pub reason: String,
    pub bits: usize,
    /// `None` when the suspect was not registered.
    pub bit_errors: Option<usize>,
    pub p_value_log10: Option<f64>,
    pub p_mark_log10: Option<f64>,
    pub p_recipient_log10: Option<f64>,
    pub registration: Option<String>,
    pub landmarks: usize,
    pub rms_m: Option<f64>,
    pub vertices_reference: usize,
    pub vertices_suspect: usize,
    pub vertices_matched: usize,
    pub seconds: f64,
}

/// Returns the bit error rate of one suspect; `None` when it was not registered.
pub fn bit_error_percent(outcome: &Outcome) -> Option<f64> {
    Some(100.0 * outcome.bit_errors? as f64 / outcome.bits as f64)
}

/// Returns whether the verdict is that the mark is there.
pub fn is_match(outcome: &Outcome) -> bool {
    outcome.verdict.as_deref() == Some("match")
}

/// A copy of a map.
struct MarkedCopy {
    recipient: String,
    path: PathBuf,
    record: PathBuf,
}

/// A map with its copies marked in one way.
struct Sheet {
    name: String,
    profile: Profile,
    reference: PathBuf,
    copies: Vec<MarkedCopy>,
}

/// The number of a sheet and the case for it.
type Job = (usize, Case);

/// A question about the suspect that a [`Case`] made.
struct Question {
    asked: String,
    guilty: bool,
    key: PathBuf,
    reference: PathBuf,
    /// `None` if options are given one by one in place of the record.
    record: Option<PathBuf>,
}

/// Runs a plan; `report` receives every outcome when it is known.
///
/// # Errors
/// Fails on maps that cannot be read, are not in metres or cannot be marked. A suspect that cannot
/// be verified is an outcome, not an error.
pub fn run(product: &Product, plan: &Plan, report: impl Fn(&Outcome) + Sync) -> Result<Vec<Outcome>> {
    let temporary = tempfile::tempdir()?;
    let folder = plan.keep.as_deref().unwrap_or(temporary.path());
    std::fs::create_dir_all(folder)?;
    if folder.read_dir()?.next().is_some() {
        return Err(format!("the folder {} is not empty: name a new one", folder.display()).into());
    }
    let lab = Lab { product, folder: folder.into(), keep: plan.keep.is_some(), seed: plan.seed };
    write_key(&lab.key(), plan.seed)?;
    write_key(&lab.pirates_key(), plan.seed + 1)?;
    let (sheets, jobs) = lab.prepare(plan)?;
    let (answered, next) = (Mutex::new(Vec::new()), AtomicUsize::new(0));
    let work = || -> Result<()> {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some((sheet, case)) = jobs.get(number) else { return Ok(()) };
            let Sheet { name, profile, .. } = &sheets[*sheet];
            let outcomes = lab
                .run_case(&sheets[*sheet], case)
                .map_err(|error| format!("{name}, {}, case {}: {error}", profile.name(), case.id()))?;
            outcomes.iter().for_each(&report);
            answered.lock().expect("no worker panics with the lock").push((number, outcomes));
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..plan.workers).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("workers return their errors"))
    })?;
    let mut answered = answered.into_inner().expect("no worker panics with the lock");
    answered.sort_by_key(|(number, _)| *number);
    Ok(answered.into_iter().flat_map(|(_, outcomes)| outcomes).collect())
}

struct Lab<'a> {
    product: &'a Product,
    folder: PathBuf,
    keep: bool,
    seed: u64,
}

impl Lab<'_> {
    fn key(&self) -> PathBuf {
        self.folder.join("key.json")
    }

    fn pirates_key(&self) -> PathBuf {
        self.folder.join("pirate.json")
    }

    /// Marks all maps in all ways, and lists the jobs for them.
    fn prepare(&self, plan: &Plan) -> Result<(Vec<Sheet>, Vec<Job>)> {
        let mut maps = Vec::new();
        for path in &plan.maps {
            check_metres(path)?;
            maps.push(Arc::new(noise::snap(&Map::read(path)?, PRECISION_M)));
        }
        let (mut sheets, mut jobs): (Vec<Sheet>, Vec<Job>) = (Vec::new(), Vec::new());
        for (number, (path, map)) in plan.maps.iter().zip(&maps).enumerate() {
            let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            if sheets.iter().any(|sheet| sheet.name == name) {
                return Err(format!("two maps are called {name}: rename one").into());
            }
            let reference = self.folder.join(format!("{name}.gpkg"));
            map.write(&reference)?;
            let others = OtherMaps { foreign: foreign(&maps, number)?, unmarked: map.clone() };
            for &profile in &plan.profiles {
                let wanted = |case: &Case| (plan.wanted)(case, profile);
                let cases: Vec<Case> = all(&others).into_iter().filter(wanted).collect();
                let most_copies = cases.iter().map(Case::copies).max().unwrap_or(1);
                let sheet = format!("{name}-{}", profile.name());
                let copies = (1..=most_copies).map(|copy| self.mark(&sheet, &reference, profile, copy));
                let copies = copies.collect::<Result<_>>()?;
                jobs.extend(cases.iter().map(|case| (sheets.len(), case.clone())));
                sheets.push(Sheet { name: name.clone(), profile, reference: reference.clone(), copies });
            }
        }
        jobs.sort_by_key(|(_, case)| case.table()); // the paper's table first, for all maps
        Ok((sheets, jobs))
    }

    fn mark(&self, sheet: &str, reference: &Path, profile: Profile, copy: usize) -> Result<MarkedCopy> {
        let recipient = format!("recipient {copy}");
        let path = self.folder.join(format!("{sheet}-copy{copy}.gpkg"));
        let record = path.with_extension("json");
        let marking = Marking { key: &self.key(), recipient: &recipient, profile, precision: PRECISION_M };
        self.product.mark(reference, &path, &record, marking)?;
        Ok(MarkedCopy { recipient, path, record })
    }

    /// Makes the suspect of a case and verifies it for everybody; for nobody when the attack leaves
    /// nothing.
    fn run_case(&self, sheet: &Sheet, case: &Case) -> Result<Vec<Outcome>> {
        let suspect = self.folder.join(format!("{}-{}-{}.gpkg", sheet.name, sheet.profile.name(), case.id()));
        let seed = seed_of(self.seed, &sheet.name, &case.id());
        let questions = self.make_suspect(sheet, case, seed, &suspect)?;
        let mut outcomes = Vec::new();
        for question in &questions {
            for demodulator in case.demodulators(sheet.profile) {
                let started = Instant::now();
                let answer = self.ask(sheet, question, demodulator, &suspect);
                let seconds = started.elapsed().as_secs_f64();
                outcomes.push(outcome(sheet, case, seed, question, demodulator, answer, seconds));
            }
        }
        if !self.keep {
            std::fs::remove_file(&suspect)?; // a whole run makes a thousand
        }
        Ok(outcomes)
    }

    fn make_suspect(&self, sheet: &Sheet, case: &Case, seed: u64, suspect: &Path) -> Result<Vec<Question>> {
        let guilty =
            |copy: &MarkedCopy| self.question(sheet, &copy.recipient, true, Some(copy.record.clone()));
        let [first, ..] = sheet.copies.as_slice() else { unreachable!("a sheet has a copy") };
        match case {
            Case::Attacked { row, .. } => {
                let attacked = row.attack.apply(&Map::read(&first.path)?, seed)?;
                attacked.write(suspect)?;
                // A map without roads has no buffered roads to verify.
                let is_empty = attacked.geometries().next().is_none();
                Ok(if is_empty { Vec::new() } else { vec![guilty(first)] })
            }
            Case::Unmarked => {
                Map::read(&sheet.reference)?.write(suspect)?;
                Ok(vec![Question { guilty: false, ..guilty(first) }])
            }
            Case::MarkedAgain => {
                let record = suspect.with_extension("json");
                let (key, recipient) = (self.pirates_key(), "pirate");
                let marking =
                    Marking { key: &key, recipient, profile: sheet.profile, precision: PRECISION_M };
                self.product.mark(&first.path, suspect, &record, marking)?;
                let pirate = Question {
                    key,
                    reference: first.path.clone(),
                    ..self.question(sheet, recipient, true, Some(record))
                };
                Ok(vec![guilty(first), pirate])
            }
            Case::Collusion { copies } => {
                let colluders = &sheet.copies[..*copies];
                let maps = colluders.iter().map(|copy| Map::read(&copy.path)).collect::<Result<Vec<_>>>()?;
                Mixture::Average.mix(&maps, seed)?.write(suspect)?;
                let innocent = |i| self.question(sheet, &format!("innocent {i}"), false, None);
                Ok(colluders.iter().map(guilty).chain((1..=INNOCENTS).map(innocent)).collect())
            }
        }
    }

    fn question(&self, sheet: &Sheet, asked: &str, guilty: bool, record: Option<PathBuf>) -> Question {
        Question { asked: asked.into(), guilty, key: self.key(), reference: sheet.reference.clone(), record }
    }

    fn ask(&self, sheet: &Sheet, question: &Question, demodulator: &str, suspect: &Path) -> Result<Report> {
        let asked = match &question.record {
            Some(record) => Asked::Record(record),
            None => Asked::Marking(Marking {
                key: &question.key,
                recipient: &question.asked,
                profile: sheet.profile,
                precision: PRECISION_M,
            }),
        };
        self.product.verify(&question.key, &question.reference, asked, demodulator, "auto", suspect)
    }
}

fn outcome(
    sheet: &Sheet,
    case: &Case,
    seed: u64,
    question: &Question,
    demodulator: &'static str,
    answer: Result<Report>,
    seconds: f64,
) -> Outcome {
    let (report, failure) = match answer {
        Ok(report) => (Some(report), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let report = report.as_ref();
    Outcome {
        table: case.table(),
        map: sheet.name.clone(),
        profile: sheet.profile,
        case: case.id(),
        title: case.title(),
        strength: case.strength(),
        seed,
        demodulator,
        asked: question.asked.clone(),
        guilty: question.guilty,
        verdict: report.map(|r| r.verdict.clone()),
        reason: failure.or(report.map(|r| r.reason.clone())).unwrap_or_default(),
        bits: report.map_or(0, |r| r.bits.len()),
        bit_errors: report.and_then(|r| r.bit_errors),
        p_value_log10: report.and_then(|r| r.p_value_log10),
        p_mark_log10: report.and_then(|r| r.p_mark_log10),
        p_recipient_log10: report.and_then(|r| r.p_recipient_log10),
        registration: report.map(|r| r.registration.method.clone()),
        landmarks: report.map_or(0, |r| r.registration.landmarks),
        rms_m: report.and_then(|r| r.registration.rms_m),
        vertices_reference: report.map_or(0, |r| r.vertices.reference),
        vertices_suspect: report.map_or(0, |r| r.vertices.suspect),
        vertices_matched: report.map_or(0, |r| r.vertices.matched),
        seconds,
    }
}

/// Fails unless a map is in metres, as the lengths of the attacks are.
fn check_metres(path: &Path) -> Result<()> {
    let dataset = gdal::Dataset::open(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let unit_m = survey(&dataset, &Selection::default())
        .and_then(|survey| Ok(survey.measure()?.metres_per_unit(survey.data.vertices.centre())))
        .map_err(|e| format!("{}: {e}", path.display()))?;
    match unit_m.iter().all(|metres| (metres - 1.0).abs() < 0.01) {
        true => Ok(()),
        false => Err(format!("{} is not in metres: reproject it first", path.display()).into()),
    }
}

/// Returns the next map; for a single map its own mirror image.
fn foreign(maps: &[Arc<Map>], number: usize) -> Result<Arc<Map>> {
    match maps {
        [only] => Ok(Arc::new(similarity::linear(only, similarity::mirror(), similarity::About::Centre)?)),
        _ => Ok(maps[(number + 1) % maps.len()].clone()),
    }
}

/// Returns the seed of a map and a case, which does not depend on the other cases (FNV-1a).
fn seed_of(seed: u64, map: &str, case: &str) -> u64 {
    let text = format!("{seed}/{map}/{case}");
    text.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::fixture;
    use std::collections::BTreeSet;

    #[test]
    fn a_seed_belongs_to_a_map_and_a_case() {
        assert_eq!(seed_of(1, "a", "9c"), seed_of(1, "a", "9c"));
        let seeds =
            [seed_of(1, "a", "9c"), seed_of(2, "a", "9c"), seed_of(1, "b", "9c"), seed_of(1, "a", "9b")];
        assert_eq!(BTreeSet::from(seeds).len(), 4);
    }

    #[test]
    fn a_map_in_degrees_is_refused() {
        assert!(check_metres(&fixture("europe_deg.gpkg")).unwrap_err().to_string().contains("not in metres"));
    }
}
