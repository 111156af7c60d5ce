//! The effect of marking on a map, in figures.

use crate::{ground::Ground, map::Map, vertices::VertexTable};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// An angle counts as right, or as kept, within this many degrees.
const RIGHT_DEG: f64 = 1.0;

/// The spread of many values; zeros for none.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // the names say it
pub struct Spread {
    pub mean: f64,
    pub root_mean_square: f64,
    /// 99th percentile.
    pub p99: f64,
    pub max: f64,
}

impl Spread {
    /// Summarises values, none of which is NaN.
    pub fn summarise(mut values: Vec<f64>) -> Self {
        values.par_sort_unstable_by(f64::total_cmp);
        let mut spread = SpreadOfSorted::new(values.len());
        values.into_iter().for_each(|value| spread.add(value));
        spread.spread()
    }
}

/// The spread of so many values, which are added in ascending order.
pub(crate) struct SpreadOfSorted {
    count: usize,
    added: usize,
    sum: f64,
    sum_of_squares: f64,
    p99: f64,
    max: f64,
}

impl SpreadOfSorted {
    pub fn new(count: usize) -> Self {
        SpreadOfSorted { count, added: 0, sum: 0.0, sum_of_squares: 0.0, p99: 0.0, max: 0.0 }
    }

    /// Adds the next value.
    pub fn add(&mut self, value: f64) {
        self.sum += value;
        self.sum_of_squares += value * value;
        if self.added == (self.count - 1) * 99 / 100 {
            self.p99 = value;
        }
        self.max = value;
        self.added += 1;
    }

    /// Returns the spread, after the last value.
    pub fn spread(self) -> Spread {
        let count = self.count.max(1) as f64;
        let [mean, mean_square] = [self.sum, self.sum_of_squares].map(|sum| sum / count);
        Spread { mean, root_mean_square: mean_square.sqrt(), p99: self.p99, max: self.max }
    }
}

/// Hausdorff distances between features before and after, metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hausdorff {
    /// 99th percentile.
    pub p99_m: f64,
    /// The largest.
    pub max_m: f64,
}

/// Changes of areas, as shares of the area before.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Areas {
    /// Polygons and multipolygons.
    pub polygons: usize,
    /// Mean.
    pub mean_change: f64,
    /// 99th percentile.
    pub p99_change: f64,
    /// The largest.
    pub max_change: f64,
}

/// Geometries that are invalid according to GEOS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validity {
    /// In the reference.
    pub invalid_before: usize,
    /// In the marked map.
    pub invalid_after: usize,
    /// Those that are valid in the reference.
    pub newly_invalid: usize,
}

/// Pairs of polygons that overlap by more than a sliver: 1e-6 m², or a cell of the output grid if
/// there is one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Overlaps {
    /// In the reference.
    pub before: usize,
    /// In the marked map.
    pub after: usize,
    /// Pairs that overlap by more than a sliver only in the marked map.
    pub new: usize,
    /// Their area, m².
    pub new_area_m2: f64,
    /// Pairs that overlap only in the marked map, by a sliver.
    pub new_slivers: usize,
}

/// How far the vertices moved, metres on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Displacement {
    /// Root mean square.
    pub rms_m: f64,
    /// 99th percentile.
    pub p99_m: f64,
    /// The largest.
    pub max_m: f64,
}

impl Displacement {
    /// Measures the displacement of the vertices of a map to `moved`, in canonical order.
    pub fn between(vertices: &VertexTable, moved: &[[f64; 2]], measure: &Ground) -> Self {
        let distances =
            vertices.coords().iter().zip(moved).map(|(&from, &to)| Self::of_vertex(from, to, measure));
        Self::new(&Spread::summarise(distances.collect()))
    }

    /// Returns the displacement of a vertex, metres.
    pub(crate) fn of_vertex(from: [f64; 2], to: [f64; 2], measure: &Ground) -> f64 {
        let [dx, dy] = measure.metres_between(from, to);
        dx.hypot(dy)
    }

    /// Creates it from the spread of the displacements of all vertices, metres.
    pub(crate) fn new(spread: &Spread) -> Self {
        Displacement { rms_m: spread.root_mean_square, p99_m: spread.p99, max_m: spread.max }
    }
}

/// How much the angles at the corners of a map changed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AngleChange {
    /// How many angles.
    pub count: usize,
    /// Mean change, degrees.
    pub mean_change_deg: f64,
    /// 99th percentile, degrees.
    pub p99_change_deg: f64,
    /// Those within 1° of a right angle in the reference.
    pub right_angles: usize,
    /// The share of these that changed by 1° at most; 1 when there is none.
    pub right_angles_kept: f64,
}

impl AngleChange {
    /// Measures the change at the corners of a map.
    pub fn at(corners: &[Corner]) -> Self {
        let spread = Spread::summarise(corners.iter().map(Corner::change_deg).collect());
        Self::new(corners.len(), &spread, RightAngles::at(corners))
    }

    /// Creates it from the spread of the changes of so many angles, degrees.
    pub(crate) fn new(count: usize, spread: &Spread, right: RightAngles) -> Self {
        let RightAngles { all, kept } = right;
        AngleChange {
            count,
            mean_change_deg: spread.mean,
            p99_change_deg: spread.p99,
            right_angles: all,
            right_angles_kept: if all == 0 { 1.0 } else { kept as f64 / all as f64 },
        }
    }
}

