//! Isolation: shifts are added until no two of the wanted eigenvalues lie between two neighbours
//! (spectrum slicing; B. N. Parlett, *The Symmetric Eigenvalue Problem*, SIAM, 1998, section 3.3).
//!
//! Counts may be wrong next to an eigenvalue, as most are made in single precision. A wrong count
//! costs time, or the proof fails.

use super::factor::Inertia;

/// The first shifts divide the range of all eigenvalues into this many parts.
const PARTS: usize = 31;
/// So many eigenvalues above the wanted ones are isolated too: their shifts are nodes of
/// interpolation.
const MARGIN: usize = 3;
/// Rounds of shifts. Each divides the distance of two shifts by three or more.
const ROUNDS: usize = 14;
/// Counts between shifts closer than this are made in double precision. Sizes are relative to the
/// norm of the matrix.
const NARROW: f64 = 1e-4;
/// A matrix with more narrow gaps than this has too many eigenvalues that nearly agree; a share of
/// the wanted eigenvalues comes on top.
const MOST_NARROW: usize = 12;
/// See [`MOST_NARROW`]: one in so many.
const NARROW_SHARE: usize = 8;
/// Eigenvalues closer than this are not isolated.
const LEAST_GAP: f64 = 1e-6;

/// A shift, with its inertia and determinant.
#[derive(Debug, Clone, Copy, Default)]
pub struct Node {
    /// σ.
    pub shift: f64,
    /// What is below it.
    pub inertia: Inertia,
}

/// A shift whose inertia is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Query {
    /// σ.
    pub shift: f64,
    /// Whether double precision is needed.
    pub is_precise: bool,
}

/// Returns shifts in ascending order that isolate the `count` lowest eigenvalues of n in `range`;
/// `evaluate` returns the nodes of any shifts.
///
/// It is `None` when some are too close to each other.
pub fn isolate(
    [low, high]: [f64; 2],
    [count, n]: [usize; 2],
    mut evaluate: impl FnMut(&[Query]) -> Vec<Node>,
) -> Option<Vec<Node>> {
    let norm = low.abs().max(high.abs());
    let part = (high - low) / PARTS as f64;
    let rough = |shift: f64| Query { shift, is_precise: false };
    let first: Vec<Query> = (0..=PARTS).map(|i| rough(low + part * i as f64)).collect();
    let mut nodes = consistent(evaluate(&first));
    let wanted = (count + MARGIN).min(n);
    for round in 0..ROUNDS {
        let queries = queries(&nodes, wanted, norm, round)?;
        if queries.is_empty() {
            break;
        }
        nodes = merged(nodes, evaluate(&queries));
    }
    Some(nodes)
}

/// Adds nodes.
pub fn merged(mut nodes: Vec<Node>, more: Vec<Node>) -> Vec<Node> {
    nodes.extend(more);
    nodes.sort_by(|a, b| a.shift.total_cmp(&b.shift));
    consistent(nodes)
}

/// Returns for each of the lowest eigenvalues the node before it, when it is alone there.
pub fn brackets(nodes: &[Node], count: usize) -> Option<Vec<usize>> {
    let mut brackets = Vec::with_capacity(count);
    for (first, pair) in nodes.windows(2).enumerate() {
        let [below, above] = [pair[0].inertia.below, pair[1].inertia.below];
        if below == brackets.len() && above == below + 1 && brackets.len() < count {
            brackets.push(first);
        }
    }
    (brackets.len() == count).then_some(brackets)
}

/// Returns the next shifts: one for every eigenvalue that is not isolated; in the first round one
/// for every eigenvalue.
fn queries(nodes: &[Node], wanted: usize, norm: f64, round: usize) -> Option<Vec<Query>> {
    let mut queries = Vec::new();
    let mut narrow = 0;
    for pair in nodes.windows(2) {
        let [below, above] = [pair[0].inertia.below, pair[1].inertia.below];
        let crowd = above - below;
        if below >= wanted || crowd == 0 || (crowd == 1 && round > 0) {
            continue;
        }
        let [low, high] = [pair[0].shift, pair[1].shift];
        let is_narrow = high - low < NARROW * norm;
        narrow += usize::from(is_narrow && crowd > 1);
        if high - low < LEAST_GAP * norm || narrow > MOST_NARROW + wanted / NARROW_SHARE {
            return None;
        }
        let is_precise = is_narrow || round > ROUNDS / 2;
        let step = (high - low) / (crowd + 1) as f64;
        queries.extend((1..=crowd).map(|i| Query { shift: low + step * i as f64, is_precise }));
    }
    Some(queries)
}

/// Drops nodes whose count contradicts those around.
fn consistent(nodes: Vec<Node>) -> Vec<Node> {
    let mut highest = usize::MAX;
    let mut kept: Vec<Node> = Vec::with_capacity(nodes.len());
    for node in nodes.into_iter().rev() {
        if node.inertia.below <= highest && node.inertia.mantissa.is_finite() {
            highest = node.inertia.below;
            kept.push(node);
        }
    }
    kept.reverse();
    kept
}
