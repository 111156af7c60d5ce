//! Registration: the affine map that brings a suspect back onto the reference (paper, section 3.5).
//!
//! Starting points are the identity, landmarks (features with the same attribute values) and geometry
//! (features of the same shape). Each is refined on matched vertices, and the one under which most
//! vertices match wins. Nothing here knows a key.

use crate::{affine::Affine, matching::Matcher, shapes};
use meshmark_core::{ground::Ground, vertices::VertexTable};
use meshmark_dataset::{Dimension, Label, Shape};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};
use serde::Serialize;
use std::collections::HashMap;

/// Reference vertices used while refining; more would not make it better.
const SAMPLE: usize = 20_000;
/// The share of the smaller map's vertices that is most of them.
const AGREE: f64 = 0.5;
/// Fewer matched vertices than this are chance: nothing was found.
pub const LEAST_MATCHED: usize = 30;
/// Lines are used when there are fewer landmarks without them.
const FEW_LANDMARKS: usize = 8;

/// How a suspect was brought onto the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Registration {
    /// "identity", "landmarks" or "geometry": where the search started.
    pub method: &'static str,
    /// Suspect to reference coordinates: x′ = a x + b y + c, y′ = d x + e y + f, CRS units.
    pub affine: [f64; 6],
    /// Pairs of features that agree with the result; 0 when none were needed.
    pub landmarks: usize,
    /// Root mean square distance of matched vertices after it, metres; null when none matched.
    pub rms_m: Option<f64>,
}

impl Registration {
    /// The suspect's vertices in reference coordinates.
    pub fn apply(&self, suspect: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let affine = Affine { coefficients: self.affine };
        suspect.iter().map(|p| affine.apply(*p)).collect()
    }
}

/// Where to start a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Start {
    /// As it stands, by landmarks or by geometry, whichever is best
    Auto,
    /// Features with the same attribute values
    Landmarks,
    /// Features of the same shape
    Geometry,
    /// Nowhere: the suspect is taken as it stands
    None,
}

/// One map of the two.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// Its distinct vertices.
    pub vertices: &'a VertexTable,
    /// Its labels.
    pub labels: &'a [Label],
    /// Its rings and lines.
    pub shapes: &'a [Shape],
}

/// Finds the affine map from the suspect to the reference. `radius_m` is the matching radius t.
pub fn register(
    reference: Side,
    suspect: Side,
    ground: &Ground,
    radius_m: f64,
    start: Start,
) -> Registration {
    let matcher = Matcher::new(reference.vertices.coords(), ground, reference.vertices.centre());
    let search = Search { matcher, reference, suspect, ground, radius_m };
    let as_it_stands = || search.refine("identity", Affine::IDENTITY, 0);
    let by_landmarks = || search.by_pairs("landmarks", &pairs(reference.labels, suspect.labels));
    let by_geometry = || search.by_pairs("geometry", &shapes::pairs(reference.shapes, suspect.shapes));
    let ways: &[&dyn Fn() -> (Registration, usize)] = match start {
        Start::Auto => &[&as_it_stands, &by_landmarks, &by_geometry],
        Start::Landmarks => &[&by_landmarks],
        Start::Geometry => &[&by_geometry],
        Start::None => return search.unchanged(),
    };
    let smaller = search.sample().min(suspect.vertices.len());
    let mut best: Option<(Registration, usize)> = None;
    for way in ways {
        let next = way();
        if best.as_ref().is_none_or(|(_, matched)| next.1 > *matched) {
            best = Some(next);
        }
        // When most vertices match there is nothing better to search for.
        if best.as_ref().is_some_and(|(_, matched)| *matched as f64 >= AGREE * smaller as f64) {
            break;
        }
    }
    let (found, matched) = best.expect("there is a way");
    if matched < LEAST_MATCHED { search.unchanged() } else { found }
}

