//! Corners: displacements of reference vertices whose own vertices a suspect no longer has. Edges
//! that meet at an angle, each with its offset, determine the displacement of the vertex between
//! them.
//!
//! The displacements of all vertices are those of greatest posterior density, given the offsets of
//! all edges: a sparse system of linear equations. No key is involved.

use crate::{
    edges::{self, Offset, Tolerance},
    linework::{Edge, Plane},
};
use meshmark_core::{ground::Ground, map_data::MapData};
use rstar::RTree;

/// Lines that are old edges to the millimetre, lines drawn by a careful hand, and coarse ones.
pub const TOLERANCES: [Tolerance; 3] = [
    Tolerance { width_m: 0.02, slope: 0.05, covered: 0.08 },
    Tolerance { width_m: 0.12, slope: 0.2, covered: 0.4 },
    Tolerance { width_m: 0.35, slope: 0.4, covered: 0.5 },
];

/// A displacement has about this standard deviation before anything is observed, metres.
const PRIOR_M: f64 = 0.5;
/// Residuals of an edge are no smaller than this, metres.
const LEAST_RESIDUAL_M: f64 = 0.005;
/// The mean square residual of all edges counts as much as this weight of the residuals of an edge.
const COMMON: f64 = 2.0;
/// A less certain displacement is none, metres.
const MOST_DEVIATION_M: f64 = 0.3;
/// The edges of a vertex that leave a direction with less than this share of the information are
/// too parallel: the angle between two is less than about 25°.
const LEAST_SHARE: f64 = 0.05;
/// A displacement with this standard deviation weighs half of a certain one, metres.
const HALF_WEIGHT_M: f64 = 0.1;
/// Steps of the conjugate gradients.
const STEPS: usize = 100;
/// They end when the residual is this share of the right-hand side.
const CONVERGED: f64 = 1e-6;

/// The displacements of vertices between edges.
#[derive(Debug, Clone, PartialEq)]
pub struct Corners {
    /// The displacement of every reference vertex, metres; `None` where the edges do not determine
    /// it.
    pub displacement_m: Vec<Option<[f64; 2]>>,
    /// The weight of every reference vertex: 1, or less where its edges determine it poorly.
    pub weights: Vec<f64>,
}

/// Two maps whose lines are compared.
pub struct Lines<'a> {
    reference: &'a MapData,
    plane: Plane,
    /// The lines of the suspect.
    tree: RTree<Edge>,
}

impl<'a> Lines<'a> {
    /// Prepares a reference and its suspect; `moved` are the vertices of the suspect in reference
    /// coordinates.
    pub fn new((reference, suspect): (&'a MapData, &MapData), ground: &Ground, moved: &[[f64; 2]]) -> Self {
        let plane = Plane::new(ground, reference.vertices.centre());
        let tree = plane.tree(moved, suspect.segments.iter().copied());
        Lines { reference, plane, tree }
    }

    /// Returns the displacements of the vertices of the reference, moved by `shift_m`, that follow
    /// from the lines of the suspect within `reach_m`.
    pub fn corners(&self, shift_m: [f64; 2], reach_m: f64, tolerance: &Tolerance) -> Corners {
        let offsets = edges::offsets((self.reference, shift_m), &self.plane, &self.tree, reach_m, tolerance);
        System::new(self.reference.vertices.len(), &offsets).corners()
    }
}

impl Corners {
    /// Returns the number of displacements.
    pub fn count(&self) -> usize {
        self.displacement_m.iter().flatten().count()
    }
}

/// An edge in the equations of the displacements.
struct Term {
    ends: [usize; 2],
    normal: [f64; 2],
    /// The information about the offsets of the ends: first end, both, second end.
    information: [f64; 3],
}

/// The normal equations of the displacements.
struct System {
    terms: Vec<Term>,
    /// The diagonal blocks: xx, xy, yy.
    blocks: Vec<[f64; 3]>,
    right: Vec<[f64; 2]>,
    /// The information about each vertex when its neighbours are unknown.
    own: Vec<[f64; 3]>,
}

impl System {
    fn new(vertices: usize, offsets: &[Offset]) -> Self {
        let prior = PRIOR_M.powi(-2);
        let mut system = System {
            terms: Vec::with_capacity(offsets.len()),
            blocks: vec![[prior, 0.0, prior]; vertices],
            right: vec![[0.0; 2]; vertices],
            own: vec![[0.0; 3]; vertices],
        };
        let mut residuals: Vec<f64> = offsets.iter().map(|offset| offset.residual2).collect();
        if residuals.is_empty() {
            return system;
        }
        let middle = residuals.len() / 2;
        let common2 = *residuals.select_nth_unstable_by(middle, f64::total_cmp).1;
        for offset in offsets {
            let residual2 = (offset.weight * offset.residual2 + COMMON * common2) / (offset.weight + COMMON);
            let scale = 1.0 / (residual2 + LEAST_RESIDUAL_M.powi(2));
            system.add(offset, scale);
        }
        system
    }

