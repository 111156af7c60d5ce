//! The search of a registration: ways to start, and how a start is improved.

use crate::{
    affine::Affine,
    consensus::consensus,
    cubic::{Cubic, Transform},
    landmarks,
    registration::{LEAST_MATCHED, OUT_OF_PLACE, Registrar, Registration, Side, TIMES_CHANCE},
    shapes,
    windows::{self, Arrangement, Window},
};
use meshmark_core::vertices::VertexTable;

/// With more matched vertices than this share there is no distortion to follow.
const ALMOST_ALL: f64 = 0.9;
/// A polynomial is kept when it matches this many times as many vertices as the affine map, and
/// [`LEAST_MATCHED`] more: its 20 coefficients find some anywhere.
const CLEARLY_MORE: f64 = 1.1;
/// Rounds of least squares at the end, which may lose a few of the pairs.
const POLISH: usize = 2;
const STILL_MATCHED: f64 = 0.98;
/// Pairs of places that tell of a distortion are so many matching radii apart at most.
const DISTORTED: f64 = 50.0;
/// A polynomial is fitted to at least so many pairs.
const LEAST_FOR_CUBIC: usize = 40;

/// A place in the suspect and the same place in the reference.
type PlacePair = [[f64; 2]; 2];

/// Where to start from, the cheapest first.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// The suspect is about in place.
    AsItStands,
    /// Attribute values.
    Landmarks,
    /// Whole rings and lines.
    Shapes,
    /// Six vertices along a line or ring.
    Lines,
    /// A vertex and its five nearest.
    Points,
}

/// One suspect and the reference it is brought onto.
pub struct Search<'a> {
    /// Of the reference.
    pub registrar: &'a Registrar<'a>,
    /// In the CRS of the reference.
    pub suspect: Side<'a>,
}

