//! Patches: the pieces of nearly `patch_size` vertices into which the map is cut, each with its
//! connected graph (paper, section 3.2; the split and the bridges are ours, see docs/method.md).

use crate::{
    Error, Result,
    constraints::Constraints,
    disjoint_sets::DisjointSets,
    map::Map,
    mesh::Mesh,
    nearness::{VertexTree, cross, dot},
    options::{Laplacian, Parameters, Rigidity},
    stiffness::{Place, Strains, strains},
};
use faer::Mat;
use rayon::prelude::*;

/// One patch: some vertices of the map and the mesh edges among them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Patch {
    /// Canonical indices of the patch's vertices, ascending; `n` of them.
    pub vertices: Vec<u32>,
    /// Edges as pairs of positions in `vertices`, `[i, j]` with i < j, sorted; they join all
    /// vertices.
    pub edges: Vec<[u32; 2]>,
    /// The weight of each edge with [`Laplacian::Cotangent`]; empty with [`Laplacian::Biggs`].
    pub weights: Vec<f64>,
    /// The T-junctions among the vertices, ascending.
    pub hanging: Vec<HangingRow>,
    /// The bodies among the vertices.
    pub bodies: Vec<BodyRows>,
    /// The strains of what is neither body nor point, with [`Rigidity::Stiff`].
    pub strains: Strains,
}

/// A body of a patch.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyRows {
    /// Positions of its vertices.
    pub rows: Vec<u32>,
    /// The vector from the mean of all vertices to each of them, metres.
    pub arms_m: Vec<[f64; 2]>,
}

/// A vertex of a patch that moves with others.
#[derive(Debug, Clone, PartialEq)]
pub struct HangingRow {
    /// Its position in the patch.
    pub row: u32,
    /// Positions and weights of its anchors; empty when one of them is in another patch.
    pub anchors: Vec<(u32, f64)>,
}

impl Patch {
    /// Replaces the rows of hanging vertices (n × any) by those that follow from their anchors.
    pub(crate) fn follow(&self, rows: &mut Mat<f64>) {
        for column in 0..rows.ncols() {
            let values = rows.col_as_slice_mut(column);
            for hanging in &self.hanging {
                let terms = hanging.anchors.iter().map(|&(anchor, weight)| weight * values[anchor as usize]);
                values[hanging.row as usize] = terms.sum();
            }
        }
    }

    /// Returns the rows that neither belong to a body nor hang.
    pub(crate) fn free_rows(&self) -> Vec<usize> {
        let mut is_free = vec![true; self.vertices.len()];
        let of_bodies = self.bodies.iter().flat_map(|body| &body.rows);
        let hanging = self.hanging.iter().map(|hanging| &hanging.row);
        of_bodies.chain(hanging).for_each(|&row| is_free[row as usize] = false);
        (0..is_free.len()).filter(|&row| is_free[row]).collect()
    }

    /// Returns whether a vertex hangs on vertices of other patches, so that this patch does not
    /// determine its movement.
    pub(crate) fn hangs_elsewhere(&self, row: usize) -> bool {
        let found = self.hanging.binary_search_by_key(&(row as u32), |hanging| hanging.row);
        found.is_ok_and(|i| self.hanging[i].anchors.is_empty())
    }
}

/// All patches of a map, in the order of the k-d tree's leaves. Every vertex is in exactly one.
#[derive(Debug, Clone, PartialEq)]
pub struct Patches {
    patches: Vec<Patch>,
    positions_m: Vec<[f64; 2]>,
    /// The polygon group of every vertex, as its first vertex; [`ALONE`] for a vertex without a
    /// group.
    groups: Vec<u32>,
    constraints: Constraints,
}

/// The group of a vertex that is in no polygon.
pub(crate) const ALONE: u32 = u32::MAX;

impl Patches {
    /// Meshes the map and cuts it into floor(N / `patch_size`) patches.
    ///
    /// # Errors
    /// [`Error::TooFewVertices`] and [`Error::Collinear`].
    pub fn new(map: &Map, parameters: &Parameters) -> Result<Self> {
        Self::with_tree(map, &VertexTree::of_all(map), parameters)
    }

