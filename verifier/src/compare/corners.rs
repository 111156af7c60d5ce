//! Angles.

use super::{Pair, Pairs};
use meshmark_core::distortion::angle_deg;

impl Pairs<'_> {
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
}

/// The places and angles of the corners of a chain, degrees from 0 to 360, turning left from the way back to the way on; that of the first
/// vertex of a ring, too. None where a segment has no length.
fn corners(chain: &[[f64; 2]], scale: [f64; 2]) -> Vec<([f64; 2], Option<f64>)> {
    let is_ring = chain.len() > 3 && chain.first() == chain.last();
    let closing = if is_ring { Some([chain[chain.len() - 2], chain[0], chain[1]]) } else { None };
    let inner = chain.windows(3).map(|w| [w[0], w[1], w[2]]);
    inner.chain(closing).map(|[from, at, to]| (at, angle_deg(from, at, to, scale))).collect()
}
