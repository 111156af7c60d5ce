//! Consensus: the affine map that most pairs of places agree on, whatever the share of wrong pairs.

use super::affine::Affine;
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

/// Returns the affine map under which most pairs are within `metres` (random sample consensus,
/// Fischler and Bolles 1981, scored as by Torr and Zisserman 2000), refined by a robust fit to
/// those pairs, and their number.
pub fn consensus(pairs: &[[[f64; 2]; 2]], unit: [f64; 2], metres: f64) -> Option<(Affine, usize)> {
    if pairs.len() < 3 {
        return None;
    }
    let miss = |affine: &Affine, pair: &[[f64; 2]; 2]| {
        let p = affine.apply(pair[0]);
        ((p[0] - pair[1][0]) * unit[0]).hypot((p[1] - pair[1][1]) * unit[1])
    };
    let cost = |affine: &Affine| -> f64 {
        pairs.iter().map(|pair| miss(affine, pair).min(metres).powi(2)).sum::<f64>()
    };
    // Any fixed seed gives the same answer for the same input.
    let mut random = ChaCha8Rng::seed_from_u64(0x6d65_7368);
    let mut best: Option<(f64, Affine)> = None;
    for _ in 0..1000 {
        let chosen = [(); 3].map(|()| pairs[random.next_u64() as usize % pairs.len()]);
        let (from, to) = (chosen.map(|p| p[0]), chosen.map(|p| p[1]));
        let Some(affine) = Affine::fit(&from, &to, &[1.0; 3]) else { continue };
        let cost = cost(&affine);
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, affine));
        }
    }
    let (_, affine) = best?;
    let agreeing: Vec<_> = pairs.iter().filter(|pair| miss(&affine, pair) <= metres).collect();
    let from: Vec<_> = agreeing.iter().map(|p| p[0]).collect();
    let to: Vec<_> = agreeing.iter().map(|p| p[1]).collect();
    let fit = Affine::fit_robustly(&from, &to, 0.01 / unit[0].max(unit[1])).unwrap_or(affine);
    Some((fit, agreeing.len()))
}
