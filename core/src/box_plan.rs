//! The plan of the boxes into which a large map is cut.
//!
//! A k-d tree divides the extent of a map along lines of a fixed grid, in proportion to the vertices on
//! either side. It follows from the numbers of vertices in the cells: one pass over a map gives it, and
//! neither the order of the vertices nor the number of threads matters.

use crate::vertices::VertexTable;

/// Cells of the grid along either axis.
const CELLS: u32 = 1 << 12;

/// The boxes, numbered in the order of the leaves of the tree.
pub(crate) struct BoxPlan {
    grid: Grid,
    tree: Node,
    /// For every box its cells along either axis: the first one, and the one after the last.
    boxes: Vec<[[u32; 2]; 2]>,
}

/// A grid over the extent of a map.
struct Grid {
    lower: [f64; 2],
    /// The sides of a cell, CRS units.
    sides: [f64; 2],
}

/// A cell that has vertices.
struct Cell {
    at: [u32; 2],
    vertices: u64,
}

enum Node {
    /// A box, by its number.
    Leaf(u32),
    /// Cells whose number along the axis is below that of the line are on the first side.
    Cut { axis: usize, line: u32, sides: Box<[Node; 2]> },
}

impl BoxPlan {
    /// Plans boxes of nearly equal numbers of vertices, at most `part_size` where the cells allow.
    /// `x_scale` is the length of a unit along x as a multiple of one along y.
    pub fn new(vertices: &VertexTable, part_size: usize, x_scale: f64) -> Self {
        let (lower, upper) = vertices.bounds();
        let sides = [0, 1].map(|axis| (upper[axis] - lower[axis]) / f64::from(CELLS));
        let grid = Grid { lower, sides };
        let mut cells = grid.count(vertices);
        let unit = [sides[0] * x_scale, sides[1]];
        let mut boxes = Vec::new();
        let parts = vertices.len().div_ceil(part_size) as u64;
        let tree = divide(&mut cells, [[0, CELLS]; 2], (parts, unit), &mut boxes);
        BoxPlan { grid, tree, boxes }
    }

    /// Returns how many boxes there are.
    pub fn len(&self) -> usize {
        self.boxes.len()
    }

    /// Returns the number of the box that a place lies in.
    pub fn box_at(&self, place: [f64; 2]) -> u32 {
        let cell = self.grid.cell(place);
        let mut node = &self.tree;
        loop {
            match node {
                Node::Leaf(number) => return *number,
                Node::Cut { axis, line, sides } => node = &sides[usize::from(cell[*axis] >= *line)],
            }
        }
    }

    /// Adds the numbers of the boxes that the bounding box of two places meets.
    pub fn boxes_between(&self, [p, q]: [[f64; 2]; 2], found: &mut Vec<u32>) {
        let (p, q) = (self.grid.cell(p), self.grid.cell(q));
        let range = [0, 1].map(|axis| [p[axis].min(q[axis]), p[axis].max(q[axis])]);
        let mut nodes = vec![&self.tree];
        while let Some(node) = nodes.pop() {
            match node {
                Node::Leaf(number) => found.push(*number),
                Node::Cut { axis, line, sides } => {
                    let [first, last] = range[*axis];
                    nodes.extend((first < *line).then_some(&sides[0]));
                    nodes.extend((last >= *line).then_some(&sides[1]));
                }
            }
        }
    }

    /// Returns whether a place in a box is within `reach`, CRS units along either axis, of a border to
    /// another box.
    pub fn is_near_border(&self, number: u32, place: [f64; 2], reach: [f64; 2]) -> bool {
        let Grid { lower, sides } = self.grid;
        (0..2).any(|axis| {
            let is_near = |line: &u32| {
                let border = lower[axis] + f64::from(*line) * sides[axis];
                (place[axis] - border).abs() <= reach[axis]
            };
            // The outline of the map is no border.
            self.boxes[number as usize][axis].iter().filter(|line| (1..CELLS).contains(*line)).any(is_near)
        })
    }
}

impl Grid {
    fn cell(&self, place: [f64; 2]) -> [u32; 2] {
        // A number that is none, on a map without width, becomes 0.
        [0, 1].map(|axis| (((place[axis] - self.lower[axis]) / self.sides[axis]) as u32).min(CELLS - 1))
    }

    /// Counts the vertices of the cells that have some.
    fn count(&self, vertices: &VertexTable) -> Vec<Cell> {
        let key = |place: &[f64; 2]| {
            let [x, y] = self.cell(*place);
            x * CELLS + y
        };
        let mut keys: Vec<u32> = vertices.coords().iter().map(key).collect();
        keys.sort_unstable();
        let cell = |run: &[u32]| Cell { at: [run[0] / CELLS, run[0] % CELLS], vertices: run.len() as u64 };
        keys.chunk_by(|a, b| a == b).map(cell).collect()
    }
}

