//! Features as points: a suspect may hold nothing but the centroids of polygons, or their bounding
//! boxes. To first order both move as linear functions of the vertices of their polygon. No key is
//! involved.

mod boxes;
mod centroids;
mod extremes;
mod points;

use crate::{
    linework::{Plane, is_alone},
    matched::Matched,
    matching::{LEAST_MATCHED, Matcher, Radius, RadiusChoice, RadiusReason, by_chance, is_chance},
    observed_on::Observations,
};
use boxes::Frame;
use meshmark_core::{Result, derived::Shares, ground::Ground, map_data::MapData, vertices::VertexTable};
use points::FeaturePoint;
use rayon::prelude::*;
use rstar::{RTree, primitives::GeomWithData};

/// The kinds of points.
const KINDS: [Observations; 2] = [Observations::Centroids, Observations::Boxes];
/// A suspect that consists of points of features has more than this share of its vertices in them.
const MOSTLY: f64 = 0.8;

/// The points of features that a suspect shows.
pub struct Features {
    /// What the points are.
    pub kind: Observations,
    /// The radius within which they were found.
    pub radius: Radius,
    /// The displacement of every point, metres; `None` where the suspect does not have it.
    pub displacement_m: Vec<Option<[f64; 2]>>,
    points: Vec<FeaturePoint>,
}

impl Features {
    /// Returns the shares of the vertices in the displacement of every point.
    pub fn shares(&self) -> impl Iterator<Item = &Shares> {
        self.points.iter().map(|point| &point.shares[..])
    }

    /// Returns the variance of every point's displacement that is no linear function, per axis.
    pub fn variance_m2(&self) -> impl Iterator<Item = f64> {
        self.points.iter().map(|point| point.variance_m2)
    }
}

/// Returns the features that a suspect shows as points, more than by chance.
pub fn shown(matched: &Matched) -> impl Iterator<Item = Features> {
    KINDS.iter().filter_map(|kind| of_kind(matched, *kind))
}

fn of_kind(matched: &Matched, kind: Observations) -> Option<Features> {
    let pair = Pair::new(matched);
    let (points, candidates) = pair.points(kind)?;
    let (reference, plane) = (matched.reference, pair.plane());
    let candidates: Vec<[f64; 2]> = (matched.moved.iter().zip(candidates))
        .filter_map(|(place, is_candidate)| is_candidate.then_some(*place))
        .collect();
    let places: Vec<[f64; 2]> = points.iter().map(|point| plane.place(point.at_m)).collect();
    let (ground, centre) = (&reference.ground, reference.data.vertices.centre());
    let (matcher, unit_m) = (Matcher::new(&places, ground, centre), ground.metres_per_unit(centre));
    let radius = match matched.radius {
        Radius { metres, reason: RadiusReason::Given } => RadiusChoice::Given(metres),
        _ => RadiusChoice::FromData,
    };
    let radius = radius.choose(&matcher, &candidates, unit_m);
    let matches = matcher.all(&candidates, radius.metres);
    let chance = by_chance(&matcher, &candidates, unit_m, radius.metres).0.count;
    let displacement_m = matches.displacements_m(&places, &candidates, ground);
    (!is_chance(matches.count, chance)).then_some(Features { kind, radius, displacement_m, points })
}

/// Returns the maps of points onto which a suspect in the CRS of the reference may be registered,
/// where it consists of the points of features.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn maps_of_features(reference: &MapData, ground: &Ground, suspect: &MapData) -> Result<Vec<MapData>> {
    let pair = Pair { reference, ground, suspect, places: suspect.vertices.coords() };
    let is_most = |candidates: &[bool]| {
        let count = candidates.iter().filter(|is_candidate| **is_candidate).count();
        count as f64 > MOSTLY * candidates.len() as f64
    };
    let plane = pair.plane();
    let mut all = Vec::new();
    if pair.alone().is_some_and(|alone| is_most(&alone)) {
        all.push(centroids::feature_points(reference, &plane));
    }
    if let Some((frame, _)) = pair.frame().filter(|(_, on_boxes)| is_most(on_boxes)) {
        // The suspect may have been turned after the boxes were drawn.
        all.push(boxes::feature_points(reference, &plane, frame, &boxes::CORNERS));
        all.push(boxes::feature_points(reference, &plane, Frame::UPRIGHT, &boxes::CORNERS));
    }
    let map = |points: Vec<FeaturePoint>| {
        let vertices = VertexTable::new(points.iter().map(|point| plane.place(point.at_m)).collect())?;
        Ok(MapData { labels: reference.labels.clone(), ..MapData::of_points(vertices) })
    };
    all.into_iter().filter(|points| points.len() >= LEAST_MATCHED).map(map).collect()
}

