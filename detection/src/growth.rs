//! Growth: a strong smooth deformation is followed from features with equal attribute values or
//! shapes to all others. No key is involved.
//!
//! Affine functions of the place, fitted to the displacements found nearby, predict where the
//! polygon groups next to them lie. Groups are looked for there as a whole, then single vertices,
//! and so on until nothing is added.

use crate::{
    groups,
    linework::Plane,
    matching::{Matcher, Near, is_chance},
};
use meshmark_core::{ground::Ground, map_data::MapData};
use nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3};
use rayon::prelude::*;
use rstar::{RTree, primitives::GeomWithData};

/// Groups are looked for within this distance of their predicted places, metres.
const REACH_M: f64 = 4.0;
/// Rounds of growth.
const ROUNDS: usize = 12;
/// A round that finds fewer than this share more vertices is the last one.
const GROWS: f64 = 0.01;
/// A displacement is predicted from so many found vertices, the nearest ones of other groups.
const NEIGHBOURS: usize = 24;
const LEAST_NEIGHBOURS: usize = 8;
/// The nearest of them is not farther away than this, metres.
const FARTHEST_M: f64 = 60.0;
/// The distance at which a neighbour counts a quarter of a near one, metres.
const NEAR_M: f64 = 12.0;
/// Standard deviation of the strain.
const STRAIN: f64 = 0.3;
/// A found group deviates by at most this from what its neighbours predict, metres.
const CONSISTENT_M: f64 = 3.0;
/// Then single vertices are looked for within these distances of their predicted places, metres.
const REACHES_M: [f64; 5] = [4.0, 3.0, 2.0, 1.5, 1.0];
/// Rounds of reweighting, in which distances below the least one have equal weight, metres.
const REWEIGHTED: usize = 4;
const LEAST_REST_M: f64 = 0.2;

/// Vertices match within this distance of the places to which growth took them, metres.
const MATCHED_M: f64 = 1.0;
/// A shift that takes any map farther out of place than growth can follow, metres.
const ELSEWHERE_M: [f64; 2] = [57.0, -41.0];

/// The reference vertices and the places of features of a map that grows.
pub struct Growth<'a> {
    reference: &'a MapData,
    ground: &'a Ground,
    plane: Plane,
    /// The reference vertices in the plane.
    places: Vec<[f64; 2]>,
    /// The places of features in suspect and reference, CRS units of the reference.
    pairs: Vec<[[f64; 2]; 2]>,
}

impl<'a> Growth<'a> {
    /// Prepares a reference; `pairs` are places of features in suspect and reference that are
    /// likely the same, CRS units of the reference.
    pub fn new(reference: &'a MapData, ground: &'a Ground, pairs: Vec<[[f64; 2]; 2]>) -> Self {
        let plane = Plane::new(ground, reference.vertices.centre());
        let places = reference.vertices.coords().iter().map(|p| plane.at(*p)).collect();
        Growth { reference, ground, plane, places, pairs }
    }

    /// Follows a deformation of a suspect that has its vertices at `moved`, CRS units of the
    /// reference. Returns the places to which it takes the reference vertices, CRS units; `None`
    /// where no more vertices match there than when the suspect starts far out of place.
    pub fn grow(&self, moved: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        let (places, count) = self.grown(moved, [0.0; 2])?;
        let by_chance = self.grown(moved, ELSEWHERE_M).map_or(0, |(_, count)| count);
        (!is_chance(count, by_chance)).then_some(places)
    }

    /// Returns the places to which growth takes the reference vertices from a suspect shifted by
    /// `shift_m`, and how many match there.
    fn grown(&self, moved: &[[f64; 2]], shift_m: [f64; 2]) -> Option<(Vec<[f64; 2]>, usize)> {
        let shifted = self.ground.displaced(moved, &vec![shift_m; moved.len()]);
        let places = self.ground.displaced(self.coords(), &self.displacements_m(&shifted, shift_m)?);
        let count = self.matcher(&places).all(&shifted, MATCHED_M).count;
        Some((places, count))
    }

    /// Returns the displacement of every reference vertex, metres, 0 where none can be predicted;
    /// `None` where nothing is found. The suspect was shifted by `shift_m`.
    fn displacements_m(&self, moved: &[[f64; 2]], shift_m: [f64; 2]) -> Option<Vec<[f64; 2]>> {
        let of_pair = |(number, [suspect, reference]): (usize, &[[f64; 2]; 2])| {
            let (from, to) = (self.plane.at(*reference), self.plane.at(*suspect));
            let displacement_m = [0, 1].map(|axis| to[axis] + shift_m[axis] - from[axis]);
            let is_near = displacement_m[0].hypot(displacement_m[1]) <= FARTHEST_M;
            is_near.then_some(Anchor { place: from, displacement_m, group: Group::Pair(number) })
        };
        let pairs = self.pairs.iter().enumerate().filter_map(of_pair).collect();
        let mut field = Field::new(pairs).consistent(CONSISTENT_M);
        for _ in 0..ROUNDS {
            let found = self.anchors(&self.predicted(&field), moved, REACH_M);
            let grown = Field::new(field.pairs().chain(found).collect()).consistent(CONSISTENT_M);
            let grows = grown.len() as f64 > (1.0 + GROWS) * field.len() as f64;
            field = grown;
            if !grows {
                break;
            }
        }
        for reach_m in REACHES_M {
            let found = self.matched(&self.predicted(&field), moved, reach_m);
            field = Field::new(found).consistent(reach_m / 2.0);
        }
        let predicted = self.predicted(&field);
        predicted.iter().flatten().next()?;
        Some(predicted.into_iter().map(Option::unwrap_or_default).collect())
    }

