//! Shifts of polygon groups: the shift of a building as a whole. No key is involved.
//!
//! Every pair of a group's vertex and a suspect vertex near it votes for the shift between them (a
//! generalised Hough transform, Ballard 1981). A group that moved as a whole has one shift with the
//! votes of nearly all its vertices, however far it moved and whatever its neighbours did.

use crate::matching::Near;
use meshmark_core::map_data::MapData;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Votes this near each other, metres on either axis, are for the same shift.
const CELL_M: f64 = 0.5;
/// The vertices of a group that must agree on a shift.
const LEAST_SHARE: f64 = 0.7;
const LEAST_VERTICES: usize = 3;
/// A shift is taken only when those with as many votes are this many times longer.
const CLEARLY_NEARER: f64 = 1.5;
/// Larger groups are represented by this many vertices, and a vertex by this many neighbours.
const MOST_VERTICES: usize = 64;
const MOST_NEIGHBOURS: usize = 128;

/// Returns the shift of every reference vertex with its polygon group, at most `reach_m`, metres;
/// `None` where there is no group or its shift is unclear.
pub fn shifts_m(reference: &MapData, near: &Near, reach_m: f64) -> Vec<Option<[f64; 2]>> {
    let mut groups: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    (0..).zip(&reference.polygon_roots).for_each(|(v, &root)| groups.entry(root).or_default().push(v));
    groups.retain(|_, vertices| vertices.len() >= LEAST_VERTICES);
    let groups: Vec<Vec<u32>> = groups.into_values().collect();
    let shifts: Vec<Option<[f64; 2]>> =
        groups.par_iter().map(|vertices| shift_m(vertices, near, reach_m)).collect();
    let mut of_vertex = vec![None; reference.vertices.len()];
    for (vertices, shift) in groups.iter().zip(shifts) {
        vertices.iter().for_each(|&vertex| of_vertex[vertex as usize] = shift);
    }
    of_vertex
}

/// Returns the shift on which the vertices of a group agree.
fn shift_m(vertices: &[u32], near: &Near, reach_m: f64) -> Option<[f64; 2]> {
    let step = vertices.len().div_ceil(MOST_VERTICES);
    let asked: Vec<Vec<[f64; 2]>> =
        vertices.iter().step_by(step).map(|&v| near.displacements_m(v, reach_m, MOST_NEIGHBOURS)).collect();
    let needed = ((LEAST_SHARE * asked.len() as f64).ceil() as usize).max(LEAST_VERTICES);
    let mut peaks: Vec<(usize, [f64; 2])> = cells(&asked)
        .into_iter()
        .map(|at| agreed(&asked, at))
        .filter(|(votes, _)| *votes >= needed)
        .collect();
    peaks.sort_by(|(a, p), (b, q)| b.cmp(a).then(length(*p).total_cmp(&length(*q))));
    let &(most, best) = peaks.first()?;
    let far = |p: &[f64; 2]| length([p[0] - best[0], p[1] - best[1]]) > 2.0 * CELL_M;
    let rival = peaks.iter().filter(|(votes, p)| *votes + 1 >= most && far(p)).map(|(_, p)| length(*p));
    let nearest_rival = rival.fold(f64::INFINITY, f64::min);
    (nearest_rival > CLEARLY_NEARER * length(best)).then_some(best)
}

/// Returns the middles of the cells with many votes, each vertex counted once, in their order.
fn cells(asked: &[Vec<[f64; 2]>]) -> Vec<[f64; 2]> {
    let mut votes: BTreeMap<[i32; 2], (usize, usize)> = BTreeMap::new();
    for (vertex, displacements) in asked.iter().enumerate() {
        for displacement in displacements {
            let cell = displacement.map(|value| (value / CELL_M).floor() as i32);
            // A shift near the border of a cell has votes on both sides.
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1), (-1, 0), (0, -1), (-1, -1), (1, -1), (-1, 1)] {
                let (count, last) = votes.entry([cell[0] + dx, cell[1] + dy]).or_insert((0, usize::MAX));
                if *last != vertex {
                    (*count, *last) = (*count + 1, vertex);
                }
            }
        }
    }
    let needed = (LEAST_SHARE * asked.len() as f64) as usize;
    let middle = |cell: [i32; 2]| cell.map(|index| (f64::from(index) + 0.5) * CELL_M);
    votes.into_iter().filter(|(_, (count, _))| *count >= needed).map(|(cell, _)| middle(cell)).collect()
}

