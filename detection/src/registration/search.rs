//! The search of a registration: its starts and their refinement.

use super::{
    affine::Affine,
    consensus::consensus,
    cubic::{Cubic, Transform},
    curves::Curves,
    landmarks,
    moments::likenesses,
    polylines,
    registrar::Registrar,
    result::{Method, Registration},
    similarity::vote,
    windows::{self, Arrangement, Window},
};
use crate::{
    linework::Plane,
    matching::{LEAST_MATCHED, is_chance, out_of_place},
};
use meshmark_core::{map_data::MapData, vertices::VertexTable};

/// Above this share of matched vertices there is no distortion to follow.
const ALMOST_ALL: f64 = 0.9;
/// A polynomial is kept when it matches this many times the vertices of the affine map, and
/// [`LEAST_MATCHED`] more, as its 20 coefficients match some vertices anywhere.
const CLEARLY_MORE: f64 = 1.1;
/// Rounds of least squares at the end, which may lose a few of the pairs.
const POLISH: usize = 2;
const STILL_MATCHED: f64 = 0.98;
/// Largest distance of place pairs that show a distortion, in matching radii.
const DISTORTED: f64 = 50.0;
/// Places of features whose vertices are new agree within so many matching radii.
const REACH: f64 = 4.0;
/// Least number of pairs for the fit of a polynomial.
const LEAST_FOR_CUBIC: usize = 40;

/// A place in the suspect and the same place in the reference.
type PlacePair = [[f64; 2]; 2];

/// The start of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// The identity, landmarks or geometry, whichever is best.
    Auto,
    /// Features with equal attribute values.
    Landmarks,
    /// Features of equal shape.
    Geometry,
    /// No search: the suspect stays in its place.
    None,
}

impl Registrar<'_> {
    /// Registers a suspect that is in the CRS of the reference.
    pub fn register(&self, suspect: &MapData, start: Start) -> Registration {
        let search = Search { registrar: self, suspect };
        let found = match start {
            Start::None => return self.as_it_stands(suspect),
            Start::Auto => {
                search.best(&[Way::AsItStands, Way::Landmarks, Way::Polylines, Way::Lines, Way::Points])
            }
            Start::Landmarks => search.best(&[Way::Landmarks]),
            Start::Geometry => search.best(&[Way::Polylines, Way::Lines, Way::Points]),
        };
        if found.matched == 0 { self.as_it_stands(suspect) } else { found }
    }

    /// Returns the registration by the identity, without a search.
    pub fn as_it_stands(&self, suspect: &MapData) -> Registration {
        let search = Search { registrar: self, suspect };
        search.registration(Method::Identity, 0, &search.matched(Affine::IDENTITY.into(), self.radius_m))
    }

    /// Registers a suspect that is approximately in place.
    pub fn refine_in_place(&self, suspect: &MapData) -> Registration {
        Search { registrar: self, suspect }.refine(Method::Identity, Affine::IDENTITY, 0)
    }
}

/// A kind of start, the cheapest first.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    /// The suspect is approximately in place.
    AsItStands,
    /// Equal attribute values.
    Landmarks,
    /// Whole rings and lines.
    Polylines,
    /// Six vertices along a line or ring.
    Lines,
    /// A vertex and its five nearest neighbours.
    Points,
}

/// One suspect and the reference onto which it is registered.
struct Search<'a> {
    /// The reference side.
    registrar: &'a Registrar<'a>,
    /// The suspect, in the CRS of the reference.
    suspect: &'a MapData,
}

