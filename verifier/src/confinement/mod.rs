//! The process of an examination. A suspect may be made to exhaust the machine or to take over what
//! reads it, so a child process examines it, which has limits and may do little else:
//!
//! ```text
//! parent: private copy ─► start, watch ──────────────────► answer, report, evidence map
//!                           │        ▲ warnings, progress        ▲
//! child:                  limits ─► sandbox ─► examination ─► handover
//! ```
//!
//! The child writes to the folder of the private copy alone. The parent publishes what it finds there
//! after the child has ended well, and removes the folder in any case.

mod limits;
mod process;
mod sandbox;

pub use limits::Limits;
pub use process::{End, Handover, examine};
pub use sandbox::enter;
