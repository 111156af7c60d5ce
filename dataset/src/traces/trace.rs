//! A trace, and the sentence about it.

use crate::{Error, Result};
use meshmark_core::{
    counted,
    options::{Options, Spelling},
};

/// Traces of one kind in one layer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trace {
    pub(super) layer: String,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    /// These attributes hold coordinates of so many vertices.
    Attributes { names: Vec<String>, vertices: usize },
    /// Foreign members of its features hold geometries, bounding boxes or coordinates of vertices.
    ForeignMembers,
    /// It is not marked and has so many vertices in common with the marked layers.
    Geometries { vertices: usize },
}

impl Trace {
    /// Returns one sentence with a remedy, which names options as `spelling` does.
    pub fn text(&self, spelling: Spelling) -> String {
        let layer = &self.layer;
        match &self.kind {
            Kind::Attributes { names, vertices } => {
                let attributes = if names.len() == 1 { "attribute" } else { "attributes" };
                let names: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
                format!(
                    "layer \"{layer}\" has the coordinates of {} in its {attributes} {}, which stay as they are: with \
                     them anybody can undo the mark; leave them out, for example with -select, or open a CSV file with \
                     KEEP_GEOM_COLUMNS=NO",
                    counted(*vertices, "vertex"),
                    names.join(", ")
                )
            }
            Kind::ForeignMembers => format!(
                "layer \"{layer}\" has geometries, bounding boxes or coordinates in foreign members of its features, \
                 which stay as they are: with them anybody can undo the mark; leave them out, for example by a \
                 conversion with -noNativeData"
            ),
            Kind::Geometries { vertices } => format!(
                "layer \"{layer}\" is not marked and has {} in common with marked layers: with them anybody can undo \
                 the mark; add it to {}, or leave it out",
                counted(*vertices, "vertex"),
                spelling.name("LAYERS")
            ),
        }
    }
}

/// Returns a warning for every trace.
///
/// # Errors
/// Fails with [`Error::Traces`] when there is one and the options refuse it.
pub fn warnings(traces: &[Trace], options: &Options, spelling: Spelling) -> Result<Vec<String>> {
    let texts: Vec<String> = traces.iter().map(|trace| trace.text(spelling)).collect();
    match options.refuses_traces && !texts.is_empty() {
        true => Err(Error::Traces(texts)),
        false => Ok(texts),
    }
}