/// Pairs of places (suspect, reference) of features that share an attribute value which occurs once
/// in either map.
pub fn pairs(reference: &[Label], suspect: &[Label]) -> Vec<[[f64; 2]; 2]> {
    let (reference, suspect) = (unique(reference), unique(suspect));
    let mut both: Vec<(&Label, &Label)> =
        reference.into_iter().filter_map(|(value, r)| Some((*suspect.get(value)?, r))).collect();
    both.sort_by(|a, b| a.1.value.cmp(&b.1.value));
    let is_line = |l: &Label| l.dimension == Dimension::Line;
    let certain = both.iter().filter(|(s, r)| !is_line(s) && !is_line(r)).count();
    let mut pairs: Vec<[[f64; 2]; 2]> = both
        .iter()
        .filter(|(s, r)| certain < FEW_LANDMARKS || (!is_line(s) && !is_line(r)))
        .map(|(s, r)| [s.point, r.point])
        .collect();
    // A feature with two unique values is one landmark.
    pairs.sort_by(|a, b| a.as_flattened().partial_cmp(b.as_flattened()).expect("finite"));
    pairs.dedup();
    pairs
}

fn unique(labels: &[Label]) -> HashMap<&str, &Label> {
    let mut seen: HashMap<&str, Option<&Label>> = HashMap::new();
    for label in labels {
        let entry = seen.entry(&label.value).or_insert(Some(label));
        // The same value in two fields of one feature is still unique.
        if entry.is_some_and(|first| first.point != label.point) {
            *entry = None;
        }
    }
    seen.into_iter().filter_map(|(value, label)| Some((value, label?))).collect()
}

struct Search<'a> {
    matcher: Matcher<'a>,
    reference: Side<'a>,
    suspect: Side<'a>,
    ground: &'a Ground,
    radius_m: f64,
}

impl Search<'_> {
    fn step(&self) -> usize {
        self.reference.vertices.len().div_ceil(SAMPLE).max(1)
    }

    fn sample(&self) -> usize {
        self.reference.vertices.len().div_ceil(self.step())
    }

    /// Improves an affine map on the vertices that match under it, and counts them.
    fn refine(&self, method: &'static str, start: Affine, landmarks: usize) -> (Registration, usize) {
        let mut best = self.matched(start, self.radius_m);
        for factor in [4.0, 2.0, 1.0, 1.0, 1.0, 1.0] {
            let trial = self.matched(best.affine, factor * self.radius_m);
            let unit = self.ground.metres_per_unit(self.reference.vertices.centre());
            let least = 0.01 / unit[0].max(unit[1]); // a centimetre in CRS units
            let Some(affine) = Affine::fit_robustly(&trial.from, &trial.to, least) else { break };
            let next = self.matched(affine, self.radius_m);
            if (next.from.len(), -next.rms_m) >= (best.from.len(), -best.rms_m) {
                best = next;
            }
        }
        let count = best.from.len();
        let rms_m = (count > 0).then_some(best.rms_m);
        (Registration { method, affine: best.affine.coefficients, landmarks, rms_m }, count)
    }

    /// Matched pairs of the sample under an affine map.
    fn matched(&self, affine: Affine, radius_m: f64) -> Pairs {
        let moved: Vec<[f64; 2]> = self.suspect.vertices.coords().iter().map(|p| affine.apply(*p)).collect();
        let matches = self.matcher.every(self.step(), &moved, radius_m);
        let mut pairs = Pairs { affine, from: Vec::new(), to: Vec::new(), rms_m: 0.0 };
        for (reference, suspect) in self.reference.vertices.coords().iter().zip(&matches.suspect_of) {
            let Some(suspect) = suspect else { continue };
            pairs.from.push(self.suspect.vertices.coords()[*suspect as usize]);
            pairs.to.push(*reference);
            let [dx, dy] = self.ground.metres_between(*reference, moved[*suspect as usize]);
            pairs.rms_m += dx * dx + dy * dy;
        }
        pairs.rms_m = (pairs.rms_m / pairs.from.len().max(1) as f64).sqrt();
        pairs
    }

    /// The best of the affine maps that many pairs of places agree on, within a few metres or within more:
    /// the places of cut or edited features are off by any amount. Without any, the identity.
    fn by_pairs(&self, method: &'static str, pairs: &[[[f64; 2]; 2]]) -> (Registration, usize) {
        let unit = self.ground.metres_per_unit(self.reference.vertices.centre());
        let starts = [1.0, 5.0, 25.0].map(|factor| consensus(pairs, unit, factor * self.radius_m));
        let refined = starts.into_iter().flatten().map(|(affine, agree)| self.refine(method, affine, agree));
        let best = refined.reduce(|best, next| if next.1 > best.1 { next } else { best });
        best.unwrap_or_else(|| (Registration { method, ..self.unchanged() }, 0))
    }

    fn unchanged(&self) -> Registration {
        let pairs = self.matched(Affine::IDENTITY, self.radius_m);
        let rms_m = (!pairs.from.is_empty()).then_some(pairs.rms_m);
        Registration { method: "identity", affine: Affine::IDENTITY.coefficients, landmarks: 0, rms_m }
    }
}

