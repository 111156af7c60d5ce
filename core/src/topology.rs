//! Moving vertices without changing the topology of the map: no vertex passes through a segment.
//!
//! Where the mark would push a vertex through, the vertices involved form a cluster. It is
//! attenuated step by step: first the differences among its displacements, then their mean. A map
//! that does not move is always legal, so the procedure ends.

use crate::{
    bodies::{Body, Motion},
    constraints::Constraints,
    disjoint_sets::DisjointSets,
    junctions::JUNCTION_M,
    map::Map,
    motion::{Slack, keeps_apart},
    nearness::VertexTree,
    placement::Placement,
    sides,
};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// The movement of a cluster at each level of attenuation: the share of its mean displacement, and
/// the share of the deviations of its members from that mean. Level 0 is a vertex that no other
/// restrains.
const LEVELS: [(f64, f64); 6] = [(1.0, 1.0), (1.0, 0.5), (1.0, 0.25), (1.0, 0.0), (0.5, 0.0), (0.0, 0.0)];
/// The last level: all members stay in place.
const FROZEN: usize = LEVELS.len() - 1;
/// The level at which clusters that meet start again: they move as one.
const RIGID: usize = 3;

/// A map after marking.
pub(crate) struct Settled {
    /// The new place of every vertex, CRS units.
    pub coords: Vec<[f64; 2]>,
    /// How many vertices moved differently from what was wanted.
    pub attenuated: usize,
    /// The deviation from what was wanted, metres along an axis: root mean square over all
    /// vertices.
    pub deviation_m: f64,
}

/// Moves every vertex by the displacement `wanted` (CRS units), bodies by the rigid motion nearest
/// to it, as far as the topology of the map and the placement allow; `tree` holds all vertices. On
/// a grid too coarse for the map, rounding alone may change the topology; such changes are not
/// undone. Vertices with a place in `standing`, which is empty where none has, go there; the
/// constraints are those on the others, which are attenuated to the movement of the standing ones
/// that they meet. Standing vertices alone may meet new segments among themselves.
pub(crate) fn settle(
    map: &Map,
    tree: &VertexTree,
    (constraints, standing): (&Constraints, &[Option<[f64; 2]>]),
    wanted: &[[f64; 2]],
    placement: &Placement,
) -> Settled {
    let mut movement = Movement::new(*map, (constraints, standing), wanted, placement);
    let free = movement.coords.clone();
    let mut clusters = Clusters::new(wanted.len());
    let mut changed: Option<Changed> = None;
    loop {
        let hits = movement.hits(tree, changed.as_ref());
        let touched = clusters.merge(hits.iter().map(|hit| movement.met_by(hit)));
        if touched.is_empty() {
            break;
        }
        touched.iter().for_each(|root| movement.attenuate(&clusters.clusters[root]));
        changed = Some(movement.advance());
    }
    let attenuated = free.iter().zip(&movement.coords).filter(|(a, b)| a != b).count();
    let apart = |(a, b): (&[f64; 2], &[f64; 2])| {
        let [dx, dy] = map.ground.metres_between(*a, *b);
        dx * dx + dy * dy
    };
    let energy: f64 = free.iter().zip(&movement.coords).map(apart).sum();
    let deviation_m = (energy / (2 * wanted.len()) as f64).sqrt();
    let mut coords = movement.coords;
    sides::keep(map, &constraints.touching, placement, &mut coords);
    Settled { coords, attenuated, deviation_m }
}

/// A vertex and a segment that meet.
type Hit = [u32; 3];

/// What takes part in a hit.
struct Met {
    movers: Vec<u32>,
    /// Vertices that stand, in ascending order.
    standing: Vec<u32>,
}

/// The state of the movement. Its movers are free vertices, and bodies, each named by its first
/// vertex.
struct Movement<'a> {
    map: Map<'a>,
    constraints: &'a Constraints,
    /// The given place of every vertex that stands, CRS units; empty where none does.
    standing: &'a [Option<[f64; 2]>],
    placement: &'a Placement<'a>,
    slack: Slack,
    /// CRS units.
    wanted: &'a [[f64; 2]],
    /// CRS units; displacements of hanging vertices and of members of bodies follow from them.
    displacements: Vec<[f64; 2]>,
    coords: Vec<[f64; 2]>,
}