    /// Does the same as [`Self::new`] with a tree of all vertices.
    pub(crate) fn with_tree(map: &Map, tree: &VertexTree, parameters: &Parameters) -> Result<Self> {
        let (Map { vertices: table, ground, .. }, patch_size) = (map, parameters.patch_size);
        if table.is_empty() {
            return Err(Error::NoVertices);
        }
        if table.len() < patch_size {
            let Parameters { code, chip_rate, .. } = *parameters;
            return Err(Error::TooFewVertices { vertices: table.len(), patch_size, code, chip_rate });
        }
        let points = table.local(ground.x_scale(table.centre()[1]));
        let mesh = Mesh::delaunay(&points)?;
        let constraints = Constraints::find(map, tree, parameters.shape);
        let leaves = split(&points, &constraints, points.len() / patch_size);
        let place = PatchRow::of_all(leaves.iter(), points.len());
        let mut patches = with_edges(leaves, mesh.edges(), &place);
        patches.par_iter_mut().for_each(|patch| bridge(patch, &points));
        constrain(&mut patches, &constraints, &place);
        if parameters.shape == Rigidity::Stiff {
            let places: Vec<Place> = place.iter().map(|place| [place.patch, place.row]).collect();
            let strains = strains(map, &constraints, &places, patches.len());
            patches.iter_mut().zip(strains).for_each(|(patch, strains)| patch.strains = strains);
        }
        if parameters.basis == Laplacian::Cotangent {
            weigh(&mut patches, mesh.triangles(), &place, &points);
        }
        Ok(Patches { patches, positions_m: positions_m(map, &points), groups: groups(map), constraints })
    }

    /// Puts the patches of parts of `map` one after the other; with each part come the indices of
    /// its vertices on the map, ascending. Vertices of no part are in no patch, and the constraints
    /// of the parts are left out.
    pub(crate) fn in_turn(map: &Map, parts: impl Iterator<Item = (Patches, Vec<u32>)>) -> Self {
        let on_map = |(part, indices): (Patches, Vec<u32>)| {
            let place = move |patch: Patch| {
                let vertices = patch.vertices.iter().map(|&v| indices[v as usize]).collect();
                Patch { vertices, ..patch }
            };
            part.patches.into_iter().map(place)
        };
        let points = map.vertices.local(map.ground.x_scale(map.vertices.centre()[1]));
        let positions_m = positions_m(map, &points);
        let (patches, constraints) = (parts.flat_map(on_map).collect(), Constraints::default());
        Patches { patches, positions_m, groups: groups(map), constraints }
    }

    /// Returns the patches; the position of a patch is its number.
    pub fn as_slice(&self) -> &[Patch] {
        &self.patches
    }

    /// Returns the number of vertices of the map.
    pub fn vertex_count(&self) -> usize {
        self.positions_m.len()
    }

    /// Returns the positions of the vertices in canonical order, metres from the middle of the map,
    /// for distances.
    pub fn positions_m(&self) -> &[[f64; 2]] {
        &self.positions_m
    }

    /// Returns the place of every vertex in its patch, [`PatchRow::NONE`] for one in none.
    pub(crate) fn rows(&self) -> Vec<PatchRow> {
        PatchRow::of_all(self.patches.iter().map(|patch| &patch.vertices), self.vertex_count())
    }

    /// Returns the polygon group of a vertex, or [`ALONE`].
    pub(crate) fn group(&self, vertex: u32) -> u32 {
        self.groups[vertex as usize]
    }

    /// Returns the constraints on the movement of vertices.
    pub fn constraints(&self) -> &Constraints {
        &self.constraints
    }

    /// Returns the first `count` patches alone; the vertices of the others are in none.
    pub(crate) fn head(&self, count: usize) -> Self {
        let patches = self.patches[..count.min(self.patches.len())].to_vec();
        let (positions_m, groups) = (self.positions_m.clone(), self.groups.clone());
        Patches { patches, positions_m, groups, constraints: Constraints::default() }
    }

    /// Returns how many coefficients of a patch and axis carry a message of `bits` bits: one for
    /// every channel bit and chip. They fit into the smallest patch besides the mean.
    ///
    /// # Errors
    /// [`Error::TooManyCoefficients`] or [`Error::CodeLength`].
    pub fn carriers(&self, bits: usize, parameters: &Parameters) -> Result<usize> {
        let Parameters { code, chip_rate, .. } = *parameters;
        let carriers = code.channel_bits(bits)? * chip_rate;
        let smallest = self.smallest();
        if carriers >= smallest {
            let of = self.positions_m.len();
            return Err(Error::TooManyCoefficients { code, bits, chip_rate, vertices: smallest, of });
        }
        Ok(carriers)
    }

    /// Checks that so many coefficients of an axis fit into the smallest patch besides the mean,
    /// and returns them.
    ///
    /// # Errors
    /// [`Error::TooManySigns`].
    pub fn check_room(&self, coefficients: usize) -> Result<usize> {
        match self.smallest() {
            smallest if coefficients >= smallest => {
                let of = self.positions_m.len();
                Err(Error::TooManySigns { coefficients, vertices: smallest, of })
            }
            _ => Ok(coefficients),
        }
    }

