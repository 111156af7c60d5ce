//! Stiffness: vertices outside rigid bodies move so that angles and lengths change little
//! (SHAPE=stiff).
//!
//! Given wanted displacements u, the vertices outside bodies have those displacements d that
//! minimise Σ |d − u|² + Σ (20 m · β)² + Σ (50 m · σ)², with the change β of every angle between
//! neighbouring segments at a vertex, in radians, and the stretch σ of every segment, as a share of
//! its length. β and σ are linear in d, as displacements are small. The rule is therefore linear
//! and follows from the reference alone: the verifier repeats it. It is that of a truss with stiff
//! joints.
//!
//! Vertices of other patches count as unmoved, so that no segment bends between two patches.

use crate::{constraints::Constraints, junctions::JUNCTION_M, map::Map};
use faer::{
    Mat, Side,
    linalg::solvers::Solve,
    sparse::{SparseColMat, Triplet},
};

/// The weight of a change of an angle, metres per radian.
const BEND_M: f64 = 20.0;
/// The weight of a stretch, metres.
const STRETCH_M: f64 = 50.0;
/// Shorter segments have no direction: their weights would exceed all others beyond the last digit.
const LEAST_LENGTH_M: f64 = 1e-3;

/// The weighted changes of angles and lengths in a patch, as linear functions of displacements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Strains {
    /// The terms of all functions: a row of the patch, and the derivatives along x and y.
    terms: Vec<(u32, [f64; 2])>,
    /// For every function the end of its terms.
    ends: Vec<u32>,
}

impl Strains {
    /// Returns whether nothing is stiff.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    fn push(&mut self, terms: impl Iterator<Item = (u32, [f64; 2])>) {
        let start = self.terms.len();
        for (row, [x, y]) in terms {
            match self.terms[start..].iter_mut().find(|(known, _)| *known == row) {
                Some((_, sum)) => *sum = [sum[0] + x, sum[1] + y],
                None => self.terms.push((row, [x, y])),
            }
        }
        if self.terms.len() > start {
            self.ends.push(self.terms.len() as u32);
        }
    }

    fn iter(&self) -> impl Iterator<Item = &[(u32, [f64; 2])]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(&start, &end)| &self.terms[start as usize..end as usize])
    }
}

/// The patch of a vertex and its row there.
pub(crate) type Place = [u32; 2];

/// Returns the strains of every patch; `places` are those of all vertices.
pub(crate) fn strains(
    map: &Map,
    constraints: &Constraints,
    places: &[Place],
    patches: usize,
) -> Vec<Strains> {
    let joints = Joints { map, constraints, places, neighbours: neighbours(map, constraints) };
    let mut all = vec![Strains::default(); patches];
    for vertex in (0..map.vertices.len() as u32).filter(|&vertex| !joints.is_in_body(vertex)) {
        let strains = &mut all[places[vertex as usize][0] as usize];
        joints.add(vertex, strains);
    }
    all
}

/// Returns the other ends of the segments at every vertex; a hanging vertex also has its anchors.
fn neighbours(map: &Map, constraints: &Constraints) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); map.vertices.len()];
    for &[a, b] in map.segments {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    for hanging in constraints.junctions.hanging() {
        let own = &mut neighbours[hanging.vertex as usize];
        let new = hanging.anchors.iter().map(|(anchor, _)| *anchor).filter(|anchor| !own.contains(anchor));
        let new: Vec<u32> = new.collect();
        own.extend(new);
    }
    neighbours
}

/// The segments that meet at vertices.
struct Joints<'a> {
    map: &'a Map<'a>,
    constraints: &'a Constraints,
    places: &'a [Place],
    neighbours: Vec<Vec<u32>>,
}

/// A segment, seen from one of its ends.
struct Spoke {
    end: u32,
    /// The unit vector to the other end.
    direction: [f64; 2],
    length_m: f64,
}