/// Divides the cells of a range into so many boxes; fewer where all vertices are in one cell. `unit`
/// has the sides of a cell.
fn divide(
    cells: &mut [Cell],
    range: [[u32; 2]; 2],
    (parts, unit): (u64, [f64; 2]),
    boxes: &mut Vec<[[u32; 2]; 2]>,
) -> Node {
    let left_parts = parts / 2;
    let extent = |axis: usize| {
        let along = cells.iter().map(|cell| cell.at[axis]);
        let (first, last) = along.fold((CELLS, 0), |(first, last), at| (first.min(at), last.max(at)));
        f64::from(last.saturating_sub(first)) * unit[axis]
    };
    let longer = usize::from(extent(1) > extent(0));
    let cut = (parts > 1).then(|| {
        [longer, 1 - longer]
            .into_iter()
            .find_map(|axis| cut(cells, axis, [left_parts, parts]).map(|(line, below)| (axis, line, below)))
    });
    let Some((axis, line, below)) = cut.flatten() else {
        boxes.push(range);
        return Node::Leaf(boxes.len() as u32 - 1);
    };
    let (lower, upper) = cells.split_at_mut(below);
    let [mut below, mut above] = [range; 2];
    (below[axis][1], above[axis][0]) = (line, line);
    let below = divide(lower, below, (left_parts, unit), boxes);
    let above = divide(upper, above, (parts - left_parts, unit), boxes);
    Node::Cut { axis, line, sides: Box::new([below, above]) }
}

/// Sorts cells along an axis. Returns the line that divides their vertices most nearly as `left_parts`
/// to the rest of `parts`, and how many cells are below it; nothing where all are in one row.
fn cut(cells: &mut [Cell], axis: usize, [left_parts, parts]: [u64; 2]) -> Option<(u32, usize)> {
    cells.sort_unstable_by_key(|cell| (cell.at[axis], cell.at[1 - axis]));
    let all: u64 = cells.iter().map(|cell| cell.vertices).sum();
    let wanted = all * left_parts / parts;
    let mut below = 0;
    let divisions = cells.windows(2).enumerate().filter_map(|(i, pair)| {
        below += pair[0].vertices;
        let [before, after] = [pair[0].at[axis], pair[1].at[axis]];
        // The line is in the middle of empty rows.
        (before < after).then(|| (below.abs_diff(wanted), (before + 1 + after) / 2, i + 1))
    });
    divisions.min().map(|(_, line, cells)| (line, cells))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn town(n: u64) -> VertexTable {
        let hash = |i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31) % 1_000_003;
        // Two thirds of the vertices are in a corner.
        let squeeze = |i: u64, value: u64| if i.is_multiple_of(3) { value } else { value / 50 };
        let place = |i: u64| [squeeze(i, hash(i)) as f64, squeeze(i, hash(i + n)) as f64];
        VertexTable::new((0..n).map(place).collect()).unwrap()
    }

    #[test]
    fn boxes_have_nearly_equal_numbers_of_vertices() {
        let vertices = town(20_000);
        for (part_size, boxes) in [(20_000, 1), (19_999, 2), (3_000, 7), (1_000, 20)] {
            let plan = BoxPlan::new(&vertices, part_size, 1.0);
            let mut counts = vec![0; plan.len()];
            vertices.coords().iter().for_each(|place| counts[plan.box_at(*place) as usize] += 1);
            assert_eq!(plan.len(), boxes);
            let mean = 20_000 / boxes;
            assert!(
                counts.iter().all(|count| (mean * 9 / 10..=mean * 11 / 10).contains(count)),
                "{counts:?}"
            );
        }
    }

    #[test]
    fn vertices_in_one_cell_are_one_box_and_a_line_is_cut_across() {
        let narrow = [[0.0, 0.0], [1.0, 1.0], [1e9, 1e9]];
        assert_eq!(BoxPlan::new(&VertexTable::new(narrow.to_vec()).unwrap(), 1, 1.0).len(), 2);
        let line = (0..100).map(|i| [7.0, f64::from(i)]).collect();
        let line = VertexTable::new(line).unwrap();
        let plan = BoxPlan::new(&line, 25, 1.0);
        let boxes: Vec<u32> = line.coords().iter().map(|place| plan.box_at(*place)).collect();
        assert!(plan.len() == 4 && boxes.is_sorted(), "{boxes:?}");
    }

    #[test]
    fn borders_are_between_boxes_and_a_segment_meets_the_boxes_of_its_ends() {
        let vertices = VertexTable::new((0..101).map(|i| [f64::from(i), 0.0]).collect()).unwrap();
        let plan = BoxPlan::new(&vertices, 51, 1.0);
        assert_eq!(plan.len(), 2);
        let is_near = |x: f64, reach: f64| plan.is_near_border(plan.box_at([x, 0.0]), [x, 0.0], [reach; 2]);
        assert!([0.0, 20.0, 80.0, 100.0].iter().all(|x| !is_near(*x, 10.0)));
        assert!(is_near(49.0, 1.0) && is_near(50.0, 1.0) && is_near(20.0, 40.0));
        let mut found = Vec::new();
        plan.boxes_between([[10.0, 0.0], [90.0, 0.0]], &mut found);
        found.sort_unstable();
        assert_eq!(found, [0, 1]);
        found.clear();
        plan.boxes_between([[10.0, 0.0], [20.0, 0.0]], &mut found);
        assert_eq!(found, [plan.box_at([10.0, 0.0])]);
    }
}
