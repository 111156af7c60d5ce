//! What to verify, and against what.

use meshmark_core::{
    key::SecretKey,
    options::{Parameters, Subject},
    record::Record,
};
use meshmark_dataset::LabelFields;
use meshmark_detection::{Demodulator, Mark, decision::Expected, registration::Start};
use std::path::PathBuf;

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

    /// What the mark is made with.
    pub(super) fn mark(&self) -> Mark<'_> {
        Mark { key: &self.key, bits: self.bits, parameters: &self.parameters }
    }

    /// What the mark may say: without a record, a message may be of the time before whitening.
    pub(super) fn subjects(&self) -> Vec<Subject> {
        match (&self.record, &self.subject) {
            (None, Some(Subject::Message(message))) => {
                vec![Subject::Message(message.clone()), Subject::Unwhitened(message.clone())]
            }
            (_, subject) => subject.iter().cloned().collect(),
        }
    }

    pub(super) fn landmarks(&self) -> LabelFields<'_> {
        match self.landmarks.as_slice() {
            [] => LabelFields::All,
            names => LabelFields::Named(names),
        }
    }
}