    fn add(&mut self, offset: &Offset, scale: f64) {
        let ends = offset.ends.map(|vertex| vertex as usize);
        let [x, y] = offset.normal;
        let outer = [x * x, x * y, y * y];
        let information = offset.products.map(|product| scale * product);
        let [first, both, second] = information;
        let prior = PRIOR_M.powi(-2);
        let sides = [(first, second), (second, first)];
        for (end, (here, there)) in sides.into_iter().enumerate() {
            let own = here - both * both / (there + prior);
            let vertex = ends[end];
            (0..3).for_each(|i| self.blocks[vertex][i] += here * outer[i]);
            (0..3).for_each(|i| self.own[vertex][i] += own * outer[i]);
            (0..2).for_each(|i| self.right[vertex][i] += scale * offset.sums[end] * offset.normal[i]);
        }
        self.terms.push(Term { ends, normal: offset.normal, information });
    }

    fn corners(self) -> Corners {
        let displacement = self.solve();
        let deviation = |own: &[f64; 3]| {
            let [smallest, largest] = eigenvalues(*own);
            (smallest > LEAST_SHARE * largest).then(|| 1.0 / smallest.sqrt())
        };
        let deviations: Vec<Option<f64>> =
            self.own.iter().map(|own| deviation(own).filter(|m| *m < MOST_DEVIATION_M)).collect();
        let known = displacement.into_iter().zip(&deviations);
        let weight = |m: &Option<f64>| m.map_or(1.0, |m| 1.0 / (1.0 + (m / HALF_WEIGHT_M).powi(2)));
        Corners {
            displacement_m: known.map(|(d, deviation)| deviation.map(|_| d)).collect(),
            weights: deviations.iter().map(weight).collect(),
        }
    }

    /// Solves the equations by conjugate gradients, preconditioned by the diagonal blocks.
    fn solve(&self) -> Vec<[f64; 2]> {
        let mut solution = vec![[0.0; 2]; self.right.len()];
        let mut rest = self.right.clone();
        let mut direction = self.precondition(&rest);
        let mut energy = dot(&rest, &direction);
        let enough = energy * CONVERGED.powi(2);
        for _ in 0..STEPS {
            if energy <= enough {
                break;
            }
            let product = self.multiply(&direction);
            let step = energy / dot(&direction, &product);
            add(&mut solution, step, &direction);
            add(&mut rest, -step, &product);
            let next = self.precondition(&rest);
            let energy_before = std::mem::replace(&mut energy, dot(&rest, &next));
            let keep = energy / energy_before;
            direction.iter_mut().zip(&next).for_each(|(d, n)| *d = [0, 1].map(|i| n[i] + keep * d[i]));
        }
        solution
    }

    fn precondition(&self, vector: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let solve = |([a, b, c], [x, y]): (&[f64; 3], &[f64; 2])| {
            let determinant = a * c - b * b;
            [(c * x - b * y) / determinant, (a * y - b * x) / determinant]
        };
        self.blocks.iter().zip(vector).map(solve).collect()
    }