/// The right angles of a map.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RightAngles {
    pub all: usize,
    /// Those that changed by 1° at most.
    pub kept: usize,
}

impl RightAngles {
    /// Counts those at the corners of a map.
    pub fn at(corners: &[Corner]) -> Self {
        let is_right = |angle: f64| [90.0, 270.0].iter().any(|right| (angle - right).abs() <= RIGHT_DEG);
        let right = corners.iter().filter(|corner| is_right(corner.before_deg));
        let kept = right.clone().filter(|corner| corner.change_deg() <= RIGHT_DEG);
        RightAngles { all: right.clone().count(), kept: kept.count() }
    }

    /// Returns those of two parts of a map.
    pub fn and(self, other: Self) -> Self {
        RightAngles { all: self.all + other.all, kept: self.kept + other.kept }
    }
}

/// A vertex of a map at which exactly two segments meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Its place before marking, CRS units.
    pub at: [f64; 2],
    /// The angle between its segments, degrees from 0 to 360.
    pub before_deg: f64,
    /// The same angle after marking.
    pub after_deg: f64,
}

impl Corner {
    /// Returns all corners of a map whose vertices are at `moved` after marking, without those at a
    /// segment of no length.
    pub fn all(map: &Map, moved: &[[f64; 2]]) -> Vec<Self> {
        Self::at_some(map, moved, |_| true)
    }

    /// Returns those of [`Self::all`] at certain vertices.
    pub(crate) fn at_some(map: &Map, moved: &[[f64; 2]], is_meant: impl Fn(u32) -> bool) -> Vec<Self> {
        let ends = map.segments.iter().flat_map(|&[a, b]| [[a, b], [b, a]]);
        let mut ends: Vec<[u32; 2]> = ends.filter(|[at, _]| is_meant(*at)).collect();
        ends.par_sort_unstable();
        let pairs: Vec<&[[u32; 2]]> = ends.chunk_by(|a, b| a[0] == b[0]).filter(|c| c.len() == 2).collect();
        let corner = |pair: &&[[u32; 2]]| {
            let [from, at, to] = [pair[0][1], pair[0][0], pair[1][1]];
            let scale = map.measure.metres_per_unit(map.at(at));
            let angle = |coords: &[[f64; 2]]| {
                let [from, at, to] = [from, at, to].map(|v| coords[v as usize]);
                angle_deg(from, at, to, scale)
            };
            let (before_deg, after_deg) = (angle(map.vertices.coords())?, angle(moved)?);
            Some(Corner { at: map.at(at), before_deg, after_deg })
        };
        pairs.par_iter().filter_map(corner).collect()
    }

    /// Returns how far the angle turned, degrees from 0 to 180.
    pub fn change_deg(&self) -> f64 {
        let turned = (self.after_deg - self.before_deg).abs();
        turned.min(360.0 - turned)
    }
}

/// Returns the angle from the segment back to the segment on, turning left, degrees from 0 to 360;
/// `scale` is metres per unit. It is `None` where either segment has no length.
fn angle_deg(from: [f64; 2], at: [f64; 2], to: [f64; 2], scale: [f64; 2]) -> Option<f64> {
    let direction = |p: [f64; 2]| {
        let [x, y] = [0, 1].map(|i| (p[i] - at[i]) * scale[i]);
        (x != 0.0 || y != 0.0).then(|| y.atan2(x))
    };
    Some((direction(from)? - direction(to)?).to_degrees().rem_euclid(360.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_has_two_segments_and_is_measured_on_the_ground() {
        // A path along three sides of a rectangle, and a fork at its end.
        let coords = vec![[0.0, 0.0], [0.0, 4.0], [2.0, 0.0], [2.0, 4.0], [3.0, 4.0], [3.0, 5.0]];
        let vertices = VertexTable::new(coords.clone()).unwrap();
        let segments = [[0, 1], [0, 2], [2, 3], [3, 4], [3, 5]];
        let ground = Ground::METRES;
        let map = Map { segments: &segments, ..Map::of_points(&vertices, &ground) };
        let still = AngleChange::at(&Corner::all(&map, &coords));
        assert_eq!((still.count, still.right_angles, still.right_angles_kept), (2, 2, 1.0));
        assert_eq!((still.mean_change_deg, still.p99_change_deg), (0.0, 0.0));
        let mut moved = coords;
        moved[1] = [4.0, 4.0]; // half of a right angle
        let bent = AngleChange::at(&Corner::all(&map, &moved));
        assert!((bent.mean_change_deg - 22.5).abs() < 1e-9 && bent.right_angles_kept == 0.5, "{bent:?}");
    }

    #[test]
    fn of_nothing_all_is_zero_without_a_sign() {
        let Spread { mean, root_mean_square, p99, max } = Spread::summarise(Vec::new());
        assert_eq!([mean, root_mean_square, p99, max].map(f64::to_bits), [0; 4]);
    }

    #[test]
    fn a_full_turn_is_no_change() {
        let corner = Corner { at: [0.0; 2], before_deg: 359.5, after_deg: 0.5 };
        assert!((corner.change_deg() - 1.0).abs() < 1e-9);
    }
}
