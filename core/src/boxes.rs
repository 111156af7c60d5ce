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

/// The share by which distances from a border are taken longer than vertices move, so that things on
/// either side keep a gap.
const MARGIN: f64 = 1.05;

/// A map in boxes.
pub(crate) struct Boxes<'a> {
    map: Map<'a>,
    /// For every box the canonical indices of its vertices, ascending.
    members: Vec<Vec<u32>>,
    /// For every vertex its box.
    box_of: Vec<u32>,
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
        let box_of: Vec<u32> = map.vertices.coords().iter().map(|place| plan.box_at(*place)).collect();
        let mut members = vec![Vec::new(); plan.len()];
        (0..).zip(&box_of).for_each(|(v, number)| members[*number as usize].push(v));
        let is_near = |v: u32, by_m: f64| {
            let reach = map.measure.metres_per_unit(map.at(v)).map(|scale| by_m / scale.max(1e-9));
            plan.is_near_border(box_of[v as usize], map.at(v), reach)
        };
        let vertices = 0..box_of.len() as u32;
        let mut is_anchor: Vec<bool> =
            vertices.map(|v| is_near(v, MARGIN * parameters.tolerance_m)).collect();
        let mut crossing = vec![Vec::new(); plan.len()];
        let mut passed = Vec::new();
        for &[a, b] in map.segments {
            let is_crossing = box_of[a as usize] != box_of[b as usize];
            // What touches a segment is at most this far away, and may be in another box.
            if is_crossing || [a, b].into_iter().any(|v| is_near(v, 2.0 * JUNCTION_M)) {
                [a, b].into_iter().for_each(|v| is_anchor[v as usize] = true);
            }
            if is_crossing {
                passed.clear();
                plan.boxes_between([map.at(a), map.at(b)], &mut passed);
                passed.iter().for_each(|number| crossing[*number as usize].push([a, b]));
            }
        }
        if parameters.shape != Rigidity::Free {
            anchor_divided_bodies(&map, &box_of, &mut is_anchor);
        }
        Boxes { map, members, box_of, is_anchor, crossing }
    }

    /// Returns how many boxes there are.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Returns the map that was cut.
    pub fn map(&self) -> &Map<'a> {
        &self.map
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
        let is_inside = |v: u32| self.box_of[v as usize] == number as u32;
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
fn anchor_divided_bodies(map: &Map, box_of: &[u32], is_anchor: &mut [bool]) {
    let (mut sizes, mut is_divided) = (vec![0u32; box_of.len()], vec![false; box_of.len()]);
    for (number, &root) in box_of.iter().zip(map.polygon_roots) {
        sizes[root as usize] += 1;
        is_divided[root as usize] |= *number != box_of[root as usize];
    }
    for (is_anchor, &root) in is_anchor.iter_mut().zip(map.polygon_roots) {
        *is_anchor |= is_divided[root as usize] && sizes[root as usize] as usize <= bodies::MOST_VERTICES;
    }
}
