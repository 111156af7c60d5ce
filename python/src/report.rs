//! The report of a verification.

use crate::notebook::framed;
use meshmark_detection::decision::Verdict;
use meshmark_verification::{html, report, words::power_of_ten};
use pyo3::prelude::*;

/// The report of a verification: text with str(), a page in a notebook.
#[pyclass(module = "meshmark", frozen)]
pub struct Report(pub report::Report);

#[pymethods]
impl Report {
    /// "match", "no-match" or "inconclusive".
    #[getter]
    fn verdict(&self) -> &'static str {
        match self.0.verdict {
            Verdict::Match => "match",
            Verdict::NoMatch => "no-match",
            Verdict::Inconclusive => "inconclusive",
        }
    }

    /// The reason of the verdict, one sentence.
    #[getter]
    fn reason(&self) -> &str {
        &self.0.reason
    }

    /// Whether the suspect is a copy with this mark.
    #[getter]
    fn is_match(&self) -> bool {
        self.0.verdict == Verdict::Match
    }

    /// Whether the suspect carries some mark of the key, whoever its recipient is.
    #[getter]
    fn shows_key(&self) -> bool {
        self.0.shows_key()
    }

    /// The only one of `recipients`; None where there is none, or several.
    #[getter]
    fn recipient(&self) -> Option<&str> {
        match self.0.recipients()[..] {
            [only] => Some(only),
            _ => None,
        }
    }

    /// The recipient whose copy was looked for, or of many records all whose records match, the best one first.
    #[getter]
    fn recipients(&self) -> Vec<&str> {
        self.0.recipients()
    }

    /// The message that was read, hexadecimal; None of a fingerprint.
    #[getter]
    fn message(&self) -> Option<&str> {
        self.0.message.as_deref()
    }

    /// The public id of the key.
    #[getter]
    fn key_id(&self) -> &str {
        &self.0.parameters.key_id
    }

    /// The decimal logarithm of the probability of such a fit by chance.
    #[getter]
    fn p_value_log10(&self) -> Option<f64> {
        self.0.p_value_log10
    }

    /// The decimal logarithm of the probability that a mark would be missed; None for a match.
    #[getter]
    fn p_missed_log10(&self) -> Option<f64> {
        self.0.p_missed_log10
    }

    /// The decimal logarithm of the likelihood ratio against a copy of another recipient.
    #[getter]
    fn another_recipient_log10(&self) -> Option<f64> {
        self.0.likelihood.as_ref().map(|likelihood| likelihood.ratios.another_recipient_log10)
    }

    /// The decimal logarithm of the likelihood ratio against no copy of this key.
    #[getter]
    fn no_copy_log10(&self) -> Option<f64> {
        self.0.likelihood.as_ref().map(|likelihood| likelihood.ratios.no_copy_log10)
    }

    /// Number of vertices of the reference that were found in the suspect.
    #[getter]
    fn matched_vertices(&self) -> usize {
        self.0.vertices.matched
    }

    /// Number of vertices of the reference.
    #[getter]
    fn reference_vertices(&self) -> usize {
        self.0.vertices.reference
    }

    /// Number of vertices of the suspect.
    #[getter]
    fn suspect_vertices(&self) -> usize {
        self.0.vertices.suspect
    }

    /// The radius within which vertices match, metres.
    #[getter]
    fn radius_m(&self) -> f64 {
        self.0.parameters.radius_m
    }

    /// The standard deviation of the noise, metres; None where nothing was compared.
    #[getter]
    fn noise_m(&self) -> Option<f64> {
        self.0.parameters.noise_m
    }

    /// How the suspect was brought onto the reference, in words.
    #[getter]
    fn registration(&self) -> String {
        self.0.registration.to_text()
    }

    /// The report as JSON, that of `meshmark verify --report` without the files.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// The report as a dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.0.to_json(),))
    }

    /// The report as a page of HTML that needs no network.
    fn to_html(&self) -> String {
        html::verification(&self.0)
    }

    /// The page, for a notebook.
    fn _repr_html_(&self, py: Python) -> PyResult<String> {
        framed(py, &self.to_html())
    }

    fn __str__(&self) -> String {
        self.0.to_text()
    }

    fn __repr__(&self) -> String {
        let recipient = match &self.recipients()[..] {
            [] => String::new(),
            [only] => format!(", recipient {only:?}"),
            several => format!(", recipients {several:?}"),
        };
        let p = self.0.p_value_log10.map_or(String::new(), |p| format!(", p-value {}", power_of_ten(p)));
        format!("<meshmark.Report {}{recipient}{p}>", self.verdict())
    }
}
