//! The numbers and choices that shape a mark.

use super::Options;
use crate::code::Code;
use serde::{Deserialize, Serialize};

/// The numbers that shape a mark; with the key, the message and the reference they determine it.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// α, amplitude per coefficient, metres on the ground.
    pub amplitude_m: f64,
    /// How the message becomes the channel bits.
    pub code: Code,
    /// c, coefficients per channel bit, patch and axis.
    pub chip_rate: usize,
    /// d, the smallest number of vertices in a patch.
    pub patch_size: usize,
    /// No vertex moves further, metres on the ground.
    pub tolerance_m: f64,
    /// What moves as one.
    pub shape: Shape,
    /// Which functions carry the mark.
    pub laplacian: Laplacian,
    /// Grid of the marked coordinates, CRS units.
    pub precision: Option<f64>,
}

impl Default for Parameters {
    /// Those of a message as long as a recipient's.
    fn default() -> Self {
        Options::parse([]).expect("the defaults are legal").parameters
    }
}

/// Which vertices move as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// None but what hangs on others.
    Free,
    /// Those of a building: a group of polygons that share vertices or walls, see [`crate::bodies`].
    Rigid,
}

impl Shape {
    /// What SHAPE may be.
    pub const NAMES: [&str; 2] = ["FREE", "RIGID"];

    pub(super) fn from_name(name: &str) -> Option<Self> {
        [Shape::Free, Shape::Rigid].into_iter().find(|shape| shape.name().eq_ignore_ascii_case(name))
    }

    /// The option's value.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// Whose eigenvectors carry the mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Laplacian {
    /// I − D⁻¹A of the mesh (the paper).
    Biggs,
    /// The Dirichlet Laplacian of the mesh: it knows distances and angles.
    Cotangent,
}

impl Laplacian {
    /// What BASIS may be.
    pub const NAMES: [&str; 2] = ["BIGGS", "COTANGENT"];

    pub(super) fn from_name(name: &str) -> Option<Self> {
        [Laplacian::Biggs, Laplacian::Cotangent].into_iter().find(|l| l.name().eq_ignore_ascii_case(name))
    }

    /// The option's value.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}
