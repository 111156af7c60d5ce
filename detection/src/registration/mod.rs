//! Registration: the transformation of a suspect onto the reference (paper, section 3.5). It is an
//! affine map, followed by a cubic polynomial where a smooth distortion remains.
//!
//! Starting points are the identity, landmarks (features with equal attribute values) and geometry
//! (features of equal shape, then equal arrangements of neighbouring vertices). Each start is
//! refined on matched vertices, and the one with most matched vertices wins. Registration uses no
//! key.

mod affine;
mod consensus;
mod cubic;
mod landmarks;
mod polylines;
mod registrar;
mod result;
mod search;
mod windows;

pub use affine::Affine;
pub use cubic::Cubic;
pub use registrar::Registrar;
pub use result::{ReadAs, Registration};
pub use search::Start;
