//! Bounding boxes of polygons, as linear functions of their vertices.

use super::{
    extremes,
    points::{FeaturePoint, places},
};
use crate::linework::Plane;
use meshmark_core::map_data::MapData;

/// The sides of a box leave its frame by at most this share of their length.
const MOST_SLOPE: f64 = 0.005;
/// Maps of which a smaller share of vertices has sides in a frame are no maps of boxes.
const LEAST_SHARE: f64 = 0.5;
/// Directions are counted in so many classes of a right angle.
const CLASSES: usize = 360;

/// The directions of the sides of boxes: the angle by which the axes of the plane are turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    cos: f64,
    sin: f64,
}

impl Frame {
    /// The frame of the axes of the plane themselves.
    pub const UPRIGHT: Frame = Frame { cos: 1.0, sin: 0.0 };

    fn new(angle: f64) -> Self {
        Frame { cos: angle.cos(), sin: angle.sin() }
    }

    /// Returns a vector in the frame.
    fn inward(self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.cos * x + self.sin * y, self.cos * y - self.sin * x]
    }

    /// Returns a vector of the frame in the plane.
    fn outward(self, [x, y]: [f64; 2]) -> [f64; 2] {
        Frame { sin: -self.sin, ..self }.inward([x, y])
    }

    /// Returns the frame of a suspect that consists of boxes, and which of its vertices have sides
    /// in the frame alone. `places` are its vertices in the plane, metres.
    pub fn of_boxes(places: &[[f64; 2]], segments: &[[u32; 2]]) -> Option<(Self, Vec<bool>)> {
        let side = |[a, b]: &[u32; 2]| {
            let (a, b) = (places[*a as usize], places[*b as usize]);
            [b[0] - a[0], b[1] - a[1]]
        };
        let frame = Frame::new(common_angle(segments.iter().map(side))?);
        let mut has_sides = vec![false; places.len()];
        let mut leaves = vec![false; places.len()];
        for segment in segments {
            let [x, y] = frame.inward(side(segment)).map(f64::abs);
            let is_in_frame = x.min(y) <= MOST_SLOPE * x.max(y);
            for &vertex in segment {
                has_sides[vertex as usize] = true;
                leaves[vertex as usize] |= !is_in_frame;
            }
        }
        let on_boxes: Vec<bool> =
            has_sides.iter().zip(&leaves).map(|(has, leaves)| *has && !leaves).collect();
        let count = on_boxes.iter().filter(|on| **on).count();
        (count as f64 > LEAST_SHARE * places.len() as f64).then_some((frame, on_boxes))
    }
}

/// Returns the direction, up to right angles, that most of the length of sides has.
fn common_angle(sides: impl Iterator<Item = [f64; 2]> + Clone) -> Option<f64> {
    let turns = |[x, y]: [f64; 2]| (y.atan2(x) / std::f64::consts::FRAC_PI_2).rem_euclid(1.0);
    let mut lengths = vec![0.0; CLASSES];
    for side in sides.clone() {
        let class = (turns(side) * CLASSES as f64).round() as usize % CLASSES;
        lengths[class] += side[0].hypot(side[1]);
    }
    let most = (0..CLASSES).max_by(|a, b| lengths[*a].total_cmp(&lengths[*b]))?;
    let middle = most as f64 / CLASSES as f64;
    let (sum, length) = sides.fold((0.0, 0.0), |(sum, length), side| {
        let away = (turns(side) - middle + 0.5).rem_euclid(1.0) - 0.5;
        let weight = if away.abs() <= 1.0 / CLASSES as f64 { side[0].hypot(side[1]) } else { 0.0 };
        (sum + weight * away, length + weight)
    });
    (length > 0.0).then(|| (middle + sum / length) * std::f64::consts::FRAC_PI_2)
}

/// The corners of a box: −1 for the least and 1 for the greatest coordinate along each axis.
pub const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
/// Two corners that determine the box.
pub const OPPOSITE_CORNERS: [[f64; 2]; 2] = [CORNERS[0], CORNERS[2]];

