//! Progress reports of a long examination.

/// One progress report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// A stage begins.
    Stage {
        /// Name of the stage.
        stage: &'static str,
        /// Number of its steps; 0 where it is unknown.
        steps: u64,
    },
    /// This many further steps of the stage are done.
    Steps(usize),
}

/// Receives the progress reports; any thread may call it.
pub type Listener<'a> = &'a (dyn Fn(Progress) + Sync);
