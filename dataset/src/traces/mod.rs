//! Traces: unmarked places of vertices in what marking leaves as it is (attributes, foreign members of
//! GeoJSON, layers that are not marked). With them anybody can undo the mark, so all values are
//! compared with the vertices.

mod numbers;
mod search;
mod trace;
mod vertices;

pub use search::{ForeignMembers, ForeignSearch, search};
pub use trace::{Trace, warnings};
