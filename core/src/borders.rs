//! Borders of sheets that are marked apart: which of their vertices stay in place, so that the marked
//! sheets fit together.
//!
//! Of two things of different sheets, a vertex and a segment, that lie within twice the tolerance of
//! each other, the vertex and both ends of the segment are anchors. Everything else of one sheet is
//! so far from everything of the others that no movement brings them together: each sheet keeps its
//! topology by itself, and so does their union. A vertex that several sheets have is near to itself.

use crate::{anchors::Anchors, ground::Ground, junctions::JUNCTION_M, map::Map, nearness::nearest};
use rstar::{AABB, RTree, primitives::GeomWithData};
use std::collections::BTreeMap;

/// Cells of a coverage along either axis.
const CELLS: usize = 64;
/// The share by which distances are taken longer than they are: two sheets may measure a unit
/// differently in the last digits.
const MARGIN: f64 = 1.05;

/// Where a sheet has something, on a coarse grid over its extent.
pub struct Coverage {
    lower: [f64; 2],
    upper: [f64; 2],
    is_covered: Vec<bool>,
}

impl Coverage {
    /// Finds the cells of a sheet that hold something of it.
    pub fn new(map: &Map) -> Self {
        let (lower, upper) = map.vertices.bounds();
        let mut coverage = Coverage { lower, upper, is_covered: vec![false; CELLS * CELLS] };
        map.vertices.coords().iter().for_each(|&at| coverage.cover([at, at]));
        map.segments.iter().for_each(|&[a, b]| coverage.cover([map.at(a), map.at(b)]));
        coverage
    }

    fn cover(&mut self, ends: [[f64; 2]; 2]) {
        let (lower, upper) = bounds(ends, [0.0; 2]);
        for cell in self.cells(lower, upper) {
            self.is_covered[cell] = true;
        }
    }

    /// Returns the cells that a box within the extent touches.
    fn cells(&self, lower: [f64; 2], upper: [f64; 2]) -> impl Iterator<Item = usize> + use<> {
        let cell = |at: [f64; 2], axis: usize| {
            let size = (self.upper[axis] - self.lower[axis]) / CELLS as f64;
            // A number that is negative or none becomes 0.
            (((at[axis] - self.lower[axis]) / size) as usize).min(CELLS - 1)
        };
        let [columns, rows] = [0, 1].map(|axis| cell(lower, axis)..=cell(upper, axis));
        columns.flat_map(move |column| rows.clone().map(move |row| column * CELLS + row))
    }

    fn meets(&self, lower: [f64; 2], upper: [f64; 2]) -> bool {
        self.is_beside(lower, upper) && self.cells(lower, upper).any(|cell| self.is_covered[cell])
    }

    /// Returns whether its extent touches a box.
    fn is_beside(&self, lower: [f64; 2], upper: [f64; 2]) -> bool {
        (0..2).all(|axis| lower[axis] <= self.upper[axis] && self.lower[axis] <= upper[axis])
    }
}

/// What of a sheet may be near something of another one.
#[derive(Default)]
pub struct Border {
    vertices: Vec<NearVertex>,
    segments: Vec<NearSegment>,
}

struct NearVertex {
    /// Its canonical index in its sheet.
    index: u32,
    at: [f64; 2],
    /// Twice the tolerance at its place, CRS units.
    reach: [f64; 2],
}

struct NearSegment {
    ends: [u32; 2],
    at: [[f64; 2]; 2],
    reach: [f64; 2],
}

impl Border {
    /// Finds what of a sheet may be near the others, given where these have something.
    pub fn new(map: &Map, tolerance_m: f64, others: &[&Coverage]) -> Self {
        let (lower, upper) = map.vertices.bounds();
        // A unit is the shortest at a corner of the extent, or hardly longer there.
        let [p, q] = [lower, upper].map(|corner| reach(map.measure, corner, tolerance_m));
        let (lower, upper) = bounds([lower, upper], [0, 1].map(|axis| 2.0 * p[axis].max(q[axis])));
        let beside: Vec<_> = others.iter().filter(|other| other.is_beside(lower, upper)).collect();
        let is_near = |(lower, upper)| beside.iter().any(|other| other.meets(lower, upper));
        let vertex = |(index, &at): (u32, &[f64; 2])| {
            let reach = reach(map.measure, at, tolerance_m);
            is_near(bounds([at, at], reach)).then_some(NearVertex { index, at, reach })
        };
        let segment = |&ends: &[u32; 2]| {
            let at = ends.map(|end| map.at(end));
            let [p, q] = at.map(|end| reach(map.measure, end, tolerance_m));
            let reach = [p[0].max(q[0]), p[1].max(q[1])];
            is_near(bounds(at, reach)).then_some(NearSegment { ends, at, reach })
        };
        Border {
            vertices: (0..).zip(map.vertices.coords()).filter_map(vertex).collect(),
            segments: map.segments.iter().filter_map(segment).collect(),
        }
    }
}