/// Returns where the vertices of the suspect go when the vertices of the reference move, if they are
/// points of features, CRS units. The nearest point of a feature takes each of them along.
pub fn moved(matched: &Matched, kind: Observations, displacement_m: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let pair = Pair::new(matched);
    let plane = pair.plane();
    let Some((points, _)) = pair.points(kind) else { return matched.moved.clone() };
    let displaced = |FeaturePoint { shares, .. }: &FeaturePoint| {
        shares.iter().fold([0.0; 2], |sum, (vertex, share)| {
            let [x, y] = displacement_m[*vertex as usize];
            [0, 1].map(|axis| sum[axis] + share[axis][0] * x + share[axis][1] * y)
        })
    };
    let nodes = points.iter().map(|point| GeomWithData::new(point.at_m, displaced(point))).collect();
    let tree = RTree::bulk_load(nodes);
    let moved = |place: &[f64; 2]| {
        let at = plane.at(*place);
        let Some(nearest) = tree.nearest_neighbor(&at) else { return *place };
        plane.place([0, 1].map(|axis| at[axis] + nearest.data[axis]))
    };
    matched.moved.par_iter().map(moved).collect()
}

/// A reference and a suspect.
struct Pair<'a> {
    reference: &'a MapData,
    ground: &'a Ground,
    suspect: &'a MapData,
    /// The vertices of the suspect in the CRS of the reference.
    places: &'a [[f64; 2]],
}

impl<'a> Pair<'a> {
    fn new(matched: &'a Matched) -> Self {
        let Matched { reference, suspect, moved, .. } = matched;
        Pair { reference: reference.data, ground: &reference.ground, suspect, places: moved }
    }

    /// Returns the points of the reference of a kind, and which vertices of the suspect may be such
    /// points; `None` where too few may be.
    fn points(&self, kind: Observations) -> Option<(Vec<FeaturePoint>, Vec<bool>)> {
        match kind {
            Observations::Centroids => {
                let alone = self.alone()?;
                Some((centroids::feature_points(self.reference, &self.plane()), alone))
            }
            Observations::Boxes => {
                let (frame, on_boxes) = self.frame()?;
                Some((
                    boxes::feature_points(self.reference, &self.plane(), frame, &boxes::OPPOSITE_CORNERS),
                    on_boxes,
                ))
            }
            Observations::Vertices | Observations::Corners => None,
        }
    }

    /// Returns which vertices of the suspect are points alone; `None` where few are.
    fn alone(&self) -> Option<Vec<bool>> {
        let alone = is_alone(self.suspect.vertices.len(), &self.suspect.segments);
        (alone.iter().filter(|alone| **alone).count() >= LEAST_MATCHED).then_some(alone)
    }

    /// Returns the frame of the boxes of the suspect, and which vertices are on them.
    fn frame(&self) -> Option<(Frame, Vec<bool>)> {
        let plane = self.plane();
        let places: Vec<[f64; 2]> = self.places.iter().map(|place| plane.at(*place)).collect();
        Frame::of_boxes(&places, &self.suspect.segments)
    }

    /// Returns the plane around the middle of the reference.
    fn plane(&self) -> Plane {
        Plane::new(self.ground, self.reference.vertices.centre())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Demodulator, Mark, Reference,
        decision::Decoys,
        power::Power,
        registration::{Registrar, Registration, Start},
    };
    use meshmark_core::{
        areas::Areas, embedding, key::SecretKey, map_data::ChainKind, message::Message, options::Parameters,
        options::Rigidity,
    };

    /// The corners of a house; the last one is the first one.
    const HOUSE: [[f64; 2]; 6] = [[0.0, 0.0], [14.0, 0.0], [14.0, 9.0], [6.0, 12.0], [0.0, 9.0], [0.0, 0.0]];

