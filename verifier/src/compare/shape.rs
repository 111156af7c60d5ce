//! Distances, angles and areas.

use super::{Angles, Areas, Displacement, Hausdorff, Pair, Pairs, quantiles::Spread};
use gdal::vector::Geometry;
use meshmark_core::{ground::Ground, vertices::VertexTable};
use meshmark_dataset::FeatureGeometry;
use rayon::prelude::*;
use rstar::{PointDistance, RTree, primitives::Line};

/// An angle is right, or kept, within this many degrees.
const RIGHT_DEG: f64 = 1.0;

pub(super) fn displacement(vertices: &VertexTable, moved: &[[f64; 2]], ground: &Ground) -> Displacement {
    let metres = |(from, to): (&[f64; 2], &[f64; 2])| {
        let [dx, dy] = ground.metres_between(*from, *to);
        dx.hypot(dy)
    };
    let spread = Spread::of(vertices.coords().iter().zip(moved).map(metres).collect());
    Displacement { rms_m: spread.rms, p99_m: spread.p99, max_m: spread.max }
}

impl Pairs {
    pub(super) fn hausdorff(&self) -> Hausdorff {
        let each = |pair: &Pair| {
            let scale = self.scale(&pair.before);
            let (before, after) = (Linework::new(&pair.before, scale), Linework::new(&pair.after, scale));
            before.furthest_from(&after).max(after.furthest_from(&before))
        };
        let spread = Spread::of(self.features.par_iter().map(each).collect());
        Hausdorff { p99_m: spread.p99, max_m: spread.max }
    }

    pub(super) fn angles(&self) -> Angles {
        let each = |pair: &Pair| {
            let scale = self.scale(&pair.before);
            let chains = pair.before.chains.iter().zip(&pair.after.chains);
            chains.flat_map(|(a, b)| corners(a, scale).into_iter().zip(corners(b, scale))).collect::<Vec<_>>()
        };
        let all = self.features.iter().flat_map(each);
        let all: Vec<[f64; 2]> = all.filter_map(|(before, after)| Some([before?, after?])).collect();
        let change = |[before, after]: &[f64; 2]| (after - before).abs().min(360.0 - (after - before).abs());
        let is_right = |angle: f64| [90.0, 270.0].iter().any(|right| (angle - right).abs() <= RIGHT_DEG);
        let right: Vec<&[f64; 2]> = all.iter().filter(|[before, _]| is_right(*before)).collect();
        let kept = right.iter().filter(|angle| change(angle) <= RIGHT_DEG).count();
        let spread = Spread::of(all.iter().map(change).collect());
        Angles {
            count: all.len(),
            mean_change_deg: spread.mean,
            p99_change_deg: spread.p99,
            right_angles: right.len(),
            right_angles_kept: if right.is_empty() { 1.0 } else { kept as f64 / right.len() as f64 },
        }
    }

    pub(super) fn areas(&self) -> Areas {
        let each = |pair: &Pair| {
            let [before, after] = [&pair.before, &pair.after].map(area);
            (before > 0.0).then(|| (after - before).abs() / before)
        };
        let changes: Vec<f64> = self.features.par_iter().filter_map(each).collect();
        let polygons = changes.len();
        let spread = Spread::of(changes);
        Areas { polygons, mean_change: spread.mean, p99_change: spread.p99, max_change: spread.max }
    }
}

/// In CRS units squared.
fn area(feature: &FeatureGeometry) -> f64 {
    Geometry::from_wkb(&feature.wkb).map_or(0.0, |geometry| geometry.area())
}

/// The angles of a chain, degrees from 0 to 360, turning left from the way back to the way on; that of the first
/// vertex of a ring, too. None where a segment has no length.
fn corners(chain: &[[f64; 2]], scale: [f64; 2]) -> Vec<Option<f64>> {
    let is_ring = chain.len() > 3 && chain.first() == chain.last();
    let closing = if is_ring { Some([chain[chain.len() - 2], chain[0], chain[1]]) } else { None };
    let inner = chain.windows(3).map(|w| [w[0], w[1], w[2]]);
    inner.chain(closing).map(|[from, at, to]| corner(from, at, to, scale)).collect()
}

fn corner(from: [f64; 2], at: [f64; 2], to: [f64; 2], scale: [f64; 2]) -> Option<f64> {
    let direction = |p: [f64; 2]| {
        let [x, y] = [0, 1].map(|i| (p[i] - at[i]) * scale[i]);
        (x != 0.0 || y != 0.0).then(|| y.atan2(x))
    };
    Some((direction(from)? - direction(to)?).to_degrees().rem_euclid(360.0))
}

/// A feature as segments (points as segments of no length), metres.
struct Linework {
    points: Vec<[f64; 2]>,
    segments: RTree<Line<[f64; 2]>>,
}

impl Linework {
    fn new(feature: &FeatureGeometry, scale: [f64; 2]) -> Self {
        let metres = |p: &[f64; 2]| [p[0] * scale[0], p[1] * scale[1]];
        let chains: Vec<Vec<[f64; 2]>> =
            feature.chains.iter().map(|c| c.iter().map(metres).collect()).collect();
        let lines = |chain: &Vec<[f64; 2]>| -> Vec<Line<[f64; 2]>> {
            match chain.as_slice() {
                [point] => vec![Line::new(*point, *point)],
                chain => chain.windows(2).map(|w| Line::new(w[0], w[1])).collect(),
            }
        };
        let segments = chains.iter().flat_map(lines).collect();
        Linework { segments: RTree::bulk_load(segments), points: chains.into_iter().flatten().collect() }
    }

    /// The distance from the other of the vertex of this one that is furthest from it.
    fn furthest_from(&self, other: &Linework) -> f64 {
        let distance2 =
            |p: &[f64; 2]| other.segments.nearest_neighbor(p).map_or(0.0, |line| line.distance_2(p));
        self.points.iter().map(distance2).fold(0.0, f64::max).sqrt()
    }
}