impl Joints<'_> {
    /// Adds the strains of the joint at a vertex, and of the segments that count there.
    fn add(&self, vertex: u32, strains: &mut Strains) {
        let [patch, _] = self.places[vertex as usize];
        let spokes = self.spokes(vertex);
        let pairs = match spokes.len() {
            0 | 1 => 0,
            2 => 1,
            around => around,
        };
        for (i, spoke) in spokes.iter().enumerate().take(pairs) {
            let next = &spokes[(i + 1) % spokes.len()];
            if [spoke, next].iter().all(|spoke| !self.is_in_body(spoke.end)) {
                let terms = [spoke.turn(vertex, 1.0), next.turn(vertex, -1.0)];
                strains.push(terms.into_iter().flatten().flat_map(|term| self.rows(patch, term)));
            }
        }
        for spoke in &spokes {
            // A segment between patches counts in both.
            let counts_there = self.places[spoke.end as usize][0] == patch && spoke.end < vertex;
            if !counts_there && !self.is_in_body(spoke.end) {
                let terms = spoke.stretch(vertex).into_iter();
                strains.push(terms.flat_map(|term| self.rows(patch, term)));
            }
        }
    }

    /// Returns the segments at a vertex, counter-clockwise.
    fn spokes(&self, vertex: u32) -> Vec<Spoke> {
        let spoke = |&end: &u32| {
            let [x, y] = self.map.ground.metres_between(self.map.at(vertex), self.map.at(end));
            let length_m = x.hypot(y);
            // A hanging vertex may lie as far from its segment as this.
            let hangs = [vertex, end].iter().any(|&v| self.hangs(v));
            let has_direction = length_m >= if hangs { JUNCTION_M } else { LEAST_LENGTH_M };
            has_direction.then(|| Spoke { end, direction: [x / length_m, y / length_m], length_m })
        };
        let mut spokes: Vec<Spoke> = self.neighbours[vertex as usize].iter().filter_map(spoke).collect();
        let azimuth = |spoke: &Spoke| spoke.direction[1].atan2(spoke.direction[0]);
        spokes.sort_by(|a, b| azimuth(a).total_cmp(&azimuth(b)).then(a.end.cmp(&b.end)));
        spokes
    }

    /// Returns the rows of a patch that move a vertex: its own, or those that it hangs on.
    fn rows(&self, patch: u32, (vertex, by): (u32, [f64; 2])) -> impl Iterator<Item = (u32, [f64; 2])> {
        let anchors = match self.constraints.junctions.hanging_at(vertex) {
            Some(hanging) => hanging.anchors.clone(),
            None => vec![(vertex, 1.0)],
        };
        anchors.into_iter().filter_map(move |(anchor, weight)| {
            let [its_patch, row] = self.places[anchor as usize];
            let moves = its_patch == patch && !self.is_in_body(anchor);
            moves.then(|| (row, by.map(|derivative| weight * derivative)))
        })
    }

    fn hangs(&self, vertex: u32) -> bool {
        self.constraints.junctions.hanging_at(vertex).is_some()
    }

    fn is_in_body(&self, vertex: u32) -> bool {
        self.constraints.bodies.number_at(vertex).is_some()
    }
}

impl Spoke {
    /// Returns the derivatives of its weighted turn.
    fn turn(&self, vertex: u32, sign: f64) -> [(u32, [f64; 2]); 2] {
        let [x, y] = self.direction;
        self.derivatives(vertex, [-y, x], sign * BEND_M)
    }

    /// Returns the derivatives of its weighted stretch.
    fn stretch(&self, vertex: u32) -> [(u32, [f64; 2]); 2] {
        self.derivatives(vertex, self.direction, STRETCH_M)
    }

    fn derivatives(&self, vertex: u32, along: [f64; 2], weight_m: f64) -> [(u32, [f64; 2]); 2] {
        let by = along.map(|unit| weight_m * unit / self.length_m);
        [(self.end, by), (vertex, by.map(|derivative| -derivative))]
    }
}