    /// Returns the displacement of every reference vertex that a field predicts.
    fn predicted(&self, field: &Field) -> Vec<Option<[f64; 2]>> {
        self.places.par_iter().map(|place| field.at(*place, |_| true)).collect()
    }

    /// Returns the vertices that match within `reach_m` of their predicted displacements.
    fn matched(&self, predicted: &[Option<[f64; 2]>], moved: &[[f64; 2]], reach_m: f64) -> Vec<Anchor> {
        let expected = self.expected(predicted);
        let matches = self.matcher(&expected).all(moved, reach_m);
        let displacements = matches.displacements_m(self.coords(), moved, self.ground);
        let known =
            displacements.into_iter().zip(predicted).map(|(found, field)| found.filter(|_| field.is_some()));
        known.enumerate().filter_map(|(vertex, found)| Some(self.anchor(vertex, found?))).collect()
    }

    fn anchor(&self, vertex: usize, displacement_m: [f64; 2]) -> Anchor {
        let group = Group::Polygons(self.reference.polygon_roots[vertex]);
        Anchor { place: self.places[vertex], displacement_m, group }
    }

    fn expected(&self, predicted: &[Option<[f64; 2]>]) -> Vec<[f64; 2]> {
        let all: Vec<[f64; 2]> = predicted.iter().map(|d| d.unwrap_or_default()).collect();
        self.ground.displaced(self.coords(), &all)
    }

    /// Returns the vertices of the groups that are found as a whole within `reach_m` of their
    /// predicted displacements.
    fn anchors(&self, predicted: &[Option<[f64; 2]>], moved: &[[f64; 2]], reach_m: f64) -> Vec<Anchor> {
        let expected = self.expected(predicted);
        let matcher = self.matcher(&expected);
        let shifts = groups::shifts_m(self.reference, &Near::new(&matcher, moved), reach_m);
        let anchor = |(vertex, shift): (usize, Option<[f64; 2]>)| {
            let (shift, predicted) = (shift?, predicted[vertex]?);
            Some(self.anchor(vertex, [0, 1].map(|axis| predicted[axis] + shift[axis])))
        };
        shifts.into_iter().enumerate().filter_map(anchor).collect()
    }

    fn coords(&self) -> &[[f64; 2]] {
        self.reference.vertices.coords()
    }

    fn matcher<'b>(&'b self, places: &'b [[f64; 2]]) -> Matcher<'b> {
        Matcher::new(places, self.ground, self.reference.vertices.centre())
    }
}

/// What an anchor belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Group {
    /// A pair of features, by its number.
    Pair(usize),
    /// A polygon group, by its first vertex.
    Polygons(u32),
}

/// A place of the reference whose displacement is found.
#[derive(Debug, Clone, Copy)]
struct Anchor {
    /// In the plane.
    place: [f64; 2],
    displacement_m: [f64; 2],
    group: Group,
}

/// Found displacements, and those that they predict elsewhere.
struct Field {
    anchors: RTree<GeomWithData<[f64; 2], Anchor>>,
}

impl Field {
    fn new(anchors: Vec<Anchor>) -> Self {
        let node = |anchor: Anchor| GeomWithData::new(anchor.place, anchor);
        Field { anchors: RTree::bulk_load(anchors.into_iter().map(node).collect()) }
    }

    fn len(&self) -> usize {
        self.anchors.size()
    }

    fn pairs(&self) -> impl Iterator<Item = Anchor> {
        self.anchors.iter().map(|node| node.data).filter(|anchor| matches!(anchor.group, Group::Pair(_)))
    }

    /// Removes the anchors that deviate by more than `within_m` from what those of other groups
    /// predict.
    fn consistent(self, within_m: f64) -> Self {
        let is_consistent = |anchor: &Anchor| {
            let predicted = self.at(anchor.place, |other| other.group != anchor.group);
            predicted.is_some_and(|[x, y]| {
                (x - anchor.displacement_m[0]).hypot(y - anchor.displacement_m[1]) <= within_m
            })
        };
        let anchors: Vec<Anchor> = self.anchors.iter().map(|node| node.data).collect();
        Field::new(anchors.into_par_iter().filter(is_consistent).collect())
    }

