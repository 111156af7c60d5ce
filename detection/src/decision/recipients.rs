//! The decision on fingerprints: one null hypothesis for all.
//!
//! *Was this recipient's copy used?* For a recipient who had no part in the suspect, the signs are
//! random and independent of it, whatever happened to it, and under a wrong key they are so for
//! everybody. The score T is then a weighted sum of independent random signs of variance 1, whose
//! tail is bounded without any assumption about the weights ([`survival::signs_log10`]). Among many
//! candidates, p is multiplied by their number (Bonferroni).
//!
//! *Who else?* In a mixture of copies everybody's share is noise for the others. Candidates that are
//! certain are taken out, and the others are scored on what remains (joint decoding: P. Meerwald,
//! T. Furon, *Towards joint Tardos decoding: the "Don Quixote" algorithm*, Information Hiding,
//! LNCS 6958, 2011). What remains depends on the suspect and on those taken out alone, so that the
//! signs of an innocent candidate are independent of it, too. Round m multiplies p by m (m + 1):
//! the sum of 1 / (m (m + 1)) is 1, so that the significance is that of all rounds together.
//!
//! *Beside others.* In a mixture of many copies nobody may be certain at first. Each candidate is
//! then scored on what remains without all *other* candidates that are suspected
//! ([`Evidence::scores_beside_others`]), which is independent of its own signs just as well.
//!
//! *Whose share?* In a mosaic everybody's share is weak in the sums of all signs, and exact where it
//! is. The wealth of a gambler who bets on the signs is the evidence then ([`Standing::bet`]).

use super::{any_message, survival};
use meshmark_core::{
    Result,
    agreement::{Agreement, Evidence},
    signs::Sequence,
};
use rayon::prelude::*;

/// Bets, and each of three scores without pilots, have a hundredth of the error that the first scores
/// have: their p-values are multiplied by 100, and all together err by at most 1.04 times the
/// significance.
const FURTHER_TESTS_LOG10: f64 = 2.0;

/// At most so many innocent candidates are suspected, and at most this share of all.
const SUSPECTED_BY_CHANCE: f64 = 32.0;
const MOST_SUSPECTED: f64 = 0.05;

/// More rounds name nobody else: every round needs stronger evidence.
const MOST_ROUNDS: usize = 20;

/// Returns log₁₀ of a bound of the probability of this score for a recipient, or for pilots, that
/// have nothing to do with the suspect.
pub fn p_log10(score: f64) -> f64 {
    survival::signs_log10(score)
}

/// Returns the least score that a recipient, one of the `tried`, needs to be named.
pub fn needed_score(tried: usize, significance: f64) -> f64 {
    survival::signs_quantile(significance / (tried as f64 * 10f64.powf(rounds_log10(1, tried))))
}

/// Returns the score from which on a candidate is suspected beside others: as many as this of the
/// `tried` have it by chance.
pub(crate) fn suspected_score(tried: usize) -> f64 {
    survival::signs_quantile((SUSPECTED_BY_CHANCE / tried as f64).min(MOST_SUSPECTED))
}

/// Returns whether a mark of the key is detected, given the score of its pilots.
pub fn shows_key(score: f64) -> bool {
    any_message::shows_key(Some(p_log10(score)))
}

/// A candidate among all that were tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// The agreement with the whole suspect.
    pub agreement: Agreement,
    /// The score in the round of the smallest p-value, on what other recipients left.
    pub score: f64,
    /// The round of the smallest p-value, counted from 1: how often others were taken out, and 1.
    pub round: usize,
    /// log₁₀ of the smallest p-value of all rounds, or of the bets, alone.
    pub p_alone_log10: f64,
    /// log₁₀ of this p-value times the number of candidates and the factor of the round.
    pub p_value_log10: f64,
    /// Whether it is that of bets on a share of the coordinates, see [`meshmark_core::mosaic`].
    pub is_of_share: bool,
    /// Whether this p-value is below the significance.
    pub is_named: bool,
}