/// Replaces the wanted response of the `free` rows, which neither belong to a body nor hang, by the
/// stiff one: `[a][b]` holds the displacements along axis a (n × k) by coefficients of axis b.
pub(crate) fn stiffen(strains: &Strains, free: &[usize], blocks: &mut [[Mat<f64>; 2]; 2]) {
    if strains.is_empty() {
        return;
    }
    let factor = normal_matrix(strains, free, blocks[0][0].nrows())
        .sp_cholesky(Side::Lower)
        .expect("the identity and squares are positive definite");
    let [[xx, xy], [yx, yy]] = blocks;
    for [along_x, along_y] in [[xx, yx], [xy, yy]] {
        let columns = along_x.ncols();
        let mut moved = Mat::zeros(2 * free.len(), columns);
        for column in 0..columns {
            let (x, y) = (along_x.col_as_slice(column), along_y.col_as_slice(column));
            let unknowns = moved.col_as_slice_mut(column).chunks_exact_mut(2);
            unknowns.zip(free).for_each(|(unknown, &row)| unknown.copy_from_slice(&[x[row], y[row]]));
        }
        factor.solve_in_place(&mut moved);
        for column in 0..columns {
            let (x, y) = (along_x.col_as_slice_mut(column), along_y.col_as_slice_mut(column));
            let unknowns = moved.col_as_slice(column).chunks_exact(2);
            unknowns.zip(free).for_each(|(unknown, &row)| [x[row], y[row]] = [unknown[0], unknown[1]]);
        }
    }
}