/// Returns twice the tolerance at a place, CRS units.
fn reach(measure: &Ground, at: [f64; 2], tolerance_m: f64) -> [f64; 2] {
    measure.metres_per_unit(at).map(|scale| 2.0 * MARGIN * tolerance_m / scale.max(1e-9))
}

/// Returns the corners of the box around two places, enlarged by `reach`.
fn bounds([p, q]: [[f64; 2]; 2], reach: [f64; 2]) -> ([f64; 2], [f64; 2]) {
    ([0, 1].map(|axis| p[axis].min(q[axis]) - reach[axis]), [0, 1].map(|a| p[a].max(q[a]) + reach[a]))
}

/// Two sheets that have vertices in common, at places that are nearly but not exactly the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Disagreement {
    /// The numbers of the sheets.
    pub sheets: [usize; 2],
    /// Such a vertex in either sheet, CRS units.
    pub places: [[f64; 2]; 2],
    /// How many there are.
    pub vertices: usize,
}

/// Returns the anchors of every sheet.
///
/// # Errors
/// Returns two sheets that disagree.
pub fn anchors(borders: &[Border], tolerance_m: f64) -> Result<Vec<Anchors>, Disagreement> {
    let near = Near::new(borders);
    if let Some(disagreement) = near.disagreement(tolerance_m) {
        return Err(disagreement);
    }
    let mut anchored: Vec<Vec<u32>> = borders.iter().map(|_| Vec::new()).collect();
    for (sheet, border) in borders.iter().enumerate() {
        for vertex in &border.vertices {
            for (other, neighbour) in near.around([vertex.at; 2], vertex.reach, sheet) {
                if distance(vertex.at, [neighbour.at; 2], vertex.reach) <= 1.0 {
                    anchored[sheet].push(vertex.index);
                    anchored[other].push(neighbour.index);
                }
            }
        }
        for segment in &border.segments {
            for (other, vertex) in near.around(segment.at, segment.reach, sheet) {
                let is_end = segment.at.contains(&vertex.at);
                if !is_end && distance(vertex.at, segment.at, vertex.reach) <= 1.0 {
                    anchored[sheet].extend(segment.ends);
                    anchored[other].push(vertex.index);
                }
            }
        }
    }
    Ok(anchored.into_iter().map(Anchors::new).collect())
}

/// Returns the distance of a place from a segment, as a multiple of `unit` along either axis.
fn distance(from: [f64; 2], [a, b]: [[f64; 2]; 2], unit: [f64; 2]) -> f64 {
    let from_a = |to: [f64; 2]| [0, 1].map(|axis| (to[axis] - a[axis]) / unit[axis]);
    nearest(from_a(from), from_a(b)).0.sqrt()
}

/// The vertices of all borders in a tree.
struct Near<'a> {
    borders: &'a [Border],
    /// Each with the number of its sheet, and its own there.
    tree: RTree<GeomWithData<[f64; 2], (u32, u32)>>,
}

/// A vertex of a border by the numbers of its sheet, and its own there.
type Place = (usize, usize);

impl<'a> Near<'a> {
    fn new(borders: &'a [Border]) -> Self {
        let leaves = (0..).zip(borders).flat_map(|(sheet, border)| {
            (0..).zip(&border.vertices).map(move |(number, v)| GeomWithData::new(v.at, (sheet, number)))
        });
        Near { borders, tree: RTree::bulk_load(leaves.collect()) }
    }

    /// Returns the vertices of other sheets in the box around a segment of a sheet.
    fn around(
        &self,
        ends: [[f64; 2]; 2],
        reach: [f64; 2],
        sheet: usize,
    ) -> impl Iterator<Item = (usize, &'a NearVertex)> {
        let found = self.places(ends, reach).filter(move |(other, _)| *other != sheet);
        found.map(|(other, number)| (other, &self.borders[other].vertices[number]))
    }

    fn places(&self, ends: [[f64; 2]; 2], reach: [f64; 2]) -> impl Iterator<Item = Place> {
        let (lower, upper) = bounds(ends, reach);
        let found = self.tree.locate_in_envelope(&AABB::from_corners(lower, upper));
        found.map(|leaf| (leaf.data.0 as usize, leaf.data.1 as usize))
    }

