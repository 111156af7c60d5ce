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
        sample: sample(scene, &extent, &displacements, &inserted),
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
    scene: &Scene,
    extent: &Extent,
    displacements: &[Option<[f64; 2]>],
    inserted: &[[f64; 2]],
) -> Sample {
    let [mut arrows, mut missing, mut shown] =
        [ARROWS, MARKS, MARKS].map(|cells| PointGrid::new(extent, cells));
    let (mut matched, mut exact, mut unmatched) = (Vec::new(), Vec::new(), Vec::new());
    for (&place, displacement) in scene.coords().iter().zip(displacements) {
        match displacement {
            Some(displacement) if arrows.takes(place) => {
                matched.push(place);
                exact.push(*displacement);
            }
            None if missing.takes(place) => unmatched.push(place),
            _ => {}
        }
    }
    // Their exact places would be displacements, too, where the radius is small.
    let inserted = inserted.iter().copied().filter(|place| shown.takes(*place)).collect::<Vec<_>>();
    let inserted = inserted.into_iter().map(|place| shown.middle_of(shown.cell_of(place))).collect();
    let displacements_m = scene.exact_displacements.then_some(exact);
    Sample { matched, displacements_m, missing: unmatched, inserted }
}
