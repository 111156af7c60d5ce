//! Progress of long steps, which appears on a terminal only.

use indicatif::{ProgressBar, ProgressStyle};
use meshmark_detection::{Listener, Progress as Event};
use std::{collections::BTreeMap, sync::Mutex, time::Instant};

/// Shows the current stage and records the duration of each.
pub struct Progress {
    bar: ProgressBar,
    stage: Option<(&'static str, Instant)>,
    seconds: BTreeMap<&'static str, f64>,
}

impl Default for Progress {
    fn default() -> Self {
        // It draws on stderr, and nothing where that is no terminal.
        let bar = ProgressBar::no_length();
        Progress { bar, stage: None, seconds: BTreeMap::new() }
    }
}

impl Progress {
    /// Starts a stage of `steps` steps (0: unknown) and ends the previous one.
    pub fn start(&mut self, stage: &'static str, steps: u64) {
        self.finish();
        self.stage = Some((stage, Instant::now()));
        let template = if steps > 0 { "{msg} {bar:30} {pos}/{len}" } else { "{msg} {spinner}" };
        self.bar.set_style(ProgressStyle::with_template(template).expect("a legal template"));
        self.bar.reset();
        self.bar.set_length(steps);
        self.bar.set_message(stage);
        self.bar.tick();
    }

    /// Returns a function that counts steps; any thread may call it.
    pub fn stepper(&self) -> impl Fn(usize) + Sync + use<> {
        let bar = self.bar.clone();
        move |steps| bar.inc(steps as u64)
    }

    /// Runs `work`, which reports its stages and steps.
    pub fn listen<T>(&mut self, work: impl FnOnce(Listener) -> T) -> T {
        let step = self.stepper();
        let stages = Mutex::new(self);
        work(&|event| match event {
            Event::Stage { stage, steps } => {
                stages.lock().expect("nobody panics with it").start(stage, steps)
            }
            Event::Steps(steps) => step(steps),
        })
    }

    /// Ends the last stage and clears the line; returns the seconds by stage.
    pub fn finish(&mut self) -> &BTreeMap<&'static str, f64> {
        if let Some((stage, since)) = self.stage.take() {
            *self.seconds.entry(stage).or_default() += since.elapsed().as_secs_f64();
        }
        self.bar.finish_and_clear();
        &self.seconds
    }
}