impl Search<'_> {
    /// Returns the best registration of several ways.
    fn best(&self, ways: &[Way]) -> Registration {
        let mut pairs: Vec<PlacePair> = Vec::new();
        let mut best = self.nothing(Method::Identity);
        for way in ways {
            let costly = matches!(way, Way::Lines | Way::Points);
            if best.agrees() || costly && best.agrees_in_part() {
                break;
            }
            let next = self.by_way(*way, &mut pairs);
            if next.matched > best.matched {
                best = next;
            }
        }
        if self.is_chance(&best) {
            return self.along_curves(&pairs).unwrap_or_else(|| self.nothing(best.method));
        }
        self.bend(&best, &pairs).unwrap_or(best)
    }

    /// Registers by the course of lines; `None` where no more of them agree than by chance, or
    /// where the suspect is in its place already.
    fn along_curves(&self, pairs: &[PlacePair]) -> Option<Registration> {
        if self.suspect.segments.is_empty() {
            return None;
        }
        let registrar = self.registrar;
        let plane = Plane::new(registrar.ground, registrar.reference.vertices.centre());
        let curves = Curves::new(registrar.reference, self.suspect, plane, registrar.radius_m);
        let in_place = curves.laid(Affine::IDENTITY);
        if curves.agrees(&in_place) {
            return None;
        }
        let near_m = REACH * registrar.radius_m;
        let of_places: Vec<PlacePair> = pairs.iter().map(|pair| pair.map(|place| plane.at(place))).collect();
        let (ours, theirs) = (&registrar.reference.polylines, &self.suspect.polylines);
        let starts = [
            Some((Affine::IDENTITY, 0)),
            consensus(&of_places, [1.0; 2], near_m),
            vote(&likenesses(ours, theirs, |place| plane.at(place)), near_m),
        ];
        let refined = starts.into_iter().flatten().map(|(affine, agree)| (curves.refine(affine), agree));
        let (laid, landmarks) = refined.max_by_key(|(laid, _)| laid.count)?;
        curves.agrees(&laid).then(|| Registration {
            landmarks,
            affine: curves.in_units(laid.affine),
            rms_m: Some(laid.rms_m),
            matched: laid.count,
            share: laid.count as f64 / curves.len() as f64,
            ..self.nothing(Method::Curves)
        })
    }

    /// Returns whether about as many vertices match after the suspect is shifted out of place.
    fn is_chance(&self, found: &Registration) -> bool {
        let radius_m = self.registrar.radius_m;
        let [a, b, c, d, e, f] = found.affine;
        let [x, y] = out_of_place(self.registrar.unit(), radius_m);
        let shifted = Affine { coefficients: [a, b, c + x, d, e, f + y] };
        is_chance(found.matched, self.matched(shifted.into(), radius_m).from.len())
    }

    fn nothing(&self, method: Method) -> Registration {
        let as_it_stands = self.registrar.as_it_stands(self.suspect);
        Registration { method, matched: 0, share: 0.0, ..as_it_stands }
    }

    /// Registers by one way and appends its pairs of places to `pairs`.
    fn by_way(&self, way: Way, pairs: &mut Vec<PlacePair>) -> Registration {
        let reference = self.registrar.reference;
        let (method, found) = match way {
            Way::AsItStands => return self.refine(Method::Identity, Affine::IDENTITY, 0),
            Way::Lines | Way::Points => return self.by_windows(way),
            Way::Landmarks => (Method::Landmarks, landmarks::pairs(&reference.labels, &self.suspect.labels)),
            Way::Polylines => {
                (Method::Geometry, polylines::pairs(&reference.polylines, &self.suspect.polylines))
            }
        };
        // The places of cut or edited features are off by an unknown amount, so the consensus tries
        // several radii.
        let radii = [1.0, 5.0, 25.0].map(|factor| factor * self.registrar.radius_m);
        let starts = radii.iter().filter_map(|radius| consensus(&found, self.registrar.unit(), *radius));
        let best = self.best_start(method, starts);
        pairs.extend(found);
        best
    }

    fn by_windows(&self, way: Way) -> Registration {
        let (reference, suspect) = (self.registrar.reference, self.suspect);
        let candidates = |ours: Vec<Window>, theirs: Vec<Window>, arrangement: Arrangement| {
            let within_m = 3.0 * self.registrar.radius_m;
            let found = windows::candidates(ours, theirs, arrangement, self.registrar.ground, within_m);
            self.best_start(Method::Geometry, found.into_iter())
        };
        if way == Way::Lines {
            let (ours, theirs) =
                (windows::of_polylines(&reference.polylines), windows::of_polylines(&suspect.polylines));
            return candidates(ours, theirs, Arrangement::Line);
        }
        let star = |vertices: &VertexTable, metric: Affine| {
            windows::of_points(vertices.coords(), |p| metric.apply(p))
        };
        // Neighbours are found at unit covariance, which is invariant under affine maps. A part of
        // a map has another covariance, so a second attempt uses its coordinates unchanged.
        let white = |vertices: &VertexTable| star(vertices, Affine::whitening(vertices.coords()));
        let [x_scale, y_scale] = self.registrar.unit();
        let metres = Affine { coefficients: [x_scale, 0.0, 0.0, 0.0, y_scale, 0.0] };
        let plain = |vertices: &VertexTable| star(vertices, metres);
        let whitened = candidates(white(&reference.vertices), white(&suspect.vertices), Arrangement::Star);
        if whitened.agrees_in_part() {
            return whitened;
        }
        let as_they_are = candidates(plain(&reference.vertices), plain(&suspect.vertices), Arrangement::Star);
        if as_they_are.matched > whitened.matched { as_they_are } else { whitened }
    }

    /// Refines several affine maps and returns the best; without any, the identity without matches.
    fn best_start(&self, method: Method, starts: impl Iterator<Item = (Affine, usize)>) -> Registration {
        let mut best = self.nothing(method);
        for (affine, agree) in starts {
            let next = self.refine(method, affine, agree);
            if next.matched > best.matched {
                best = next;
            }
            if best.agrees() {
                break;
            }
        }
        best
    }

    /// Refines an affine map on the vertices that match under it.
    fn refine(&self, method: Method, start: Affine, landmarks: usize) -> Registration {
        let radius_m = self.registrar.radius_m;
        let mut best = self.matched(start.into(), radius_m);
        for factor in [4.0, 2.0, 1.0, 1.0, 1.0, 1.0] {
            let trial = self.matched(best.transform, factor * radius_m);
            let fit = Affine::fit_robustly(&trial.from, &trial.to, self.registrar.centimetre());
            let Some(affine) = fit else { break };
            let next = self.matched(affine.into(), radius_m);
            let settled = factor == 1.0 && next.from.len() <= best.from.len();
            best = best.or_better(next);
            if settled {
                break;
            }
        }
        self.registration(method, landmarks, &self.polish(best))
    }

    /// Replaces least distances by least squares, which are more exact once the pairs are right:
    /// only the mark and noise remain then.
    fn polish(&self, best: Pairs) -> Pairs {
        let least = STILL_MATCHED * best.from.len() as f64;
        let mut polished = best;
        for _ in 0..POLISH {
            let fit = Affine::fit(&polished.from, &polished.to, &vec![1.0; polished.from.len()]);
            let Some(affine) = fit else { break };
            let next = self.matched(affine.into(), self.registrar.radius_m);
            // Where no vertex moved, rounding must not introduce a displacement.
            let closer = next.from.len() != polished.from.len() || next.rms_m < polished.rms_m;
            if (next.from.len() as f64) < least || !closer {
                break;
            }
            polished = next;
        }
        polished
    }

    /// Adds a cubic polynomial where it matches clearly more vertices than the affine map alone.
    fn bend(&self, flat: &Registration, pairs: &[PlacePair]) -> Option<Registration> {
        if flat.share >= ALMOST_ALL {
            return None;
        }
        let (registrar, vertices) = (self.registrar, &self.registrar.reference.vertices);
        let (min, max) = vertices.bounds();
        let half = (max[0] - min[0]).max(max[1] - min[1]) / 2.0;
        let frame = Cubic::zero(vertices.centre(), half);
        let refined = Affine { coefficients: flat.affine };
        // The fit starts from the matched vertices and works outwards, or from features all over
        // the map.
        let near = self.matched(refined.into(), 4.0 * registrar.radius_m);
        let mut starts = vec![(refined, near.from, near.to)];
        if let Some((affine, _)) = consensus(pairs, registrar.unit(), DISTORTED * registrar.radius_m) {
            let is_near = |pair: &&PlacePair| {
                let [dx, dy] = registrar.ground.metres_between(pair[1], affine.apply(pair[0]));
                dx.hypot(dy) <= DISTORTED * registrar.radius_m
            };
            starts.push((affine, Vec::new(), Vec::new()));
            let (_, from, to) = starts.last_mut().expect("just pushed");
            pairs.iter().filter(is_near).for_each(|pair| {
                from.push(pair[0]);
                to.push(pair[1]);
            });
        }
        let bent = starts.iter().filter_map(|(affine, from, to)| self.bend_from(*affine, frame, from, to));
        let bent = bent.reduce(|best, next| best.or_better(next))?;
        let least = (CLEARLY_MORE * flat.matched as f64).max((flat.matched + LEAST_MATCHED) as f64);
        let kept = bent.from.len() as f64 >= least;
        kept.then(|| self.registration(flat.method, flat.landmarks, &bent))
    }

    /// Follows a distortion from pairs of places to all vertices within reach.
    fn bend_from(&self, affine: Affine, frame: Cubic, from: &[[f64; 2]], to: &[[f64; 2]]) -> Option<Pairs> {
        let fit = |from: &[[f64; 2]], to: &[[f64; 2]]| {
            let flat: Vec<[f64; 2]> = from.iter().map(|p| affine.apply(*p)).collect();
            let enough = from.len() >= LEAST_FOR_CUBIC;
            let cubic = enough.then(|| frame.fit_robustly(&flat, to, self.registrar.centimetre()))??;
            Some(Transform { affine, cubic: Some(cubic) })
        };
        let radius_m = self.registrar.radius_m;
        let mut best = self.matched(fit(from, to)?, radius_m);
        for factor in [4.0, 4.0, 4.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0] {
            let trial = self.matched(best.transform, factor * radius_m);
            let Some(next) = fit(&trial.from, &trial.to) else { break };
            best = best.or_better(self.matched(next, radius_m));
        }
        Some(best)
    }

    /// Returns the matched pairs of the sample under a transformation.
    fn matched(&self, transform: Transform, radius_m: f64) -> Pairs {
        let (ours, theirs) = (self.registrar.reference.vertices.coords(), self.suspect.vertices.coords());
        let moved: Vec<[f64; 2]> = theirs.iter().map(|p| transform.apply(*p)).collect();
        let matches = self.registrar.matcher.every(self.registrar.step(), &moved, radius_m);
        let mut pairs = Pairs { transform, from: Vec::new(), to: Vec::new(), rms_m: 0.0 };
        for (reference, suspect) in ours.iter().zip(&matches.suspect_of) {
            let Some(suspect) = suspect else { continue };
            pairs.from.push(theirs[*suspect as usize]);
            pairs.to.push(*reference);
            let [dx, dy] = self.registrar.ground.metres_between(*reference, moved[*suspect as usize]);
            pairs.rms_m += dx * dx + dy * dy;
        }
        pairs.rms_m = (pairs.rms_m / pairs.from.len().max(1) as f64).sqrt();
        pairs
    }

    /// Returns the registration for a transformation and the vertices that match under it.
    fn registration(&self, method: Method, landmarks: usize, pairs: &Pairs) -> Registration {
        let matched = pairs.from.len();
        // A sample of the reference limits the number of possible matches.
        let smaller = self.registrar.reference.vertices.len().min(self.suspect.vertices.len());
        let most = smaller.div_ceil(self.registrar.step()).max(1);
        Registration {
            method,
            read_as: None,
            affine: pairs.transform.affine.coefficients,
            polynomial: pairs.transform.cubic,
            landmarks,
            rms_m: (matched > 0).then_some(pairs.rms_m),
            matched,
            share: matched as f64 / most as f64,
        }
    }
}

