//! Distances, angles and areas.

use super::{Areas, Hausdorff, Pair, Pairs};
use gdal::vector::Geometry;
use meshmark_core::distortion::{Spread, angle_deg};
use meshmark_dataset::FeatureGeometry;
use rayon::prelude::*;
use rstar::{PointDistance, RTree, primitives::Line};

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

    /// Of every corner where it is and its angle before and after, degrees.
    pub(super) fn corners(&self) -> Vec<([f64; 2], [f64; 2])> {
        let each = |pair: &Pair| {
            let scale = self.scale(&pair.before);
            let chains = pair.before.chains.iter().zip(&pair.after.chains);
            chains.flat_map(|(a, b)| corners(a, scale).into_iter().zip(corners(b, scale))).collect::<Vec<_>>()
        };
        let all = self.features.iter().flat_map(each);
        all.filter_map(|((at, before), (_, after))| Some((at, [before?, after?]))).collect()
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

/// The places and angles of the corners of a chain, degrees from 0 to 360, turning left from the way back to the way on; that of the first
/// vertex of a ring, too. None where a segment has no length.
fn corners(chain: &[[f64; 2]], scale: [f64; 2]) -> Vec<([f64; 2], Option<f64>)> {
    let is_ring = chain.len() > 3 && chain.first() == chain.last();
    let closing = if is_ring { Some([chain[chain.len() - 2], chain[0], chain[1]]) } else { None };
    let inner = chain.windows(3).map(|w| [w[0], w[1], w[2]]);
    inner.chain(closing).map(|[from, at, to]| (at, angle_deg(from, at, to, scale))).collect()
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
