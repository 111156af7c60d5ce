//! Marking: layers and options → map → core → moved layers and a record.

use crate::{
    crs::PyCrs,
    errors::{of_map, of_options},
    geos::PyGeos,
    key::Key,
    layer::{Besides, Layer, survey},
    record::Record,
    waiting::{Job, run},
};
use meshmark_core::{
    embedding::{Embedding, Marked},
    fingerprint_embedding::FingerprintEmbedding,
    fingerprint_record::Divided,
    key::SecretKey,
    map::Map,
    options::{self, Options, Spelling, Subject},
    series::{Edition, Series},
};
use meshmark_marking::{self as marking, KnownCrs, Lineage, Moves, Survey, Unmarked, damage_warning};
use pyo3::{prelude::*, types::PyBytes};

/// The geometries of each layer, well-known binary.
type Geometries<T> = Vec<Vec<Option<T>>>;

/// Marked copies with their records, and warnings.
struct Copies {
    copies: Vec<(Geometries<Vec<u8>>, Record)>,
    warnings: Vec<String>,
}

/// Marked copies for Python.
type PyCopies<'py> = (Vec<(Geometries<Bound<'py, PyBytes>>, Record)>, Vec<String>);

/// What does not shape the mark, a dict.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings<'py> {
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
}

/// Mark layers for every one of these subjects, each a recipient or a message, with the options NAME,
/// value; `geos` is the package's module `_geos`. Warnings are those about the first copy.
#[pyfunction]
pub fn mark<'py>(
    py: Python<'py>,
    layers: Vec<Layer>,
    key: &Key,
    options: Vec<(String, String)>,
    subjects: Vec<(String, String)>,
    geos: Py<PyModule>,
    settings: Settings<'py>,
) -> PyResult<PyCopies<'py>> {
    let Settings { threads, progress } = settings;
    let parse = |subject: &(String, String)| {
        let pairs = options.iter().chain([subject]).map(|(name, value)| (name.as_str(), value.as_str()));
        Options::parse(pairs).map_err(of_options)
    };
    let options = subjects.iter().map(parse).collect::<PyResult<Vec<Options>>>()?;
    let Some(first) = options.first() else { return Ok((Vec::new(), Vec::new())) };
    let known = KnownCrs::parse(first.srs.as_deref(), None).map_err(of_map)?;
    let all: Vec<&Layer> = layers.iter().collect();
    let map = survey(&all, &known, Besides::Geometries).map_err(of_map)?;
    let (layers, geos) = (&layers[..], &PyGeos(geos));
    let Copies { copies, warnings } = run(py, progress.as_ref(), threads, |job| {
        marked(layers, &map, (&key.0, &options), geos, job).map_err(of_map)
    })?;
    let bytes = |wkb: Option<Vec<u8>>| wkb.map(|wkb| PyBytes::new(py, &wkb));
    let of_layers = |layers: Geometries<Vec<u8>>| {
        layers.into_iter().map(|layer| layer.into_iter().map(bytes).collect()).collect()
    };
    Ok((copies.into_iter().map(|(layers, record)| (of_layers(layers), record)).collect(), warnings))
}

/// Check the names of the recipients of new marks, and return warnings about them.
#[pyfunction]
pub fn check_recipients(names: Vec<String>) -> PyResult<Vec<String>> {
    options::check_recipients(&names).map_err(of_options)?;
    Ok(names.iter().filter_map(|name| marking::spelling_warning(name)).collect())
}

/// Marks a map with each of these options, which differ in their subjects alone.
fn marked(
    layers: &[Layer],
    map: &Survey<PyCrs>,
    (key, options): (&SecretKey, &[Options]),
    geos: &PyGeos,
    job: &Job,
) -> marking::Result<Copies> {
    let (parameters, spelling) = (&options[0].parameters, Spelling::Keyword);
    let on_ground = map.map(parameters)?;
    marking::check_extent(&on_ground, parameters)?;
    marking::check_scale(&on_ground, map.crs())?;
    let marked = embed(on_ground, key, options, job)?;
    let geometries = map.geometries.as_ref().expect("the map was read with them");
    let unmarked = Unmarked::new(geometries, &on_ground, geos);
    let described = (&map.data.vertices, map.crs());
    let (mut copies, mut warnings) = (Vec::new(), Vec::new());
    for ((marked, divided), options) in marked.into_iter().zip(options) {
        let subject = subject_of(options);
        let distortion = unmarked.distortion(&marked, parameters);
        if copies.is_empty() {
            let message = options.coefficients.is_none().then(|| subject.carried(key));
            warnings = marking::warnings(options, message.as_ref(), described, marked.patches, spelling);
            warnings.extend(marking::signless_warning(&marked, options, spelling));
            warnings.extend(damage_warning(parameters, &marked.angles, Some(&distortion.areas), spelling));
        }
        let reference = marking::reference(described.0, described.1, marked.patches);
        let lineage = Lineage { divided, ..Lineage::default() };
        let record = marking::recorded(options, subject, key, (reference, lineage), distortion);
        let moves = Moves { from: &map.data.vertices, to: &marked.coords };
        let moved = layers.iter().map(|layer| layer.moved(&moves)).collect::<marking::Result<_>>()?;
        copies.push((moved, Record(record)));
    }
    Ok(Copies { copies, warnings })
}

fn subject_of(options: &Options) -> &Subject {
    options.subject.as_ref().expect("the package gives each")
}

/// Solves every patch once for all copies.
fn embed(
    map: Map,
    key: &SecretKey,
    options: &[Options],
    job: &Job,
) -> meshmark_core::Result<Vec<(Marked, Divided)>> {
    let (parameters, subjects) = (&options[0].parameters, options.iter().map(subject_of));
    if let Some(coefficients) = options[0].coefficients {
        let part_size = options[0].parts_of(map.vertices.len());
        let edition = Edition { map, bases: Vec::new(), anchors: &[], part_size };
        let series = Series::new(vec![edition], parameters)?;
        let embedding = FingerprintEmbedding::new(&series, key, coefficients)?;
        job.start(embedding.patches());
        let recipients = subjects.map(|subject| subject.recipient().expect("a fingerprint has one"));
        let fingerprints: Vec<_> = recipients.map(|recipient| embedding.fingerprint(recipient)).collect();
        let wanted = embedding.wanted(&fingerprints, &|_| job.step())?;
        let settle = |(own, wanted)| {
            let divided = embedding.divided(&wanted);
            Ok((embedding.settle(own, wanted)?, divided))
        };
        return fingerprints.iter().zip(wanted).map(settle).collect();
    }
    let messages: Vec<_> = subjects.map(|subject| subject.carried(key)).collect();
    let embedding = Embedding::new(&map, key, messages[0].len(), parameters)?;
    job.start(embedding.patches());
    let wanted = embedding.wanted(&messages, &|_| job.step())?;
    let settle = |(own, wanted): (_, &Vec<_>)| Ok((embedding.settle(own, wanted)?, Divided::default()));
    messages.iter().zip(&wanted).map(settle).collect()
}
