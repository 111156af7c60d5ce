//! Boxes: a large map is cut into parts that are solved one after the other, so that one of them at a
//! time needs memory.
//!
//! A vertex belongs to the box that it lies in, whichever feature it is in. The following stay in
//! place, so that nothing leaves its box and each box keeps its topology by itself: both ends of a
//! segment that crosses a border, or touches it; vertices that could reach a border; and all polygons
//! that share vertices, of which the borders divide some, if they could move as one. Of two boxes, what
//! moves in one is then never beside what moves in the other. A box knows the segments of others that
//! pass through it as standing ones.

use crate::{
    bodies,
    box_plan::BoxPlan,
    junctions::JUNCTION_M,
    map::Map,
    options::{Parameters, Rigidity},
    part::PartDigest,
    submap::Submap,
    vertices::VertexTable,
};
use std::sync::Arc;

/// The share by which distances from a border are taken longer than vertices move, so that things on
/// either side keep a gap.
const MARGIN: f64 = 1.05;

/// A map in boxes.
pub(crate) struct Boxes<'a> {
    map: Map<'a>,
    /// For every box the canonical indices of its vertices, ascending.
    members: Vec<Vec<u32>>,
    plan: Arc<BoxPlan>,
    /// For every vertex whether it stays in place.
    is_anchor: Vec<bool>,
    /// For every box the segments between boxes that may pass through it.
    crossing: Vec<Vec<[u32; 2]>>,
}

/// A box as a map of its own, with the ends of the segments that pass through it.
pub(crate) struct BoxMap {
    /// The box.
    pub submap: Submap,
    /// The positions of its vertices that stay in place, and of all that are those of other boxes.
    pub anchors: Vec<u32>,
    /// For every vertex whether it is one of the box.
    pub is_own: Vec<bool>,
}

impl<'a> Boxes<'a> {
    /// Cuts a map into boxes of about `part_size` vertices.
    pub fn new(map: Map<'a>, part_size: usize, parameters: &Parameters) -> Self {
        let plan = BoxPlan::new(map.vertices, part_size, map.ground.x_scale(map.vertices.centre()[1]));
        let is_near = |number: u32, at: [f64; 2], by_m: f64| {
            let reach = map.measure.metres_per_unit(at).map(|scale| by_m / scale.max(1e-9));
            plan.is_near_border(number, at, reach)
        };
        let mut members = vec![Vec::new(); plan.len()];
        let mut is_anchor = Vec::with_capacity(map.vertices.len());
        for (v, &at) in (0..).zip(map.vertices.coords()) {
            let number = plan.box_at(at);
            members[number as usize].push(v);
            is_anchor.push(is_near(number, at, MARGIN * parameters.tolerance_m));
        }
        members.iter_mut().for_each(Vec::shrink_to_fit);
        let mut crossing = vec![Vec::new(); plan.len()];
        let mut passed = Vec::new();
        for &[a, b] in map.segments {
            let numbers = [a, b].map(|v| plan.box_at(map.at(v)));
            let is_crossing = numbers[0] != numbers[1];
            // What touches a segment is at most this far away, and may be in another box.
            let mut ends = [a, b].into_iter().zip(numbers);
            if is_crossing || ends.any(|(v, number)| is_near(number, map.at(v), 2.0 * JUNCTION_M)) {
                [a, b].into_iter().for_each(|v| is_anchor[v as usize] = true);
            }
            if is_crossing {
                passed.clear();
                plan.boxes_between([map.at(a), map.at(b)], &mut passed);
                passed.iter().for_each(|number| crossing[*number as usize].push([a, b]));
            }
        }
        if parameters.shape != Rigidity::Free {
            anchor_divided_bodies(&map, &plan, &mut is_anchor);
        }
        Boxes { map, members, plan: Arc::new(plan), is_anchor, crossing }
    }

    /// Returns how many boxes there are.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Returns the map that was cut.
    pub fn map(&self) -> &Map<'a> {
        &self.map
    }

    /// Returns the plan by which it was cut.
    pub fn plan(&self) -> Arc<BoxPlan> {
        self.plan.clone()
    }

    /// Returns the number of vertices of a box.
    pub fn vertices(&self, number: usize) -> usize {
        self.members[number].len()
    }

    /// Returns the name of a box as a part: the digest of its vertices, which move or stay.
    pub fn digest(&self, number: usize) -> PartDigest {
        let coords = self.members[number].iter().map(|&v| self.map.at(v)).collect();
        PartDigest::new(&VertexTable::new(coords).expect("they are vertices of a map"))
    }

    /// Cuts a box out of the map.
    pub fn cut(&self, number: usize) -> BoxMap {
        let is_inside = |v: u32| self.plan.box_at(self.map.at(v)) == number as u32;
        let crossing = &self.crossing[number];
        let others = crossing.iter().flatten().copied().filter(|&v| !is_inside(v));
        let mut indices: Vec<u32> = self.members[number].iter().copied().chain(others).collect();
        indices.sort_unstable();
        indices.dedup();
        let from = |&v: &u32| {
            let first = self.map.segments.partition_point(|[a, _]| *a < v);
            self.map.segments[first..].iter().take_while(move |[a, _]| *a == v)
        };
        let inside = self.members[number].iter().flat_map(from).filter(|[_, b]| is_inside(*b));
        let submap = Submap::new(&self.map, indices, inside.chain(crossing).copied());
        let is_own: Vec<bool> = submap.indices.iter().map(|&v| is_inside(v)).collect();
        let stays = |(_, v): &(u32, &u32)| self.is_anchor[**v as usize] || !is_inside(**v);
        let anchors = (0..).zip(&submap.indices).filter(stays).map(|(position, _)| position).collect();
        BoxMap { submap, anchors, is_own }
    }
}

/// Makes anchors of all vertices of the polygon groups that may be bodies and are in several boxes.
fn anchor_divided_bodies(map: &Map, plan: &BoxPlan, is_anchor: &mut [bool]) {
    // A size that does not fit is that of a group which is too large for a body.
    let (mut sizes, mut is_divided) = (vec![0u8; is_anchor.len()], vec![false; is_anchor.len()]);
    const { assert!(bodies::MOST_VERTICES < u8::MAX as usize) };
    for (&at, &root) in map.vertices.coords().iter().zip(map.polygon_roots) {
        sizes[root as usize] = sizes[root as usize].saturating_add(1);
        is_divided[root as usize] |= plan.box_at(at) != plan.box_at(map.at(root));
    }
    for (is_anchor, &root) in is_anchor.iter_mut().zip(map.polygon_roots) {
        *is_anchor |= is_divided[root as usize] && usize::from(sizes[root as usize]) <= bodies::MOST_VERTICES;
    }
}