    /// Returns the number of vertices of the smallest patch.
    fn smallest(&self) -> usize {
        self.patches.iter().map(|p| p.vertices.len()).min().unwrap_or(0)
    }

    /// Checks the invariants: every vertex in one patch, ascending, edges sorted, patches
    /// connected.
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

/// Returns the positions of vertices in metres; `points` are their local coordinates.
fn positions_m(map: &Map, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let [_, metres] = map.ground.metres_per_unit(map.vertices.centre());
    points.iter().map(|p| p.map(|value| value * metres)).collect()
}

/// Returns the polygon group of every vertex.
fn groups(map: &Map) -> Vec<u32> {
    let mut sizes = vec![0u32; map.vertices.len()];
    map.polygon_roots.iter().for_each(|&root| sizes[root as usize] += 1);
    let group =
        |vertex: usize| map.polygon_roots.get(vertex).copied().filter(|&root| sizes[root as usize] > 2);
    (0..map.vertices.len()).map(|vertex| group(vertex).unwrap_or(ALONE)).collect()
}

/// Splits the vertices by a k-d tree into `parts` leaves of nearly equal size. Each set is cut
/// across the longer side of its bounding box, in proportion to the leaves on either side. A body
/// goes to the side of its first vertex. There are fewer leaves where a body leaves nothing for one
/// of the sides.
fn split(points: &[[f64; 2]], constraints: &Constraints, parts: usize) -> Vec<Vec<u32>> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let mut leaves = Vec::with_capacity(parts);
    split_set(points, constraints, &mut order, parts, &mut leaves);
    leaves
}

fn split_set(
    points: &[[f64; 2]],
    constraints: &Constraints,
    set: &mut [u32],
    parts: usize,
    leaves: &mut Vec<Vec<u32>>,
) {
    let left_parts = parts / 2;
    let left = if parts == 1 { 0 } else { cut(points, constraints, set, [left_parts, parts]) };
    if left == 0 || left == set.len() {
        let mut leaf = set.to_vec();
        leaf.sort_unstable();
        return leaves.push(leaf);
    }
    let (lower, upper) = set.split_at_mut(left);
    split_set(points, constraints, lower, left_parts, leaves);
    split_set(points, constraints, upper, parts - left_parts, leaves);
}

/// Moves the vertices of `left_parts` of `parts` equal parts of a set to its beginning, and returns
/// how many these are.
fn cut(
    points: &[[f64; 2]],
    constraints: &Constraints,
    set: &mut [u32],
    [left_parts, parts]: [usize; 2],
) -> usize {
    let axis = longer_side(points, set);
    let left = (set.len() as u64 * left_parts as u64 / parts as u64) as usize;
    let first = |v: u32| {
        constraints.bodies.number_at(v).map_or(v, |body| constraints.bodies.as_slice()[body].members[0])
    };
    // Ties are broken by the canonical index, so the cut is the same on any machine.
    let order = |a: &u32, b: &u32| {
        let (p, q) = (first(*a), first(*b));
        points[p as usize][axis].total_cmp(&points[q as usize][axis]).then(p.cmp(&q)).then(a.cmp(b))
    };
    set.select_nth_unstable_by(left, order);
    // A body is a run in this order: the cut moves before or after the body it meets, whichever is
    // nearer.
    let met = first(set[left]);
    let below = set[..left].iter().filter(|&&v| first(v) == met).count();
    let above = set[left..].iter().filter(|&&v| first(v) == met).count();
    let left = match (below, above) {
        (0, _) => left,
        (below, above) if below > above && left + above < set.len() => left + above,
        (below, _) => left - below,
    };
    set.select_nth_unstable_by(left, order);
    left
}

fn longer_side(points: &[[f64; 2]], set: &[u32]) -> usize {
    let extent = |axis: usize| {
        let values = set.iter().map(|&i| points[i as usize][axis]);
        let (min, max) = values.fold((f64::MAX, f64::MIN), |(lo, hi), v| (lo.min(v), hi.max(v)));
        max - min
    };
    usize::from(extent(1) > extent(0))
}

/// The patch of a vertex and its position in it.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct PatchRow {
    pub patch: u32,
    pub row: u32,
}

impl PatchRow {
    /// The place of a vertex that is in no patch.
    pub const NONE: PatchRow = PatchRow { patch: u32::MAX, row: u32::MAX };