    /// Predicts the displacement at a place by an affine function of the place, fitted to the
    /// nearest anchors that `is_used` admits.
    fn at(&self, place: [f64; 2], is_used: impl Fn(&Anchor) -> bool) -> Option<[f64; 2]> {
        let near = self.anchors.nearest_neighbor_iter(&place).filter(|node| is_used(&node.data));
        let near: Vec<&Anchor> = near.take(NEIGHBOURS).map(|node| &node.data).collect();
        if near.len() < LEAST_NEIGHBOURS || near[0].distance_m(place) > FARTHEST_M {
            return None;
        }
        let weight = |anchor: &&Anchor| (1.0 + (anchor.distance_m(place) / NEAR_M).powi(2)).powi(-2);
        let nearness: Vec<f64> = near.iter().map(weight).collect();
        let mut weights = nearness.clone();
        let mut solution = Matrix3x2::<f64>::zeros();
        for _ in 0..REWEIGHTED {
            solution = affine(&near, place, &weights)?;
            for ((weight, nearness), anchor) in weights.iter_mut().zip(&nearness).zip(&near) {
                let rest = solution.transpose() * anchor.row(place) - Vector2::from(anchor.displacement_m);
                *weight = nearness / rest.norm().max(LEAST_REST_M);
            }
        }
        Some([solution[(0, 0)], solution[(0, 1)]])
    }
}

impl Anchor {
    fn distance_m(&self, place: [f64; 2]) -> f64 {
        (self.place[0] - place[0]).hypot(self.place[1] - place[1])
    }

    /// Returns 1 and the place relative to another one.
    fn row(&self, place: [f64; 2]) -> Vector3<f64> {
        Vector3::new(1.0, self.place[0] - place[0], self.place[1] - place[1])
    }
}

/// Returns the affine function of the place relative to `place` that fits the displacements of
/// anchors: 3 coefficients for either axis.
fn affine(anchors: &[&Anchor], place: [f64; 2], weights: &[f64]) -> Option<Matrix3x2<f64>> {
    let (mut normal, mut right) = (Matrix3::<f64>::zeros(), Matrix3x2::<f64>::zeros());
    for (anchor, weight) in anchors.iter().zip(weights) {
        let row = anchor.row(place);
        normal += row * row.transpose() * *weight;
        right += row * Vector2::from(anchor.displacement_m).transpose() * *weight;
    }
    // A metre of deviation is as likely as a strain of [`STRAIN`].
    let prior = normal[(0, 0)] / anchors.len() as f64 / STRAIN.powi(2);
    normal[(1, 1)] += prior;
    normal[(2, 2)] += prior;
    Some(normal.cholesky()?.solve(&right))
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshmark_core::map_data::ChainKind;

    /// Returns a number from 0 to 1 that looks random.
    fn random(i: usize) -> f64 {
        ((i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / 2f64.powi(53)
    }

    /// 400 houses of five corners, 25 m apart or more, of different sizes and places.
    fn town(seed: usize) -> MapData {
        let apart_m = (25 + 6 * seed) as f64;
        let corner =
            |i: usize| [[0.0, 0.0], [1.0, 0.0], [1.0, 0.7], [0.4, 1.1], [0.0, 0.7], [0.0, 0.0]][i % 6];
        let house = |i: usize| i / 6 + 1000 * seed;
        let place = |i: usize| [i / 6 % 20, i / 120].map(|index| index as f64 * apart_m);
        let vertex = |i: usize, axis: usize| {
            place(i)[axis]
                + 8.0 * random(2 * house(i) + axis)
                + corner(i)[axis] * (8.0 + 4.0 * random(house(i)))
        };
        let coords = (0..2400).map(|i| [vertex(i, 0), vertex(i, 1)]).collect();
        let starts: Vec<u32> = (0..2400).step_by(6).collect();
        MapData::from_chains(coords, &starts, vec![ChainKind::Shell; 400]).unwrap().0
    }

    /// Waves of 250 m that move places by up to 11 m.
    fn bent([x, y]: [f64; 2]) -> [f64; 2] {
        [x + 8.0 * (y / 40.0 + 1.0).sin(), y + 8.0 * ((x + y / 2.0) / 40.0).sin()]
    }

    #[test]
    fn a_strong_deformation_is_followed_from_some_features_to_nearly_all_vertices() {
        let town = town(0);
        let coords = town.vertices.coords();
        let moved: Vec<[f64; 2]> = coords.iter().map(|p| bent(*p)).collect();
        let pairs = coords.iter().step_by(5).map(|p| [bent(*p), *p]).collect();
        let grown = Growth::new(&town, &Ground::METRES, pairs).grow(&moved).unwrap();
        let miss = |(a, b): &(&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]);
        let found = grown.iter().zip(&moved).filter(|pair| miss(pair) < 1.0).count();
        assert!(found as f64 > 0.7 * coords.len() as f64, "{found} of {}", coords.len());
    }

    #[test]
    fn another_town_is_no_deformation() {
        let (town, other) = (town(0), town(1));
        assert!(Growth::new(&town, &Ground::METRES, Vec::new()).grow(other.vertices.coords()).is_none());
    }
}