    fn at(&self, (sheet, number): Place) -> &'a NearVertex {
        &self.borders[sheet].vertices[number]
    }

    /// Returns two sheets of which one has what seems to be a vertex of the other at another place:
    /// either all its neighbours are there, too, or more vertices nearly coincide than coincide.
    fn disagreement(&self, tolerance_m: f64) -> Option<Disagreement> {
        let mut pairs: BTreeMap<[usize; 2], Pair> = BTreeMap::new();
        let neighbours: Vec<Neighbours> = self.borders.iter().map(Neighbours::new).collect();
        for place in self.all() {
            let own = self.at(place);
            for (sheet, _) in self.places([own.at; 2], [0.0; 2]).filter(|(sheet, _)| *sheet > place.0) {
                pairs.entry([place.0, sheet]).or_default().equal += 1;
            }
            let Some((other, apart)) = self.nearest_unshared(place) else { continue };
            if other.0 < place.0 || self.nearest_unshared(other).is_none_or(|(back, _)| back != place) {
                continue;
            }
            // The reach is twice the tolerance.
            let apart_m = 2.0 * MARGIN * tolerance_m * apart;
            let is_same = || neighbours[place.0].are_those_of(own, (&neighbours[other.0], self.at(other)));
            let pair = pairs.entry([place.0, other.0]).or_default();
            if apart_m <= JUNCTION_M {
                pair.apart += 1;
                pair.example.get_or_insert([own.at, self.at(other).at]);
            }
            if apart_m <= tolerance_m && is_same() {
                pair.moved += 1;
                pair.example = Some([own.at, self.at(other).at]);
            }
        }
        pairs.into_iter().find_map(|(sheets, pair)| pair.disagreement(sheets))
    }

    fn all(&self) -> impl Iterator<Item = Place> {
        let of_sheet = |(sheet, border): (usize, &'a Border)| {
            (0..border.vertices.len()).map(move |number| (sheet, number))
        };
        self.borders.iter().enumerate().flat_map(of_sheet)
    }

    /// Returns the nearest vertex of another sheet that its sheet alone has, if it is within reach,
    /// and how far it is, as a share of the reach. Nothing where several sheets have the vertex itself.
    fn nearest_unshared(&self, place: Place) -> Option<(Place, f64)> {
        let own = self.at(place);
        let is_shared =
            |of: Place| self.places([self.at(of).at; 2], [0.0; 2]).any(|(sheet, _)| sheet != of.0);
        if is_shared(place) {
            return None;
        }
        let others = self.places([own.at; 2], own.reach).filter(|other| other.0 != place.0);
        let others = others.filter(|&other| !is_shared(other));
        let apart = |other: Place| (other, distance(own.at, [self.at(other).at; 2], own.reach));
        others.map(apart).min_by(|(a, a_apart), (b, b_apart)| a_apart.total_cmp(b_apart).then(a.cmp(b)))
    }
}

/// How the vertices of two sheets compare.
#[derive(Default)]
struct Pair {
    /// Vertices that both have.
    equal: usize,
    /// Vertices that nearly coincide.
    apart: usize,
    /// Vertices that are nearly at one place, and have the same neighbours.
    moved: usize,
    example: Option<[[f64; 2]; 2]>,
}

impl Pair {
    fn disagreement(self, sheets: [usize; 2]) -> Option<Disagreement> {
        let is_one = self.moved > 0 || self.apart > self.equal;
        let vertices = self.moved.max(self.apart);
        self.example.filter(|_| is_one).map(|places| Disagreement { sheets, places, vertices })
    }
}

/// The neighbours of the vertices of a border along its segments.
struct Neighbours(BTreeMap<u32, Vec<[f64; 2]>>);

impl Neighbours {
    fn new(border: &Border) -> Self {
        let mut neighbours: BTreeMap<u32, Vec<[f64; 2]>> = BTreeMap::new();
        for NearSegment { ends: [a, b], at: [p, q], .. } in &border.segments {
            neighbours.entry(*a).or_default().push(*q);
            neighbours.entry(*b).or_default().push(*p);
        }
        Neighbours(neighbours)
    }

    /// Returns whether a vertex has as many neighbours as one of another sheet, each within the
    /// tolerance of one of these, of which two, or the only one, are further away than that: on either
    /// side of a border, small things look alike.
    fn are_those_of(&self, vertex: &NearVertex, (others, other): (&Self, &NearVertex)) -> bool {
        let of =
            |all: &BTreeMap<u32, Vec<[f64; 2]>>, index: u32| all.get(&index).cloned().unwrap_or_default();
        let (own, others) = (of(&self.0, vertex.index), of(&others.0, other.index));
        let tolerance = vertex.reach.map(|reach| reach / 2.0);
        let are_near = |a: [f64; 2], b: [f64; 2]| distance(a, [b; 2], tolerance) <= 1.0;
        let is_there = |at: &[f64; 2]| others.iter().any(|to| are_near(*at, *to));
        let far = own.iter().filter(|at| !are_near(**at, vertex.at)).count();
        own.len() == others.len() && far >= own.len().clamp(1, 2) && own.iter().all(is_there)
    }
}