    fn of_all<'a>(leaves: impl Iterator<Item = &'a Vec<u32>>, vertices: usize) -> Vec<PatchRow> {
        let mut places = vec![PatchRow::NONE; vertices];
        for (patch, leaf) in leaves.enumerate() {
            for (row, &v) in leaf.iter().enumerate() {
                places[v as usize] = PatchRow { patch: patch as u32, row: row as u32 };
            }
        }
        places
    }
}

/// Gives every leaf the mesh edges whose two ends are in it.
fn with_edges(leaves: Vec<Vec<u32>>, edges: &[[u32; 2]], places: &[PatchRow]) -> Vec<Patch> {
    let patch = |vertices: Vec<u32>| Patch {
        edges: Vec::with_capacity(3 * vertices.len()),
        vertices,
        ..Patch::default()
    };
    let mut patches: Vec<Patch> = leaves.into_iter().map(patch).collect();
    // Edges come sorted by canonical index and positions ascend with it, so each list stays sorted.
    for edge in edges {
        let [a, b] = edge.map(|v| places[v as usize]);
        if a.patch == b.patch {
            patches[a.patch as usize].edges.push([a.row, b.row]);
        }
    }
    patches
}

/// Gives every patch the constraints on its vertices.
fn constrain(patches: &mut [Patch], constraints: &Constraints, places: &[PatchRow]) {
    for hanging in constraints.junctions.hanging() {
        let PatchRow { patch, row } = places[hanging.vertex as usize];
        let position = |&(anchor, weight): &(u32, f64)| match places[anchor as usize] {
            place if place.patch == patch => Some((place.row, weight)),
            _ => None,
        };
        let anchors = hanging.anchors.iter().map(position).collect::<Option<_>>().unwrap_or_default();
        patches[patch as usize].hanging.push(HangingRow { row, anchors });
    }
    for body in constraints.bodies.as_slice() {
        let rows = body.members.iter().map(|&v| places[v as usize].row).collect();
        let patch = places[body.members[0] as usize].patch;
        patches[patch as usize].bodies.push(BodyRows { rows, arms_m: body.arms_m.clone() });
    }
}

/// A triangle counts as no flatter than this (approximately height over base), so that cotangents
/// stay finite.
const LEAST_HEIGHT: f64 = 0.01;

/// Weighs the edges of every patch by cot α + cot β, over the angles that face them in the
/// triangles of the mesh with all three corners in the patch. Edges of no such triangle, bridges
/// among them, weigh 1.
fn weigh(patches: &mut [Patch], triangles: &[[u32; 3]], places: &[PatchRow], points: &[[f64; 2]]) {
    let mut of_patch: Vec<Vec<[u32; 3]>> = vec![Vec::new(); patches.len()];
    for triangle in triangles {
        let corners = triangle.map(|v| places[v as usize]);
        if corners.iter().all(|corner| corner.patch == corners[0].patch) {
            of_patch[corners[0].patch as usize].push(corners.map(|corner| corner.row));
        }
    }
    patches.par_iter_mut().zip(of_patch).for_each(|(patch, triangles)| {
        let mut weights = vec![None; patch.edges.len()];
        for triangle in triangles {
            let at = triangle.map(|row| points[patch.vertices[row as usize] as usize]);
            for corner in 0..3 {
                let (a, b) = (triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]);
                let edge =
                    patch.edges.binary_search(&[a.min(b), a.max(b)]).expect("a triangle has mesh edges");
                *weights[edge].get_or_insert(0.0) += cotangent(at, corner);
            }
        }
        patch.weights = weights.into_iter().map(|weight| weight.unwrap_or(1.0)).collect();
    });
}

/// Returns the cotangent of a triangle's angle at a corner. The three cotangents of a flat triangle
/// shrink alike, so that its energy stays positive.
fn cotangent(at: [[f64; 2]; 3], corner: usize) -> f64 {
    let side = |from: usize, to: usize| [at[to][0] - at[from][0], at[to][1] - at[from][1]];
    let (u, v) = (side(corner, (corner + 1) % 3), side(corner, (corner + 2) % 3));
    let longest2 = (0..3).map(|i| dot(side(i, (i + 1) % 3), side(i, (i + 1) % 3))).fold(0.0, f64::max);
    dot(u, v) / cross(u, v).abs().max(LEAST_HEIGHT * longest2)
}

/// Returns the component of every vertex of a patch, by its first vertex, and how many components
/// there are.
fn components(patch: &Patch) -> (Vec<u32>, usize) {
    let mut pieces = DisjointSets::new(patch.vertices.len());
    patch.edges.iter().for_each(|&[a, b]| pieces.join(a, b));
    let label = pieces.roots();
    let count = (0..).zip(&label).filter(|(i, root)| i == *root).count();
    (label, count)
}

