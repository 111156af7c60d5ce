//! Progress of long steps, which appears on a terminal only. A process that examines a suspect has
//! no terminal: it passes its progress to its parent, line by line.

use indicatif::{ProgressBar, ProgressStyle};
use meshmark_detection::Progress as Event;

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

/// Shows the current stage.
#[derive(Clone)]
pub struct Progress(Display);

impl Default for Progress {
    fn default() -> Self {
        Progress(Display::Bar(Bar::default()))
    }
}

impl Progress {
    /// Creates the progress of a child, whose parent shows it.
    pub fn of_child() -> Self {
        Progress(Display::Parent)
    }

    /// Starts a stage of `steps` steps (0: unknown).
    pub fn start(&self, stage: &str, steps: u64) {
        match &self.0 {
            Display::Bar(bar) => {
                bar.finish();
                bar.start(stage, steps);
            }
            Display::Parent => eprintln!("{STAGE}{steps} {stage}"),
        }
    }

    /// Counts steps.
    pub fn step(&self, steps: usize) {
        match &self.0 {
            Display::Bar(Bar(bar)) => bar.inc(steps as u64),
            Display::Parent => eprintln!("{STEPS}{steps}"),
        }
    }

    /// Shows an event of a verification.
    pub fn show(&self, event: Event) {
        match event {
            Event::Stage { stage, steps } => self.start(stage, steps),
            Event::Steps(steps) => self.step(steps),
        }
    }

    /// Clears the line.
    pub fn finish(&self) {
        if let Display::Bar(bar) = &self.0 {
            bar.finish();
        }
    }
}
