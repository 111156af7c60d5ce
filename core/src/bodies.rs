//! Rigid bodies: polygons that share vertices or walls move as one, shifted and turned but not
//! bent.

use crate::{disjoint_sets::DisjointSets, map::Map};
use std::collections::BTreeMap;

/// A group of polygons with more vertices stays free: as one body it would carry as little as one
/// building.
pub const MOST_VERTICES: usize = 60;

/// The groups of polygons that move as one.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bodies {
    bodies: Vec<Body>,
    /// For every vertex the number of its body, or [`FREE`]; empty without bodies.
    number: Vec<u32>,
}

const FREE: u32 = u32::MAX;

/// A group of polygons.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Canonical indices of its vertices, ascending.
    pub members: Vec<u32>,
    /// The vector from the mean of all vertices to each of them, metres.
    pub arms_m: Vec<[f64; 2]>,
    /// Metres per CRS unit along x and y.
    pub scale: [f64; 2],
}

/// A rigid motion.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Motion {
    /// The shift of the mean of the vertices, metres.
    pub shift_m: [f64; 2],
    /// The turn about that mean, radians.
    pub turn: f64,
}

impl Bodies {
    /// Finds the groups of polygons of `map`. `touching` are vertices that lie on segments: a
    /// corner on the wall of another polygon joins the two.
    pub(crate) fn find(map: &Map, touching: impl Iterator<Item = (u32, [u32; 2])>) -> Self {
        let in_polygon = sizes(map.polygon_roots);
        let mut groups = DisjointSets::new(map.polygon_roots.len());
        (0..).zip(map.polygon_roots).for_each(|(v, &first)| groups.join(v, first));
        for (vertex, [a, b]) in touching {
            let wall = map.polygon_roots[a as usize] == map.polygon_roots[b as usize];
            if wall && [vertex, a].iter().all(|&v| in_polygon[map.polygon_roots[v as usize] as usize] > 1) {
                groups.join(vertex, a);
            }
        }
        let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let mut number = vec![FREE; map.polygon_roots.len()];
        (0..).zip(groups.roots()).for_each(|(v, root)| members.entry(root).or_default().push(v));
        let groups = members.into_values().filter(|members| (2..=MOST_VERTICES).contains(&members.len()));
        let bodies: Vec<Body> = groups.map(|members| Body::new(map, members)).collect();
        for (body, Body { members, .. }) in bodies.iter().enumerate() {
            members.iter().for_each(|&v| number[v as usize] = body as u32);
        }
        Bodies { bodies, number }
    }

    /// Returns the bodies that are kept, and the others.
    pub(crate) fn divide(self, is_kept: impl Fn(&Body) -> bool) -> (Self, Vec<Body>) {
        let Bodies { bodies, mut number } = self;
        let (kept, others): (Vec<Body>, Vec<Body>) = bodies.into_iter().partition(is_kept);
        others.iter().flat_map(|body| &body.members).for_each(|&v| number[v as usize] = FREE);
        for (new, body) in kept.iter().enumerate() {
            body.members.iter().for_each(|&v| number[v as usize] = new as u32);
        }
        (Bodies { bodies: kept, number }, others)
    }

    /// Returns all bodies; the position of a body is its number.
    pub fn as_slice(&self) -> &[Body] {
        &self.bodies
    }

    /// Returns the number of the body a vertex belongs to.
    pub fn number_at(&self, vertex: u32) -> Option<usize> {
        self.number.get(vertex as usize).filter(|number| **number != FREE).map(|number| *number as usize)
    }
}

/// Counts, for every vertex, the vertices whose polygon root it is.
fn sizes(first: &[u32]) -> Vec<u32> {
    let mut sizes = vec![0; first.len()];
    first.iter().for_each(|&v| sizes[v as usize] += 1);
    sizes
}

impl Body {
    pub(crate) fn new(map: &Map, members: Vec<u32>) -> Self {
        let origin = map.at(members[0]);
        let scale = map.ground.metres_per_unit(origin);
        let at: Vec<[f64; 2]> = members
            .iter()
            .map(|&v| [0, 1].map(|axis| (map.at(v)[axis] - origin[axis]) * scale[axis]))
            .collect();
        let mean = mean(&at);
        let arms_m = at.iter().map(|p| [p[0] - mean[0], p[1] - mean[1]]).collect();
        Body { members, arms_m, scale }
    }