/// Joins the pieces of a patch: cutting the edges between patches can disconnect a patch, and a
/// disconnected graph has a repeated eigenvalue 0. Starting from the piece of the first vertex, the
/// piece with the shortest edge to the joined ones is added (ties: smaller positions) until one
/// piece is left.
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
    // Each entry holds distance² to, and position of, the nearest joined vertex.
    let mut nearest = vec![(f64::INFINITY, 0); n];
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
    use crate::{
        code::Code,
        ground::Ground,
        map_data::{ChainKind, MapData},
        vertices::VertexTable,
    };

    fn scattered(n: u64) -> VertexTable {
        let hash = |i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31) % 1_000_003;
        let coords = (0..n).map(|i| [hash(i) as f64, hash(i + n) as f64]).collect();
        VertexTable::new(coords).unwrap()
    }

    fn size(patch_size: usize) -> Parameters {
        Parameters { patch_size, ..Parameters::default() }
    }

    #[test]
    fn every_patch_has_nearly_patch_size_vertices() {
        for (n, d, patches) in [(5000, 480, 10), (959, 480, 1), (960, 480, 2), (4000, 100, 40)] {
            let cut = Patches::new(&Map::of_points(&scattered(n), &Ground::METRES), &size(d)).unwrap();
            cut.validate().unwrap();
            assert_eq!(cut.as_slice().len(), patches);
            for patch in cut.as_slice() {
                assert!(patch.vertices.len() >= d && patch.vertices.len() <= n as usize / patches + 2);
            }
        }
    }

    /// Returns a map of closed rings with so many corners each.
    fn rings(corners: &[u32]) -> MapData {
        let ring = |(number, &corners): (usize, &u32)| {
            let corner = move |i: u32| f64::from(i % corners) * std::f64::consts::TAU / f64::from(corners);
            (0..=corners)
                .map(move |i| [90.0 * number as f64 + 30.0 * corner(i).cos(), 30.0 * corner(i).sin()])
        };
        let coords: Vec<[f64; 2]> = corners.iter().enumerate().flat_map(ring).collect();
        let starts: Vec<u32> = (0..corners.len())
            .map(|number| corners[..number].iter().map(|corners| corners + 1).sum())
            .collect();
        MapData::from_chains(coords, &starts, vec![ChainKind::Shell; corners.len()]).unwrap().0
    }

    #[test]
    fn bodies_larger_than_patches_stay_whole() {
        let cases: [&[u32]; 5] = [&[40], &[60], &[60, 4], &[4, 60], &[5, 50, 5, 50, 30]];
        for corners in cases {
            let data = rings(corners);
            for shape in [Rigidity::Rigid, Rigidity::Stiff] {
                let cut = Patches::new(
                    &data.on(&Ground::METRES, &Ground::METRES),
                    &Parameters { shape, ..size(16) },
                )
                .unwrap();
                cut.validate().unwrap();
                assert!(cut.smallest() > 0);
                let bodies = &cut.constraints().bodies;
                let patch_of: Vec<u32> = cut.rows().iter().map(|place| place.patch).collect();
                let is_whole = |members: &[u32]| {
                    members.iter().all(|&v| patch_of[v as usize] == patch_of[members[0] as usize])
                };
                assert!(bodies.as_slice().iter().all(|body| is_whole(&body.members)), "{corners:?}");
            }
        }
    }

    #[test]
    fn too_few_vertices_name_the_size_that_fits() {
        let error = Patches::new(&Map::of_points(&scattered(300), &Ground::METRES), &size(480)).unwrap_err();
        assert!(error.to_string().contains("300 distinct vertices"), "{error}");
        assert!(error.to_string().contains("use PATCH_SIZE=300"), "{error}");
    }

    #[test]
    fn capacity_counts_the_mean_as_taken() {
        let cut = Patches::new(&Map::of_points(&scattered(600), &Ground::METRES), &size(300)).unwrap();
        let p = Parameters { code: Code::Repetition, chip_rate: 1, ..Parameters::default() };
        assert_eq!(cut.carriers(299, &p).unwrap(), 299);
        assert!(cut.carriers(300, &p).unwrap_err().to_string().contains("has 299"));
    }

    #[test]
    fn pieces_are_bridged_by_their_shortest_edges() {
        let points = [[0.0, 0.0], [1.0, 0.0], [5.0, 0.0], [6.0, 0.0], [5.5, 3.0]];
        let mut patch = Patch { vertices: (0..5).collect(), edges: vec![[0, 1], [2, 3]], ..Patch::default() };
        bridge(&mut patch, &points);
        assert_eq!(patch.edges, [[0, 1], [1, 2], [2, 3], [2, 4]]);
    }
}