struct Pairs {
    affine: Affine,
    /// Suspect coordinates as they stand.
    from: Vec<[f64; 2]>,
    /// Reference coordinates.
    to: Vec<[f64; 2]>,
    rms_m: f64,
}

/// The affine map under which most pairs are within `metres` (random sample consensus, Fischler and
/// Bolles 1981, scored as by Torr and Zisserman 2000), then the robust fit to those.
fn consensus(pairs: &[[[f64; 2]; 2]], unit: [f64; 2], metres: f64) -> Option<(Affine, usize)> {
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
    let mut random = ChaCha8Rng::seed_from_u64(0x6d65_7368); // any fixed seed: same input, same answer
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

#[cfg(test)]
mod tests {
    use super::*;

    const METRES: Ground = Ground::Plane { metres_per_unit: 1.0 };

    fn label(value: &str, point: [f64; 2]) -> Label {
        Label { value: value.into(), point, dimension: Dimension::Area }
    }

    fn scattered(n: u64, width: u64) -> Vec<[f64; 2]> {
        let mut random = ChaCha8Rng::seed_from_u64(n);
        let mut next = || (random.next_u64() % (width * 1000)) as f64 / 1000.0;
        (0..n).map(|_| [next(), next()]).collect()
    }

    #[test]
    fn only_values_that_occur_once_in_either_map_make_a_pair() {
        let reference = [label("a", [0.0, 0.0]), label("b", [1.0, 0.0]), label("b", [2.0, 0.0])];
        let suspect = [label("a", [5.0, 5.0]), label("b", [6.0, 5.0]), label("c", [7.0, 5.0])];
        assert_eq!(pairs(&reference, &suspect), [[[5.0, 5.0], [0.0, 0.0]]]);
    }

    #[test]
    fn landmarks_recover_a_mirrored_sheared_map_with_two_fifths_of_wrong_pairs() {
        let truth = Affine { coefficients: [-0.7, 0.4, 1.0e6, 0.2, 0.9, -5.0e5] };
        let back: Vec<[f64; 2]> = scattered(2000, 800); // reference
        let reference = VertexTable::new(back.clone()).unwrap();
        let [a, b, c, d, e, f] = truth.coefficients;
        let det = a * e - b * d;
        let invert = |p: [f64; 2]| {
            let (x, y) = (p[0] - c, p[1] - f);
            [(e * x - b * y) / det, (a * y - d * x) / det]
        };
        let suspect = VertexTable::new(back.iter().map(|p| invert(*p)).collect()).unwrap();
        let labels: Vec<Label> = (0..50).map(|i| label(&format!("n{i}"), back[i])).collect();
        let moved = |(i, l): (usize, &Label)| {
            let wrong = if i % 5 < 2 { 40.0 * (i as f64 + 1.0) } else { 0.0 };
            label(&l.value, invert([l.point[0] + wrong, l.point[1] - wrong]))
        };
        let theirs: Vec<Label> = labels.iter().enumerate().map(moved).collect();
        let found = register(
            Side { vertices: &reference, labels: &labels, shapes: &[] },
            Side { vertices: &suspect, labels: &theirs, shapes: &[] },
            &METRES,
            1.0,
            Start::Auto,
        );
        assert_eq!((found.method, found.landmarks), ("landmarks", 30));
        assert!(found.rms_m.unwrap() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_map_that_agrees_as_it_stands_needs_no_landmarks() {
        let reference = VertexTable::new(scattered(500, 400)).unwrap();
        let moved = reference.coords().iter().map(|p| [p[0] + 0.3, p[1] - 0.2]).collect();
        let suspect = VertexTable::new(moved).unwrap();
        let side = |vertices| Side { vertices, labels: &[], shapes: &[] };
        let found = register(side(&reference), side(&suspect), &METRES, 1.0, Start::Auto);
        assert_eq!(found.method, "identity");
        assert!(found.rms_m.unwrap() < 1e-6, "{found:?}");
    }
}
