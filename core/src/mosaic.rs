//! The evidence for a recipient in a mixture that has every coordinate from one of several copies: a
//! mosaic of vertices or features, or the least or the largest values.
//!
//! There a recipient's share of all coordinates is small, but exact. The test is one by betting (G.
//! Shafer, *Testing by betting*, J. R. Stat. Soc. A 184, 2021; J. Ville, 1939): a gambler bets on the
//! signs of the recipient one after the other, and knows those before. For a recipient who has
//! nothing to do with the suspect they are fair coins, whatever the gambler believes, so that the
//! wealth has an expectation of 1 and reaches 1 / p with a probability of at most p.
//!
//! The gambler believes that a share of the coordinates is the recipient's: the signs that are
//! known predict these better and better, which tells them from the others. Coordinates that lie
//! where copies of other candidates have them are probably theirs; how many these gave follows from
//! the suspect and their signs alone.

use crate::{
    Result,
    covariance::Found,
    deformation::Observed,
    derived::Observables,
    options::Parameters,
    patches::{Patch, Patches},
    response::Response,
    signs::{Signs, is_pilot},
    spectrum::Basis,
};
use rayon::prelude::*;
use std::f64::consts::{LN_2, LN_10, TAU};

/// What a gambler believes: the share of the recipient's coordinates, and the standard deviation of
/// these from the recipient's copy, metres.
const BELIEFS: [(f64, f64); 5] = [(0.25, 0.004), (0.25, 0.04), (0.05, 0.001), (0.05, 0.004), (0.05, 0.04)];

/// A coordinate within so many standard deviations is counted as that of a copy.
const NEAR: f64 = 2.0;
/// A copy has a share where so many standard deviations more coordinates are near it than near its
/// opposite, whose signs nobody has.
const LEAST_DEVIATIONS: f64 = 3.0;

/// How much of the log-odds a gambler trusts: the vertices of a house move together, and count as
/// many times.
const TRUST: [f64; 5] = [1.0, 0.5, 0.25, 0.12, 0.06];

/// The coordinates are judged anew after so many signs.
const BLOCK: usize = 8;

/// The suspect, as bets see it: the displacement of every vertex in order, metres, or `None`; and the
/// shares that candidates have in it for each belief.
pub struct View<'a> {
    observed: &'a Observed,
    /// The candidates that have a share, and this.
    shares: [Vec<(usize, f64)>; BELIEFS.len()],
}

impl<'a> View<'a> {
    /// Estimates the shares of copies, which have these displacements, metres; `pilots_m` are those
    /// that all copies have.
    pub fn new(observed: &'a Observed, copies_m: &[Vec<[f64; 2]>], pilots_m: &[[f64; 2]]) -> Self {
        let shares = BELIEFS.map(|(_, noise_m)| {
            let share = |copy_m: &Vec<[f64; 2]>| share(observed, copy_m, pilots_m, NEAR * noise_m);
            let all: Vec<f64> = copies_m.par_iter().map(share).collect();
            all.into_iter().enumerate().filter(|(_, share)| *share > 0.0).collect()
        });
        View { observed, shares }
    }
}

/// Returns the share of the coordinates that are those of a copy, or 0 where that may be chance.
fn share(observed: &Observed, copy_m: &[[f64; 2]], pilots_m: &[[f64; 2]], near_m: f64) -> f64 {
    let (mut all, mut own, mut opposite) = (0.0_f64, 0.0_f64, 0.0_f64);
    for ((seen, copy), pilot) in observed.iter().zip(copy_m).zip(pilots_m) {
        for axis in 0..2 {
            let Some(seen) = seen.map(|seen| seen[axis] - pilot[axis]) else { continue };
            let copy = copy[axis] - pilot[axis];
            all += 1.0;
            own += f64::from((seen - copy).abs() < near_m);
            opposite += f64::from((seen + copy).abs() < near_m);
        }
    }
    let more = own - opposite;
    if more > LEAST_DEVIATIONS * f64::sqrt(own + opposite) { more / all } else { 0.0 }
}

