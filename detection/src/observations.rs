//! What is observed of the reference vertices: matched vertices, the corners of lines drawn anew, or
//! the points that stand for features. The choice follows from their information about the displacements, so no key is involved.

use crate::{
    corners::{self, Corners, Lines},
    features::{self, Features},
    matched::Matched,
    matching::{LEAST_MATCHED, Matches, OUT_OF_PLACE, Radius, is_chance},
    observed_on::Observations,
    tracking::Followed,
};
use meshmark_core::{
    Result,
    deformation::{Deformation, Observed, Prediction, mark_deviation_m},
    derived::{DerivedPoints, Observables},
    options::Parameters,
};

/// The displacements to demodulate.
pub struct Chosen<'a> {
    /// The points that are observed in place of the vertices.
    pub derived: Option<DerivedPoints<'a>>,
    /// The displacements of the observed points.
    pub followed: Followed,
    /// What was observed.
    pub observations: Observations,
}

/// Lines are looked for within this distance of their edges, metres.
const REACH_M: f64 = 1.5;
/// Noise below this is explained by the vertices themselves, metres; corners cannot do better by
/// far.
const QUIET_M: f64 = 0.1;
/// The size of a house, metres.
const HOUSE_M: f64 = 10.0;
/// Information beyond this accuracy counts no more, metres.
const LEAST_NOISE_M: f64 = 0.03;
/// A matched vertex within this distance of the corner is that corner, metres.
const SAME_M: f64 = 0.1;
/// The matched vertices are new where no more than this share of them are corners.
const MOST_NEW: f64 = 1.0 / 3.0;
/// Corners must have this many times the information of vertices that are corners.
const CLEARLY: f64 = 1.2;
/// New vertices match by their nearness alone, and their information seems more than it is.
const NEARLY: f64 = 0.5;
/// A point whose displacement varies by this beside the function of its vertices weighs half,
/// metres.
const HALF_WEIGHT_M: f64 = 0.1;
/// A deformation that changes over less than this many metres hides a mark like noise.
const SMOOTH_M: f64 = 20.0;

/// Chooses between the `followed` vertices, the corners of a suspect and its features, unless the
/// kind is `given`.
///
/// # Errors
/// Returns the errors of the estimation.
pub fn choose<'a>(
    matched: &Matched<'a>,
    followed: Followed,
    carriers: usize,
    parameters: &Parameters,
    given: Option<Observations>,
) -> Result<Chosen<'a>> {
    let vertices = |followed| Chosen { derived: None, followed, observations: Observations::Vertices };
    let is_plain = match given {
        Some(kind) => kind == Observations::Vertices,
        None => {
            let found = followed.observed.iter().flatten().count();
            is_quiet(&followed.disturbance.deformation) && matched.is_mostly_found(found)
        }
    };
    if is_plain {
        return Ok(vertices(followed));
    }
    let is_wanted = |kind| given.is_none_or(|given| given == kind);
    let mut best: Option<(f64, Read)> = None;
    let mut take = |read: Read<'a>| {
        let seen = information(&read.observed, &read.chosen.followed.disturbance);
        if best.as_ref().is_none_or(|(most, _)| seen > *most) {
            best = Some((seen, read));
        }
    };
    if is_wanted(Observations::Corners) {
        for corners in all_corners(matched) {
            take(Read::corners(matched, corners, carriers, parameters)?);
        }
    }
    for features in features::shown(matched).filter(|features| is_wanted(features.kind)) {
        take(Read::features(matched, features, carriers, parameters)?);
    }
    let Some((seen, read)) = best else { return Ok(vertices(followed)) };
    let displaced = displaced(matched, &followed);
    let of_vertices = information(&displaced, &followed.disturbance);
    if given.is_some() || seen > needed(matched, &displaced, &read) * of_vertices {
        return Ok(read.chosen);
    }
    Ok(vertices(followed))
}

/// Returns whether lines show more corners, or points more features, than by chance.
pub fn show(matched: &Matched) -> bool {
    all_corners(matched).next().is_some() || features::shown(matched).next().is_some()
}

/// Returns the corners that lines within each tolerance show, unless they are chance.
fn all_corners(matched: &Matched) -> impl Iterator<Item = Corners> {
    let maps = (matched.reference.data, matched.suspect);
    let lines = Lines::new(maps, &matched.reference.ground, &matched.moved);
    corners::TOLERANCES.iter().filter_map(move |tolerance| {
        let found = lines.corners([0.0; 2], REACH_M, tolerance);
        let by_chance = || lines.corners(OUT_OF_PLACE.map(|reaches| reaches * REACH_M), REACH_M, tolerance);
        let is_chance = found.count() < LEAST_MATCHED || is_chance(found.count(), by_chance().count());
        (!is_chance).then_some(found)
    })
}

