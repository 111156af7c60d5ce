//! Progress of long steps, which appears on a terminal only. A process that examines a suspect has
//! no terminal: it passes its progress to its parent, line by line.

use indicatif::{ProgressBar, ProgressStyle};
use meshmark_detection::{Listener, Progress as Event};
use std::{collections::BTreeMap, sync::Mutex, time::Instant};

const STAGE: &str = "stage ";
const STEPS: &str = "steps ";

/// What is shown of the progress.
#[derive(Clone)]
pub struct Bar(ProgressBar);

impl Default for Bar {
    fn default() -> Self {
        // It draws on stderr, and nothing where that is no terminal.
        Bar(ProgressBar::no_length())
    }
}

impl Bar {
    fn start(&self, stage: &str, steps: u64) {
        let template = if steps > 0 { "{msg} {bar:30} {pos}/{len}" } else { "{msg} {spinner}" };
        self.0.set_style(ProgressStyle::with_template(template).expect("a legal template"));
        self.0.reset();
        self.0.set_length(steps);
        self.0.set_message(stage.to_string());
        self.0.tick();
    }

    /// Shows a line from a child; returns whether it is one about progress.
    pub fn show(&self, line: &str) -> bool {
        if let Some(steps) = line.strip_prefix(STEPS).and_then(|steps| steps.parse().ok()) {
            self.0.inc(steps);
            return true;
        }
        let stage = line.strip_prefix(STAGE).and_then(|rest| rest.split_once(' '));
        let Some((Ok(steps), stage)) = stage.map(|(steps, stage)| (steps.parse(), stage)) else {
            return false;
        };
        self.start(stage, steps);
        true
    }

    /// Clears the line.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// Where progress goes.
#[derive(Clone)]
enum Display {
    Bar(Bar),
    Parent,
}

/// Shows the current stage and records the duration of each.
pub struct Progress {
    display: Display,
    stage: Option<(&'static str, Instant)>,
    seconds: BTreeMap<&'static str, f64>,
}

impl Default for Progress {
    fn default() -> Self {
        Progress::on(Display::Bar(Bar::default()))
    }
}

impl Progress {
    fn on(display: Display) -> Self {
        Progress { display, stage: None, seconds: BTreeMap::new() }
    }

    /// Creates the progress of a child, whose parent shows it.
    pub fn of_child() -> Self {
        Progress::on(Display::Parent)
    }

    /// Starts a stage of `steps` steps (0: unknown) and ends the previous one.
    pub fn start(&mut self, stage: &'static str, steps: u64) {
        self.finish();
        self.stage = Some((stage, Instant::now()));
        match &self.display {
            Display::Bar(bar) => bar.start(stage, steps),
            Display::Parent => eprintln!("{STAGE}{steps} {stage}"),
        }
    }

    /// Returns a function that counts steps; any thread may call it.
    pub fn stepper(&self) -> impl Fn(usize) + Sync + use<> {
        let display = self.display.clone();
        move |steps| match &display {
            Display::Bar(Bar(bar)) => bar.inc(steps as u64),
            Display::Parent => eprintln!("{STEPS}{steps}"),
        }
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
        if let Display::Bar(bar) = &self.display {
            bar.finish();
        }
        &self.seconds
    }
}
