//! Towns for tests: houses that share walls or nearly touch, and roads that end at each other.

use meshmark_core::{
    ground::Ground,
    map::Map,
    map_data::{ChainKind, MapData},
    orientation::orientation,
};
use std::collections::BTreeSet;

/// Houses along a side of a town.
pub const SIDE: usize = 18;

/// A ring, whose first corner is not repeated, or a line. A hole follows its polygon.
#[derive(Clone)]
pub struct Feature {
    pub points: Vec<[f64; 2]>,
    pub kind: ChainKind,
}

/// Returns a town: houses in rows, of which many share a wall, have a shed on one, or a neighbour five
/// centimetres away, and roads that end at each other.
pub fn town(seed: usize) -> Vec<Feature> {
    let chance = |plot: usize, n: usize| (plot * 7919 + seed * 104_729 + n * 1_299_709) % 1009;
    let ring = |points: &[[f64; 2]]| Feature { points: points.to_vec(), kind: ChainKind::Shell };
    let mut features = Vec::new();
    for plot in 0..SIDE * SIDE {
        let jitter = |n: usize| (chance(plot, n) % 101) as f64 / 50.0;
        let (x, y) = ((plot % SIDE * 20) as f64 + jitter(3), (plot / SIDE * 20) as f64 + jitter(4));
        let (right, top) = (x + 8.0 + jitter(1), y + 7.0 + jitter(2));
        features.push(ring(&[[x, y], [right, y], [right, top], [x, top]]));
        match chance(plot, 5) % 4 {
            0 => features.push(ring(&[[right, y], [right + 5.0, y], [right + 5.0, top - 1.0], [right, top]])),
            1 => features.push(ring(&[[x + 1.0, top], [x + 4.0, top], [x + 4.0, top + 3.0]])),
            2 => features.push(ring(&[[x + 1.0, top + 0.05], [x + 5.0, top + 0.05], [x + 3.0, top + 3.0]])),
            _ => {}
        }
    }
    for row in 0..SIDE {
        let y = 20.0 * row as f64 - 4.0;
        let road = (0..2 * SIDE).map(|i| [10.0 * i as f64, y + (i % 3) as f64]);
        features.push(Feature { points: road.collect(), kind: ChainKind::Line });
        let lane = [[20.0 * row as f64 - 4.0, -3.0], [20.0 * row as f64 - 4.5, 20.0 * SIDE as f64]];
        features.push(Feature { points: lane.to_vec(), kind: ChainKind::Line });
    }
    features
}

/// Returns the numbers of a map of features.
pub fn data(features: &[Feature]) -> MapData {
    let (mut coords, mut starts) = (Vec::new(), Vec::new());
    for Feature { points, kind } in features {
        starts.push(coords.len() as u32);
        coords.extend(points);
        if !matches!(kind, ChainKind::Line) {
            coords.push(points[0]);
        }
    }
    MapData::from_chains(coords, &starts, features.iter().map(|feature| feature.kind)).unwrap().0
}

/// Returns a map whose unit is a metre.
pub fn on(data: &MapData) -> Map<'_> {
    data.on(&Ground::METRES, &Ground::METRES)
}

/// Returns the pairs of segments that cross.
pub fn crossings(segments: &[[[f64; 2]; 2]]) -> BTreeSet<[usize; 2]> {
    let apart =
        |[p, q]: [[f64; 2]; 2], [r, s]: [[f64; 2]; 2]| orientation(p, q, r) * orientation(p, q, s) < 0.0;
    let near = |[p, q]: [[f64; 2]; 2], [r, s]: [[f64; 2]; 2]| {
        (0..2).all(|i| p[i].max(q[i]) >= r[i].min(s[i]) && r[i].max(s[i]) >= p[i].min(q[i]))
    };
    let pairs = (0..segments.len()).flat_map(|i| (0..i).map(move |j| [i, j]));
    let crosses = |[i, j]: &[usize; 2]| {
        let (a, b) = (segments[*i], segments[*j]);
        near(a, b) && apart(a, b) && apart(b, a)
    };
    pairs.filter(crosses).collect()
}
