//! The report of a verification.

use crate::{crs::PyCrs, notebook::framed};
use meshmark_detection::decision::Verdict;
use meshmark_verification::{
    html,
    report::{self, EvidenceMap, PatchEvidence},
    words::power_of_ten,
};
use pyo3::prelude::*;

/// The report of a verification: text with str(), a page in a notebook.
#[pyclass(module = "meshmark", frozen)]
pub struct Report {
    /// The report, without the evidence map.
    pub report: report::Report,
    /// The evidence map, if it was asked for.
    pub evidence_map: Option<EvidenceMap>,
    /// The CRS of the reference.
    pub crs: Option<PyCrs>,
}

/// A matched vertex: its place, patch and weight, and with exact displacements its place in the suspect and
/// its displacement in metres.
type VertexRow = ([f64; 2], usize, f64, Option<([f64; 2], [f64; 2])>);

/// A patch: the places of its vertices, how many are found, its score and its recipient.
type PatchRow = (Vec<[f64; 2]>, usize, Option<f64>, Option<String>);

#[pymethods]
impl Report {
    /// "match", "no-match" or "inconclusive".
    #[getter]
    fn verdict(&self) -> &'static str {
        match self.report.verdict {
            Verdict::Match => "match",
            Verdict::NoMatch => "no-match",
            Verdict::Inconclusive => "inconclusive",
        }
    }

    /// The reason of the verdict, one sentence.
    #[getter]
    fn reason(&self) -> &str {
        &self.report.reason
    }

    /// Whether the suspect is a copy with this mark.
    #[getter]
    fn is_match(&self) -> bool {
        self.report.verdict == Verdict::Match
    }

    /// Whether the suspect carries some mark of the key, whoever its recipient is.
    #[getter]
    fn shows_key(&self) -> bool {
        self.report.shows_key()
    }

    /// The only one of `recipients`; None where there is none, or several.
    #[getter]
    fn recipient(&self) -> Option<&str> {
        match self.report.recipients()[..] {
            [only] => Some(only),
            _ => None,
        }
    }

    /// The recipient whose copy was looked for, or of many records all whose records match, the best one first.
    #[getter]
    fn recipients(&self) -> Vec<&str> {
        self.report.recipients()
    }

    /// The message that was read, hexadecimal; None of a fingerprint.
    #[getter]
    fn message(&self) -> Option<&str> {
        self.report.message.as_deref()
    }

    /// The public id of the key.
    #[getter]
    fn key_id(&self) -> &str {
        &self.report.parameters.key_id
    }

    /// The decimal logarithm of the probability of such a fit by chance.
    #[getter]
    fn p_value_log10(&self) -> Option<f64> {
        self.report.p_value_log10
    }

    /// The decimal logarithm of the probability that a mark would be missed; None for a match.
    #[getter]
    fn p_missed_log10(&self) -> Option<f64> {
        self.report.p_missed_log10
    }

    /// The decimal logarithm of the likelihood ratio against a copy of another recipient.
    #[getter]
    fn another_recipient_log10(&self) -> Option<f64> {
        self.report.likelihood.as_ref().map(|likelihood| likelihood.ratios.another_recipient_log10)
    }

    /// The decimal logarithm of the likelihood ratio against no copy of this key.
    #[getter]
    fn no_copy_log10(&self) -> Option<f64> {
        self.report.likelihood.as_ref().map(|likelihood| likelihood.ratios.no_copy_log10)
    }

    /// Number of vertices of the reference that were found in the suspect.
    #[getter]
    fn matched_vertices(&self) -> usize {
        self.report.vertices.matched
    }

    /// Number of vertices of the reference.
    #[getter]
    fn reference_vertices(&self) -> usize {
        self.report.vertices.reference
    }

    /// Number of vertices of the suspect.
    #[getter]
    fn suspect_vertices(&self) -> usize {
        self.report.vertices.suspect
    }

    /// The radius within which vertices match, metres.
    #[getter]
    fn radius_m(&self) -> f64 {
        self.report.parameters.radius_m
    }

    /// The standard deviation of the noise, metres; None where nothing was compared.
    #[getter]
    fn noise_m(&self) -> Option<f64> {
        self.report.parameters.noise_m
    }

    /// How the suspect was brought onto the reference, in words.
    #[getter]
    fn registration(&self) -> String {
        self.report.registration.to_text()
    }

    /// The report as JSON, that of `meshmark verify --report` without the files.
    fn to_json(&self) -> String {
        self.report.to_json()
    }

    /// The report as a dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.report.to_json(),))
    }

    /// The report as a page of HTML that needs no network.
    fn to_html(&self) -> String {
        html::verification(&self.report)
    }

    /// The rows of the evidence map for the package's module `_evidence`: those of vertices, whether these
    /// have displacements, and those of patches; None unless it was asked for.
    fn _evidence_rows(&self) -> Option<(Vec<VertexRow>, bool, Vec<PatchRow>)> {
        let map = self.evidence_map.as_ref()?;
        let vertices = map.vertices.iter().map(|vertex| {
            let displacement =
                vertex.displacement.map(|displacement| (displacement.to, displacement.moved_m));
            (vertex.at, vertex.patch, vertex.weight, displacement)
        });
        let row = |patch: &PatchEvidence| {
            (patch.vertices.clone(), patch.found, patch.score, patch.recipient.clone())
        };
        let patches = map.patches.iter().map(row);
        Some((vertices.collect(), map.has_displacements, patches.collect()))
    }

    /// The CRS of the reference, of the package's class `_crs.Crs`; None where it has none.
    #[getter]
    fn _crs<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.crs.as_ref().map(|crs| crs.object(py))
    }

    /// The page, for a notebook.
    fn _repr_html_(&self, py: Python) -> PyResult<String> {
        framed(py, &self.to_html())
    }

    fn __str__(&self) -> String {
        self.report.to_text()
    }

    fn __repr__(&self) -> String {
        let recipient = match &self.recipients()[..] {
            [] => String::new(),
            [only] => format!(", recipient {only:?}"),
            several => format!(", recipients {several:?}"),
        };
        let p = self.report.p_value_log10.map_or(String::new(), |p| format!(", p-value {}", power_of_ten(p)));
        format!("<meshmark.Report {}{recipient}{p}>", self.verdict())
    }
}
