//! Registration: the map that brings a suspect back onto the reference (paper, section 3.5): an affine one, and
//! where that leaves a smooth distortion, a cubic polynomial.
//!
//! Starting points are the identity, landmarks (features with the same attribute values) and geometry
//! (features of the same shape, then the same arrangement of neighbouring vertices). Each is refined on matched
//! vertices, and the one under which most vertices match wins. Nothing here knows a key.

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
pub use cubic::{Cubic, TERMS, Transform};
pub use registrar::Registrar;
pub use result::{ReadAs, Registration};
pub use search::Start;