/// Returns the lower triangle of I + Σ g gᵀ over the gradients g of all strains; unknown 2 i + a is
/// the displacement of free row i along axis a.
fn normal_matrix(strains: &Strains, free: &[usize], rows: usize) -> SparseColMat<usize, f64> {
    let mut number = vec![usize::MAX; rows];
    free.iter().enumerate().for_each(|(i, &row)| number[row] = i);
    let mut entries: Vec<Triplet<usize, usize, f64>> =
        (0..2 * free.len()).map(|i| Triplet::new(i, i, 1.0)).collect();
    for terms in strains.iter() {
        let gradient =
            terms.iter().flat_map(|&(row, by)| [0, 1].map(|a| (2 * number[row as usize] + a, by[a])));
        let gradient: Vec<(usize, f64)> = gradient.collect();
        for &(i, by_i) in &gradient {
            let lower = gradient.iter().filter(|(j, _)| *j <= i);
            entries.extend(lower.map(|&(j, by_j)| Triplet::new(i, j, by_i * by_j)));
        }
    }
    let unknowns = 2 * free.len();
    SparseColMat::try_new_from_triplets(unknowns, unknowns, &entries).expect("indices are in range")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        distortion::Corner,
        ground::Ground,
        map_data::{ChainKind, MapData},
        options::{Parameters, Rigidity},
        patches::Patches,
        response::Response,
        spectrum::Basis,
    };

    /// Terraces: rows of 40 houses that share walls, too many vertices for a body. The first house
    /// of each row is half as deep, so that a corner lies on its neighbour's wall.
    fn terraces() -> MapData {
        let mut coords = Vec::new();
        for (row, house) in (0..10).flat_map(|row| (0..40).map(move |house| (row, house))) {
            let (x, y) = (6.0 * f64::from(house), 30.0 * f64::from(row));
            let depth = if house == 0 { 5.0 } else { 10.0 };
            coords.extend([[x, y], [x + 6.0, y], [x + 6.0, y + depth], [x, y + depth], [x, y]]);
        }
        let starts: Vec<u32> = (0..coords.len() as u32).step_by(5).collect();
        let kinds = vec![ChainKind::Shell; starts.len()];
        MapData::from_chains(coords, &starts, kinds).unwrap().0
    }

    fn on(town: &MapData) -> Map<'_> {
        town.on(&Ground::METRES, &Ground::METRES)
    }

    /// Returns the marked map by one pattern of signs, and its root mean square displacement.
    fn marked(town: &MapData, shape: Rigidity) -> (Vec<[f64; 2]>, f64) {
        let parameters = Parameters { shape, ..Parameters::of_fingerprint() };
        let patches = Patches::new(&on(town), &parameters).unwrap();
        let mut coords = town.vertices.coords().to_vec();
        let mut energy = 0.0;
        for patch in patches.as_slice() {
            let basis = Basis::low_frequencies(patch, 129).unwrap();
            let response = Response::carriers(patch, &basis, &parameters);
            let sign = |i: usize| if (i * i / 3 + i / 7).is_multiple_of(2) { 0.1 } else { -0.1 };
            let coefficients = [0, 1].map(|axis| (0..128).map(|i| sign(i + 50 * axis)).collect());
            for (vertex, [x, y]) in patch.vertices.iter().zip(response.synthesise(&coefficients)) {
                let at = &mut coords[*vertex as usize];
                *at = [at[0] + x, at[1] + y];
                energy += x * x + y * y;
            }
        }
        let count = coords.len() as f64;
        (coords, (energy / count).sqrt())
    }

    #[test]
    fn terraces_keep_their_angles_and_move_as_far_as_free_vertices() {
        let town = terraces();
        let bent = |shape| {
            let (coords, rms_m) = marked(&town, shape);
            assert!((rms_m / 0.1 - 1.0).abs() < 0.1, "{shape:?} {rms_m}");
            let corners = Corner::all(&on(&town), &coords);
            assert!(corners.len() > 20);
            corners.iter().map(Corner::change_deg).sum::<f64>() / corners.len() as f64
        };
        let [free, rigid, stiff] = [Rigidity::Free, Rigidity::Rigid, Rigidity::Stiff].map(bent);
        assert!(rigid > 0.5 * free, "the rows are no bodies: {rigid} {free}");
        assert!(stiff < 0.2 && stiff < 0.3 * free, "{stiff} {free}");
    }

    #[test]
    fn segments_without_a_length_do_not_count() {
        // Lines of two vertices that nearly coincide, and one whose length is no normal number.
        let line = |i: u32| {
            let x = 10.0 * f64::from(i);
            [[x, 0.0], [if i == 0 { 1e-310 } else { x * (1.0 + 1e-15) }, 0.0]]
        };
        let far = |i: u32| [[10.0 * f64::from(i), 50.0], [10.0 * f64::from(i) + 4.0, 57.0]];
        let coords: Vec<[f64; 2]> = (0..100).flat_map(|i| [line(i), far(i)]).flatten().collect();
        let starts: Vec<u32> = (0..coords.len() as u32).step_by(2).collect();
        let kinds = vec![ChainKind::Line; starts.len()];
        let town = MapData::from_chains(coords, &starts, kinds).unwrap().0;
        let parameters = Parameters { patch_size: 100, ..Parameters::of_fingerprint() };
        let patches = Patches::new(&on(&town), &parameters).unwrap();
        for patch in patches.as_slice() {
            let basis = Basis::low_frequencies(patch, 33).unwrap();
            let response = Response::carriers(patch, &basis, &parameters);
            let moved = response.synthesise(&[0, 1].map(|_| vec![0.1; 32]));
            assert!(!patch.strains.is_empty() && moved.as_flattened().iter().all(|value| value.is_finite()));
        }
    }

    #[test]
    fn a_patch_that_shifts_or_turns_as_a_whole_is_not_strained() {
        let town = terraces();
        let patch_size = town.vertices.len();
        let parameters = Parameters { patch_size, ..Parameters::of_fingerprint() };
        let patches = Patches::new(&on(&town), &parameters).unwrap();
        let [patch] = patches.as_slice() else { panic!("{} patches", patches.as_slice().len()) };
        let count = patch.vertices.len();
        let at = |row: usize| town.vertices.coords()[patch.vertices[row] as usize];
        // Columns: a shift along x, and a turn by 1 mrad about the origin.
        let x = Mat::from_fn(count, 2, |row, column| if column == 0 { 1.0 } else { -1e-3 * at(row)[1] });
        let y = Mat::from_fn(count, 2, |row, column| if column == 0 { 0.0 } else { 1e-3 * at(row)[0] });
        let zeros = || Mat::zeros(count, 2);
        let mut blocks = [[x.clone(), zeros()], [y.clone(), zeros()]];
        stiffen(&patch.strains, &patch.free_rows(), &mut blocks);
        for (block, expected) in [(&blocks[0][0], &x), (&blocks[1][0], &y)] {
            assert!((block - expected).norm_max() < 1e-9, "{}", (block - expected).norm_max());
        }
        assert!(!patch.strains.is_empty() && blocks[0][1].norm_max() == 0.0);
    }
}
