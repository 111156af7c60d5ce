//! The segments of a map as few and short lines, where segments that share a point of the page are
//! drawn once.

use crate::report::Extent;
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of segments in a drawing; more would be no clearer on a page.
const MOST: usize = 30_000;
/// Number of grid points along the longer side of a page in the finest grid, which is tried first.
const FINEST: usize = 4000;

type Node = [u32; 2];

/// Returns lines along the segments, CRS units, snapped to the finest grid that keeps within the
/// limit.
pub fn lines(extent: &Extent, coords: &[[f64; 2]], segments: &[[u32; 2]]) -> Vec<Vec<[f64; 2]>> {
    let mut points = FINEST;
    loop {
        let grid = Grid::new(extent, points);
        let snapped = grid.snap(coords, segments);
        if snapped.len() <= MOST || points <= 250 {
            return joined(snapped).into_iter().map(|line| grid.places(&line)).collect();
        }
        points /= 2;
    }
}

struct Grid {
    lower: [f64; 2],
    /// Width and height of a grid cell, CRS units.
    step: [f64; 2],
}

impl Grid {
    fn new(extent: &Extent, points: usize) -> Self {
        let [width, height] = extent.size_m();
        let step_m = (width.max(height) / points as f64).max(f64::MIN_POSITIVE);
        Grid { lower: extent.lower, step: extent.metres_per_unit.map(|metres| step_m / metres) }
    }

    fn snap(&self, coords: &[[f64; 2]], segments: &[[u32; 2]]) -> BTreeSet<[Node; 2]> {
        let node = |v: u32| {
            [0, 1]
                .map(|axis| ((coords[v as usize][axis] - self.lower[axis]) / self.step[axis]).round() as u32)
        };
        let ends = segments.iter().map(|s| s.map(node));
        ends.filter(|[a, b]| a != b).map(|[a, b]| [a.min(b), a.max(b)]).collect()
    }

    fn places(&self, line: &[Node]) -> Vec<[f64; 2]> {
        let place =
            |node: &Node| [0, 1].map(|axis| self.lower[axis] + f64::from(node[axis]) * self.step[axis]);
        line.iter().map(place).collect()
    }
}

/// Joins segments into lines, each as long as there is a segment that continues it.
fn joined(segments: BTreeSet<[Node; 2]>) -> Vec<Vec<Node>> {
    let mut left: BTreeMap<Node, BTreeSet<Node>> = BTreeMap::new();
    for [a, b] in segments {
        left.entry(a).or_default().insert(b);
        left.entry(b).or_default().insert(a);
    }
    let starts: Vec<Node> = left.keys().copied().collect();
    let mut lines = Vec::new();
    for start in starts {
        while !left[&start].is_empty() {
            let mut line = vec![start];
            let mut at = start;
            while let Some(next) = left.get_mut(&at).and_then(BTreeSet::pop_first) {
                left.get_mut(&next).expect("both ends are known").remove(&at);
                line.push(next);
                at = next;
            }
            lines.push(line);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent { lower: [0.0; 2], upper: [100.0; 2], metres_per_unit: [1.0; 2] };

    #[test]
    fn every_segment_is_drawn_once_and_neighbours_in_one_line() {
        let coords = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0], [1e-9, 1e-9]];
        let ring = [[0, 1], [1, 2], [2, 3], [0, 3], [3, 4], [0, 4]];
        let found = lines(&EXTENT, &coords, &ring);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].len(), 5, "the vertex beside another one is none on the page");
    }

    #[test]
    fn a_map_of_more_segments_than_a_page_can_show_is_thinned() {
        let random = |i: u64| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / 2f64.powi(53) * 99.99;
        let mut coords = Vec::new();
        for i in 0..200_000 {
            let [x, y] = [random(2 * i + 1), random(2 * i + 2)];
            coords.extend([[x, y], [x + 0.01, y + 0.01]]);
        }
        let segments: Vec<[u32; 2]> = (0..200_000).map(|i| [2 * i, 2 * i + 1]).collect();
        let drawn: usize = lines(&EXTENT, &coords, &segments).iter().map(|line| line.len() - 1).sum();
        assert!((1..=MOST).contains(&drawn), "{drawn}");
    }
}
