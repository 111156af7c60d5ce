//! Registration: the transformation of a suspect onto the reference (paper, section 3.5). It is an
//! affine map, followed by a cubic polynomial where a smooth distortion remains.
//!
//! Starting points are the identity, landmarks (features with equal attribute values) and geometry
//! (features of equal shape, then equal arrangements of neighbouring vertices). Each start is
//! refined on matched vertices, and the one with most matched vertices wins. Where the vertices of
//! the suspect are new, the course of its lines takes their place. Registration uses no key.

mod affine;
mod consensus;
mod cubic;
mod curves;
mod landmarks;
mod moments;
mod polylines;
mod registrar;
mod result;
mod search;
mod similarity;
mod windows;

use meshmark_core::map_data::MapData;

pub use affine::Affine;
pub use cubic::Cubic;
pub use registrar::Registrar;
pub use result::{Method, ReadAs, Registration};
pub use search::Start;

/// Returns places of features in suspect and reference, each in its own CRS units, that have equal
/// attribute values or shapes.
pub(crate) fn place_pairs(reference: &MapData, suspect: &MapData) -> Vec<[[f64; 2]; 2]> {
    let by_value = landmarks::pairs(&reference.labels, &suspect.labels);
    let by_shape = polylines::pairs(&reference.polylines, &suspect.polylines);
    [by_value, by_shape].concat()
}
