//! Verification: layers, records and options → maps and requests → a report.

use crate::{
    crs::PyCrs,
    errors::{OptionError, VerificationError},
    key::Key,
    layered_maps::LayeredMaps,
    record::Record,
    report::Report,
    waiting::{Job, run},
};
use meshmark_core::{key::SecretKey, visible};
use meshmark_detection::{Demodulator, Progress, matching::RadiusChoice, registration::Start};
use meshmark_verification::{
    Error, Stages,
    verify::{
        self as verification, LARGEST_SIGNIFICANCE, NamedRecord, ReadRecord, Request, Settings as Chosen,
        Verification,
    },
};
use pyo3::{exceptions::PyUserWarning, prelude::*};
use std::{ffi::CString, sync::Mutex};

/// The maps that are compared, a dict.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ComparedMaps<'py> {
    suspect: Bound<'py, PyAny>,
    references: Vec<Bound<'py, PyAny>>,
}

/// What names the mark, a dict: options NAME, value; the record; or all records with their names.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Sought<'py> {
    options: Vec<(String, String)>,
    record: Option<PyRef<'py, Record>>,
    records: Option<Vec<(String, PyRef<'py, Record>)>>,
}

/// How the suspect is verified, a dict.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings<'py> {
    registration: String,
    demodulator: String,
    radius: Option<f64>,
    significance: f64,
    evidence_map: bool,
    exact_displacements: bool,
    show_recipients: bool,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
}

/// What a job looks for.
enum Marks {
    One(Vec<Request>),
    Any(Vec<NamedRecord>),
}

/// Verify a suspect. Records that are skipped are warnings, also where an exception follows.
#[pyfunction]
pub fn verify(
    py: Python,
    maps: ComparedMaps,
    key: &Key,
    sought: Sought,
    settings: Settings,
) -> PyResult<Report> {
    let chosen = chosen(&settings, &key.0)?;
    let marks = marks(&chosen, &sought)?;
    let mut maps = LayeredMaps::new(&maps.references, &maps.suspect)?;
    let Settings { show_recipients, threads, progress, .. } = settings;
    let warnings = Mutex::new(Vec::new());
    let report = run(py, progress.as_ref(), threads, |job| {
        let mut warn = |text: &str| warnings.lock().expect("nobody panics with it").push(text.to_owned());
        let Verification { mut report, crs } = verified(&mut maps, &chosen, marks, job, &mut warn)?;
        report.warning().iter().for_each(|text| warn(text));
        if !show_recipients {
            report.hide_others();
        }
        let evidence_map = report.evidence_map.take();
        Ok(Report { report: report.into_file(), evidence_map, crs })
    });
    for text in warnings.into_inner().expect("nobody panics with it") {
        let text = CString::new(visible(&text)).expect("a visible text has no null character");
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 2)?;
    }
    report
}

fn verified(
    maps: &mut LayeredMaps,
    settings: &Chosen,
    marks: Marks,
    job: &Job,
    warn: &mut dyn FnMut(&str),
) -> Result<Verification<PyCrs>, VerificationError> {
    let listen = |event| match event {
        Progress::Stage { stage, steps } => job.begin(stage, steps as usize),
        Progress::Steps(steps) => job.steps(steps),
    };
    let mut stages = Stages::new(&listen);
    Ok(match marks {
        Marks::One(requests) => verification::verify(maps, &requests, &mut stages)?,
        Marks::Any(records) => verification::verify_records(maps, settings, records, &mut stages, warn)?,
    })
}

fn marks(settings: &Chosen, sought: &Sought) -> PyResult<Marks> {
    let read = |record: &PyRef<Record>| ReadRecord::parse(&record.0.to_json());
    if let Some(records) = &sought.records {
        let named = |(name, record): &(String, PyRef<Record>)| NamedRecord {
            name: name.clone(),
            read: read(record).map_err(|error| error.to_string()),
        };
        return Ok(Marks::Any(records.iter().map(named).collect()));
    }
    let of_core = |error: meshmark_core::Error| VerificationError::from(Error::from(error));
    let record = sought.record.as_ref().map(read).transpose().map_err(of_core)?;
    let options: Vec<_> =
        sought.options.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
    let requests = verification::requests(settings, &options, record.as_ref());
    Ok(Marks::One(requests.map_err(VerificationError::from)?))
}

fn chosen(settings: &Settings, key: &SecretKey) -> PyResult<Chosen> {
    let registration = match settings.registration.as_str() {
        "auto" => Start::Auto,
        "landmarks" => Start::Landmarks,
        "geometry" => Start::Geometry,
        "none" => Start::None,
        other => {
            return Err(unknown("registration", other, "\"auto\", \"landmarks\", \"geometry\" or \"none\""));
        }
    };
    let demodulator = match settings.demodulator.as_str() {
        "joint" => Demodulator::Joint,
        "paper" => Demodulator::Paper,
        other => return Err(unknown("demodulator", other, "\"joint\" or \"paper\"")),
    };
    let radius = match settings.radius {
        None => RadiusChoice::FromData,
        Some(radius) if radius > 0.0 && radius.is_finite() => RadiusChoice::Given(radius),
        Some(other) => return Err(unknown("radius", &other.to_string(), "a number greater than 0")),
    };
    let most = LARGEST_SIGNIFICANCE;
    if !(settings.significance > 0.0 && settings.significance <= most) {
        let legal = format!("a number greater than 0 and at most {most}");
        return Err(unknown("significance", &settings.significance.to_string(), &legal));
    }
    Ok(Chosen {
        key: key.clone(),
        registration,
        demodulator,
        radius,
        significance: settings.significance,
        sketch: true,
        evidence_map: settings.evidence_map,
        exact_displacements: settings.exact_displacements,
    })
}

fn unknown(option: &str, value: &str, legal: &str) -> PyErr {
    OptionError::new_err(format!("{option}={value} is not legal: give {legal}"))
}
