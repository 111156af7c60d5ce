//! Marking: layers and options → map → core → moved layers and a record.

use crate::{
    errors::{of_map, of_options},
    geos::PyGeos,
    key::Key,
    layer::{Layer, LayeredMap, assign_crs},
    record::Record,
    waiting::{Job, run},
};
use meshmark_core::{
    embedding::{Embedding, Marked},
    fingerprint_embedding::FingerprintEmbedding,
    fingerprint_record::Divided,
    key::SecretKey,
    map::Map,
    options::{Options, Spelling, Subject},
    series::{Edition, Series},
};
use meshmark_marking::{self as marking, Lineage, Moves, ThreadPool, Unmarked, damage_warning};
use pyo3::{exceptions::PyOSError, prelude::*, types::PyBytes};
use std::thread::available_parallelism;

/// A marked map: the geometries of each layer, the record, and warnings.
type MarkedLayers = (Vec<Vec<Option<Vec<u8>>>>, Record, Vec<String>);

/// Marked layers for Python.
type PyMarkedLayers<'py> = (Vec<Vec<Option<Bound<'py, PyBytes>>>>, Record, Vec<String>);

/// What does not shape the mark, a dict.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings<'py> {
    /// The CRS of layers without one.
    srs: Option<Bound<'py, PyAny>>,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
}

/// Mark layers with the options NAME, value; `geos` is the package's module `_geos`.
#[pyfunction]
pub fn mark<'py>(
    py: Python<'py>,
    mut layers: Vec<Layer>,
    key: &Key,
    options: Vec<(String, String)>,
    geos: Py<PyModule>,
    settings: Settings<'py>,
) -> PyResult<PyMarkedLayers<'py>> {
    let Settings { srs, threads, progress } = settings;
    let pairs = options.iter().map(|(name, value)| (name.as_str(), value.as_str()));
    let options = Options::parse(pairs).map_err(of_options)?;
    if let Some(srs) = srs {
        assign_crs(py, &mut layers, &srs)?.map_err(of_map)?;
    }
    let map = LayeredMap::read(py, &layers)?.map_err(of_map)?;
    let threads = threads.unwrap_or_else(|| available_parallelism().map_or(1, usize::from));
    let (layers, geos) = (&layers[..], &PyGeos(geos));
    let (moved, record, warnings) = run(py, progress.as_ref(), |job| {
        let pool = ThreadPool::new(threads, || (), || ());
        let pool =
            pool.map_err(|error| PyOSError::new_err(format!("the system gives no threads: {error}")))?;
        pool.install(|| marked(layers, &map, (&key.0, &options), geos, job)).map_err(of_map)
    })?;
    let bytes = |wkb: Option<Vec<u8>>| wkb.map(|wkb| PyBytes::new(py, &wkb));
    let moved = moved.into_iter().map(|layer| layer.into_iter().map(bytes).collect()).collect();
    Ok((moved, record, warnings))
}

fn marked(
    layers: &[Layer],
    map: &LayeredMap,
    (key, options): (&SecretKey, &Options),
    geos: &PyGeos,
    job: &Job,
) -> marking::Result<MarkedLayers> {
    let (parameters, spelling) = (&options.parameters, Spelling::Keyword);
    let subject = options.subject.as_ref().expect("the package asks for it");
    let on_ground = map.metric.map(&map.data, parameters)?;
    marking::check_extent(&on_ground, parameters)?;
    marking::check_scale(&on_ground, map.crs())?;
    let (marked, divided) = embed(on_ground, key, (options, subject), job)?;
    let distortion = Unmarked::new(&map.geometries, &on_ground, geos).distortion(&marked, parameters);
    let described = (&map.data.vertices, map.crs());
    let message = options.coefficients.is_none().then(|| subject.carried(key));
    let mut warnings = marking::warnings(options, message.as_ref(), described, marked.patches, spelling);
    warnings.extend(damage_warning(parameters, &marked.angles, Some(&distortion.areas), spelling));
    let reference = marking::reference(described.0, described.1, marked.patches);
    let lineage = Lineage { divided, ..Lineage::default() };
    let record = marking::recorded(options, subject, key, (reference, lineage), distortion);
    let moves = Moves { from: &map.data.vertices, to: &marked.coords };
    let moved = layers.iter().map(|layer| layer.moved(&moves)).collect::<marking::Result<_>>()?;
    Ok((moved, Record(record), warnings))
}

fn embed(
    map: Map,
    key: &SecretKey,
    (options, subject): (&Options, &Subject),
    job: &Job,
) -> meshmark_core::Result<(Marked, Divided)> {
    let parameters = &options.parameters;
    if let (Some(coefficients), Subject::Recipient(recipient)) = (options.coefficients, subject) {
        let part_size = options.parts_of(map.vertices.len());
        let edition = Edition { map, bases: Vec::new(), anchors: &[], part_size };
        let series = Series::new(vec![edition], parameters)?;
        let embedding = FingerprintEmbedding::new(&series, key, coefficients)?;
        job.start(embedding.patches());
        let fingerprint = embedding.fingerprint(recipient);
        let mut wanted = embedding.wanted(std::slice::from_ref(&fingerprint), &|_| job.step())?;
        let wanted = wanted.pop().expect("one for each fingerprint");
        let divided = embedding.divided(&wanted);
        return Ok((embedding.settle(&fingerprint, wanted)?, divided));
    }
    let message = subject.carried(key);
    let embedding = Embedding::new(&map, key, message.len(), parameters)?;
    job.start(embedding.patches());
    let wanted = embedding.wanted(std::slice::from_ref(&message), &|_| job.step())?;
    Ok((embedding.settle(&message, &wanted[0])?, Divided::default()))
}
