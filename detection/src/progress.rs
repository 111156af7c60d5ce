//! What a long examination reports while it runs.

/// One report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// A stage begins.
    Stage {
        /// Its name.
        stage: &'static str,
        /// How many steps it has; 0 where that is not known.
        steps: u64,
    },
    /// So many steps of the stage are done.
    Steps(usize),
}

/// Who is told; it may be called from any thread.
pub type Listener<'a> = &'a (dyn Fn(Progress) + Sync);