/// Returns these corners of the box of every feature.
pub fn feature_points(
    reference: &MapData,
    plane: &Plane,
    frame: Frame,
    corners: &[[f64; 2]],
) -> Vec<FeaturePoint> {
    let of_shells = |shells: Vec<u32>| {
        let places = places(reference, plane, &shells).into_iter().map(|place| frame.inward(place));
        let places: Vec<[f64; 2]> = places.collect();
        corners.iter().map(move |signs| corner(&shells, &places, *signs, frame))
    };
    let features = reference.areas.features();
    let shells = features.map(|rings| {
        rings.filter(|ring| !ring.is_hole).flat_map(|ring| ring.vertices.iter().copied()).collect()
    });
    shells.filter(|shells: &Vec<u32>| !shells.is_empty()).flat_map(of_shells).collect()
}

/// Returns the corner of the greatest coordinates times `signs`, of vertices that have these places
/// in the frame.
fn corner(vertices: &[u32], places: &[[f64; 2]], signs: [f64; 2], frame: Frame) -> FeaturePoint {
    let sides = [0, 1].map(|axis| {
        let values: Vec<f64> = places.iter().map(|place| signs[axis] * place[axis]).collect();
        extremes::largest(&values)
    });
    // A vertex moves a side by the part of its displacement along an axis of the frame.
    let along = [frame.outward([1.0, 0.0]), frame.outward([0.0, 1.0])];
    let of_side = |axis: usize| {
        let [x, y] = along[axis];
        let share = move |(number, share): &(usize, f64)| {
            (vertices[*number], [[share * x * x, share * x * y], [share * x * y, share * y * y]])
        };
        sides[axis].shares.iter().map(share)
    };
    FeaturePoint {
        at_m: frame.outward([0, 1].map(|axis| signs[axis] * sides[axis].mean)),
        shares: of_side(0).chain(of_side(1)).collect(),
        variance_m2: (sides[0].variance + sides[1].variance) / 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshmark_core::{areas::Areas, ground::Ground, map_data::ChainKind};

    #[test]
    fn the_vertex_farthest_out_moves_the_corners_of_a_box() {
        let diamond = vec![[0.0, 4.0], [5.0, 0.0], [11.0, 6.0], [6.0, 9.0], [0.0, 4.0]];
        let (map, indices) = MapData::from_chains(diamond, &[0], [ChainKind::Shell]).unwrap();
        let areas = Areas::new(&indices, &[0], [ChainKind::Shell], &[0]);
        let points = feature_points(
            &MapData { areas, ..map },
            &Plane::new(&Ground::METRES, [0.0; 2]),
            Frame::UPRIGHT,
            &OPPOSITE_CORNERS,
        );
        let (along_x, along_y) = ([[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]);
        let expected = [
            ([0.0, 0.0], [(indices[0], along_x), (indices[1], along_y)]),
            ([11.0, 9.0], [(indices[2], along_x), (indices[3], along_y)]),
        ];
        for (point, (at, shares)) in points.iter().zip(expected) {
            assert!((point.at_m[0] - at[0]).hypot(point.at_m[1] - at[1]) < 1e-6, "{:?}", point.at_m);
            for (found, expected) in point.shares.iter().zip(shares) {
                assert_eq!(found.0, expected.0);
                let pairs = found.1.as_flattened().iter().zip(expected.1.as_flattened());
                assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
            }
        }
        assert_eq!(points.len(), 2);
    }

    #[test]
    fn sides_at_right_angles_make_a_frame_and_others_do_not() {
        for angle in [0.0, 0.4, 1.5, -0.002] {
            let turned = |[x, y]: [f64; 2]| Frame::new(angle).outward([x, y]);
            let places: Vec<[f64; 2]> =
                [[0.0, 0.0], [9.0, 0.0], [9.0, 4.0], [0.0, 4.0], [30.0, 8.0]].map(turned).to_vec();
            let segments = [[0, 1], [1, 2], [2, 3], [0, 3]];
            let (frame, on_boxes) = Frame::of_boxes(&places, &segments).unwrap();
            assert_eq!(on_boxes, [true, true, true, true, false], "{angle}");
            let [x, y] = frame.inward(turned([1.0, 0.0])).map(f64::abs);
            assert!(x.min(y) < 1e-9, "{angle}: {x} {y}");
        }
        let crooked = [[0.0, 0.0], [9.0, 0.2], [8.0, 4.0], [0.0, 5.0]];
        assert_eq!(Frame::of_boxes(&crooked, &[[0, 1], [1, 2], [2, 3], [0, 3]]), None);
        assert_eq!(Frame::of_boxes(&crooked, &[]), None);
    }
}