/// Vertices that have moved since the last search for hits.
struct Changed<'a> {
    is_changed: Vec<bool>,
    tree: VertexTree<'a>,
}

impl<'a> Movement<'a> {
    fn new(
        map: Map<'a>,
        (constraints, standing): (&'a Constraints, &'a [Option<[f64; 2]>]),
        wanted: &'a [[f64; 2]],
        placement: &'a Placement<'a>,
    ) -> Self {
        let (min, max) = map.vertices.bounds();
        let [_, metres_per_unit] = map.ground.metres_per_unit(map.vertices.centre());
        let largest = min.iter().chain(&max).fold(0f64, |largest, value| largest.max(value.abs()));
        let slack = Slack::new(
            largest * f64::EPSILON * metres_per_unit,
            placement.grid() * metres_per_unit,
            JUNCTION_M,
        );
        let (displacements, coords) = (wanted.to_vec(), map.vertices.coords().to_vec());
        let mut movement =
            Movement { map, constraints, standing, placement, slack, wanted, displacements, coords };
        for body in constraints.bodies.as_slice() {
            movement.move_by(body.members[0], movement.wanted_of(body.members[0]));
        }
        movement.place();
        movement
    }

    /// Returns the given place of a vertex that stands.
    fn standing_at(&self, vertex: u32) -> Option<[f64; 2]> {
        self.standing.get(vertex as usize).copied().flatten()
    }

