//! The places near vertices, and how often any other places would be there.

use crate::{CoordinateSystem, Result, Survey, parse_srs};
use gdal::spatial_ref::CoordTransform;
use meshmark_marking::{TransformableCrs, reproject};
use statrs::function::gamma::gamma_lr;
use std::{cell::OnceCell, collections::HashSet, ops::RangeInclusive};

/// Places no further away than this share of the amplitude of the mark show that a vertex moved:
/// a little more than the half of a unit in the last place of six decimals of a degree.
const REACH: f64 = 0.6;
/// Both numbers of a place have this many digits together; a few digits agree by chance.
const LEAST_DIGITS: usize = 7;
/// Places that agree so well by chance, in one of so many layers, are no trace.
const SIGNIFICANCE: f64 = 1e-3;
/// So many times as many as expected may be near, where vertices crowd.
const MOST_OF_CHANCE: f64 = 3.0;
/// Points on each side of a map by which its extent in another CRS is measured.
const SAMPLES: usize = 33;

/// Cells near a vertex: its own and those around it.
const CELLS_NEAR: f64 = 9.0;
/// Number of vertices in a block of cells on average, if they were spread evenly.
const VERTICES_IN_BLOCK: f64 = 8.0;

/// The cell of a vertex, which has the size of the reach.
type Cell = [u32; 2];

/// The vertices of a map, by place.
pub(super) struct Vertices<'a> {
    coords: &'a [[f64; 2]],
    /// The lower left corner, CRS units.
    lower: [f64; 2],
    /// The size of a cell, CRS units.
    reach: [f64; 2],
    frames: Vec<Frame>,
    index: OnceCell<Index>,
}

/// The vertices by cell, made when a place within the extent of the map is found.
struct Index {
    cells: HashSet<Cell>,
    /// The share of the area with vertices that is near one of them.
    share_near: f64,
}

/// A CRS in which places may be written.
struct Frame {
    x: RangeInclusive<f64>,
    y: RangeInclusive<f64>,
    /// The transformation into the CRS of the map, unless it is that.
    to_map: Option<CoordTransform>,
}

impl<'a> Vertices<'a> {
    pub(super) fn new(map: &'a Survey, amplitude_m: f64) -> Result<Self> {
        let table = &map.data.vertices;
        let (lower, upper) = table.bounds();
        let reach_m = REACH * amplitude_m;
        let reach = map.measure()?.metres_per_unit(table.centre()).map(|unit_m| reach_m / unit_m);
        let [x, y] = [0, 1].map(|axis| lower[axis] - reach[axis]..=upper[axis] + reach[axis]);
        let mut frames = vec![Frame { x, y, to_map: None }];
        frames.extend(map.crs.as_ref().and_then(|crs| Frame::in_degrees(crs, (lower, upper))));
        Ok(Vertices { coords: table.coords(), lower, reach, frames, index: OnceCell::new() })
    }

    /// Returns whether a number may be a coordinate of a vertex.
    pub(super) fn may_hold(&self, number: f64) -> bool {
        self.frames.iter().any(|frame| frame.x.contains(&number) || frame.y.contains(&number))
    }

    /// Counts a place in any CRS and order of axes.
    pub(super) fn count(&self, place: [f64; 2], tally: &mut Tally) {
        for frame in &self.frames {
            for [x, y] in [place, [place[1], place[0]]] {
                if !frame.x.contains(&x) || !frame.y.contains(&y) {
                    continue;
                }
                let Some(in_map) = frame.place_in_map([x, y]) else { continue };
                self.count_in_map(in_map, tally, || digits(x) + digits(y) >= LEAST_DIGITS);
            }
        }
    }

    /// Counts a place in the CRS of the map if it is within its extent; `is_exact` says whether it
    /// has so many digits that it is near a vertex by chance as rarely as any.
    pub(super) fn count_in_map(&self, place: [f64; 2], tally: &mut Tally, is_exact: impl Fn() -> bool) {
        let own = &self.frames[0];
        if !own.x.contains(&place[0]) || !own.y.contains(&place[1]) {
            return;
        }
        tally.places += 1;
        let [x, y] = self.cell(place).map(|at| at.saturating_sub(1)..=at.saturating_add(1));
        let mut around = x.flat_map(|x| y.clone().map(move |y| [x, y]));
        let near = around.find(|cell| self.index().cells.contains(cell));
        if let Some(cell) = near.filter(|_| is_exact()) {
            tally.near.insert(cell);
        }
    }

