//! Vertices that touch a segment stay on their side of it, to the last bit.
//!
//! Such a vertex follows the place where it touches, and rounding puts it on either side. Where all
//! its own segments lead away on one side, the other side is through the wall: the vertex is nudged
//! back by a few ulps.

use crate::{map::Map, orientation::orientation, placement::Placement};

/// Contacts depend on each other through shared vertices; this many rounds exceed the longest
/// chain.
const MOST_ROUNDS: usize = 16;
/// A vertex is nudged by at most this many ulps.
const MOST_STEPS: usize = 64;

/// A vertex and a segment that it touches without being its end.
pub(crate) type Touching = (u32, [u32; 2]);

/// The side of a segment on which a vertex must be.
struct Contact {
    vertex: u32,
    segment: [u32; 2],
    is_left: bool,
    /// Whether it may lie on the segment.
    may_touch: bool,
}

impl Contact {
    fn is_kept(&self, coords: &[[f64; 2]]) -> bool {
        let side = side(coords, self.vertex, self.segment);
        if side == 0.0 { self.may_touch } else { (side > 0.0) == self.is_left }
    }
}

/// Puts vertices back on their side; `coords` are their new places. On a grid there is no room for
/// it.
pub(crate) fn keep(map: &Map, touching: &[Touching], placement: &Placement, coords: &mut [[f64; 2]]) {
    if placement.grid() > 0.0 || touching.is_empty() {
        return;
    }
    let contacts = contacts(map, touching);
    for _ in 0..MOST_ROUNDS {
        let mut all_kept = true;
        for contact in &contacts {
            if !contact.is_kept(coords) {
                all_kept = false;
                put_back(map, contact, placement, coords);
            }
        }
        if all_kept {
            return;
        }
    }
}

/// Moves the vertex along the axis that leads away from the segment fastest.
fn put_back(map: &Map, contact: &Contact, placement: &Placement, coords: &mut [[f64; 2]]) {
    let (vertex, [a, b]) = (contact.vertex as usize, contact.segment.map(|end| coords[end as usize]));
    let to_left = [a[1] - b[1], b[0] - a[0]];
    let axis = usize::from(to_left[1].abs() > to_left[0].abs());
    let goes_up = (to_left[axis] > 0.0) == contact.is_left;
    let before = coords[vertex];
    for _ in 0..MOST_STEPS {
        let value = &mut coords[vertex][axis];
        *value = if goes_up { value.next_up() } else { value.next_down() };
        if contact.is_kept(coords) {
            break;
        }
    }
    if !placement.allows(map.at(contact.vertex), coords[vertex]) {
        coords[vertex] = before;
    }
}

fn contacts(map: &Map, touching: &[Touching]) -> Vec<Contact> {
    let mut touches = vec![false; map.vertices.len()];
    touching.iter().for_each(|(vertex, _)| touches[*vertex as usize] = true);
    let both_ways = map.segments.iter().flat_map(|&[a, b]| [(a, b), (b, a)]);
    let mut neighbours: Vec<(u32, u32)> = both_ways.filter(|(from, _)| touches[*from as usize]).collect();
    neighbours.sort_unstable();
    let contact = |&(vertex, segment): &Touching| {
        let coords = map.vertices.coords();
        let own = side(coords, vertex, segment);
        let first = neighbours.partition_point(|(from, _)| *from < vertex);
        let neighbours = neighbours[first..].iter().take_while(|(from, _)| *from == vertex);
        let sides = neighbours.map(|(_, to)| side(coords, *to, segment));
        let (is_left, is_right) =
            sides.fold((own > 0.0, own < 0.0), |(left, right), side| match own == 0.0 {
                true => (left || side > 0.0, right || side < 0.0),
                false => (left, right),
            });
        (is_left != is_right).then_some(Contact { vertex, segment, is_left, may_touch: own == 0.0 })
    };
    touching.iter().filter_map(contact).collect()
}

/// Returns the orientation of a vertex to a segment.
fn side(coords: &[[f64; 2]], vertex: u32, segment: [u32; 2]) -> f64 {
    let [a, b, p] = [segment[0], segment[1], vertex].map(|v| coords[v as usize]);
    orientation(a, b, p)
}