/// Returns log₁₀ of the wealth for every recipient of `candidates`, whose copies have the
/// displacements `copies_m`; `pilots` are the signs that all copies share. The gamblers of each view
/// have an equal share of the stakes.
///
/// # Errors
/// Fails when a patch cannot be solved.
pub fn wealth_log10<S: Signs>(
    patches: &Patches,
    views: &[View],
    (coefficients, parameters): (usize, &Parameters),
    pilots: &dyn Signs,
    (candidates, copies_m): (&[S], &[Vec<[f64; 2]>]),
) -> Result<Vec<f64>> {
    let of = Observables::from(patches);
    let of_patch = |(number, patch): (usize, &Patch)| -> Result<Vec<Vec<Wealth>>> {
        let basis = Basis::low_frequencies(patch, coefficients + 1)?;
        let response = Response::carriers(patch, &basis, parameters);
        let pilots = signs_of(pilots, number, coefficients);
        let of_view = |view: &View| -> Vec<Wealth> {
            let found = Found::new(of, number, view.observed);
            if found.rows.is_empty() {
                return vec![[0.0; GAMBLERS]; candidates.len()];
            }
            let seen = of.seen(number, &response, &found.rows);
            let table = Table::new(&seen, &found, parameters.amplitude_m, &pilots);
            let vertices: Vec<u32> = found.rows.iter().map(|&row| of.in_patch(number)[row]).collect();
            let others = Others::new(&table, view, &vertices, copies_m);
            let bet = |(k, signs): (usize, &S)| table.bet(&signs_of(signs, number, coefficients), &others, k);
            candidates.iter().enumerate().map(bet).collect()
        };
        Ok(views.iter().map(of_view).collect())
    };
    let all = patches.as_slice().par_iter().enumerate().map(of_patch);
    let all: Vec<Vec<Vec<Wealth>>> = all.collect::<Result<_>>()?;
    let of_view = |view: usize, candidate: usize| sum(all.iter().map(|patch| &patch[view][candidate]));
    let of_candidate = |candidate: usize| {
        mean_log10(&(0..views.len()).flat_map(|view| of_view(view, candidate)).collect::<Vec<f64>>())
    };
    Ok((0..candidates.len()).map(of_candidate).collect())
}

const GAMBLERS: usize = BELIEFS.len() * TRUST.len();

/// The natural logarithm of every gambler's wealth, of 1 before the first bet.
type Wealth = [f64; GAMBLERS];

/// Returns the signs of both axes of a patch, those of x first.
fn signs_of(signs: &dyn Signs, patch: usize, coefficients: usize) -> Vec<f64> {
    [0, 1].map(|axis| signs.signs(patch, axis, coefficients)).concat()
}

/// Returns the logarithms of the gamblers' wealths after all patches.
fn sum<'a>(patches: impl Iterator<Item = &'a Wealth>) -> Wealth {
    patches.fold([0.0; GAMBLERS], |sums, wealth| std::array::from_fn(|g| sums[g] + wealth[g]))
}

/// Returns log₁₀ of the mean of wealths, of which the natural logarithms are given.
fn mean_log10(wealths: &[f64]) -> f64 {
    let most = wealths.iter().copied().fold(f64::MIN, f64::max);
    let mean = wealths.iter().map(|wealth| (wealth - most).exp()).sum::<f64>() / wealths.len() as f64;
    (most + mean.ln()) / LN_10
}

/// A patch as a gambler sees it: coordinates, and what each sign contributes to them.
struct Table {
    /// The displacements of all coordinates, x first, metres.
    displaced: Vec<f64>,
    /// The same without the pilots.
    moved: Vec<f64>,
    /// Numbers of the signs on which bets are made, those that move the map most first, and their
    /// contributions to all coordinates, metres.
    columns: Vec<(usize, Vec<f64>)>,
    /// The variance of every coordinate by all these signs.
    variance: Vec<f64>,
    /// The mean square of the displacements as a share of that of a copy, 1 at most: averages and
    /// medians of many copies have less.
    spread: f64,
}

impl Table {
    fn new(response: &Response, found: &Found, amplitude_m: f64, pilots: &[f64]) -> Self {
        let displaced: Vec<f64> =
            [0, 1].iter().flat_map(|&axis| found.moved.col(axis).iter().copied()).collect();
        let mut moved = displaced.clone();
        let mut columns = Vec::new();
        for (number, column) in response.columns_of_coordinates().into_iter().enumerate() {
            let column: Vec<f64> = column.into_iter().map(|value| amplitude_m * value).collect();
            match is_pilot(number % (pilots.len() / 2) + 1) {
                true => moved.iter_mut().zip(&column).for_each(|(y, c)| *y -= pilots[number] * c),
                false => columns.push((number, column)),
            }
        }
        let energy = |column: &[f64]| column.iter().map(|value| value * value).sum::<f64>();
        columns.sort_by(|(_, a), (_, b)| energy(b).total_cmp(&energy(a)));
        let mut variance = vec![0.0; moved.len()];
        for (_, column) in &columns {
            variance.iter_mut().zip(column).for_each(|(sum, value)| *sum += value * value);
        }
        let [seen, of_copy] = [moved.iter().map(|y| y * y).sum::<f64>(), variance.iter().sum()];
        let spread = if seen < of_copy { seen / of_copy } else { 1.0 };
        Table { displaced, moved, columns, variance, spread }
    }

