//! Patches: the map cut into pieces of nearly `patch_size` vertices, each with its connected graph
//! (paper, section 3.2; the split and the bridges are ours, see docs/method.md).

use crate::{Error, Result, ground::Ground, mesh::Mesh, options::Parameters, vertices::VertexTable};
use rayon::prelude::*;

/// One patch: some vertices of the map and the mesh edges among them.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Canonical indices of the patch's vertices, ascending; `n` of them.
    pub vertices: Vec<u32>,
    /// Edges as pairs of positions in `vertices`, `[i, j]` with i < j, sorted; they join all vertices.
    pub edges: Vec<[u32; 2]>,
}

/// All patches of a map, in the order of the k-d tree's leaves. Every vertex is in exactly one.
#[derive(Debug, Clone, PartialEq)]
pub struct Patches {
    patches: Vec<Patch>,
    positions_m: Vec<[f64; 2]>,
}

impl Patches {
    /// Meshes the map and cuts it into floor(N / `patch_size`) patches.
    ///
    /// # Errors
    /// [`Error::TooFewVertices`] and [`Error::Collinear`].
    pub fn new(table: &VertexTable, ground: &Ground, patch_size: usize) -> Result<Self> {
        if table.is_empty() {
            return Err(Error::NoVertices);
        }
        if table.len() < patch_size {
            return Err(Error::TooFewVertices { vertices: table.len(), patch_size });
        }
        let points = table.local(ground.x_scale(table.centre()[1]));
        let mesh = Mesh::delaunay(&points)?;
        let leaves = split(&points, points.len() / patch_size);
        let mut patches = with_edges(leaves, mesh.edges(), points.len());
        patches.par_iter_mut().for_each(|patch| bridge(patch, &points));
        let [_, metres] = ground.metres_per_unit(table.centre());
        let positions_m = points.iter().map(|p| p.map(|value| value * metres)).collect();
        Ok(Patches { patches, positions_m })
    }

    /// The patches; the position of a patch is its number.
    pub fn as_slice(&self) -> &[Patch] {
        &self.patches
    }

    /// How many vertices the map has.
    pub fn vertex_count(&self) -> usize {
        self.positions_m.len()
    }

    /// Where the vertices are, in canonical order, metres from the map's middle: for distances.
    pub fn positions_m(&self) -> &[[f64; 2]] {
        &self.positions_m
    }

    /// How many coefficients of a patch and axis carry a message of `bits` bits: one for every channel bit and
    /// chip. They fit into the smallest patch besides the mean.
    ///
    /// # Errors
    /// [`Error::TooManyCoefficients`] or [`Error::CodeLength`].
    pub fn carriers(&self, bits: usize, parameters: &Parameters) -> Result<usize> {
        let Parameters { code, chip_rate, .. } = *parameters;
        let carriers = code.channel_bits(bits)? * chip_rate;
        let smallest = self.patches.iter().map(|p| p.vertices.len()).min().unwrap_or(0);
        if carriers >= smallest {
            return Err(Error::TooManyCoefficients { code, bits, chip_rate, vertices: smallest });
        }
        Ok(carriers)
    }

    /// Checks the invariants: every vertex in one patch, ascending, edges sorted, patches connected.
    pub fn validate(&self) -> std::result::Result<(), String> {
        let mut seen = vec![false; self.positions_m.len()];
        for (number, patch) in self.patches.iter().enumerate() {
            if !patch.vertices.is_sorted_by(|a, b| a < b) || !patch.edges.is_sorted_by(|a, b| a < b) {
                return Err(format!("patch {number} is not sorted"));
            }
            for &v in &patch.vertices {
                if std::mem::replace(&mut seen[v as usize], true) {
                    return Err(format!("vertex {v} is in two patches"));
                }
            }
            if components(patch).1 != 1 {
                return Err(format!("patch {number} falls apart"));
            }
        }
        seen.iter().position(|s| !s).map_or(Ok(()), |v| Err(format!("vertex {v} is in no patch")))
    }
}

/// k-d split into `parts` leaves of nearly equal vertex counts, each set cut across the longer side
/// of its bounding box, in proportion to the leaves on either side.
fn split(points: &[[f64; 2]], parts: usize) -> Vec<Vec<u32>> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let mut leaves = Vec::with_capacity(parts);
    split_set(points, &mut order, parts, &mut leaves);
    leaves
}

fn split_set(points: &[[f64; 2]], set: &mut [u32], parts: usize, leaves: &mut Vec<Vec<u32>>) {
    if parts == 1 {
        let mut leaf = set.to_vec();
        leaf.sort_unstable();
        return leaves.push(leaf);
    }
    let axis = longer_side(points, set);
    let left_parts = parts / 2;
    let left = (set.len() as u64 * left_parts as u64 / parts as u64) as usize;
    // Ties are broken by the canonical index, so the cut is the same on any machine.
    set.select_nth_unstable_by(left, |&a, &b| {
        points[a as usize][axis].total_cmp(&points[b as usize][axis]).then(a.cmp(&b))
    });
    let (lower, upper) = set.split_at_mut(left);
    split_set(points, lower, left_parts, leaves);
    split_set(points, upper, parts - left_parts, leaves);
}

fn longer_side(points: &[[f64; 2]], set: &[u32]) -> usize {
    let extent = |axis: usize| {
        let values = set.iter().map(|&i| points[i as usize][axis]);
        let (min, max) = values.fold((f64::MAX, f64::MIN), |(lo, hi), v| (lo.min(v), hi.max(v)));
        max - min
    };
    usize::from(extent(1) > extent(0))
}