impl Search<'_> {
    /// The best of several ways.
    pub fn best(&self, ways: &[Way]) -> Registration {
        let mut pairs: Vec<PlacePair> = Vec::new();
        let mut best = self.nothing("identity");
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
            return self.nothing(best.method);
        }
        self.bend(&best, &pairs).unwrap_or(best)
    }

    /// Whether about as many vertices match when the suspect is certainly not in place.
    fn is_chance(&self, found: &Registration) -> bool {
        let (unit, radius_m) = (self.registrar.unit(), self.registrar.radius_m);
        let [a, b, c, d, e, f] = found.affine;
        let [x, y] = [0, 1].map(|axis| OUT_OF_PLACE[axis] * radius_m / unit[axis].max(f64::MIN_POSITIVE));
        let shifted = Affine { coefficients: [a, b, c + x, d, e, f + y] };
        let chance = self.matched(shifted.into(), radius_m).from.len();
        found.matched < LEAST_MATCHED || found.matched < TIMES_CHANCE * chance
    }

    fn nothing(&self, method: &'static str) -> Registration {
        let as_it_stands = self.registrar.as_it_stands(self.suspect);
        Registration { method, matched: 0, share: 0.0, ..as_it_stands }
    }

    /// One way; pairs of places that it went by are added to `pairs`.
    fn by_way(&self, way: Way, pairs: &mut Vec<PlacePair>) -> Registration {
        let reference = self.registrar.reference;
        let (method, found) = match way {
            Way::AsItStands => return self.refine("identity", Affine::IDENTITY, 0),
            Way::Lines | Way::Points => return self.by_windows(way),
            Way::Landmarks => ("landmarks", landmarks::pairs(reference.labels, self.suspect.labels)),
            Way::Shapes => ("geometry", shapes::pairs(reference.shapes, self.suspect.shapes)),
        };
        // The places of cut or edited features are off by any amount: within a few metres, or within more.
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
            self.best_start("geometry", found.into_iter())
        };
        if way == Way::Lines {
            let (ours, theirs) = (windows::of_shapes(reference.shapes), windows::of_shapes(suspect.shapes));
            return candidates(ours, theirs, Arrangement::Line);
        }
        let star = |vertices: &VertexTable, metric: Affine| {
            windows::of_points(vertices.coords(), |p| metric.apply(p))
        };
        // Neighbours are those of a map at unit covariance, which no affine map changes; of a part, whose
        // covariance is another one, those of the map as it stands.
        let white = |vertices: &VertexTable| star(vertices, Affine::whitening(vertices.coords()));
        let [x_scale, y_scale] = self.registrar.unit();
        let metres = Affine { coefficients: [x_scale, 0.0, 0.0, 0.0, y_scale, 0.0] };
        let plain = |vertices: &VertexTable| star(vertices, metres);
        let whitened = candidates(white(reference.vertices), white(suspect.vertices), Arrangement::Star);
        if whitened.agrees_in_part() {
            return whitened;
        }
        let as_they_are = candidates(plain(reference.vertices), plain(suspect.vertices), Arrangement::Star);
        if as_they_are.matched > whitened.matched { as_they_are } else { whitened }
    }

    /// The best of several affine maps, each refined. Without any, the identity, and nothing matches.
    fn best_start(
        &self,
        method: &'static str,
        starts: impl Iterator<Item = (Affine, usize)>,
    ) -> Registration {
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

    /// Improves an affine map on the vertices that match under it.
    pub fn refine(&self, method: &'static str, start: Affine, landmarks: usize) -> Registration {
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

    /// Least squares instead of least distances: once the pairs are right they are the more exact, for all that
    /// is left is the mark and noise.
    fn polish(&self, best: Pairs) -> Pairs {
        let least = STILL_MATCHED * best.from.len() as f64;
        let mut polished = best;
        for _ in 0..POLISH {
            let fit = Affine::fit(&polished.from, &polished.to, &vec![1.0; polished.from.len()]);
            let Some(affine) = fit else { break };
            let next = self.matched(affine.into(), self.registrar.radius_m);
            // Where nothing moved, rounding must not move it.
            let closer = next.from.len() != polished.from.len() || next.rms_m < polished.rms_m;
            if (next.from.len() as f64) < least || !closer {
                break;
            }
            polished = next;
        }
        polished
    }

    /// Adds a cubic polynomial, where that matches clearly more vertices than the affine map alone.
    fn bend(&self, flat: &Registration, pairs: &[PlacePair]) -> Option<Registration> {
        if flat.share >= ALMOST_ALL {
            return None;
        }
        let (registrar, vertices) = (self.registrar, self.registrar.reference.vertices);
        let (min, max) = vertices.bounds();
        let half = (max[0] - min[0]).max(max[1] - min[1]) / 2.0;
        let frame = Cubic::zero(vertices.centre(), half);
        let refined = Affine { coefficients: flat.affine };
        // From the vertices that match outwards, or from features all over the map.
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

    /// Follows a distortion from pairs of places to all vertices it can reach.
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

    /// Matched pairs of the sample under a map.
    pub fn matched(&self, transform: Transform, radius_m: f64) -> Pairs {
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

    /// The report on a map and the vertices that match under it.
    pub fn registration(&self, method: &'static str, landmarks: usize, pairs: &Pairs) -> Registration {
        let matched = pairs.from.len();
        // Of a sampled reference only so many vertices of the suspect can be matched.
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

/// Matched vertices under a map.
pub struct Pairs {
    transform: Transform,
    /// Suspect coordinates as they stand.
    from: Vec<[f64; 2]>,
    /// Reference coordinates.
    to: Vec<[f64; 2]>,
    rms_m: f64,
}

impl Pairs {
    /// The one with more pairs, or as many and closer ones.
    fn or_better(self, next: Pairs) -> Pairs {
        let rank = |pairs: &Pairs| (pairs.from.len(), -pairs.rms_m);
        if rank(&next) >= rank(&self) { next } else { self }
    }
}
