//! Many recipients: one map, read and solved once, and a marked copy with its record for each of them.
//!
//! ```text
//! map ──survey──> vertices ──core::embedding──> displacements of a batch of recipients
//!  └──ogr2ogr──> staged GeoPackage ──a thread each──> copy ─> moved in place ─> read back ─> published with its record
//! ```
//!
//! A copy that is there is complete; the same command again makes those that are not.

mod copies;
mod moving;
mod ogr2ogr;
mod recipients;
mod spatial_index;
mod staged;
mod writing;

use crate::{Error, Result, progress::Progress, reading};
use copies::Copy;
use meshmark_core::{
    embedding::Embedding,
    key::{RECIPIENT_BITS, SecretKey},
    options::{Options, Spelling},
    record::Reference,
    vertices::VertexTable,
};
use meshmark_dataset::{
    Error as MapError, Survey, ThreadPool,
    formats::Format,
    marking::{self, Unmarked},
    parse_srs, threads,
    workplace::Workplace,
};
use staged::Staged;
use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

/// What to distribute, to whom, and how it is marked.
pub struct Request {
    /// The key.
    pub key: SecretKey,
    /// The marking options, without a subject.
    pub options: Options,
    /// The map.
    pub map: PathBuf,
    /// The list of recipients.
    pub recipients: PathBuf,
    /// Where the copies go.
    pub folder: PathBuf,
    /// GDAL's short name of their format.
    pub format: String,
}

/// What was done.
pub struct Summary {
    /// Copies that were written.
    pub written: usize,
    /// Copies that were there.
    pub finished_before: usize,
}

/// What all copies are made of.
struct Job<'a> {
    key: &'a SecretKey,
    options: &'a Options,
    vertices: &'a VertexTable,
    unmarked: Unmarked<'a>,
    reference: Reference,
    format: &'static Format,
    /// The GeoPackage with the unmarked map.
    staged: &'a Staged,
    folder: &'a Path,
    /// What was said while copies were written, each once.
    warnings: Mutex<BTreeSet<String>>,
}

/// Writes a marked copy and its record for every recipient who has none yet. `warn` hears of what is legal and
/// probably not meant.
pub fn distribute(request: &Request, progress: &mut Progress, warn: &mut dyn FnMut(&str)) -> Result<Summary> {
    let Request { key, options, folder, .. } = request;
    let format = Format::find(Some(&request.format), Path::new("")).map_err(Error::from)?;
    let recipients = recipients::read(&request.recipients, warn)?;
    let made = make_folder(folder)?;
    let done = Workplace::new(folder).map_err(Error::from).and_then(|workplace| {
        progress.start("reading", 0);
        let map = reading::source(&request.map, options, warn)?;
        let mut copies: Vec<Copy> =
            recipients.into_iter().map(|recipient| Copy::new(recipient, folder, format)).collect();
        let all = copies.len();
        let reference = marking::reference(&map, 0);
        let finished = copies.iter().map(|copy| copy.is_finished(options, key, &reference));
        let finished: Vec<bool> = finished.collect::<Result<_>>()?;
        let mut finished = finished.into_iter();
        copies.retain(|_| !finished.next().expect("one of each"));
        if !copies.is_empty() {
            let staged = stage(request, format, &map, &workplace, progress, warn)?;
            run(request, &map, (format, &staged), &copies, progress, warn)?;
        }
        Ok(Summary { written: copies.len(), finished_before: all - copies.len() })
    });
    progress.finish();
    if done.is_err() && made {
        drop(fs::remove_dir(folder)); // unless something is in it
    }
    done
}

/// Makes the folder of the copies; whether it was not there.
fn make_folder(folder: &Path) -> Result<bool> {
    let is_there = folder.is_dir();
    fs::create_dir_all(folder).map(|()| !is_there).map_err(|error| {
        let folder = folder.display();
        Error::Usage(format!("the output folder {folder} cannot be made ({error}): name one that can be"))
    })
}

/// Copies the map to a GeoPackage, which is the source of all copies.
fn stage(
    request: &Request,
    format: &'static Format,
    map: &Survey,
    workplace: &Workplace,
    progress: &mut Progress,
    warn: &mut dyn FnMut(&str),
) -> Result<Staged> {
    progress.start("copying", 0);
    let staged = workplace.folder().join("staged.gpkg");
    let mut options = vec!["-lco", "SPATIAL_INDEX=YES"];
    options.extend(marking::OPEN_OPTIONS.iter().flat_map(|option| ["-oo", option]));
    ogr2ogr::copy("GPKG", &request.map, &staged, &options)?.iter().for_each(|text| warn(text));
    let (again, layers) = reading::staged(&staged, &request.options)?;
    if again.vertices.digest() != map.vertices.digest() {
        return Err(Error::Unreadable(format!(
            "the map {} has other coordinates as a GeoPackage, or was changed while it was read: convert it to a \
             GeoPackage, and distribute that",
            request.map.display()
        )));
    }
    let driver = format.driver;
    let refused = |error: MapError| {
        Err(Error::Usage(format!("the map {}: {}", request.map.display(), error.text(Spelling::Flag))))
    };
    if layers.len() > 1 && !format.many_layers {
        return refused(MapError::OneLayer { driver });
    }
    let is_wgs84 =
        map.crs.as_ref().is_none_or(|crs| parse_srs("EPSG:4326").is_ok_and(|wgs84| crs.is_same(&wgs84)));
    if let (true, false, Some(layer)) = (format.is_wgs84_only(&[]), is_wgs84, layers.into_iter().next()) {
        return refused(MapError::NotWgs84 { driver, layer });
    }
    let marks = |name: &str| {
        let layers = request.options.layers.as_ref();
        layers.is_none_or(|layers| layers.iter().any(|layer| layer == name))
    };
    Staged::read(staged, &map.vertices, marks)
}