/// Returns how many times the information of the vertices another reading must have.
fn needed(matched: &Matched, displaced: &Observed, read: &Read) -> f64 {
    if matched.is_chance_of_vertices() {
        return 0.0;
    }
    if read.chosen.derived.is_some() {
        return CLEARLY;
    }
    let gap = |(v, c): (&Option<[f64; 2]>, &Option<[f64; 2]>)| {
        let (v, c) = (v.as_ref()?, c.as_ref()?);
        Some((v[0] - c[0]).hypot(v[1] - c[1]))
    };
    let gaps: Vec<f64> = displaced.iter().zip(&read.observed).filter_map(gap).collect();
    let same = gaps.iter().filter(|gap| **gap < SAME_M).count();
    if same as f64 > MOST_NEW * gaps.len() as f64 { CLEARLY } else { NEARLY }
}

/// Returns the displacements of the matched vertices as they are, metres.
fn displaced(matched: &Matched, followed: &Followed) -> Vec<Option<[f64; 2]>> {
    let coords = matched.reference.data.vertices.coords();
    followed.matches.displacements_m(coords, &matched.moved, &matched.reference.ground)
}

/// Corners or features that were read.
struct Read<'a> {
    /// Their displacements without outliers, metres.
    observed: Vec<Option<[f64; 2]>>,
    /// The same with shaped noise, and the disturbance.
    chosen: Chosen<'a>,
}

/// Displacements before outliers are removed.
struct Raw<'a> {
    observations: Observations,
    derived: Option<DerivedPoints<'a>>,
    displacement_m: Vec<Option<[f64; 2]>>,
    weights: Vec<f64>,
    radius: Radius,
    matches: Matches,
}

impl<'a> Read<'a> {
    fn corners(
        matched: &Matched<'a>,
        corners: Corners,
        carriers: usize,
        parameters: &Parameters,
    ) -> Result<Self> {
        let raw = Raw {
            observations: Observations::Corners,
            derived: None,
            displacement_m: corners.displacement_m,
            weights: corners.weights,
            radius: matched.radius,
            matches: matched.matches.clone(),
        };
        Self::new(matched, raw, carriers, parameters)
    }

    fn features(
        matched: &Matched<'a>,
        features: Features,
        carriers: usize,
        parameters: &Parameters,
    ) -> Result<Self> {
        let patches = &matched.reference.patches;
        let mark2 = mark_deviation_m(patches, carriers, parameters.amplitude_m).powi(2);
        let derived = DerivedPoints::new(patches, features.shares());
        let variances = derived.foreign_variance(mark2).zip(features.variance_m2());
        let weights = variances.map(|(foreign, own)| 1.0 / (1.0 + (foreign + own) / HALF_WEIGHT_M.powi(2)));
        let raw = Raw {
            observations: features.kind,
            weights: weights.collect(),
            derived: Some(derived),
            displacement_m: features.displacement_m,
            radius: features.radius,
            matches: Matches { suspect_of: vec![None; patches.vertex_count()], count: 0 },
        };
        Self::new(matched, raw, carriers, parameters)
    }

    fn new(matched: &Matched<'a>, raw: Raw<'a>, carriers: usize, parameters: &Parameters) -> Result<Self> {
        let (patches, amplitude_m) = (&matched.reference.patches, parameters.amplitude_m);
        let mark_m = mark_deviation_m(patches, carriers, amplitude_m);
        let of = || raw.derived.as_ref().map_or(Observables::Vertices(patches), Observables::Derived);
        let fit = |observed: &Observed| {
            let deformation = Deformation::estimate(of(), observed, carriers, parameters)?;
            Ok(deformation.predict(of(), observed, carriers, amplitude_m))
        };
        let prediction = fit(&raw.displacement_m)?;
        let observed = prediction.without_outliers(&raw.displacement_m, mark_m);
        let prediction = if observed == raw.displacement_m { prediction } else { fit(&observed)? };
        let (shaped, mut disturbance) = prediction.shape_noise(patches, &observed, carriers, amplitude_m);
        disturbance.weights.iter_mut().zip(&raw.weights).for_each(|(weight, own)| *weight *= own);
        let followed = Followed { radius: raw.radius, matches: raw.matches, observed: shaped, disturbance };
        let (derived, observations) = (raw.derived, raw.observations);
        Ok(Read { observed, chosen: Chosen { derived, followed, observations } })
    }
}

/// Returns the information of displacements, 1/m²: their number over the mean square of what is not
/// smooth. The mark is part of it, as it is for all observations.
fn information(observed: &Observed, disturbance: &Prediction) -> f64 {
    let Deformation { deviation_m, range_m, .. } = disturbance.deformation;
    let rest = |(o, f): (&Option<[f64; 2]>, &[f64; 2])| o.map(|o| (o[0] - f[0]).hypot(o[1] - f[1]));
    let rests: Vec<f64> = observed.iter().zip(&disturbance.displacement_m).filter_map(rest).collect();
    if rests.is_empty() {
        return 0.0;
    }
    let count = rests.len() as f64;
    let rest2 = rests.iter().map(|rest| rest * rest).sum::<f64>() / (2.0 * count);
    let rough2 = deviation_m.powi(2) / (1.0 + (range_m / SMOOTH_M).powi(2));
    count / (rest2 + rough2).max(LEAST_NOISE_M.powi(2))
}

