//! The drawing data of a verification report: a map thinned to the resolution of a page.

use super::extent::Extent;
use meshmark_detection::Histogram;
use serde::Serialize;

/// The thinned map.
#[derive(Debug, Clone, Serialize)]
pub struct Sketch {
    /// The extent of the reference.
    pub extent: Extent,
    /// The patches of the reference, by number.
    pub patches: Vec<PatchPlace>,
    /// Displacements of matched vertices, metres; null when none matched.
    pub displacement_m: Option<Histogram>,
    /// The linear part of the registration.
    pub alignment: Alignment,
    /// The smooth deformation besides the mark; null when it was not estimated.
    pub deformation: Option<DeformationEntry>,
    /// Number of reference vertices without a match.
    pub missing: usize,
    /// Number of suspect vertices without a match.
    pub inserted: usize,
    /// A sample of the vertices, spread over the map.
    pub sample: Sample,
    /// Rings and lines of the reference, thinned, CRS units.
    #[serde(skip)]
    pub lines: Vec<Vec<[f64; 2]>>,
}

/// The place of a patch on the map.
#[derive(Debug, Clone, Serialize)]
pub struct PatchPlace {
    /// Convex hull of the vertices, CRS units.
    pub outline: Vec<[f64; 2]>,
    /// Number of vertices.
    pub vertices: usize,
    /// Number of vertices with a match.
    pub matched: usize,
}

/// The linear part of the registration, measured on the ground.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Alignment {
    /// Shift of the middle of the suspect, metres.
    pub shift_m: [f64; 2],
    /// Rotation, degrees, counter-clockwise.
    pub turn_deg: f64,
    /// The largest and the smallest factor of length.
    pub stretch: [f64; 2],
    /// Whether the map is mirrored.
    pub mirrored: bool,
}

/// Hyper-parameters of the deformation.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct DeformationEntry {
    /// Standard deviation, metres; 0 without a deformation.
    pub deviation_m: f64,
    /// Range of the covariance, metres.
    pub range_m: f64,
    /// Standard deviation of the shifts of polygon groups as a whole, metres; 0 without any.
    pub group_shift_m: f64,
}

/// A sample of the vertices.
#[derive(Debug, Clone, Serialize)]
pub struct Sample {
    /// Matched vertices: their places in the reference, CRS units.
    pub matched: Vec<[f64; 2]>,
    /// The exact displacements of these, metres; null unless they are asked for.
    pub displacements_m: Option<Vec<[f64; 2]>>,
    /// Reference vertices without a match, CRS units.
    pub missing: Vec<[f64; 2]>,
    /// The middles of cells that hold suspect vertices without a match, within the extent of the
    /// reference, CRS units.
    pub inserted: Vec<[f64; 2]>,
}