    fn multiply(&self, vector: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let block = |([a, b, c], [x, y]): (&[f64; 3], &[f64; 2])| [a * x + b * y, b * x + c * y];
        let mut product: Vec<[f64; 2]> = self.blocks.iter().zip(vector).map(block).collect();
        for Term { ends, normal, information } in &self.terms {
            let across = ends.map(|vertex| normal[0] * vector[vertex][0] + normal[1] * vector[vertex][1]);
            for (end, vertex) in ends.iter().enumerate() {
                (0..2).for_each(|i| product[*vertex][i] += information[1] * across[1 - end] * normal[i]);
            }
        }
        product
    }
}

/// Returns the eigenvalues of the symmetric matrix xx, xy, yy, the smaller one first.
fn eigenvalues([a, b, c]: [f64; 3]) -> [f64; 2] {
    let (mean, spread) = ((a + c) / 2.0, ((a - c) / 2.0).hypot(b));
    [mean - spread, mean + spread]
}

fn dot(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}

fn add(sum: &mut [[f64; 2]], factor: f64, vector: &[[f64; 2]]) {
    sum.as_flattened_mut().iter_mut().zip(vector.as_flattened()).for_each(|(s, v)| *s += factor * v);
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshmark_core::map_data::ChainKind;

    const REACH_M: f64 = 1.5;

    fn rings(rings: &[Vec<[f64; 2]>]) -> MapData {
        let mut coords: Vec<[f64; 2]> = Vec::new();
        let mut starts = Vec::new();
        for ring in rings {
            starts.push(coords.len() as u32);
            coords.extend(ring.iter().chain(ring.first()));
        }
        MapData::from_chains(coords, &starts, vec![ChainKind::Shell; rings.len()]).unwrap().0
    }

    fn line(places: Vec<[f64; 2]>) -> MapData {
        MapData::from_chains(places, &[0], [ChainKind::Line]).unwrap().0
    }

    /// 100 houses, 30 m apart, each turned by an angle of its own.
    fn town() -> Vec<Vec<[f64; 2]>> {
        let house = |i: usize| {
            let (sin, cos) = (i as f64).sin_cos();
            let corner = |[x, y]: [f64; 2]| {
                [x * cos - y * sin + (i % 10 * 30) as f64, x * sin + y * cos + (i / 10 * 30) as f64]
            };
            [[0.0, 0.0], [12.0, 0.0], [12.0, 5.0], [7.0, 5.0], [7.0, 9.0], [0.0, 9.0]].map(corner).to_vec()
        };
        (0..100).map(house).collect()
    }

    /// A smooth displacement of some decimetres.
    fn displacement([x, y]: [f64; 2]) -> [f64; 2] {
        [0.3 * (x / 40.0).sin() + 0.1, 0.25 * (y / 30.0).cos() - 0.1]
    }

    fn displaced(ring: &[[f64; 2]]) -> Vec<[f64; 2]> {
        ring.iter().map(|p| [p[0] + displacement(*p)[0], p[1] + displacement(*p)[1]]).collect()
    }

    /// Returns places on the sides of a ring, 1.7 m apart, without its vertices.
    fn resampled(ring: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let sides = ring.iter().zip(ring.iter().cycle().skip(1));
        let side = |(a, b): (&[f64; 2], &[f64; 2])| {
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let (from, to) = (*a, *b);
            let count = (length / 1.7) as usize;
            (0..count)
                .map(move |i| (0.6 + 1.7 * i as f64) / length)
                .map(move |share| [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis])))
        };
        sides.flat_map(side).collect()
    }

    fn drawn_anew() -> Vec<Vec<[f64; 2]>> {
        town().iter().map(|ring| resampled(&displaced(ring))).collect()
    }

    fn found(reference: &MapData, suspect: &MapData, tolerance: &Tolerance) -> Corners {
        let lines = Lines::new((reference, suspect), &Ground::METRES, suspect.vertices.coords());
        lines.corners([0.0; 2], REACH_M, tolerance)
    }

    /// Returns how far each displacement found is from the right one, metres.
    fn misses(reference: &MapData, corners: &Corners) -> Vec<f64> {
        let each = reference.vertices.coords().iter().zip(&corners.displacement_m);
        let miss = |(place, found): (&[f64; 2], &Option<[f64; 2]>)| {
            let ([x, y], right) = ((*found)?, displacement(*place));
            Some((x - right[0]).hypot(y - right[1]))
        };
        each.filter_map(miss).collect()
    }

    #[test]
    fn corners_of_lines_drawn_anew_come_back_without_one_old_vertex() {
        let (reference, suspect) = (rings(&town()), rings(&drawn_anew()));
        let corners = found(&reference, &suspect, &TOLERANCES[0]);
        let mut misses = misses(&reference, &corners);
        assert!(misses.len() > 550, "{} of 600", misses.len());
        misses.sort_by(f64::total_cmp);
        assert!(misses[misses.len() * 9 / 10] < 0.02, "{misses:?}");
        assert!(corners.weights.iter().all(|weight| *weight > 0.0 && *weight <= 1.0));
    }

    #[test]
    fn a_wide_tolerance_reads_lines_of_an_unsteady_hand() {
        let error = |[x, y]: [f64; 2], axis: usize| 0.25 * ((x * 7.3 + y * 9.1 + axis as f64) * 43.7).sin();
        let unsteady = |ring: &Vec<[f64; 2]>| -> Vec<[f64; 2]> {
            ring.iter().map(|p| [p[0] + error(*p, 0), p[1] + error(*p, 1)]).collect()
        };
        let large = |ring: &Vec<[f64; 2]>| ring.iter().map(|p| p.map(|x| 3.0 * x)).collect();
        let halls: Vec<Vec<[f64; 2]>> = town().iter().map(large).collect();
        let drawn: Vec<Vec<[f64; 2]>> =
            halls.iter().map(|ring| unsteady(&resampled(&displaced(ring)))).collect();
        let (reference, suspect) = (rings(&halls), rings(&drawn));
        let [narrow, _, wide] = TOLERANCES.each_ref().map(|tolerance| found(&reference, &suspect, tolerance));
        let typical_m = |corners: &Corners| {
            let mut misses = misses(&reference, corners);
            misses.sort_by(f64::total_cmp);
            misses[misses.len() / 2]
        };
        assert!(wide.count() > narrow.count(), "{} {}", wide.count(), narrow.count());
        assert!(typical_m(&wide) < 0.15, "{} {}", typical_m(&wide), typical_m(&narrow));
    }

    #[test]
    fn a_straight_line_shows_its_bend_and_no_vertex_between() {
        let places = |shift: f64, spacing: f64, from: f64| {
            let steps = (40.0 / spacing) as usize;
            let east = (0..steps).map(|i| [from + spacing * i as f64, shift]);
            let north = (0..steps).map(|i| [40.0 - shift, from + spacing * i as f64]);
            east.chain(north).collect::<Vec<_>>()
        };
        let reference = line([places(0.0, 10.0, 0.0), vec![[40.0, 40.0]]].concat());
        let suspect = line(places(0.2, 3.0, 1.3));
        let corners = found(&reference, &suspect, &TOLERANCES[0]);
        for (place, displacement) in reference.vertices.coords().iter().zip(&corners.displacement_m) {
            assert_eq!(displacement.is_some(), *place == [40.0, 0.0], "{place:?} {displacement:?}");
        }
        let [x, y] = corners.displacement_m.into_iter().flatten().next().unwrap();
        assert!((x + 0.2).abs() < 0.01 && (y - 0.2).abs() < 0.01, "{x} {y}");
    }

    #[test]
    fn a_foreign_map_and_a_map_out_of_place_show_few_corners() {
        let (reference, suspect) = (rings(&town()), rings(&drawn_anew()));
        let turned: Vec<Vec<[f64; 2]>> =
            drawn_anew().iter().map(|ring| ring.iter().map(|[x, y]| [*y, 285.0 - *x]).collect()).collect();
        for tolerance in &TOLERANCES {
            let right = found(&reference, &suspect, tolerance).count();
            assert!(found(&reference, &rings(&turned), tolerance).count() < right / 10);
            let lines = Lines::new((&reference, &suspect), &Ground::METRES, suspect.vertices.coords());
            assert!(lines.corners([11.0, -7.7], REACH_M, tolerance).count() < right / 10);
        }
        let points = MapData::of_points(suspect.vertices.clone());
        assert_eq!(found(&reference, &points, &TOLERANCES[0]).count(), 0);
        assert_eq!(found(&points, &suspect, &TOLERANCES[0]).count(), 0);
    }

    #[test]
    fn a_heap_of_lines_in_one_place_spoils_that_place_alone() {
        let (reference, mut suspect) = (rings(&town()), drawn_anew());
        let scribble =
            |i: usize| [(i * 7919 % 1009) as f64 / 60.0 - 4.0, (i * 104_729 % 1013) as f64 / 60.0 - 4.0];
        suspect.push((0..100_000).map(scribble).collect());
        let corners = found(&reference, &rings(&suspect), &TOLERANCES[0]);
        let near = misses(&reference, &corners).iter().filter(|miss| **miss < 0.02).count();
        assert!(near > 500, "{near} of 600");
    }

    #[test]
    fn an_edge_across_the_map_is_read_among_many_lines() {
        let mut reference = town();
        let across = vec![[-500.0, -500.0], [900.0, 900.0], [900.0, -500.0]];
        reference.push(across.clone());
        let mut suspect = drawn_anew();
        suspect.push(resampled(&displaced(&across)));
        let reference = rings(&reference);
        let corners = found(&reference, &rings(&suspect), &TOLERANCES[0]);
        let of = |corner: &[f64; 2]| {
            let vertex = reference.vertices.coords().iter().position(|place| place == corner).unwrap();
            (corners.displacement_m[vertex].unwrap(), displacement(*corner))
        };
        for ([x, y], right) in across.iter().map(of) {
            assert!((x - right[0]).hypot(y - right[1]) < 0.03, "{x} {y} {right:?}");
        }
    }
}
