//! The numbers and choices that shape a mark.

use serde::{Deserialize, Serialize};

/// The numbers that shape a mark; with the key, the message and the reference they determine it.
/// Records and reports hold them as they are here.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// The amplitude, metres on the ground.
    pub amplitude_m: f64,
    /// What the amplitude measures. The version of the mark determines it, so that records do not
    /// repeat it.
    #[serde(skip)]
    pub amplitude_of: AmplitudeOf,
    /// How the message becomes the channel bits.
    pub code: Code,
    /// c, coefficients per channel bit, patch and axis.
    pub chip_rate: usize,
    /// d, the smallest number of vertices in a patch.
    pub patch_size: usize,
    /// No vertex moves further than this, metres on the ground.
    pub tolerance_m: f64,
    /// Which vertices move as one.
    pub shape: Rigidity,
    /// Which functions carry the mark.
    pub basis: Laplacian,
    /// Grid of the marked coordinates, CRS units; `None` where it is not rounded.
    pub precision_crs_units: Option<f64>,
}

/// What an amplitude measures.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AmplitudeOf {
    /// α, the amplitude of every coefficient (marks of messages, as in the paper).
    #[default]
    Coefficient,
    /// The expected displacement of the vertices, root mean square (fingerprints).
    Displacement,
}

/// How many bits of a message LDPC carries.
pub(crate) const LDPC_MESSAGE_BITS: usize = 128;
/// How many channel bits it makes of them.
pub(crate) const LDPC_CHANNEL_BITS: usize = 256;

/// How the message becomes the channel bits, see [`crate::code`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Code {
    /// The channel bits are the message bits.
    Repetition,
    /// 128 message bits, 256 channel bits.
    Ldpc,
}

impl Code {
    /// The values of CODE.
    pub const NAMES: [&str; 2] = ["REPETITION", "LDPC"];

    /// Looks up the code of this name, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        let index = Self::NAMES.iter().position(|known| known.eq_ignore_ascii_case(name))?;
        Some([Code::Repetition, Code::Ldpc][index])
    }

    /// Returns the name in lower case, for records and reports.
    pub fn name(self) -> String {
        Self::NAMES[self as usize].to_lowercase()
    }

    /// Returns CODE when it is not given: LDPC for messages it can carry, as it recovers more of
    /// them from the same displacement (docs/evaluation.md).
    pub fn default_for(message_bits: usize) -> Self {
        if message_bits == LDPC_MESSAGE_BITS { Code::Ldpc } else { Code::Repetition }
    }

    /// Returns CHIP_RATE when it is not given, for the same displacement with either code.
    pub fn default_chip_rate(self) -> usize {
        2 / self.expansion()
    }

    /// Returns the number of channel bits for each message bit.
    pub(crate) fn expansion(self) -> usize {
        match self {
            Code::Repetition => 1,
            Code::Ldpc => LDPC_CHANNEL_BITS / LDPC_MESSAGE_BITS,
        }
    }
}

/// Which vertices move as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rigidity {
    /// None but hanging vertices with their anchors.
    Free,
    /// Those of a building: a group of polygons that share vertices or walls, see
    /// [`crate::bodies`].
    Rigid,
    /// Those of a building, and all others so that angles and lengths change little, see
    /// [`crate::stiffness`].
    Stiff,
}

impl Rigidity {
    /// The values of SHAPE.
    pub const NAMES: [&str; 3] = ["FREE", "RIGID", "STIFF"];

    pub(super) fn from_name(name: &str) -> Option<Self> {
        let shapes = [Rigidity::Free, Rigidity::Rigid, Rigidity::Stiff];
        shapes.into_iter().find(|shape| shape.name().eq_ignore_ascii_case(name))
    }

    /// Returns the option's value.
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
    /// The Dirichlet Laplacian of the mesh, which depends on distances and angles.
    Cotangent,
}

impl Laplacian {
    /// The values of BASIS.
    pub const NAMES: [&str; 2] = ["BIGGS", "COTANGENT"];

    pub(super) fn from_name(name: &str) -> Option<Self> {
        [Laplacian::Biggs, Laplacian::Cotangent].into_iter().find(|l| l.name().eq_ignore_ascii_case(name))
    }

    /// Returns the option's value.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}