    fn body(&self, vertex: u32) -> Option<&'a Body> {
        self.constraints.bodies.number_at(vertex).map(|body| &self.constraints.bodies.as_slice()[body])
    }

    /// Returns the wanted motion of a free vertex or a body.
    fn wanted_of(&self, mover: u32) -> Motion {
        let wanted_m =
            |scale: [f64; 2], v: u32| [0, 1].map(|axis| self.wanted[v as usize][axis] * scale[axis]);
        match self.body(mover) {
            Some(body) => {
                let all: Vec<[f64; 2]> = body.members.iter().map(|&v| wanted_m(body.scale, v)).collect();
                body.nearest_motion(&all)
            }
            None => Motion { shift_m: wanted_m(self.scale(mover), mover), turn: 0.0 },
        }
    }

    fn move_by(&mut self, mover: u32, motion: Motion) {
        let in_units = |[x, y]: [f64; 2], scale: [f64; 2]| [x / scale[0], y / scale[1]];
        let Some(body) = self.body(mover) else {
            self.displacements[mover as usize] = in_units(motion.shift_m, self.scale(mover));
            return;
        };
        let motion = match body.members.iter().any(|&v| self.placement.is_pinned(self.map.at(v))) {
            true => Motion::default(),
            false => {
                let at = self.map.at(body.members[0]);
                body.within(motion, self.placement.tolerance_in(at, body.scale))
            }
        };
        for (&v, displacement_m) in body.members.iter().zip(body.displacements_m(&motion)) {
            self.displacements[v as usize] = in_units(displacement_m, body.scale);
        }
    }

    fn scale(&self, vertex: u32) -> [f64; 2] {
        self.map.ground.metres_per_unit(self.map.at(vertex))
    }

    /// Moves the members of a cluster by its level of attenuation.
    fn attenuate(&mut self, cluster: &Cluster) {
        let (of_mean, of_rest) = LEVELS[cluster.level];
        let wanted: Vec<Motion> = cluster.members.iter().map(|&mover| self.wanted_of(mover)).collect();
        let mean = mean(wanted.iter().map(|motion| motion.shift_m));
        for (&mover, motion) in cluster.members.iter().zip(wanted) {
            let rest = self.standing_near(mover, &cluster.met);
            let shift = |axis: usize| {
                let of_all = rest[axis] + of_mean * (mean[axis] - rest[axis]);
                of_all + of_rest * (motion.shift_m[axis] - mean[axis])
            };
            self.move_by(mover, Motion { shift_m: [0, 1].map(shift), turn: of_rest * motion.turn });
        }
    }

    /// Returns the movement of standing vertices at the place of a mover, metres: their mean, each
    /// weighted by the inverse of its distance, which on a segment is that of the nearest place.
    fn standing_near(&self, mover: u32, standing: &BTreeSet<u32>) -> [f64; 2] {
        let own = [mover];
        let members = self.body(mover).map_or(&own[..], |body| &body.members);
        let weight = |v: u32| {
            let distance = |&member: &u32| {
                let [dx, dy] = self.map.ground.metres_between(self.map.at(member), self.map.at(v));
                dx.hypot(dy)
            };
            1.0 / members.iter().map(distance).fold(f64::INFINITY, f64::min).max(JUNCTION_M)
        };
        let (mut sum, mut weights) = ([0.0; 2], 0.0);
        for &v in standing {
            let (weight, scale) = (weight(v), self.scale(v));
            weights += weight;
            sum = [0, 1].map(|a| sum[a] + weight * self.wanted[v as usize][a] * scale[a]);
        }
        if weights > 0.0 { sum.map(|value| value / weights) } else { sum }
    }

    /// Moves hanging vertices along with their anchors and places all vertices.
    fn place(&mut self) {
        self.constraints.junctions.follow(&mut self.displacements);
        let place = |(v, (from, displacement)): (usize, (&[f64; 2], &[f64; 2]))| {
            self.standing_at(v as u32).unwrap_or_else(|| self.placement.place(*from, *displacement))
        };
        let moves = self.map.vertices.coords().par_iter().zip(&self.displacements);
        self.coords = moves.enumerate().map(place).collect();
    }

    /// Places all vertices and returns what changed.
    fn advance(&mut self) -> Changed<'a> {
        let before = std::mem::take(&mut self.coords);
        self.place();
        let is_changed: Vec<bool> = before.iter().zip(&self.coords).map(|(a, b)| a != b).collect();
        let changed = (0u32..).zip(&is_changed).filter(|(_, changed)| **changed).map(|(v, _)| v);
        Changed { tree: VertexTree::new(self.map, changed), is_changed }
    }

    /// Returns all vertices that meet a segment on their way, or, after a change, those that the
    /// change affects.
    fn hits(&self, tree: &VertexTree, changed: Option<&Changed>) -> Vec<Hit> {
        let moved =
            |v: usize| [0, 1].map(|axis| (self.coords[v][axis] - self.map.vertices.coords()[v][axis]).abs());
        let furthest = (0..self.coords.len()).into_par_iter().map(moved).reduce(|| [0.0; 2], larger);
        let of_segment = |&[a, b]: &[u32; 2]| {
            let near = match changed {
                Some(changed) if !changed.is_changed[a as usize] && !changed.is_changed[b as usize] => {
                    &changed.tree
                }
                _ => tree,
            };
            let ends = larger(moved(a as usize), moved(b as usize));
            // The margin covers the least gap in any unit.
            let reach = [0, 1].map(|axis| 1.001 * (ends[axis] + furthest[axis]));
            let found = near.around([a, b], reach).map(move |v| [v, a, b]);
            found.filter(|&triple| !self.keeps_apart(triple)).collect::<Vec<Hit>>()
        };
        self.map.segments.par_iter().flat_map_iter(of_segment).collect()
    }

    fn keeps_apart(&self, triple: Hit) -> bool {
        let before = triple.map(|v| self.map.at(v));
        let after = triple.map(|v| self.coords[v as usize]);
        keeps_apart(&before, &after, self.map.ground.metres_per_unit(before[0]), self.slack)
    }

    /// Returns the free vertices and bodies whose displacements make a hit, and the vertices of it
    /// that stand.
    fn met_by(&self, hit: &Hit) -> Met {
        let of = |vertex: &u32| match self.constraints.junctions.hanging_at(*vertex) {
            Some(hanging) => hanging.anchors.iter().map(|(anchor, _)| *anchor).collect(),
            None => vec![*vertex],
        };
        let all = hit.iter().flat_map(of);
        let (standing, free): (Vec<u32>, Vec<u32>) = all.partition(|&v| self.standing_at(v).is_some());
        let mover = |vertex: u32| self.body(vertex).map_or(vertex, |body| body.members[0]);
        Met { movers: free.into_iter().map(mover).collect(), standing }
    }
}