/// Returns whether a disturbance leaves little to explain. One that changes from house to house
/// explains nothing.
fn is_quiet(Deformation { deviation_m, range_m, noise_m, .. }: &Deformation) -> bool {
    *noise_m < QUIET_M && (*deviation_m < QUIET_M || *range_m > HOUSE_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Demodulator, Mark, Reference, matching::RadiusChoice, registration::Registrar, registration::Start,
    };
    use meshmark_core::{
        embedding,
        ground::Ground,
        key::SecretKey,
        map_data::{ChainKind, MapData},
        message::Message,
    };

    /// The corners of a house; the last one is the first one.
    const HOUSE: [[f64; 2]; 5] = [[0.0, 0.0], [14.0, 0.0], [14.0, 9.0], [0.0, 9.0], [0.0, 0.0]];

    fn rings(coords: Vec<[f64; 2]>, vertices: usize) -> (MapData, Vec<u32>) {
        let starts: Vec<u32> = (0..coords.len() as u32).step_by(vertices).collect();
        let kinds = vec![ChainKind::Shell; starts.len()];
        MapData::from_chains(coords, &starts, kinds).unwrap()
    }

    /// 400 houses, 25 m apart, unevenly placed.
    fn town() -> (MapData, Vec<u32>) {
        let house = |i: usize| [(i % 20 * 25 + i % 7) as f64, (i / 20 * 25 + i % 3) as f64];
        let coords = (0..400).flat_map(|i| HOUSE.map(|[x, y]| [x + house(i)[0], y + house(i)[1]]));
        rings(coords.collect(), HOUSE.len())
    }

    /// Returns the score of a mark on what `alter` makes of the corners of a marked town, and what
    /// it was read from.
    fn read(alter: impl Fn(Vec<[f64; 2]>) -> MapData) -> (f64, Observations) {
        let (town, indices) = town();
        let map = town.on(&Ground::METRES, &Ground::METRES);
        let (key, parameters) = (SecretKey::from_bytes([7; 32]), Parameters::default());
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let copy = embedding::embed(&map, &key, &message, &parameters).unwrap();
        let suspect = alter(indices.iter().map(|&vertex| copy.coords[vertex as usize]).collect());
        let reference = Reference::new(&town, &map, 128, &parameters).unwrap();
        let registration = Registrar::new(&town, &Ground::METRES, 1.0).register(&suspect, Start::None);
        let matched = Matched::new(&reference, &suspect, &registration, RadiusChoice::FromData);
        assert!(!matched.is_chance(Demodulator::Joint));
        let mark = Mark { key: &key, bits: 128, parameters: &parameters };
        let found = matched.demodulate(mark, Demodulator::Joint, &|_| ()).unwrap();
        (found.found.mark_score(&message), found.observations)
    }

    fn between([a, b]: [[f64; 2]; 2], share: f64) -> [f64; 2] {
        [0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis]))
    }

    #[test]
    fn lines_with_new_vertices_are_read_by_their_corners() {
        for shares in [[0.15, 0.6], [0.35, 0.8]] {
            let (score, observations) = read(|corners| {
                let sides = corners.chunks(HOUSE.len()).flat_map(|ring| {
                    let sides = ring.windows(2).map(|ends| [ends[0], ends[1]]);
                    let mut places: Vec<_> =
                        sides.flat_map(|side| shares.map(|share| between(side, share))).collect();
                    places.push(places[0]);
                    places
                });
                rings(sides.collect(), 2 * (HOUSE.len() - 1) + 1).0
            });
            assert_eq!(observations, Observations::Corners, "{shares:?}");
            assert!(score > 15.0, "{score}, {shares:?}");
        }
    }

    #[test]
    fn old_vertices_are_read_themselves_whether_exact_or_noisy() {
        for noise_m in [0.0, 0.8] {
            let noise = |i: usize| noise_m * ((i * 7919 % 1009) as f64 / 504.0 - 1.0);
            let (score, observations) = read(|corners| {
                // The last corner of a ring is the first one.
                let vertex =
                    |i: usize| if i % HOUSE.len() == HOUSE.len() - 1 { i + 1 - HOUSE.len() } else { i };
                let each = corners.iter().enumerate().map(|(i, p)| (vertex(i), p));
                let noisy = each.map(|(i, p)| [p[0] + noise(2 * i), p[1] + noise(2 * i + 1)]);
                rings(noisy.collect(), HOUSE.len()).0
            });
            assert_eq!(observations, Observations::Vertices, "{noise_m} m");
            assert!(score > 5.0, "{score}, {noise_m} m");
        }
    }
}