/// Marks and writes, batch by batch.
fn run(
    request: &Request,
    survey: &Survey,
    (format, staged): (&'static Format, &Staged),
    copies: &[Copy],
    progress: &mut Progress,
    warn: &mut dyn FnMut(&str),
) -> Result<()> {
    let Request { key, options, folder, .. } = request;
    let of_map = |error| reading::failed("map", &request.map, error);
    let map = survey.map().map_err(of_map)?;
    let parameters = &options.parameters;
    marking::check_extent(&map, parameters).map_err(of_map)?;
    marking::check_scale(&map, survey.crs.as_ref()).map_err(of_map)?;
    let threads = threads();
    let pool = ThreadPool::new(threads, || (), || ());
    let pool = pool.map_err(|error| Error::Usage(format!("no threads can be started ({error})")))?;
    progress.start("patches", 0);
    let embedding = pool.install(|| Embedding::new(&map, key, RECIPIENT_BITS, parameters)?.for_many())?;
    let message = copies[0].carried(key);
    let warnings = marking::warnings(parameters, &message, survey, embedding.patches(), Spelling::Flag);
    warnings.iter().for_each(|text| warn(text));
    let reference = marking::reference(survey, embedding.patches());
    let geometries = survey.geometries.as_ref().expect("the map was read with them");
    let unmarked = pool.install(|| Unmarked::new(geometries, &map));
    let vertices = &survey.vertices;
    let warnings = Mutex::default();
    let job = Job { key, options, vertices, unmarked, reference, format, staged, folder, warnings };
    let mut written = 0;
    for batch in copies.chunks(embedding.batch()) {
        progress.start("solving patches", embedding.patches() as u64);
        let messages: Vec<_> = batch.iter().map(|copy| copy.carried(key)).collect();
        let wanted = pool.install(|| embedding.wanted(&messages, &progress.stepper()))?;
        progress.start("writing copies", batch.len() as u64);
        let step = progress.stepper();
        let todo = Mutex::new(batch.iter().zip(messages).zip(wanted));
        let write_next = || {
            let next = todo.lock().expect("nobody panics with it").next();
            next.map(|((copy, message), wanted)| {
                let marked = pool.install(|| embedding.settle(&message, &wanted)).map_err(Error::from);
                drop(wanted);
                let written = marked.and_then(|marked| {
                    let distortion = pool.install(|| job.unmarked.distortion(&marked, parameters));
                    writing::write(&job, copy, &marked.coords, distortion)
                });
                written.map(|()| step(1)).map_err(|error| error.of(&copy.recipient))
            })
        };
        written += in_parallel(threads.min(batch.len()), write_next).map_err(|(done, error)| {
            let (done, all) = (written + done, copies.len());
            error.with(&format!(
                "; {done} of {} written, and the same command again makes the rest",
                match all {
                    1 => "1 copy was".into(),
                    _ => format!("{all} copies were"),
                }
            ))
        })?;
    }
    job.warnings.into_inner().expect("nobody panics with them").iter().for_each(|text| warn(text));
    Ok(())
}

/// Calls `step` on so many threads until it has nothing left to do: how often it succeeded. After an error no step
/// begins.
fn in_parallel(
    threads: usize,
    step: impl Fn() -> Option<Result<()>> + Sync,
) -> std::result::Result<usize, (usize, Error)> {
    let has_failed = AtomicBool::new(false);
    let work = || {
        let mut done = 0;
        while !has_failed.load(Ordering::Relaxed) {
            match step() {
                None => break,
                Some(Ok(())) => done += 1,
                Some(Err(error)) => {
                    has_failed.store(true, Ordering::Relaxed);
                    return (done, Some(error));
                }
            }
        }
        (done, None)
    };
    let ended: Vec<(usize, Option<Error>)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().map(|worker| worker.join().expect("no worker panics")).collect()
    });
    let done = ended.iter().map(|(done, _)| done).sum();
    match ended.into_iter().find_map(|(_, error)| error) {
        None => Ok(done),
        Some(error) => Err((done, error)),
    }
}
