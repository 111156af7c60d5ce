//! What marking and verifying cost, beside plain `ogr2ogr` and a numpy script, from thousands of vertices to
//! millions. Processes are run as a user runs them, in turns; stages are timed in this process. Nothing is asserted,
//! for times depend on the machine and on what else it does.

pub mod job;
pub mod process;
pub mod report;
pub mod stages;
pub mod startup;
pub mod tiling;

pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;