    fn cell(&self, point: [f64; 2]) -> Cell {
        // The conversion saturates. One more, so that the first cell has a neighbour below.
        [0, 1].map(|axis| ((point[axis] - self.lower[axis]) / self.reach[axis] + 1.0) as u32)
    }

    fn index(&self) -> &Index {
        self.index.get_or_init(|| {
            let cells: HashSet<Cell> = self.coords.iter().map(|point| self.cell(*point)).collect();
            let share_near = share_near(&cells);
            Index { cells, share_near }
        })
    }

    /// Returns whether more places are near vertices than would be by chance, in one of
    /// `candidates` that were counted.
    pub(super) fn are_found_by(&self, tally: &Tally, candidates: usize) -> bool {
        if tally.near.is_empty() {
            return false;
        }
        let expected = tally.places as f64 * self.index().share_near;
        let near = tally.near.len() as f64;
        near > MOST_OF_CHANCE * expected && gamma_lr(near, expected) < SIGNIFICANCE / candidates as f64
    }
}

impl Frame {
    /// Returns longitudes and latitudes of WGS 84, unless these are the coordinates of the map.
    fn in_degrees(crs: &CoordinateSystem, (lower, upper): ([f64; 2], [f64; 2])) -> Option<Self> {
        let wgs84 = parse_srs("EPSG:4326").ok().filter(|wgs84| !wgs84.is_same(crs))?;
        let at = |axis: usize, step: usize| {
            lower[axis] + (upper[axis] - lower[axis]) * step as f64 / (SAMPLES - 1) as f64
        };
        let mut samples: Vec<_> =
            (0..SAMPLES).flat_map(|x| (0..SAMPLES).map(move |y| [at(0, x), at(1, y)])).collect();
        reproject(&mut samples, Some(crs), &wgs84, "").ok()?;
        let [x, y] = [0, 1].map(|axis| {
            let values = || samples.iter().map(|sample| sample[axis]).filter(|value| value.is_finite());
            let (least, most) = (values().fold(f64::MAX, f64::min), values().fold(f64::MIN, f64::max));
            let margin = (most - least) / (SAMPLES - 1) as f64;
            least - margin..=most + margin
        });
        Some(Frame { x, y, to_map: Some(wgs84.transform_to(crs).ok()?) })
    }

    fn place_in_map(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let Some(to_map) = &self.to_map else { return Some([x, y]) };
        let (mut x, mut y) = ([x], [y]);
        to_map.transform_coords(&mut x, &mut y, &mut []).ok()?;
        Some([x[0], y[0]])
    }
}

/// Returns the share of the area with vertices that is near one of them: a map may have large gaps,
/// in which nothing else lies either.
fn share_near(cells: &HashSet<Cell>) -> f64 {
    let most = [0, 1].map(|axis| cells.iter().map(|cell| cell[axis]).max().unwrap_or(0));
    let area = f64::from(most[0]) * f64::from(most[1]);
    let side = (area * VERTICES_IN_BLOCK / cells.len() as f64).sqrt().ceil().max(1.0);
    let block = |cell: &Cell| cell.map(|at| (f64::from(at) / side) as u32);
    let blocks = cells.iter().map(block).collect::<HashSet<_>>().len();
    (CELLS_NEAR * cells.len() as f64 / (blocks as f64 * side * side)).min(1.0)
}

/// Places that were compared with the vertices.
#[derive(Default)]
pub(super) struct Tally {
    /// Number of places within the extent of the map.
    places: u64,
    /// The cells of the vertices that are near one of them.
    pub(super) near: HashSet<Cell>,
}

/// Returns the number of significant digits of a number.
fn digits(number: f64) -> usize {
    let text = number.abs().to_string();
    let digits: Vec<u8> =
        text.bytes().filter(u8::is_ascii_digit).skip_while(|digit| *digit == b'0').collect();
    digits.len() - digits.iter().rev().take_while(|digit| **digit == b'0').count()
}