    /// Returns the logarithm of every gambler's wealth who bets on candidate `number`.
    fn bet(&self, signs: &[f64], others: &Others, number: usize) -> Wealth {
        let mut wealth = [0.0; GAMBLERS];
        for (belief, wealth) in wealth.chunks_mut(TRUST.len()).enumerate() {
            let elsewhere = others.densities_log(self, belief, number);
            self.bet_with(BELIEFS[belief], &elsewhere, signs, wealth);
        }
        wealth
    }

    /// `elsewhere` has the logarithm of the density of every coordinate if it is not the recipient's.
    fn bet_with(&self, (share, noise_m): (f64, f64), elsewhere: &[f64], signs: &[f64], wealth: &mut [f64]) {
        let noise = noise_m * noise_m;
        let (mut rest, mut unknown) = (self.moved.clone(), self.variance.clone());
        let mut weights = vec![0.0; rest.len()];
        for block in self.columns.chunks(BLOCK) {
            for (v, weight) in weights.iter_mut().enumerate() {
                let own = unknown[v].max(0.0) + noise;
                let odds = (1.0 - share) / share * (elsewhere[v] - normal_log(rest[v], own)).exp();
                *weight = 1.0 / (1.0 + odds) / own;
            }
            for (number, column) in block {
                let sign = signs[*number];
                let odds: f64 =
                    2.0 * weights.iter().zip(&rest).zip(column).map(|((w, r), c)| w * r * c).sum::<f64>();
                for (wealth, trust) in wealth.iter_mut().zip(TRUST) {
                    // 2 P(sign)
                    let against = -trust * sign * odds;
                    *wealth += LN_2 - against.max(0.0) - (-against.abs()).exp().ln_1p();
                }
                for ((rest, unknown), c) in rest.iter_mut().zip(&mut unknown).zip(column) {
                    *rest -= sign * c;
                    *unknown -= c * c;
                }
            }
        }
    }
}

/// The copies of candidates that have a share, as the coordinates of a patch see them.
struct Others {
    /// For every belief: the candidates, their shares, and these times the density of every
    /// coordinate if it is theirs.
    of_beliefs: Vec<Vec<(usize, f64, Vec<f64>)>>,
}

impl Others {
    fn new(table: &Table, view: &View, vertices: &[u32], copies_m: &[Vec<[f64; 2]>]) -> Self {
        let of_belief = |(belief, &(_, noise_m)): (usize, &(f64, f64))| {
            let of_copy = |&(number, share): &(usize, f64)| {
                let copy = [0, 1].iter().flat_map(|&axis| {
                    vertices.iter().map(move |&vertex| copies_m[number][vertex as usize][axis])
                });
                let gaps = table.displaced.iter().zip(copy).map(|(seen, copy)| seen - copy);
                let density = gaps.map(|gap| share * normal_log(gap, noise_m * noise_m).exp());
                (number, share, density.collect())
            };
            view.shares[belief].iter().map(of_copy).collect()
        };
        Others { of_beliefs: BELIEFS.iter().enumerate().map(of_belief).collect() }
    }

    /// Returns the logarithm of the density of every coordinate under a belief, if it is not that of
    /// candidate `own`.
    fn densities_log(&self, table: &Table, belief: usize, own: usize) -> Vec<f64> {
        let noise = BELIEFS[belief].1.powi(2);
        let others = || self.of_beliefs[belief].iter().filter(|(number, ..)| *number != own);
        let sum = others().fold(0.0, |sum, (_, share, _)| sum + share);
        let scale = f64::min(1.0, (1.0 - LEAST_NOBODYS) / sum);
        let nobodys = (1.0 - scale * sum).ln();
        let mut of_others = vec![0.0; table.moved.len()];
        for (_, _, density) in others() {
            of_others.iter_mut().zip(density).for_each(|(sum, density)| *sum += scale * density);
        }
        let coordinates = table.moved.iter().zip(&table.variance).zip(of_others);
        let log = |((moved, all), of_others): ((&f64, &f64), f64)| {
            let (nobodys, of_others) =
                (nobodys + normal_log(*moved, table.spread * all + noise), of_others.ln());
            nobodys.max(of_others) + (-(nobodys - of_others).abs()).exp().ln_1p()
        };
        coordinates.map(log).collect()
    }
}

/// This share of the coordinates at least is that of nobody who is listed.
const LEAST_NOBODYS: f64 = 0.01;

/// Returns the logarithm of the density of the normal distribution with mean 0.
fn normal_log(x: f64, variance: f64) -> f64 {
    -0.5 * (x * x / variance + (TAU * variance).ln())
}
