//! Interpolation: the determinant det(A − σ) is a polynomial in σ, and its roots are the
//! eigenvalues. Between two shifts that isolate an eigenvalue, the root of the polynomial through
//! the determinants at the shifts around it is a close guess.
//!
//! The polynomial has its barycentric form (J.-P. Berrut, L. N. Trefethen, *Barycentric Lagrange
//! Interpolation*, SIAM Review 46, 2004), and its root is found by the Illinois method (M. Dowell,
//! P. Jarratt, *A modified regula falsi method for computing the root of an equation*, BIT 11,
//! 1971).

use super::{
    isolation::{Node, Query},
    lanes::{LANES, Lanes, sum},
};
use pulp::{Arch, Simd, WithSimd};

/// Nodes of a polynomial.
const NODES: usize = 14;
/// Nodes beside the bracket keep this distance from each other, in mean distances of eigenvalues.
const CROWDED: f64 = 0.15;
/// Steps towards its root; every third one is a bisection.
const STEPS: usize = 30;
/// The last steps are shorter than this share of the distance of the shifts.
const NARROW: f64 = 1e-5;

/// A guess is good when a node is closer than this share of the distance to the next eigenvalue.
const CLOSE: f64 = 6e-2;
/// Determinants between eigenvalues closer than this, relative to the norm of the matrix, are
/// computed in double precision.
const NARROW_GAP: f64 = 1e-4;

/// Returns guesses of the eigenvalues after the nodes `brackets`.
pub fn guesses(nodes: &[Node], brackets: &[usize]) -> Vec<f64> {
    Arch::new().dispatch(Guessing { nodes, brackets })
}

/// [`guesses`], compiled for every instruction set.
struct Guessing<'a> {
    nodes: &'a [Node],
    brackets: &'a [usize],
}

impl WithSimd for Guessing<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<f64> {
        let Guessing { nodes, brackets } = self;
        let ends = [brackets[0], brackets[brackets.len() - 1] + 1].map(|node| nodes[node].shift);
        let spacing = (ends[1] - ends[0]) / brackets.len() as f64;
        brackets.iter().map(|&first| root(nodes, first, spacing)).collect()
    }
}

/// Returns the guesses of eigenvalues after the nodes `brackets` that no node is close to.
pub fn queries(nodes: &[Node], brackets: &[usize], norm: f64) -> Vec<Query> {
    let guesses = guesses(nodes, brackets);
    let gap = |i: usize| {
        let below = if i > 0 { guesses[i] - guesses[i - 1] } else { f64::INFINITY };
        let above = guesses.get(i + 1).map_or(f64::INFINITY, |next| next - guesses[i]);
        below.min(above)
    };
    let query = |i: usize| {
        let (shift, first) = (guesses[i], brackets[i]);
        let distance = (shift - nodes[first].shift).min(nodes[first + 1].shift - shift);
        let is_precise = gap(i) < NARROW_GAP * norm;
        (distance > CLOSE * gap(i)).then_some(Query { shift, is_precise })
    };
    (0..guesses.len()).filter_map(query).collect()
}

/// Returns a guess of the only eigenvalue between node `first` and the next one, where eigenvalues
/// have a mean distance of `spacing`.
#[inline(always)]
fn root(nodes: &[Node], first: usize, spacing: f64) -> f64 {
    let polynomial = Polynomial::through(nodes, first, spacing);
    let [mut a, mut b] = [nodes[first].shift, nodes[first + 1].shift];
    let width = b - a;
    let mut f_a = polynomial.near(a);
    let mut f_b = polynomial.near(b);
    // The signs at the ends are those of the inertia, whatever the rounding.
    let mut last = f64::NAN;
    let mut last_side = 0;
    for step in 0..STEPS {
        let secant = (a * f_b - b * f_a) / (f_b - f_a);
        let is_secant = step % 3 < 2 && secant > a && secant < b;
        let x = if is_secant { secant } else { (a + b) / 2.0 };
        if is_secant && (x - last).abs() < NARROW * width {
            return x;
        }
        last = x;
        let f_x = polynomial.near(x);
        let is_left = (f_x < 0.0) == (f_a < 0.0);
        let side = if is_left { -1 } else { 1 };
        let by = if side == last_side && is_secant { 0.5 } else { 1.0 };
        if is_left {
            (a, f_a, f_b) = (x, f_x, by * f_b);
        } else {
            (b, f_b, f_a) = (x, f_x, by * f_a);
        }
        last_side = side;
    }
    last
}