    /// 400 houses, 30 m apart, each turned by an angle of its own, and the vertex of every corner.
    fn town() -> (MapData, Vec<u32>) {
        let corner = |i: usize, [x, y]: [f64; 2]| {
            let (sin, cos) = (i as f64).sin_cos();
            [x * cos - y * sin + (i % 20 * 30) as f64, x * sin + y * cos + (i / 20 * 30) as f64]
        };
        let coords: Vec<[f64; 2]> = (0..400).flat_map(|i| HOUSE.map(|place| corner(i, place))).collect();
        let starts: Vec<u32> = (0..400).map(|i| i * HOUSE.len() as u32).collect();
        let (kinds, firsts) = (vec![ChainKind::Shell; 400], (0..400).collect::<Vec<u32>>());
        let (town, indices) = MapData::from_chains(coords, &starts, kinds.clone()).unwrap();
        let areas = Areas::new(&indices, &starts, kinds, &firsts);
        (MapData { areas, ..town }, indices)
    }

    fn centroid(house: &[[f64; 2]]) -> [f64; 2] {
        let turn = |ends: &[[f64; 2]]| ends[0][0] * ends[1][1] - ends[0][1] * ends[1][0];
        let area: f64 = house.windows(2).map(turn).sum();
        [0, 1].map(|axis| {
            house.windows(2).map(|ends| turn(ends) * (ends[0][axis] + ends[1][axis])).sum::<f64>()
                / 3.0
                / area
        })
    }

    fn centroids(houses: &[[f64; 2]]) -> MapData {
        let places = houses.chunks(HOUSE.len()).map(centroid).collect();
        MapData::of_points(VertexTable::new(places).unwrap())
    }

    /// Returns boxes around houses, with sides along axes that are turned by `angle`.
    fn boxes(houses: &[[f64; 2]], angle: f64) -> MapData {
        let turned = |[x, y]: [f64; 2], angle: f64| {
            [angle.cos() * x - angle.sin() * y, angle.sin() * x + angle.cos() * y]
        };
        let around = |house: &[[f64; 2]]| {
            let places: Vec<[f64; 2]> = house.iter().map(|place| turned(*place, -angle)).collect();
            let end = |axis: usize, most: fn(f64, f64) -> f64| {
                places.iter().map(|place| place[axis]).reduce(most).unwrap()
            };
            let ([left, right], [low, high]) =
                ([end(0, f64::min), end(0, f64::max)], [end(1, f64::min), end(1, f64::max)]);
            [[left, low], [right, low], [right, high], [left, high], [left, low]]
                .map(|place| turned(place, angle))
        };
        let coords: Vec<[f64; 2]> = houses.chunks(HOUSE.len()).flat_map(around).collect();
        let starts: Vec<u32> = (0..coords.len() as u32).step_by(5).collect();
        let kinds = vec![ChainKind::Shell; starts.len()];
        MapData::from_chains(coords, &starts, kinds).unwrap().0
    }

    /// What was read from a suspect.
    struct Seen {
        kind: Observations,
        score: f64,
        power: Power,
        decoys: Decoys,
    }

    /// Reads what `altered` makes of the houses of a town, of which the mark is that of `copy`, under
    /// the key of the tests.
    fn seen(copy: u8, shape: Rigidity, altered: impl Fn(&[[f64; 2]]) -> MapData) -> Seen {
        let (town, indices) = town();
        let map = town.on(&Ground::METRES, &Ground::METRES);
        let (key, parameters) =
            (SecretKey::from_bytes([7; 32]), Parameters { shape, ..Parameters::default() });
        let message = Message::from_hex("00112233445566778899aabbccddeeff").unwrap();
        let marked =
            embedding::embed(&map, &SecretKey::from_bytes([copy; 32]), &message, &parameters).unwrap();
        let houses: Vec<[f64; 2]> = indices.iter().map(|&vertex| marked.coords[vertex as usize]).collect();
        let suspect = altered(&houses);
        let reference = Reference::new(&town, &map, 128, &parameters).unwrap();
        let maps = maps_of_features(&town, &Ground::METRES, &suspect).unwrap();
        let onto = |map| Registrar::new(map, &Ground::METRES, 1.0).register(&suspect, Start::Auto);
        let registration = maps.iter().map(onto).find(Registration::agrees).unwrap();
        let matched = Matched::new(&reference, &suspect, &registration, RadiusChoice::FromData);
        assert!(!matched.is_chance(Demodulator::Joint));
        let mark = Mark { key: &key, bits: 128, parameters: &parameters };
        let found = matched.demodulate(mark, Demodulator::Joint, &|_| ()).unwrap();
        let power = Power::measure(&matched, &found, mark, Demodulator::Joint, &|_| ()).unwrap();
        let score = found.found.mark_score(&message);
        Seen { kind: found.observations, score, power, decoys: found.decoys.unwrap() }
    }

