//! Matching with neighbours along rings and lines: where several suspect vertices are near a
//! reference vertex, the matched neighbours of each decide among them.

use super::matches::Matches;
use rayon::prelude::*;

/// The graph of vertices that rings and lines join, as concatenated lists of neighbours.
#[derive(Debug, Clone)]
pub(crate) struct Graph {
    /// Index of the first neighbour of vertex v; entry v + 1 is the end of its list.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// Builds the graph of `vertices` vertices from segments, each pair of indices once.
    pub fn new(vertices: usize, segments: &[[u32; 2]]) -> Self {
        let mut starts = vec![0u32; vertices + 1];
        for v in segments.as_flattened() {
            starts[*v as usize + 1] += 1;
        }
        for v in 0..vertices {
            starts[v + 1] += starts[v];
        }
        let mut free = starts.clone();
        let mut neighbours = vec![0; 2 * segments.len()];
        for &[a, b] in segments {
            for (from, to) in [(a, b), (b, a)] {
                neighbours[free[from as usize] as usize] = to;
                free[from as usize] += 1;
            }
        }
        Graph { starts, neighbours }
    }

    /// Returns whether a segment joins two vertices.
    pub(crate) fn is_joined(&self, a: u32, b: u32) -> bool {
        self.neighbours(a).contains(&b)
    }

    fn neighbours(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.neighbours[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

/// A suspect vertex that may correspond to a reference vertex.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Canonical index in the reference.
    pub reference: u32,
    /// Canonical index in the suspect.
    pub suspect: u32,
    /// Distance between the two, metres.
    pub distance_m: f64,
}

/// The log-likelihood ratio of one neighbour that is matched to a neighbour. In real maps under ±50
/// cm of noise a right candidate has such a neighbour about twenty times as often as a wrong one.
const NEIGHBOUR: f64 = 3.0;
/// After this many rounds no match changes any more, apart from a few that alternate.
const ROUNDS: usize = 4;
/// Lower bound of the spread of displacements, metres per axis: about the amplitude of a mark.
const LEAST_SPREAD_M: f64 = 0.1;

/// Chooses among `candidates` (sorted by reference), starting from `nearest`. The criteria are the
/// distance and the number of neighbours of the reference vertex that are matched to neighbours of
/// the candidate (relaxation labelling, Rosenfeld, Hummel and Zucker 1976, with hard labels). Each
/// suspect vertex matches at most one reference vertex.
pub fn choose(nearest: Matches, candidates: &[Candidate], reference: &Graph, suspect: &Graph) -> Matches {
    let spread2 = spread2(&nearest, candidates);
    let mut matches = nearest;
    for _ in 0..ROUNDS {
        let support = |c: &Candidate| {
            let there = suspect.neighbours(c.suspect);
            let matched = |r: &&u32| matches.suspect_of[**r as usize].is_some_and(|s| there.contains(&s));
            reference.neighbours(c.reference).iter().filter(matched).count()
        };
        let score = |c: &Candidate| NEIGHBOUR * support(c) as f64 - c.distance_m.powi(2) / (2.0 * spread2);
        let mut scored: Vec<(f64, Candidate)> = candidates.par_iter().map(|c| (score(c), *c)).collect();
        scored.par_sort_unstable_by(|(a, x), (b, y)| {
            b.total_cmp(a).then((x.reference, x.suspect).cmp(&(y.reference, y.suspect)))
        });
        let next = best_first(&scored, matches.suspect_of.len());
        if next == matches {
            break;
        }
        matches = next;
    }
    matches
}

/// Returns the variance per axis of the displacements of matched vertices, square metres.
fn spread2(nearest: &Matches, candidates: &[Candidate]) -> f64 {
    let chosen = |c: &&Candidate| nearest.suspect_of[c.reference as usize] == Some(c.suspect);
    let sum: f64 = candidates.iter().filter(chosen).map(|c| c.distance_m.powi(2)).sum();
    (sum / (2 * nearest.count.max(1)) as f64).max(LEAST_SPREAD_M.powi(2))
}

fn best_first(scored: &[(f64, Candidate)], vertices: usize) -> Matches {
    let mut matches = Matches { suspect_of: vec![None; vertices], count: 0 };
    let most = scored.iter().map(|(_, c)| c.suspect as usize + 1).max().unwrap_or(0);
    let mut taken = vec![false; most];
    for (_, c) in scored {
        let slot = &mut matches.suspect_of[c.reference as usize];
        if slot.is_none() && !taken[c.suspect as usize] {
            *slot = Some(c.suspect);
            taken[c.suspect as usize] = true;
            matches.count += 1;
        }
    }
    matches
}
