//! Matching within the radius t: mutual nearest neighbours (paper, section 3.5), and for the joint
//! demodulator those among all near vertices whose neighbours along rings and lines match too.

use super::{
    joined::{self, Candidate, Graph},
    matches::Matches,
};
use meshmark_core::ground::Ground;
use rayon::prelude::*;
use rstar::{RTree, primitives::GeomWithData};

/// A vertex in the plane, and its index.
type Node = GeomWithData<[f64; 2], u32>;

/// So many points within a radius are compared one by one, which is faster than a search in order of
/// distance.
const FEW: usize = 8;

/// Finds the suspect vertex of every reference vertex within a radius.
pub struct Matcher<'a> {
    reference: &'a [[f64; 2]],
    ground: &'a Ground,
    /// The plane in which distances are measured: the origin is subtracted from coordinates, then
    /// `x_scale` multiplies x.
    origin: [f64; 2],
    x_scale: f64,
    tree: RTree<Node>,
}

impl<'a> Matcher<'a> {
    /// Indexes the vertices of a reference, CRS units; `centre` is the middle of the map.
    pub fn new(reference: &'a [[f64; 2]], ground: &'a Ground, centre: [f64; 2]) -> Self {
        let mut matcher = Matcher {
            reference,
            ground,
            origin: centre,
            x_scale: ground.x_scale(centre[1]),
            tree: RTree::new(),
        };
        matcher.tree = matcher.tree_of(reference);
        matcher
    }

    /// Matches every reference vertex. `suspect` are vertices in the CRS of the reference;
    /// `radius_m` is in metres.
    pub fn all(&self, suspect: &[[f64; 2]], radius_m: f64) -> Matches {
        self.every(1, suspect, radius_m)
    }

    /// Matches every `step`-th reference vertex.
    pub(crate) fn every(&self, step: usize, suspect: &[[f64; 2]], radius_m: f64) -> Matches {
        self.mutual(step, suspect, &self.tree_of(suspect), radius_m)
    }

    /// Matches every reference vertex. Where several suspect vertices are near, their neighbours
    /// decide. `graphs` are those of the reference and of the suspect.
    pub(crate) fn joined(&self, suspect: &[[f64; 2]], radius_m: f64, graphs: [&Graph; 2]) -> Matches {
        let tree = self.tree_of(suspect);
        let nearest = self.mutual(1, suspect, &tree, radius_m);
        let near = |reference: u32| {
            let within = self.within(&tree, self.reference[reference as usize], radius_m);
            within.map(move |(distance_m, suspect)| Candidate { reference, suspect, distance_m })
        };
        let candidates: Vec<Candidate> =
            (0..self.reference.len() as u32).into_par_iter().flat_map_iter(near).collect();
        joined::choose(nearest, &candidates, graphs[0], graphs[1])
    }

    /// Returns the number of reference vertices.
    pub(crate) fn reference_count(&self) -> usize {
        self.reference.len()
    }

    /// Returns the distance of every match, metres.
    pub(crate) fn distances_m(&self, suspect: &[[f64; 2]], matches: &Matches) -> Vec<f64> {
        let displacements = matches.displacements_m(self.reference, suspect, self.ground);
        displacements.into_iter().flatten().map(|[x, y]| x.hypot(y)).collect()
    }

    fn mutual(&self, step: usize, suspect: &[[f64; 2]], tree: &RTree<Node>, radius_m: f64) -> Matches {
        let mutual = |i: usize| {
            if !i.is_multiple_of(step) {
                return None;
            }
            let there = self.nearest(tree, self.reference[i], radius_m)?;
            let back = self.nearest(&self.tree, suspect[there as usize], radius_m)?;
            (back as usize == i).then_some(there)
        };
        let suspect_of: Vec<Option<u32>> = (0..self.reference.len()).into_par_iter().map(mutual).collect();
        Matches { count: suspect_of.iter().flatten().count(), suspect_of }
    }

    fn tree_of(&self, points: &[[f64; 2]]) -> RTree<Node> {
        let node = |(i, p): (usize, &[f64; 2])| Node::new(self.plane(*p), i as u32);
        RTree::bulk_load(points.iter().enumerate().map(node).collect())
    }

    fn plane(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [(x - self.origin[0]) * self.x_scale, y - self.origin[1]]
    }