/// Matched vertices under a transformation.
struct Pairs {
    transform: Transform,
    /// Original coordinates of the suspect.
    from: Vec<[f64; 2]>,
    /// Reference coordinates.
    to: Vec<[f64; 2]>,
    rms_m: f64,
}

impl Pairs {
    /// Returns the set with more pairs, or the closer one of equal size.
    fn or_better(self, next: Pairs) -> Pairs {
        let rank = |pairs: &Pairs| (pairs.from.len(), -pairs.rms_m);
        if rank(&next) >= rank(&self) { next } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use meshmark_core::{
        ground::Ground,
        map_data::{Dimension, Label},
    };
    use rand_chacha::{
        ChaCha8Rng,
        rand_core::{Rng, SeedableRng},
    };

    fn label(value: &str, point: [f64; 2]) -> Label {
        Label { value: value.into(), point, dimension: Dimension::Area }
    }

    fn scattered(n: u64, width: u64) -> Vec<[f64; 2]> {
        let mut random = ChaCha8Rng::seed_from_u64(n);
        let mut next = || (random.next_u64() % (width * 1000)) as f64 / 1000.0;
        (0..n).map(|_| [next(), next()]).collect()
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
        let ours = MapData { labels, ..MapData::of_points(reference) };
        let theirs = MapData { labels: theirs, ..MapData::of_points(suspect) };
        let found = Registrar::new(&ours, &Ground::METRES, 1.0).register(&theirs, Start::Auto);
        assert_eq!((found.method, found.landmarks), (Method::Landmarks, 30));
        assert!(found.rms_m.unwrap() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_map_that_agrees_as_it_stands_needs_no_landmarks() {
        let reference = VertexTable::new(scattered(500, 400)).unwrap();
        let moved = reference.coords().iter().map(|p| [p[0] + 0.3, p[1] - 0.2]).collect();
        let suspect = VertexTable::new(moved).unwrap();
        let (reference, suspect) = (MapData::of_points(reference), MapData::of_points(suspect));
        let found = Registrar::new(&reference, &Ground::METRES, 1.0).register(&suspect, Start::Auto);
        assert_eq!(found.method, Method::Identity);
        assert!(found.rms_m.unwrap() < 1e-6, "{found:?}");
    }
}