/// Returns the number of vertices with a displacement near `at`, and the mean of these.
fn agreed(asked: &[Vec<[f64; 2]>], at: [f64; 2]) -> (usize, [f64; 2]) {
    let mut at = at;
    let mut count = 0;
    for _ in 0..3 {
        let away = |d: &[f64; 2]| length([d[0] - at[0], d[1] - at[1]]);
        let nearest = asked.iter().filter_map(|displacements| {
            displacements.iter().min_by(|a, b| away(a).total_cmp(&away(b))).filter(|d| away(d) <= CELL_M)
        });
        let (votes, sum) = nearest.fold((0, [0.0; 2]), |(n, sum), d| (n + 1, [sum[0] + d[0], sum[1] + d[1]]));
        if votes == 0 {
            return (0, at);
        }
        (count, at) = (votes, sum.map(|total| total / votes as f64));
    }
    (count, at)
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matching::Matcher;
    use meshmark_core::{ground::Ground, map_data::ChainKind};

    /// Houses of five corners and of different sizes, 20 m apart.
    fn town() -> MapData {
        let size = |house: usize| 7.0 + (house % 7) as f64 * 0.8;
        let corner =
            |i: usize| [[0.0, 0.0], [1.0, 0.0], [1.0, 0.7], [0.4, 1.1], [0.0, 0.7], [0.0, 0.0]][i % 6];
        let place = |house: usize| [(house % 10 * 20) as f64, (house / 10 * 20) as f64];
        let coords = (0..600).map(|i| [0, 1].map(|a| corner(i)[a] * size(i / 6) + place(i / 6)[a])).collect();
        let starts: Vec<u32> = (0..600).step_by(6).collect();
        MapData::from_chains(coords, &starts, vec![ChainKind::Shell; 100]).unwrap().0
    }

    #[test]
    fn a_house_that_went_elsewhere_is_found_there_and_scattered_vertices_are_not() {
        let town = town();
        let coords = town.vertices.coords();
        let matcher = Matcher::new(coords, &Ground::METRES, town.vertices.centre());
        let shift = |root: u32| [f64::from(root % 11) * 0.7 - 3.5, f64::from(root % 7) * 0.8 - 2.4];
        let moved: Vec<[f64; 2]> = (coords.iter().zip(&town.polygon_roots))
            .map(|(p, &root)| [p[0] + shift(root)[0], p[1] + shift(root)[1]])
            .collect();
        let found = shifts_m(&town, &Near::new(&matcher, &moved), 7.0);
        let right = |(found, &root): (&Option<[f64; 2]>, &u32)| {
            found.is_some_and(|f| length([f[0] - shift(root)[0], f[1] - shift(root)[1]]) < 0.01)
        };
        let count = found.iter().zip(&town.polygon_roots).filter(|pair| right(*pair)).count();
        assert!(count >= 450 && found.iter().flatten().count() <= count + 5, "{count}");

        let scatter =
            |i: usize| [0, 1].map(|a| coords[i][a] + ((i * (31 + 16 * a)) % 101) as f64 / 17.0 - 3.0);
        let scattered: Vec<[f64; 2]> = (0..coords.len()).map(scatter).collect();
        let found = shifts_m(&town, &Near::new(&matcher, &scattered), 7.0);
        assert!(found.iter().flatten().count() < 50, "{}", found.iter().flatten().count());
    }
}
