//! The drawing data of a verification report: a map thinned to the resolution of a page. No key is
//! involved.

mod extent;
mod lines;
mod thinning;

use geo::{ConvexHull, MultiPoint};
use meshmark_core::patches::Patch;
use meshmark_detection::{Demodulated, Histogram, Matched, matching::Matches, registration::Registration};
use serde::Serialize;

pub use extent::Extent;
pub(crate) use lines::lines;
pub(crate) use thinning::Thinning;

/// Number of bins of the displacement histogram.
pub(crate) const BINS: usize = 40;

/// The two maps after registration.
pub struct Scene<'a> {
    /// The registered suspect and its reference.
    pub matched: &'a Matched<'a>,
    /// The matches after tracking of the deformation.
    pub matches: &'a Matches,
    /// The demodulated evidence, if there is any.
    pub demodulated: Option<&'a Demodulated>,
}

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
    /// Matched vertices: x and y in the reference, CRS units, displacement in x and y, metres.
    pub matched: Vec<[f64; 4]>,
    /// Reference vertices without a match, CRS units.
    pub missing: Vec<[f64; 2]>,
    /// Suspect vertices without a match, within the extent of the reference, CRS units.
    pub inserted: Vec<[f64; 2]>,
}

impl Scene<'_> {
    /// Returns the thinned map.
    pub fn sketch(&self, registration: &Registration) -> Sketch {
        let reference = self.matched.reference;
        let coords = self.coords();
        let extent = Extent::new(&reference.data.vertices, &reference.ground);
        let displacements = self.matches.displacements_m(coords, &self.matched.moved, &reference.ground);
        let deformation = self.demodulated.and_then(|demodulated| demodulated.deformation);
        let lengths: Vec<f64> = displacements.iter().flatten().map(|[x, y]| x.hypot(*y)).collect();
        let inserted = self.inserted();
        Sketch {
            extent,
            patches: reference.patches.as_slice().iter().map(|patch| self.place(patch)).collect(),
            displacement_m: Histogram::of_values(&lengths, BINS),
            alignment: self.alignment(registration),
            deformation: deformation.map(|d| DeformationEntry {
                deviation_m: d.deviation_m,
                range_m: d.range_m,
                group_shift_m: d.group_shift_m,
            }),
            missing: coords.len() - self.matches.count,
            inserted: inserted.len(),
            sample: sample(&extent, coords, &displacements, &inserted),
            lines: lines(&extent, coords, &reference.data.segments),
        }
    }

    fn coords(&self) -> &[[f64; 2]] {
        self.matched.reference.data.vertices.coords()
    }

    fn place(&self, patch: &Patch) -> PatchPlace {
        let at = |v: &u32| self.coords()[*v as usize];
        let points: MultiPoint = patch.vertices.iter().map(at).collect();
        let found = |v: &&u32| self.matches.suspect_of[**v as usize].is_some();
        PatchPlace {
            outline: points.convex_hull().exterior().coords().skip(1).map(|c| [c.x, c.y]).collect(),
            vertices: patch.vertices.len(),
            matched: patch.vertices.iter().filter(found).count(),
        }
    }

    /// Returns the places of suspect vertices without a match.
    fn inserted(&self) -> Vec<[f64; 2]> {
        let moved = &self.matched.moved;
        let mut taken = vec![false; moved.len()];
        self.matches.suspect_of.iter().flatten().for_each(|v| taken[*v as usize] = true);
        moved.iter().zip(taken).filter(|(_, taken)| !taken).map(|(place, _)| *place).collect()
    }

    fn alignment(&self, registration: &Registration) -> Alignment {
        let [a, b, c, d, e, f] = registration.affine;
        let [x, y] = self.matched.suspect.vertices.centre();
        let to = [a * x + b * y + c, d * x + e * y + f];
        let [mx, my] = self.matched.reference.ground.metres_per_unit(to);
        let [b, d] = [b * mx / my, d * my / mx]; // on the ground
        let (squares, determinant) = (a * a + b * b + d * d + e * e, a * e - b * d);
        let root = (squares * squares - 4.0 * determinant * determinant).max(0.0).sqrt();
        let mirror = if determinant < 0.0 { -1.0 } else { 1.0 };
        Alignment {
            shift_m: [(to[0] - x) * mx, (to[1] - y) * my],
            turn_deg: (d - mirror * b).atan2(a + mirror * e).to_degrees(),
            stretch: [squares + root, squares - root].map(|s| (s.max(0.0) / 2.0).sqrt()),
            mirrored: determinant < 0.0,
        }
    }
}

/// Number of cells for arrows, which need more room than points.
pub(crate) const ARROWS: usize = 44;
const MARKS: usize = 72;

fn sample(
    extent: &Extent,
    coords: &[[f64; 2]],
    displacements: &[Option<[f64; 2]>],
    inserted: &[[f64; 2]],
) -> Sample {
    let (mut arrows, mut missing) = (Thinning::new(extent, ARROWS), Thinning::new(extent, MARKS));
    let mut sample = Sample { matched: Vec::new(), missing: Vec::new(), inserted: Vec::new() };
    for (&[x, y], displacement) in coords.iter().zip(displacements) {
        match displacement {
            Some([dx, dy]) if arrows.takes([x, y]) => sample.matched.push([x, y, *dx, *dy]),
            None if missing.takes([x, y]) => sample.missing.push([x, y]),
            _ => {}
        }
    }
    let mut shown = Thinning::new(extent, MARKS);
    sample.inserted = inserted.iter().copied().filter(|place| shown.takes(*place)).collect();
    sample
}
