//! Distribution: reads and solves one map once, and writes a marked copy with its record for each
//! recipient.
//!
//! ```text
//! map ──survey──> vertices ──core::embedding──> displacements of a batch of recipients
//!  ├──> staged GeoPackage ──a thread each──> moved in place ─┐
//!  └──ogr2ogr──> plain copy, for formats other than GPKG ────┴> copy ─> read back ─> published with its record
//! ```
//!
//! An existing copy is complete; a repeated command makes the missing ones.

mod copies;
mod flatgeobuf;
mod geojson;
mod marks;
mod moving;
mod ogr2ogr;
mod opening;
mod plain;
mod recipients;
mod request;
mod spatial_index;
mod staged;
mod staging;
mod writing;

pub use request::DistributeRequest;

use crate::{Error, Result, inputs::maps, progress::Progress};
use copies::MarkedCopy;
use marks::Marks;
use meshmark_core::options::Spelling;
use meshmark_dataset::{
    GeosOfGdal, Survey, file_digest, formats::Format, read_bases, threads, workplace::Workplace,
};
use meshmark_marking::{self as marking, Bases, ThreadPool, Unmarked};
use staging::Stage;
use std::{
    fs,
    path::Path,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};
use writing::Job;

/// The result of a distribution.
pub struct Summary {
    /// Number of copies that were written.
    pub written: usize,
    /// Number of copies that existed before.
    pub finished_before: usize,
}

/// Writes a marked copy and its record for every recipient who has none yet. `warn` receives
/// warnings about legal but probably unintended input.
pub fn distribute(
    request: &DistributeRequest,
    progress: &Progress,
    warn: &mut dyn FnMut(&str),
) -> Result<Summary> {
    let DistributeRequest { key, options, folder, .. } = request;
    let format = Format::find(Some(&request.format), Path::new("")).map_err(Error::from)?;
    let recipients = recipients::read(&request.recipients, warn)?;
    let made = make_folder(folder)?;
    let done = Workplace::new(folder).map_err(Error::from).and_then(|workplace| {
        progress.start("reading", 0);
        let (dataset, map) = maps::source(&request.map, options, warn)?;
        let bases = read_bases(options, key, &map, &mut |path, entry| maps::base_reference(path, entry))?;
        let mut copies: Vec<MarkedCopy> =
            recipients.into_iter().map(|recipient| MarkedCopy::new(recipient, folder, format)).collect();
        let all = copies.len();
        let reference = marking::reference(&map.data.vertices, map.crs(), 0);
        let finished = copies.iter().map(|copy| copy.is_finished(options, key, (&map, &reference, &bases)));
        let finished: Vec<bool> = finished.collect::<Result<_>>()?;
        let mut finished = finished.into_iter();
        copies.retain(|_| !finished.next().expect("one of each"));
        if !copies.is_empty() {
            progress.start("copying", 0);
            let stage = Stage::new(request, format, (&dataset, &map), &workplace, warn)?;
            run(request, (&map, &bases), (format, &stage), &copies, progress, warn)?;
        }
        Ok(Summary { written: copies.len(), finished_before: all - copies.len() })
    });
    progress.finish();
    if done.is_err() && made {
        drop(fs::remove_dir(folder)); // fails harmlessly unless the folder is empty
    }
    done
}

/// Creates the folder of the copies; returns whether it was missing.
fn make_folder(folder: &Path) -> Result<bool> {
    let is_there = folder.is_dir();
    fs::create_dir_all(folder)
        .map(|()| !is_there)
        .map_err(|error| Error::NoFolder { path: folder.into(), source: error })
}

/// Marks and writes the copies, batch by batch.
fn run(
    request: &DistributeRequest,
    (survey, bases): (&Survey, &Bases),
    (format, stage): (&'static Format, &Stage),
    copies: &[MarkedCopy],
    progress: &Progress,
    warn: &mut dyn FnMut(&str),
) -> Result<()> {
    let DistributeRequest { key, options, folder, .. } = request;
    let unsuited = |error: marking::Error| maps::failed("map", &request.map, error);
    let parameters = &options.parameters;
    let map = survey.map(parameters).map_err(unsuited)?;
    marking::check_extent(&map, parameters).map_err(unsuited)?;
    marking::check_scale(&map, survey.crs()).map_err(unsuited)?;
    let threads = threads();
    let pool = ThreadPool::new(threads, || (), || ());
    let pool = pool.map_err(|source| Error::Threads { source })?;
    progress.start("patches", 0);
    let series = pool.install(|| bases.series(map, parameters))?;
    let marks = pool.install(|| Marks::new(&map, &series, key, options))?;
    let message = options.coefficients.is_none().then(|| copies[0].carried(key));
    let described = (&survey.data.vertices, survey.crs());
    let warnings = marking::warnings(options, message.as_ref(), described, marks.patches(), Spelling::Flag);
    warnings.iter().for_each(|text| warn(text));
    let reference = marking::reference(&survey.data.vertices, survey.crs(), marks.patches());
    let geometries = survey.geometries.as_ref().expect("the map was read with them");
    let unmarked = pool.install(|| Unmarked::new(geometries, &map, &GeosOfGdal));
    let vertices = &survey.data.vertices;
    let warnings = Mutex::default();
    let map_sha256 = digest_of(&request.map)?;
    let job =
        Job { key, options, vertices, unmarked, reference, map_sha256, format, stage, folder, warnings };
    let mut written = 0;
    for batch in copies.chunks(marks.batch()) {
        progress.start("solving patches", marks.patches() as u64);
        let wanted = pool.install(|| marks.wanted(batch, &|steps| progress.step(steps)))?;
        progress.start("writing copies", batch.len() as u64);
        let step = |steps| progress.step(steps);
        let todo = Mutex::new(batch.iter().zip(wanted));
        let write_next = || {
            let next = todo.lock().expect("nobody panics with it").next();
            next.map(|(copy, wanted)| {
                let lineage = bases.lineage(marks.divided(&wanted));
                let marked = pool.install(|| marks.settle(copy, wanted)).map_err(Error::from);
                let written = marked.and_then(|marked| {
                    let signless = marking::signless_warning(&marked, options, Spelling::Flag);
                    job.warnings.lock().expect("nobody panics with them").extend(signless);
                    let distortion = pool.install(|| job.unmarked.distortion(&marked, parameters));
                    writing::write(&job, copy, &marked.coords, (lineage, distortion))
                });
                written.map(|()| step(1)).map_err(|error| Error::Copy {
                    recipient: copy.recipient.clone(),
                    source: Box::new(error),
                })
            })
        };
        written += in_parallel(threads.min(batch.len()), write_next).map_err(|(done, error)| {
            Error::Stopped { source: Box::new(error), done: written + done, all: copies.len() }
        })?;
    }
    job.warnings.into_inner().expect("nobody panics with them").iter().for_each(|text| warn(text));
    Ok(())
}

/// Returns the digest of a map that is one file.
fn digest_of(map: &Path) -> Result<Option<String>> {
    let failed = |source| Error::Undigested { path: map.into(), source };
    map.is_file().then(|| file_digest(map).map_err(failed)).transpose()
}

/// Calls `step` on this many threads until it returns `None`, and returns the number of successes.
/// After an error no further step begins.
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