/// A polynomial without the factor that has no root in the bracket. What is left of the arrays
/// behind the last node adds nothing.
struct Polynomial {
    /// The shifts of the nodes, the ends of the bracket first.
    shifts: Lanes<f64>,
    /// Determinants over the products of the distances to the other nodes.
    weighted: Lanes<f64>,
}

impl Polynomial {
    #[inline(always)]
    fn through(nodes: &[Node], first: usize, spacing: f64) -> Self {
        let (around, count) = around(nodes, first, spacing);
        let around = &around[..count];
        let trend = Trend::of(around);
        let scale = 1.0 / spacing;
        let mut shifts = [f64::INFINITY; LANES];
        around.iter().zip(&mut shifts).for_each(|(node, shift)| *shift = node.shift);
        let mut products = [1.0; LANES];
        for (number, node) in around.iter().enumerate() {
            for lane in 0..LANES {
                let distance = (shifts[lane] - node.shift) * scale;
                products[lane] *= if lane == number { 1.0 } else { distance };
            }
        }
        let mut weighted = [0.0; LANES];
        around.iter().zip(&mut weighted).for_each(|(node, value)| *value = trend.taken_from(node));
        for lane in 0..LANES {
            weighted[lane] /= products[lane];
        }
        Polynomial { shifts, weighted }
    }

    /// Returns the value at x, times a function that has one sign in the bracket.
    #[inline(always)]
    fn near(&self, x: f64) -> f64 {
        let [a, b] = [self.shifts[0], self.shifts[1]];
        if x == a {
            return self.weighted[0] * (b - a);
        }
        if x == b {
            return -self.weighted[1] * (b - a);
        }
        let mut terms = self.weighted;
        for lane in 0..LANES {
            terms[lane] /= x - self.shifts[lane];
        }
        sum(terms) * (x - a) * (b - x)
    }
}

/// Returns the nodes of the polynomial for the bracket after node `first`, and their number: its
/// ends, then the nearest ones on either side in turn. Two nodes close to each other would turn the
/// rounding of their determinants into a wrong slope.
#[inline(always)]
fn around(nodes: &[Node], first: usize, spacing: f64) -> ([Node; NODES], usize) {
    let mut around = [Node::default(); NODES];
    (around[0], around[1]) = (nodes[first], nodes[first + 1]);
    let mut count = 2;
    let mut last = [first, first + 1];
    let least = CROWDED * spacing;
    while count < NODES {
        let [low, high] = last.map(|i| nodes[i].shift);
        let below = nodes[..last[0]].iter().rposition(|node| node.shift < low - least);
        let above = nodes[last[1] + 1..].iter().position(|node| node.shift > high + least);
        if below.is_none() && above.is_none() {
            break;
        }
        for (side, next) in [below, above.map(|i| last[1] + 1 + i)].into_iter().enumerate() {
            if let (Some(next), true) = (next, count < NODES) {
                around[count] = nodes[next];
                count += 1;
                last[side] = next;
            }
        }
    }
    (around, count)
}

/// The exponential trend of the determinant, 2^(`mean` + `slope` (σ − `middle`)): most eigenvalues
/// lie on one side, so that it changes by orders of magnitude from node to node.
struct Trend {
    middle: f64,
    mean: f64,
    slope: f64,
}

impl Trend {
    #[inline(always)]
    fn of(nodes: &[Node]) -> Self {
        let count = nodes.len() as f64;
        let middle = nodes.iter().map(|node| node.shift).sum::<f64>() / count;
        let mean = nodes.iter().map(logarithm).sum::<f64>() / count;
        let [mut covariance, mut variance] = [0.0; 2];
        for node in nodes {
            let distance = node.shift - middle;
            covariance += distance * (logarithm(node) - mean);
            variance += distance * distance;
        }
        Trend { middle, mean, slope: covariance / variance }
    }

    /// Returns the determinant at a node over the trend.
    #[inline(always)]
    fn taken_from(&self, node: &Node) -> f64 {
        let exponent = f64::from(node.inertia.exponent) - self.mean - self.slope * (node.shift - self.middle);
        let size = node.inertia.mantissa * power_of_two(exponent);
        if node.inertia.below.is_multiple_of(2) { size } else { -size }
    }
}

/// Returns approximately the binary logarithm of the determinant.
#[inline(always)]
fn logarithm(node: &Node) -> f64 {
    f64::from(node.inertia.exponent) + node.inertia.mantissa - 1.0
}

/// Returns approximately 2^x, a smooth function that has the same bits on all machines.
#[inline(always)]
fn power_of_two(x: f64) -> f64 {
    let root = 1.0 + x.clamp(-500.0, 500.0) * (std::f64::consts::LN_2 / 1024.0);
    (0..10).fold(root, |power, _| power * power)
}
