//! What bases and anchors leave to a map: which vertices stand, which are attached to these, and which
//! are free.

use crate::{
    Result,
    bodies::{Body, Motion},
    constraints::Constraints,
    map::Map,
    nearness::VertexTree,
    options::Parameters,
    placement::Placement,
    submap::Submap,
    topology::{Settled, settle},
};
use std::collections::BTreeMap;

/// Where a vertex comes from that does not move freely.
#[derive(Clone, Copy)]
pub(crate) enum Origin {
    /// An edition and the index of the vertex there.
    Base(usize, u32),
    Anchor,
}

/// What bases and anchors leave to a map.
pub(crate) struct Changes<'a> {
    /// For every vertex that stands, what determines its place.
    pub origins: Vec<Option<Origin>>,
    tree: VertexTree<'a>,
    placement: Placement<'a>,
    /// The constraints on the vertices that do not stand.
    pub constraints: Constraints,
    attached: Vec<Attached>,
    /// Its own part: the vertices that move freely.
    pub part: Submap,
}

/// Vertices that follow standing ones together.
struct Attached {
    followers: Vec<u32>,
    standing: Vec<u32>,
}

impl<'a> Changes<'a> {
    /// # Errors
    /// [`crate::Error::PrecisionTooCoarse`].
    pub fn new(map: Map<'a>, origins: Vec<Option<Origin>>, parameters: &Parameters) -> Result<Self> {
        let (placement, tree) = (Placement::new(&map, parameters)?, VertexTree::of_all(&map));
        let stands: Vec<bool> = origins.iter().map(Option::is_some).collect();
        let (constraints, torn) = Constraints::around(&map, &tree, parameters.shape, &stands);
        let attached = attach(&map, &constraints, &torn, &stands);
        let mut is_own: Vec<bool> = stands.iter().map(|stands| !stands).collect();
        attached.iter().flat_map(|group| &group.followers).for_each(|&v| is_own[v as usize] = false);
        for hanging in constraints.junctions.hanging() {
            // Its anchors are free, or belong to bodies.
            if hanging.anchors.iter().any(|(anchor, _)| !is_own[*anchor as usize]) {
                is_own[hanging.vertex as usize] = false;
            }
        }
        let own = (0..is_own.len() as u32).filter(|&v| is_own[v as usize]).collect();
        let part = Submap::new(&map, own, map.segments.iter().copied());
        Ok(Changes { origins, tree, placement, constraints, attached, part })
    }

    /// Moves the map; `of_part` are the displacements of its own part, CRS units, and `before` the
    /// editions before it.
    pub fn settle(&self, map: Map, of_part: &[[f64; 2]], before: &[Settled]) -> Settled {
        let place = |(from, origin): (&[f64; 2], &Option<Origin>)| match *origin {
            None => None,
            Some(Origin::Base(edition, vertex)) => Some(before[edition].coords[vertex as usize]),
            Some(Origin::Anchor) => Some(self.placement.place(*from, [0.0; 2])),
        };
        let from = map.vertices.coords();
        let standing: Vec<Option<[f64; 2]>> = from.iter().zip(&self.origins).map(place).collect();
        let moved = |(from, to): (&[f64; 2], &Option<[f64; 2]>)| {
            to.map_or([0.0; 2], |to| [to[0] - from[0], to[1] - from[1]])
        };
        let mut wanted: Vec<[f64; 2]> = from.iter().zip(&standing).map(moved).collect();
        self.part
            .indices
            .iter()
            .zip(of_part)
            .for_each(|(&v, displacement)| wanted[v as usize] = *displacement);
        self.attached.iter().for_each(|group| group.follow(&map, &mut wanted));
        settle(&map, &self.tree, (&self.constraints, &standing), &wanted, &self.placement)
    }
}

/// Returns the vertices that a segment or a body joins to standing ones, with these. The bodies that
/// have standing vertices are `torn`.
fn attach(map: &Map, constraints: &Constraints, torn: &[Body], stands: &[bool]) -> Vec<Attached> {
    let of_body = |body: &Body| {
        let (standing, followers) = body.members.iter().partition(|&&v| stands[v as usize]);
        Attached { followers, standing }
    };
    let mut attached: Vec<Attached> = torn.iter().map(of_body).collect();
    let mut is_attached = stands.to_vec();
    torn.iter().flat_map(|body| &body.members).for_each(|&v| is_attached[v as usize] = true);
    // A body is named by its first vertex.
    let mover = |v: u32| {
        let body = constraints.bodies.number_at(v).map(|body| &constraints.bodies.as_slice()[body]);
        body.map_or(v, |body| body.members[0])
    };
    let mut others: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (new, old) in map.segments.iter().flat_map(|&[a, b]| [(a, b), (b, a)]) {
        let hangs = constraints.junctions.hanging_at(new).is_some();
        if !is_attached[new as usize] && stands[old as usize] && !hangs {
            others.entry(mover(new)).or_default().push(old);
        }
    }
    let members = |first: u32| match constraints.bodies.number_at(first) {
        Some(body) => constraints.bodies.as_slice()[body].members.clone(),
        None => vec![first],
    };
    let of_mover = |(first, standing)| Attached { followers: members(first), standing };
    attached.extend(others.into_iter().map(of_mover));
    attached
}

impl Attached {
    /// Moves the followers as the standing vertices move, by the rigid motion nearest to theirs;
    /// `displacements` are those of all vertices, CRS units.
    fn follow(&self, map: &Map, displacements: &mut [[f64; 2]]) {
        let body = Body::new(map, self.standing.clone());
        let [x, y] = body.scale;
        let in_m = |&v: &u32| [displacements[v as usize][0] * x, displacements[v as usize][1] * y];
        let of_standing: Vec<[f64; 2]> = self.standing.iter().map(in_m).collect();
        let Motion { shift_m, turn } = body.nearest_motion(&of_standing);
        let (from, origin) = (map.at(self.standing[0]), body.arms_m[0]);
        let arm = |&v: &u32| {
            let at = map.at(v);
            [origin[0] + (at[0] - from[0]) * x, origin[1] + (at[1] - from[1]) * y]
        };
        let arms_m: Vec<[f64; 2]> = self.followers.iter().map(arm).collect();
        // A turn that near vertices show must not carry far ones away.
        let longest = |vectors: &[[f64; 2]]| vectors.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
        let most = longest(&of_standing) / longest(&arms_m).max(f64::MIN_POSITIVE);
        let motion = Motion { shift_m, turn: turn.clamp(-most, most) };
        let followers = Body { members: self.followers.clone(), arms_m, scale: body.scale };
        for (&v, [dx, dy]) in self.followers.iter().zip(followers.displacements_m(&motion)) {
            displacements[v as usize] = [dx / x, dy / y];
        }
    }
}
