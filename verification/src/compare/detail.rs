//! The places of differences, thinned to the resolution of a page, for the report of a comparison.

use crate::{
    report::{Digested, Extent},
    thinning::{ARROWS, BINS, PointGrid, extent_of, lines},
};
use meshmark_core::{distortion::Corner, ground::Ground, vertices::VertexTable};
use meshmark_detection::Histogram;
use serde::Serialize;
use std::collections::BTreeMap;

/// Angles that turn by less than this do not count as changed, degrees.
pub const NOTABLE_DEG: f64 = 1.0;
/// Number of cells along the longer side of the map of angles.
const CELLS: usize = 60;
/// Number of places per kind of topology change that are drawn; more overlap each other.
const MOST_PLACES: usize = 2000;

/// The places of differences on the map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Detail {
    /// The files; null until they are digested.
    pub provenance: Option<ComparedFiles>,
    /// The extent of the reference.
    pub extent: Extent,
    /// Displacements of the vertices, metres; null without vertices.
    pub displacement_m: Option<Histogram>,
    /// Changes of the angles at corners, degrees; null without corners.
    pub angle_change_deg: Option<Histogram>,
    /// A sample of the vertices: x and y, CRS units, displacement in x and y, metres; null unless
    /// exact displacements are asked for.
    pub moved: Option<Vec<[f64; 4]>>,
    /// Cells in which an angle turned by 1° or more: x and y of their middle, CRS units, and the
    /// largest change, whole degrees, rounded down.
    pub angle_cells: Vec<[f64; 3]>,
    /// Width and height of a cell, CRS units.
    pub cell: [f64; 2],
    /// Places of changed topology.
    pub topology: Topology,
    /// Rings and lines of the reference, thinned, CRS units.
    #[serde(skip)]
    pub lines: Vec<Vec<[f64; 2]>>,
}

/// Places of changed topology, CRS units, at most 2000 of each kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Topology {
    /// Vertices whose occurrences separated.
    pub torn: Vec<[f64; 2]>,
    /// Geometries that became invalid.
    pub invalid: Vec<[f64; 2]>,
    /// Polygons that newly overlap.
    pub overlaps: Vec<[f64; 2]>,
    /// Segments that cross in only one of the maps.
    pub crossings: Vec<[f64; 2]>,
}

/// The files of a comparison, and the means to repeat it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedFiles {
    /// The reference.
    pub reference: Digested,
    /// The marked map.
    pub marked: Digested,
    /// The command line.
    pub command: String,
    /// Programs and libraries that the result depends on, with their versions.
    pub versions: Vec<String>,
}

/// The comparison, vertex by vertex.
pub(super) struct Findings<'a> {
    pub vertices: &'a VertexTable,
    pub moved: &'a [[f64; 2]],
    pub measure: &'a Ground,
    pub segments: &'a [[u32; 2]],
    pub corners: &'a [Corner],
    /// Places of torn vertices, new invalid geometries, new overlaps and changed crossings, CRS
    /// units.
    pub places: [Vec<[f64; 2]>; 4],
}

impl Findings<'_> {
    /// Returns the places of differences; displacements only if they are `exact`.
    pub fn detail(self, exact: bool) -> Detail {
        let (coords, extent) = (self.vertices.coords(), extent_of(self.vertices, self.measure));
        let pairs = coords.iter().zip(self.moved);
        let displacements: Vec<[f64; 2]> = pairs.map(|(a, b)| self.measure.metres_between(*a, *b)).collect();
        let lengths: Vec<f64> = displacements.iter().map(|[x, y]| x.hypot(*y)).collect();
        let changes: Vec<f64> = self.corners.iter().map(Corner::change_deg).collect();
        let mut arrows = PointGrid::new(&extent, ARROWS);
        let shown = coords.iter().zip(&displacements).filter(|(at, _)| arrows.takes(**at));
        let grid = PointGrid::new(&extent, CELLS);
        let [torn, invalid, overlaps, crossings] = self.places.map(|mut places| {
            places.truncate(MOST_PLACES);
            places
        });
        Detail {
            provenance: None,
            extent,
            displacement_m: Histogram::of_values(&lengths, BINS),
            angle_change_deg: Histogram::of_values(&changes, BINS),
            moved: exact.then(|| shown.map(|(at, d)| [at[0], at[1], d[0], d[1]]).collect()),
            angle_cells: cells(&grid, self.corners),
            cell: grid.cell(),
            topology: Topology { torn, invalid, overlaps, crossings },
            lines: lines(&extent, coords, self.segments),
        }
    }
}

/// Returns the middle and the largest change of every cell with a notable change.
fn cells(grid: &PointGrid, corners: &[Corner]) -> Vec<[f64; 3]> {
    let mut largest: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for corner in corners.iter().filter(|corner| corner.change_deg() >= NOTABLE_DEG) {
        let cell = largest.entry(grid.cell_of(corner.at)).or_default();
        *cell = cell.max(corner.change_deg());
    }
    let place = |(cell, change): (&[u32; 2], &f64)| {
        let [x, y] = grid.middle_of(*cell);
        [x, y, change.floor()]
    };
    largest.iter().map(place).collect()
}