    /// Returns the point of `tree` nearest to `from` on the ground, within `radius_m`. The smaller
    /// index wins ties.
    fn nearest(&self, tree: &RTree<Node>, from: [f64; 2], radius_m: f64) -> Option<u32> {
        let nearer = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let mut within = self.within(tree, from, radius_m);
        let best = within.by_ref().take(FEW).min_by(nearer);
        if within.next().is_none() {
            return best.map(|(_, index)| index);
        }
        // The nearest point of the plane bounds the distance, so that a heap of points costs nothing.
        let [mx, my] = self.ground.metres_per_unit(from);
        let (at, near) = (self.plane(from), tree.nearest_neighbor(&self.plane(from))?.geom());
        let bound_m = ((near[0] - at[0]) * mx / self.x_scale).hypot((near[1] - at[1]) * my);
        let within = self.within(tree, from, radius_m.min(bound_m * (1.0 + 1e-9)));
        within.min_by(nearer).map(|(_, index)| index)
    }

    /// Returns the points of `tree` within `radius_m` of `from` on the ground, each as its distance
    /// in metres and its index.
    fn within(&self, tree: &RTree<Node>, from: [f64; 2], radius_m: f64) -> impl Iterator<Item = (f64, u32)> {
        let [mx, my] = self.ground.metres_per_unit(from);
        let scale = [mx / self.x_scale, my]; // metres per unit of the plane
        let reach = radius_m / scale[0].min(scale[1]);
        let at = self.plane(from);
        let distance = move |node: &Node| {
            let [x, y] = node.geom();
            (((x - at[0]) * scale[0]).hypot((y - at[1]) * scale[1]), node.data)
        };
        let candidates = tree.locate_within_distance(at, reach * reach * (1.0 + 1e-12));
        candidates.map(distance).filter(move |(d, _)| *d <= radius_m)
    }
}

/// The vertices of a suspect near those of its reference.
pub(crate) struct Near<'a> {
    matcher: &'a Matcher<'a>,
    suspect: &'a [[f64; 2]],
    tree: RTree<Node>,
}

impl<'a> Near<'a> {
    /// Indexes the vertices of a suspect in the CRS of the reference.
    pub fn new(matcher: &'a Matcher<'a>, suspect: &'a [[f64; 2]]) -> Self {
        Near { matcher, suspect, tree: matcher.tree_of(suspect) }
    }

    /// Returns the displacements to at most `most` suspect vertices within `radius_m` of a
    /// reference vertex, metres.
    pub fn displacements_m(&self, vertex: u32, radius_m: f64, most: usize) -> Vec<[f64; 2]> {
        let from = self.matcher.reference[vertex as usize];
        let within = self.matcher.within(&self.tree, from, radius_m).take(most);
        within.map(|(_, s)| self.matcher.ground.metres_between(from, self.suspect[s as usize])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn t_is_a_radius_and_one_suspect_vertex_serves_one_reference_vertex() {
        let reference = [[0.0, 0.0], [0.6, 0.0], [10.0, 0.0], [20.0, 0.0]];
        let suspect = [[0.5, 0.0], [10.0, 0.99], [20.0, 1.01]];
        let matches = Matcher::new(&reference, &Ground::METRES, [10.0, 0.0]).all(&suspect, 1.0);
        assert_eq!(matches.suspect_of, [None, Some(0), Some(1), None]);
        assert_eq!(matches.count, 2);
    }

    #[test]
    fn the_radius_is_in_metres_at_every_latitude() {
        let ground = Ground::WGS84;
        // The points are two thirds of a metre east of points on the equator and at 70° N.
        let reference = [[10.0, 0.0], [10.0, 70.0]];
        let east = |p: [f64; 2]| [p[0] + 2.0 / 3.0 / ground.metres_per_unit(p)[0], p[1]];
        let matcher = Matcher::new(&reference, &ground, [10.0, 35.0]);
        assert_eq!(matcher.all(&reference.map(east), 0.7).count, 2);
        assert_eq!(matcher.all(&reference.map(east), 0.6).count, 0);
    }

    #[test]
    fn a_heap_of_vertices_is_matched_as_few_of_them_are() {
        let reference: Vec<[f64; 2]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20)]).collect();
        let heap = (0..200_000).map(|i| [10.2 + f64::from(i) * 1e-7, 10.3 + f64::from(i % 317) * 1e-7]);
        let few: Vec<[f64; 2]> = reference.iter().map(|p| [p[0] + 0.1, p[1] - 0.05]).collect();
        let all: Vec<[f64; 2]> = few.iter().copied().chain(heap).collect();
        let matcher = Matcher::new(&reference, &Ground::METRES, [10.0, 10.0]);
        assert_eq!(matcher.all(&all, 6.0).suspect_of, matcher.all(&few, 6.0).suspect_of);
    }
}