    #[test]
    fn a_mark_is_read_from_centroids_and_from_boxes_alone_with_free_and_rigid_shapes() {
        for shape in [Rigidity::Free, Rigidity::Rigid] {
            let of_centroids = seen(7, shape, centroids);
            assert_eq!(of_centroids.kind, Observations::Centroids);
            assert!(of_centroids.score > 12.0, "{shape:?} {}", of_centroids.score);
            for angle in [0.0, 0.3] {
                let of_boxes = seen(7, shape, |houses| boxes(houses, angle));
                assert_eq!(of_boxes.kind, Observations::Boxes);
                assert!(of_boxes.score > 12.0, "{shape:?} {}", of_boxes.score);
            }
        }
    }

    #[test]
    fn features_are_registered_after_a_move_and_a_turn() {
        let moved = |suspect: MapData| {
            let (sin, cos) = 0.5f64.sin_cos();
            let place = |[x, y]: [f64; 2]| [cos * x - sin * y + 3000.0, sin * x + cos * y - 500.0];
            suspect.moved::<meshmark_core::Error>(|all| Ok(all.into_iter().map(place).collect())).unwrap()
        };
        let of_centroids = seen(7, Rigidity::Free, |houses| moved(centroids(houses)));
        assert!(of_centroids.score > 12.0, "{}", of_centroids.score);
        let of_boxes = seen(7, Rigidity::Free, |houses| moved(boxes(houses, 0.0)));
        assert!(of_boxes.score > 12.0, "{}", of_boxes.score);
    }

    #[test]
    fn another_key_has_no_score_on_features_and_a_trial_mark_beside_another_has_one() {
        let upright = |houses: &[[f64; 2]]| boxes(houses, 0.0);
        // Beside the mark of another key, a trial mark of boxes shows under some keys only: the power is
        // then understated, and the verdict inconclusive.
        let kinds = [(&centroids as &dyn Fn(&[[f64; 2]]) -> MapData, 8.0), (&upright, f64::NEG_INFINITY)];
        for (altered, least) in kinds {
            let present = seen(7, Rigidity::Free, altered).score;
            let Seen { score, power, decoys, .. } = seen(8, Rigidity::Free, altered);
            assert!(score.abs() < 5.0, "{score}");
            // The limits are 5 deviations.
            assert!(decoys.mean.abs() < 0.16 && (decoys.standard_deviation - 1.0).abs() < 0.12);
            let Power::Trial(trial) = power else { panic!("{power:?}") };
            // The mark of the other key is noise for it.
            assert!(trial > least && trial < 1.1 * present, "{trial} {present}");
        }
    }

    #[test]
    fn points_of_another_place_and_few_points_are_no_features() {
        let (town, indices) = town();
        let map = town.on(&Ground::METRES, &Ground::METRES);
        let reference = Reference::new(&town, &map, 128, &Parameters::default()).unwrap();
        let anywhere = |i: usize| [(i * 7919 % 60_101) as f64 / 100.0, (i * 104_729 % 60_013) as f64 / 100.0];
        let houses: Vec<[f64; 2]> =
            indices.iter().map(|&vertex| town.vertices.coords()[vertex as usize]).collect();
        let few = centroids(&houses[..20 * HOUSE.len()]).vertices.coords().to_vec();
        for places in [(0..500).map(anywhere).collect(), few] {
            let suspect = MapData::of_points(VertexTable::new(places).unwrap());
            let registration = Registrar::new(&town, &Ground::METRES, 1.0).as_it_stands(&suspect);
            let matched = Matched::new(&reference, &suspect, &registration, RadiusChoice::FromData);
            assert_eq!(shown(&matched).count(), 0);
        }
    }
}
