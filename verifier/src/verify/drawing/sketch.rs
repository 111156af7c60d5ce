//! The sketch of a scene for a report.

use super::{alignment::alignment, scene::Scene};
use crate::{
    report::{
        Extent,
        sketch::{DeformationEntry, PatchPlace, Sample, Sketch},
    },
    thinning::{ARROWS, BINS, PointGrid, extent_of, lines},
};
use geo::{ConvexHull, MultiPoint};
use meshmark_core::patches::Patch;
use meshmark_detection::{Histogram, registration::Registration};

/// Returns the thinned map.
pub fn sketch(scene: &Scene, registration: &Registration) -> Sketch {
    let (reference, coords) = (scene.matched.reference, scene.coords());
    let extent = extent_of(&reference.data.vertices, &reference.ground);
    let displacements = scene.displacements_m();
    let lengths: Vec<f64> = displacements.iter().flatten().map(|[x, y]| x.hypot(*y)).collect();
    let inserted = scene.inserted();
    Sketch {
        extent,
        patches: reference.patches.as_slice().iter().map(|patch| place(scene, patch)).collect(),
        displacement_m: Histogram::of_values(&lengths, BINS),
        alignment: alignment(scene.matched, registration),
        deformation: scene.deformation.map(|d| DeformationEntry {
            deviation_m: d.deviation_m,
            range_m: d.range_m,
            group_shift_m: d.group_shift_m,
        }),
        missing: coords.len() - scene.matches.count,
        inserted: inserted.len(),
        sample: sample(&extent, coords, &displacements, &inserted),
        lines: lines(&extent, coords, &reference.data.segments),
    }
}

fn place(scene: &Scene, patch: &Patch) -> PatchPlace {
    let at = |v: &u32| scene.coords()[*v as usize];
    let points: MultiPoint = patch.vertices.iter().map(at).collect();
    let found = |v: &&u32| scene.matches.suspect_of[**v as usize].is_some();
    PatchPlace {
        outline: points.convex_hull().exterior().coords().skip(1).map(|c| [c.x, c.y]).collect(),
        vertices: patch.vertices.len(),
        matched: patch.vertices.iter().filter(found).count(),
    }
}

/// Number of cells for missing and inserted vertices along the longer side.
const MARKS: usize = 72;

fn sample(
    extent: &Extent,
    coords: &[[f64; 2]],
    displacements: &[Option<[f64; 2]>],
    inserted: &[[f64; 2]],
) -> Sample {
    let (mut arrows, mut missing) = (PointGrid::new(extent, ARROWS), PointGrid::new(extent, MARKS));
    let mut sample = Sample { matched: Vec::new(), missing: Vec::new(), inserted: Vec::new() };
    for (&[x, y], displacement) in coords.iter().zip(displacements) {
        match displacement {
            Some([dx, dy]) if arrows.takes([x, y]) => sample.matched.push([x, y, *dx, *dy]),
            None if missing.takes([x, y]) => sample.missing.push([x, y]),
            _ => {}
        }
    }
    let mut shown = PointGrid::new(extent, MARKS);
    sample.inserted = inserted.iter().copied().filter(|place| shown.takes(*place)).collect();
    sample
}
