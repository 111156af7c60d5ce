//! What a report draws of a verification: a map that is thinned to what a page can show. No key is involved.

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

/// Bins of the displacements.
pub(crate) const BINS: usize = 40;

/// The two maps after registration.
pub struct Scene<'a> {
    /// The suspect on the reference.
    pub matched: &'a Matched<'a>,
    /// Which vertex is which in the end.
    pub matches: &'a Matches,
    /// What was demodulated, if anything was.
    pub demodulated: Option<&'a Demodulated>,
}

/// The thinned map.
#[derive(Debug, Clone, Serialize)]
pub struct Sketch {
    /// Where the reference is.
    pub extent: Extent,
    /// Its patches, by number.
    pub patches: Vec<PatchPlace>,
    /// How far matched vertices are from where they were, metres; null when none matched.
    pub displacement_m: Option<Histogram>,
    /// What the registration did to the suspect.
    pub alignment: Alignment,
    /// What moved the vertices smoothly besides the mark; null when it was not estimated.
    pub deformation: Option<DeformationEntry>,
    /// Vertices of the reference without a counterpart.
    pub missing: usize,
    /// Vertices of the suspect without a counterpart.
    pub inserted: usize,
    /// Some of the vertices, a few for every piece of the map.
    pub sample: Sample,
    /// Rings and lines of the reference, thinned, CRS units.
    #[serde(skip)]
    pub lines: Vec<Vec<[f64; 2]>>,
}

/// A patch on the map.
#[derive(Debug, Clone, Serialize)]
pub struct PatchPlace {
    /// Convex hull of its vertices, CRS units.
    pub outline: Vec<[f64; 2]>,
    /// How many vertices it has.
    pub vertices: usize,
    /// Those with a counterpart.
    pub matched: usize,
}

/// The linear part of the registration, in terms of the ground.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Alignment {
    /// How far the middle of the suspect was shifted, metres.
    pub shift_m: [f64; 2],
    /// How far it was turned, degrees, counter-clockwise.
    pub turn_deg: f64,
    /// The largest and the smallest factor by which lengths were stretched.
    pub stretch: [f64; 2],
    /// Whether it was mirrored.
    pub mirrored: bool,
}

/// Hyper-parameters of the deformation.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct DeformationEntry {
    /// Its standard deviation, metres; 0 where there is none.
    pub deviation_m: f64,
    /// The distance over which it changes, metres.
    pub range_m: f64,
}

/// Vertices, thinned.
#[derive(Debug, Clone, Serialize)]
pub struct Sample {
    /// Matched: x and y in the reference, CRS units, displacement in x and y, metres.
    pub matched: Vec<[f64; 4]>,
    /// Of the reference without a counterpart.
    pub missing: Vec<[f64; 2]>,
    /// Of the suspect without a counterpart, within the extent of the reference.
    pub inserted: Vec<[f64; 2]>,
}

impl Scene<'_> {
    /// Thins the map.
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
            deformation: deformation
                .map(|d| DeformationEntry { deviation_m: d.deviation_m, range_m: d.range_m }),
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

    /// Places of the suspect's vertices without a counterpart.
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

/// Arrows need more room than marks.
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