/// Returns the mean of vectors; zero of none.
fn mean(vectors: impl Iterator<Item = [f64; 2]> + Clone) -> [f64; 2] {
    let count = vectors.clone().count().max(1) as f64;
    [0, 1].map(|axis| vectors.clone().map(|vector| vector[axis]).sum::<f64>() / count)
}

fn larger(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].max(b[0]), a[1].max(b[1])]
}

/// Movers that move together, as disjoint sets.
struct Clusters {
    sets: DisjointSets,
    /// By their roots. One body alone is a cluster, too: its turn may carry it through what hangs
    /// on it.
    clusters: BTreeMap<u32, Cluster>,
}

#[derive(Default)]
struct Cluster {
    members: Vec<u32>,
    /// The standing vertices that they meet.
    met: BTreeSet<u32>,
    level: usize,
}

impl Cluster {
    /// Returns the least level at which a cluster comes nearer to the standing vertices that it meets:
    /// below, vertices that move alike, or not at all, would not change, and the search would end.
    fn least_level(&self) -> usize {
        if self.met.is_empty() { 0 } else { RIGID + 1 }
    }
}

impl Clusters {
    fn new(vertices: usize) -> Self {
        Clusters { sets: DisjointSets::new(vertices), clusters: BTreeMap::new() }
    }

    /// Joins the vertices of every hit, raises the level of their clusters and returns the roots of
    /// these. Clusters that are frozen cannot be attenuated further and are not among them.
    fn merge(&mut self, hits: impl Iterator<Item = Met>) -> BTreeSet<u32> {
        let (mut joined, mut again) = (BTreeSet::new(), Vec::new());
        for Met { movers, standing } in hits.filter(|met| !met.movers.is_empty()) {
            let roots: BTreeSet<u32> = movers.iter().map(|&v| self.sets.root(v)).collect();
            let first = movers_root(&roots);
            let root = match roots.len() == 1 && self.clusters.contains_key(&first) {
                true => {
                    again.push(first);
                    first
                }
                false => {
                    let root = self.join(roots);
                    joined.insert(root);
                    root
                }
            };
            self.clusters.get_mut(&root).expect("it was joined").met.extend(standing);
        }
        let joined: BTreeSet<u32> = joined.into_iter().map(|root| self.sets.root(root)).collect();
        for &root in &joined {
            let cluster = self.clusters.get_mut(&root).expect("it was joined");
            cluster.level = cluster.level.clamp(1, RIGID).max(cluster.least_level());
        }
        let mut touched = joined.clone();
        let again: BTreeSet<u32> = again.into_iter().map(|root| self.sets.root(root)).collect();
        for root in again.difference(&joined) {
            let cluster = self.clusters.get_mut(root).expect("it was joined before");
            if cluster.level < FROZEN {
                cluster.level = (cluster.level + 1).max(cluster.least_level());
                touched.insert(*root);
            }
        }
        touched
    }

    fn join(&mut self, roots: BTreeSet<u32>) -> u32 {
        let size = |root: &u32| self.clusters.get(root).map_or(1, |cluster| cluster.members.len());
        let largest =
            *roots.iter().max_by_key(|root| (size(root), u32::MAX - **root)).expect("a hit has vertices");
        let single = |root: u32| Cluster { members: vec![root], ..Cluster::default() };
        let mut all = self.clusters.remove(&largest).unwrap_or_else(|| single(largest));
        for root in roots.into_iter().filter(|&root| root != largest) {
            let other = self.clusters.remove(&root).unwrap_or_else(|| single(root));
            self.sets.put_under(root, largest);
            all.members.extend(other.members);
            all.met.extend(other.met);
            all.level = all.level.max(other.level);
        }
        self.clusters.insert(largest, all);
        largest
    }
}

fn movers_root(roots: &BTreeSet<u32>) -> u32 {
    *roots.first().expect("a hit has vertices")
}