/// Returns the standing of every candidate in evidence alone, in the order given.
pub fn name_recipients(evidence: &Evidence, candidates: &[Sequence], significance: f64) -> Vec<Standing> {
    let tried = candidates.len();
    let linear = |named: &[usize], _: &[usize]| {
        Ok(evidence.without(&named.iter().map(|&k| candidates[k].clone()).collect::<Vec<_>>()))
    };
    name_in_rounds(evidence, candidates, (tried, significance), linear).expect("nothing fails")
}

/// Returns the standing of every candidate, in the order given; `tried` counts them and those that
/// are scored on other evidence, and the significance is for all of these. `rest` returns what remains without
/// some, of which the second ones were named in the last round; it may depend on the suspect and on
/// them alone.
///
/// # Errors
/// Returns the errors of `rest`.
pub fn name_in_rounds(
    evidence: &Evidence,
    candidates: &[Sequence],
    (tried, significance): (usize, f64),
    mut rest: impl FnMut(&[usize], &[usize]) -> Result<Evidence>,
) -> Result<Vec<Standing>> {
    let first = |signs: &Sequence| {
        let agreement = evidence.agreement(signs);
        let p_value_log10 = p_value_log10(agreement.score, 1, tried);
        let is_named = p_value_log10 < significance.log10();
        let p_alone_log10 = p_log10(agreement.score).min(0.0);
        let (score, round, is_of_share) = (agreement.score, 1, false);
        Standing { agreement, score, round, p_alone_log10, p_value_log10, is_of_share, is_named }
    };
    let mut standings: Vec<Standing> = candidates.par_iter().map(first).collect();
    let (mut named, mut round) = (Vec::new(), 1);
    while round < MOST_ROUNDS {
        round += 1;
        let new: Vec<usize> =
            (0..candidates.len()).filter(|k| standings[*k].is_named && !named.contains(k)).collect();
        named.extend(&new);
        if new.is_empty() || named.len() == candidates.len() {
            break;
        }
        let rest = rest(&named, &new)?;
        let again = |(standing, signs): (&mut Standing, &Sequence)| {
            let score = rest.agreement(signs).score;
            let p_value_log10 = p_value_log10(score, round, tried);
            if p_value_log10 < standing.p_value_log10 {
                let is_named = p_value_log10 < significance.log10();
                let p_alone_log10 = p_log10(score).min(0.0);
                *standing = Standing { score, round, p_alone_log10, p_value_log10, is_named, ..*standing };
            }
        };
        let others = standings.par_iter_mut().zip(candidates).filter(|(standing, _)| !standing.is_named);
        others.for_each(again);
    }
    Ok(standings)
}

impl Standing {
    /// Takes the score in further evidence where it is the stronger one. One of the `tried`, whose
    /// significance together is this one.
    pub fn take(&mut self, score: f64, tried: (usize, f64)) {
        if self.improve((p_log10(score) + FURTHER_TESTS_LOG10).min(0.0), tried) {
            *self = Standing { score, is_of_share: false, ..*self };
        }
    }

    /// Takes the wealth of a gambler, log₁₀, for evidence where it is stronger than the score.
    pub fn bet(&mut self, wealth_log10: f64, tried: (usize, f64)) {
        if self.improve((FURTHER_TESTS_LOG10 - wealth_log10).min(0.0), tried) {
            self.is_of_share = true;
        }
    }

    /// Takes a p-value where it is smaller, and returns whether it is.
    fn improve(&mut self, p_alone_log10: f64, (tried, significance): (usize, f64)) -> bool {
        let p_value_log10 = (p_alone_log10 + (tried as f64).log10()).min(0.0);
        let is_smaller = p_value_log10 < self.p_value_log10;
        if is_smaller {
            let is_named = p_value_log10 < significance.log10();
            *self = Standing { p_alone_log10, p_value_log10, is_named, round: 1, ..*self };
        }
        is_smaller
    }
}

/// Returns log₁₀ of the p-value of a score in a round among so many candidates.
fn p_value_log10(score: f64, round: usize, tried: usize) -> f64 {
    (p_log10(score) + (tried as f64).log10() + rounds_log10(round, tried)).min(0.0)
}

/// Returns log₁₀ of the factor of a round. A single candidate has no second round.
fn rounds_log10(round: usize, tried: usize) -> f64 {
    if tried == 1 { 0.0 } else { ((round * (round + 1)) as f64).log10() }
}
