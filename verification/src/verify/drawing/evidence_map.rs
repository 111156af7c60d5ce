//! The evidence map of a scene.

use super::scene::Scene;
use crate::report::{EvidenceMap, ExactDisplacement, FoundVertex, PatchEvidence};
use meshmark_core::patches::Patch;

/// Returns the evidence map; without demodulation it has patches alone.
pub fn evidence_map(scene: &Scene) -> EvidenceMap {
    let reference = scene.matched.reference;
    let (coords, ground) = (scene.coords(), &reference.ground);
    let patches = reference.patches.as_slice();
    let mut patch_of = vec![None; coords.len()];
    for (number, patch) in patches.iter().enumerate() {
        patch.vertices.iter().for_each(|&v| patch_of[v as usize] = Some(number));
    }
    let of_patch = |patch: &Patch| PatchEvidence {
        vertices: patch.vertices.iter().map(|&v| coords[v as usize]).collect(),
        found: 0,
        score: None,
        recipient: None,
    };
    let patches = patches.iter().map(of_patch).collect();
    let has_displacements = scene.exact_displacements;
    let mut map = EvidenceMap { vertices: Vec::new(), has_displacements, patches };
    let moved_m = scene.displacements_m();
    for (v, &weight) in scene.weights.iter().enumerate() {
        // Vertices that only follow others are in no patch.
        let (Some(moved_m), Some(patch), at) = (moved_m[v], patch_of[v], coords[v]) else { continue };
        let unit = ground.metres_per_unit(at);
        let to = [at[0] + moved_m[0] / unit[0], at[1] + moved_m[1] / unit[1]];
        let displacement = has_displacements.then_some(ExactDisplacement { to, moved_m });
        // A weight follows from the length of the displacement.
        let weight = if has_displacements { weight } else { (10.0 * weight).round() / 10.0 };
        map.vertices.push(FoundVertex { at, patch, displacement, weight });
        map.patches[patch].found += 1;
    }
    map
}
