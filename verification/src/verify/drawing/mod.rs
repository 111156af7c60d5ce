//! The drawing of a verification: the sketch of a report and the evidence map, computed from two
//! maps after registration. No key is involved.

mod alignment;
mod evidence_map;
mod scene;
mod sketch;

pub use evidence_map::evidence_map;
pub use scene::Scene;
pub use sketch::sketch;