/// Gives every leaf the mesh edges whose two ends are in it.
fn with_edges(leaves: Vec<Vec<u32>>, edges: &[[u32; 2]], vertices: usize) -> Vec<Patch> {
    let mut place = vec![[0u32; 2]; vertices]; // patch, position in it
    for (patch, leaf) in leaves.iter().enumerate() {
        for (position, &v) in leaf.iter().enumerate() {
            place[v as usize] = [patch as u32, position as u32];
        }
    }
    let patch = |vertices: Vec<u32>| Patch { edges: Vec::with_capacity(3 * vertices.len()), vertices };
    let mut patches: Vec<Patch> = leaves.into_iter().map(patch).collect();
    // Edges come sorted by canonical index and positions ascend with it, so each list stays sorted.
    for [a, b] in edges {
        let ([patch_a, i], [patch_b, j]) = (place[*a as usize], place[*b as usize]);
        if patch_a == patch_b {
            patches[patch_a as usize].edges.push([i, j]);
        }
    }
    patches
}

/// The component number of every vertex of a patch, and how many components there are.
fn components(patch: &Patch) -> (Vec<usize>, usize) {
    let mut parent: Vec<usize> = (0..patch.vertices.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for &[a, b] in &patch.edges {
        let (a, b) = (root(&mut parent, a as usize), root(&mut parent, b as usize));
        parent[a.max(b)] = a.min(b);
    }
    let label: Vec<usize> = (0..parent.len()).map(|i| root(&mut parent, i)).collect();
    let count = label.iter().enumerate().filter(|(i, l)| i == *l).count();
    (label, count)
}

/// Cutting the edges between patches can leave a patch in pieces, and a graph in pieces has a
/// repeated eigenvalue 0. Starting from the piece of its first vertex, join the piece whose shortest
/// edge to what is already joined is the shortest (ties: smaller positions), until one is left.
fn bridge(patch: &mut Patch, points: &[[f64; 2]]) {
    let (label, count) = components(patch);
    if count == 1 {
        return;
    }
    let at = |i: usize| points[patch.vertices[i] as usize];
    let distance2 = |i: usize, j: usize| {
        let (a, b) = (at(i), at(j));
        (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
    };
    let n = patch.vertices.len();
    let mut nearest = vec![(f64::INFINITY, 0); n]; // distance² to, and position of, the nearest joined vertex
    let mut joined = vec![false; n];
    let mut piece = label[0];
    loop {
        for j in (0..n).filter(|&j| label[j] == piece) {
            joined[j] = true;
            for i in (0..n).filter(|&i| label[i] != piece) {
                let candidate = (distance2(i, j), j);
                if candidate.0 < nearest[i].0 {
                    nearest[i] = candidate;
                }
            }
        }
        let open = (0..n).filter(|&i| !joined[i]);
        let Some(i) = open.min_by(|&a, &b| nearest[a].0.total_cmp(&nearest[b].0)) else { break };
        let j = nearest[i].1;
        patch.edges.push([i.min(j) as u32, i.max(j) as u32]);
        piece = label[i];
    }
    patch.edges.sort_unstable();
}

#[cfg(test)]
mod tests {
    use super::*;

    const METRES: Ground = Ground::Plane { metres_per_unit: 1.0 };

    fn scattered(n: u64) -> VertexTable {
        let hash = |i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31) % 1_000_003;
        let coords = (0..n).map(|i| [hash(i) as f64, hash(i + n) as f64]).collect();
        VertexTable::new(coords).unwrap()
    }

    #[test]
    fn every_patch_has_nearly_patch_size_vertices() {
        for (n, d, patches) in [(5000, 480, 10), (959, 480, 1), (960, 480, 2), (4000, 100, 40)] {
            let cut = Patches::new(&scattered(n), &METRES, d).unwrap();
            cut.validate().unwrap();
            assert_eq!(cut.as_slice().len(), patches);
            for patch in cut.as_slice() {
                assert!(patch.vertices.len() >= d && patch.vertices.len() <= n as usize / patches + 2);
            }
        }
    }

    #[test]
    fn too_few_vertices_name_the_size_that_fits() {
        let error = Patches::new(&scattered(300), &METRES, 480).unwrap_err();
        assert!(error.to_string().contains("300 distinct vertices"), "{error}");
        assert!(error.to_string().contains("PATCH_SIZE=300 or less"), "{error}");
    }

    #[test]
    fn capacity_counts_the_mean_as_taken() {
        let cut = Patches::new(&scattered(600), &METRES, 300).unwrap();
        let p = Parameters { chip_rate: 1, ..Parameters::default() };
        assert_eq!(cut.carriers(299, &p), Ok(299));
        assert!(cut.carriers(300, &p).unwrap_err().to_string().contains("has 299"));
    }

    #[test]
    fn pieces_are_bridged_by_their_shortest_edges() {
        let points = [[0.0, 0.0], [1.0, 0.0], [5.0, 0.0], [6.0, 0.0], [5.5, 3.0]];
        let mut patch = Patch { vertices: (0..5).collect(), edges: vec![[0, 1], [2, 3]] };
        bridge(&mut patch, &points);
        assert_eq!(patch.edges, [[0, 1], [1, 2], [2, 3], [2, 4]]);
    }
}
