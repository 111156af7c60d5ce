//! The stages of a verification, and how long each takes.

use meshmark_detection::{Listener, Progress};
use std::{collections::BTreeMap, sync::Mutex, time::Instant};

/// Tells a listener of the stages, and records the duration of each.
pub struct Stages<'a> {
    listener: Listener<'a>,
    stage: Option<(&'static str, Instant)>,
    seconds: BTreeMap<&'static str, f64>,
}

impl<'a> Stages<'a> {
    /// Creates the stages of a verification before the first one.
    pub fn new(listener: Listener<'a>) -> Self {
        Stages { listener, stage: None, seconds: BTreeMap::new() }
    }

    /// Starts a stage of `steps` steps (0: unknown) and ends the previous one.
    pub fn start(&mut self, stage: &'static str, steps: u64) {
        self.finish();
        self.stage = Some((stage, Instant::now()));
        (self.listener)(Progress::Stage { stage, steps });
    }

    /// Runs `work`, which reports its stages and steps.
    pub fn listen<T>(&mut self, work: impl FnOnce(Listener) -> T) -> T {
        let listener = self.listener;
        let stages = Mutex::new(self);
        work(&|event| match event {
            Progress::Stage { stage, steps } => {
                stages.lock().expect("nobody panics with it").start(stage, steps)
            }
            Progress::Steps(_) => listener(event),
        })
    }

    /// Ends the last stage; returns the seconds by stage.
    pub fn finish(&mut self) -> &BTreeMap<&'static str, f64> {
        if let Some((stage, since)) = self.stage.take() {
            *self.seconds.entry(stage).or_default() += since.elapsed().as_secs_f64();
        }
        &self.seconds
    }
}
