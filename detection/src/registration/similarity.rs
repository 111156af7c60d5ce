//! Votes for a similarity: the one under which most shapes of a suspect lie on like shapes of the
//! reference.

use super::{affine::Affine, moments::Likeness};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};
use std::f64::consts::PI;

/// Number of likenesses that vote, those of the largest shapes first.
const MOST_VOTES: usize = 8000;
/// Number of pairs that each propose a similarity.
const TRIALS: usize = 100_000;
/// Sizes agree within this, as a logarithm.
const SIZE: f64 = 0.1;
/// Directions agree within this, radians.
const TURN: f64 = 0.12;
/// Two places this close together, metres, determine no similarity.
const LEAST_APART_M: f64 = 30.0;
/// Fewer likenesses that agree are chance.
const LEAST_AGREE: usize = 6;

/// z′ = turn · z + shift, where z is mirrored at the x axis first if `mirrored`.
#[derive(Clone, Copy)]
struct Similarity {
    mirrored: bool,
    /// Cosine and sine of the turn, times the scale.
    turn: [f64; 2],
    shift: [f64; 2],
}

impl Similarity {
    /// Returns the similarity that maps two places onto two others.
    fn between(a: &Likeness, b: &Likeness, mirrored: bool) -> Option<Self> {
        let flip = |[x, y]: [f64; 2]| if mirrored { [x, -y] } else { [x, y] };
        let ([p, q], [r, s]) = ([a, b].map(|pair| flip(pair.places[0])), [a, b].map(|pair| pair.places[1]));
        let (from, to) = ([q[0] - p[0], q[1] - p[1]], [s[0] - r[0], s[1] - r[1]]);
        let length2 = from[0] * from[0] + from[1] * from[1];
        if length2 < LEAST_APART_M.powi(2) {
            return None;
        }
        let turn =
            [(to[0] * from[0] + to[1] * from[1]) / length2, (to[1] * from[0] - to[0] * from[1]) / length2];
        let shift = [r[0] - turn[0] * p[0] + turn[1] * p[1], r[1] - turn[1] * p[0] - turn[0] * p[1]];
        Some(Similarity { mirrored, turn, shift })
    }

    fn affine(&self) -> Affine {
        let ([c, s], flip) = (self.turn, if self.mirrored { -1.0 } else { 1.0 });
        Affine { coefficients: [c, -s * flip, self.shift[0], s, c * flip, self.shift[1]] }
    }

    fn log_scale(&self) -> f64 {
        self.turn[0].hypot(self.turn[1]).ln()
    }

    /// Returns whether size and direction of a shape agree with the similarity.
    fn suits(&self, likeness: &Likeness) -> bool {
        let [from, to] = likeness.directions;
        let turned = self.turn[1].atan2(self.turn[0]) + if self.mirrored { -from } else { from };
        let turn = (to - turned).rem_euclid(PI);
        (self.log_scale() - likeness.log_scale).abs() < SIZE && turn.min(PI - turn) < TURN
    }
}

/// Returns the affine map, in the plane of the places, on which most likenesses agree to within
/// `metres`, and their number (random sample consensus, Fischler and Bolles 1981).
pub fn vote(likenesses: &[Likeness], metres: f64) -> Option<(Affine, usize)> {
    let votes = &likenesses[..likenesses.len().min(MOST_VOTES)];
    if votes.is_empty() {
        return None;
    }
    // Any fixed seed gives the same answer for the same input.
    let mut random = ChaCha8Rng::seed_from_u64(0x6d65_7368);
    let mut any = || &votes[random.next_u64() as usize % votes.len()];
    let mut best: Option<(usize, Similarity)> = None;
    for trial in 0..TRIALS {
        let (a, b) = (any(), any());
        let Some(similarity) = Similarity::between(a, b, trial % 2 == 1) else { continue };
        if !similarity.suits(a) || !similarity.suits(b) {
            continue;
        }
        let agree = agreeing(votes, &similarity, metres).count();
        if best.is_none_or(|(most, _)| agree > most) {
            best = Some((agree, similarity));
        }
    }
    let (agree, similarity) = best.filter(|(agree, _)| *agree >= LEAST_AGREE)?;
    let [from, to] = [0, 1].map(|side| -> Vec<[f64; 2]> {
        agreeing(votes, &similarity, metres).map(|likeness| likeness.places[side]).collect()
    });
    let affine = Affine::fit_robustly(&from, &to, 0.01).unwrap_or(similarity.affine());
    Some((affine, agree))
}

fn agreeing<'a>(
    votes: &'a [Likeness],
    similarity: &Similarity,
    metres: f64,
) -> impl Iterator<Item = &'a Likeness> {
    let (affine, log_scale) = (similarity.affine(), similarity.log_scale());
    votes.iter().filter(move |likeness| {
        let [x, y] = affine.apply(likeness.places[0]);
        let [u, v] = likeness.places[1];
        (x - u).hypot(y - v) <= metres && (log_scale - likeness.log_scale).abs() < SIZE
    })
}
