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
//! known predict these better and better, which tells them from the others.

use crate::{
    Result,
    covariance::Found,
    deformation::Observed,
    derived::Observables,
    options::Parameters,
    patches::Patch,
    response::Response,
    signs::{Signs, is_pilot},
    spectrum::Basis,
};
use rayon::prelude::*;
use std::f64::consts::{LN_2, LN_10};

/// What a gambler believes: the share of the recipient's coordinates, and the standard deviation of
/// these from the recipient's copy, metres.
const BELIEFS: [(f64, f64); 4] = [(0.25, 0.004), (0.25, 0.04), (0.05, 0.004), (0.05, 0.04)];

/// How much of the log-odds a gambler trusts: the vertices of a house move together, and count as
/// many times.
const TRUST: [f64; 5] = [1.0, 0.5, 0.25, 0.12, 0.06];

/// The coordinates are judged anew after so many signs.
const BLOCK: usize = 8;

/// Returns log₁₀ of the wealth for every recipient of `candidates`; `pilots` are the signs that all
/// copies share. Every view has the displacement of every point in order, metres, or `None`: the
/// suspect as it stands, or registered; the gamblers of each have an equal share of the stakes.
///
/// # Errors
/// Fails when a patch cannot be solved.
pub fn wealth_log10<'a, S: Signs>(
    of: impl Into<Observables<'a>>,
    views: &[&Observed],
    coefficients: usize,
    parameters: &Parameters,
    pilots: &dyn Signs,
    candidates: &[S],
) -> Result<Vec<f64>> {
    let of = of.into();
    let of_patch = |(number, patch): (usize, &Patch)| -> Result<Vec<Vec<Wealth>>> {
        let basis = Basis::low_frequencies(patch, coefficients + 1)?;
        let response = Response::carriers(patch, &basis, parameters);
        let pilots = signs_of(pilots, number, coefficients);
        let of_view = |observed: &&Observed| -> Vec<Wealth> {
            let found = Found::new(of, number, observed);
            if found.rows.is_empty() {
                return vec![[0.0; GAMBLERS]; candidates.len()];
            }
            let seen = of.seen(number, &response, &found.rows);
            let table = Table::new(&seen, &found, parameters.amplitude_m, &pilots);
            candidates.iter().map(|signs| table.bet(&signs_of(signs, number, coefficients))).collect()
        };
        Ok(views.iter().map(of_view).collect())
    };
    let patches = of.patches().as_slice().par_iter().enumerate();
    let all: Vec<Vec<Vec<Wealth>>> = patches.map(of_patch).collect::<Result<_>>()?;
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
    /// The displacements of all coordinates without the pilots, metres.
    moved: Vec<f64>,
    /// Numbers of the signs on which bets are made, those that move the map most first, and their
    /// contributions to all coordinates, metres.
    columns: Vec<(usize, Vec<f64>)>,
    /// The variance of every coordinate by all these signs.
    variance: Vec<f64>,
}

impl Table {
    fn new(response: &Response, found: &Found, amplitude_m: f64, pilots: &[f64]) -> Self {
        let mut moved: Vec<f64> =
            [0, 1].iter().flat_map(|&axis| found.moved.col(axis).iter().copied()).collect();
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
        Table { moved, columns, variance }
    }

    /// Returns the logarithm of every gambler's wealth.
    fn bet(&self, signs: &[f64]) -> Wealth {
        let mut wealth = [0.0; GAMBLERS];
        for (belief, wealth) in BELIEFS.iter().zip(wealth.chunks_mut(TRUST.len())) {
            self.bet_with(*belief, signs, wealth);
        }
        wealth
    }

    fn bet_with(&self, (share, noise_m): (f64, f64), signs: &[f64], wealth: &mut [f64]) {
        let noise = noise_m * noise_m;
        let (mut rest, mut unknown) = (self.moved.clone(), self.variance.clone());
        let mut weights = vec![0.0; rest.len()];
        for block in self.columns.chunks(BLOCK) {
            for (v, weight) in weights.iter_mut().enumerate() {
                let (own, all) = (unknown[v].max(0.0) + noise, self.variance[v] + noise);
                let odds = (1.0 - share) / share
                    * (own / all).sqrt()
                    * (0.5 * (rest[v] * rest[v] / own - self.moved[v] * self.moved[v] / all)).exp();
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