    /// Returns the rigid motion nearest to displacements of the vertices (metres). It is linear in
    /// them, as turns are small.
    pub(crate) fn nearest_motion(&self, displacements_m: &[[f64; 2]]) -> Motion {
        let turned =
            self.arms_m.iter().zip(displacements_m).map(|(r, d)| r[0] * d[1] - r[1] * d[0]).sum::<f64>();
        let turn = if self.inertia() > 0.0 { turned / self.inertia() } else { 0.0 };
        Motion { shift_m: mean(displacements_m), turn }
    }

    /// Returns the displacement of every vertex under a motion, metres. The turn is a true
    /// rotation, not its linear part.
    pub(crate) fn displacements_m(&self, motion: &Motion) -> impl Iterator<Item = [f64; 2]> {
        let (sin, versine) = (motion.turn.sin(), 2.0 * (motion.turn / 2.0).sin().powi(2));
        let [x, y] = motion.shift_m;
        self.arms_m.iter().map(move |r| [x - versine * r[0] - sin * r[1], y + sin * r[0] - versine * r[1]])
    }

    /// Shrinks a motion until no vertex moves further than `tolerance_m`.
    pub(crate) fn within(&self, motion: Motion, tolerance_m: f64) -> Motion {
        let furthest =
            |motion: &Motion| self.displacements_m(motion).map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
        let mut limited = motion;
        while furthest(&limited) > tolerance_m {
            limited = limited.times(tolerance_m / furthest(&limited) * (1.0 - 1e-9));
        }
        limited
    }

    /// Returns Σ |r|², square metres.
    pub(crate) fn inertia(&self) -> f64 {
        self.arms_m.iter().map(|[x, y]| x * x + y * y).sum()
    }
}

impl Motion {
    pub(crate) fn times(self, factor: f64) -> Self {
        Motion { shift_m: self.shift_m.map(|shift| factor * shift), turn: factor * self.turn }
    }
}

fn mean(points: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ground::Ground, vertices::VertexTable};

    fn bodies(polygon_roots: &[u32], touching: &[(u32, [u32; 2])]) -> Vec<Vec<u32>> {
        let coords = (0..polygon_roots.len()).map(|i| [i as f64, (i * i) as f64]).collect();
        let vertices = VertexTable::new(coords).unwrap();
        let ground = Ground::METRES;
        let map =
            Map { vertices: &vertices, segments: &[], polygon_roots, ..Map::of_points(&vertices, &ground) };
        let found = Bodies::find(&map, touching.iter().copied());
        found.as_slice().iter().map(|body| body.members.clone()).collect()
    }

    #[test]
    fn polygons_are_one_body_when_a_corner_is_on_a_wall_but_not_when_a_line_is() {
        let roots = [0, 0, 0, 3, 3, 3, 6, 7];
        assert_eq!(bodies(&roots, &[]), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(bodies(&roots, &[(6, [0, 1]), (5, [6, 7])]), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(bodies(&roots, &[(5, [0, 1])]), [[0, 1, 2, 3, 4, 5]]);
    }

    #[test]
    fn a_group_too_large_stays_free() {
        assert_eq!(bodies(&[0; MOST_VERTICES], &[]).len(), 1);
        assert_eq!(bodies(&[0; MOST_VERTICES + 1], &[]).len(), 0);
    }

    #[test]
    fn the_nearest_motion_to_a_small_rigid_one_is_that_one() {
        let body = Body {
            members: vec![0, 1, 2],
            arms_m: vec![[-3.0, -1.0], [1.0, 4.0], [2.0, -3.0]],
            scale: [1.0, 1.0],
        };
        let motion = Motion { shift_m: [0.1, -0.2], turn: 1e-5 };
        let found = body.nearest_motion(&body.displacements_m(&motion).collect::<Vec<_>>());
        assert!((found.turn - motion.turn).abs() < 1e-12);
        assert!((0..2).all(|axis| (found.shift_m[axis] - motion.shift_m[axis]).abs() < 1e-9));
    }
}
