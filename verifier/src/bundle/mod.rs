//! The bundle of a case: one ZIP archive with the report, what vouches for it, and a manifest of all
//! that is needed to make it again. Equal inputs make equal bytes. It holds neither the key nor a map
//! nor a record.
//!
//! ```text
//! verify --bundle:  inputs ─► manifest ─► examination ─► archive
//! repeat:           archive ─► manifest ─► the same inputs? ─► verify --bundle ─► the same bytes?
//! ```

mod archive;
mod manifest;

pub use archive::Bundle;
pub use manifest::{Input, Manifest, Role, Used};

/// The report to read.
const PAGE: &str = "report.html";
/// The report to process.
const JSON: &str = "report.json";
/// The list of all that is needed to make the bundle again.
const MANIFEST: &str = "manifest.json";
