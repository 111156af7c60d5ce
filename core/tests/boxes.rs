//! A map that is cut into parts keeps its topology, also across their borders.

mod towns;

use meshmark_core::{
    Error,
    agreement::Evidence,
    columns::{Column, Columns, InMemory},
    deformation::Prediction,
    distortion::{AngleChange, Corner, Displacement},
    embedding::Marked,
    estimation::Estimates,
    fingerprint::recipient_signs,
    fingerprint_embedding::{self, FingerprintEmbedding},
    fingerprint_record::Divided,
    key::SecretKey,
    map_data::{ChainKind, MapData},
    options::Parameters,
    series::{Edition, Series},
    vertices::VertexTable,
};
use proptest::prelude::*;
use std::collections::BTreeMap;
use towns::{Feature, SIDE, crossings, data, on, town};

const COEFFICIENTS: usize = 24;

fn parameters() -> Parameters {
    Parameters { patch_size: 60, ..Parameters::of_fingerprint() }
}

fn key() -> SecretKey {
    SecretKey::from_bytes([42; 32])
}

fn in_parts<'a>(data: &'a MapData, part_size: usize, parameters: &'a Parameters) -> Series<'a> {
    let edition = Edition { map: on(data), bases: Vec::new(), anchors: &[], part_size: Some(part_size) };
    Series::new(vec![edition], parameters).unwrap()
}

fn mark(data: &MapData, part_size: usize) -> Result<(Marked, Divided), Error> {
    let parameters = parameters();
    fingerprint_embedding::embed(&in_parts(data, part_size, &parameters), &key(), "ACME", COEFFICIENTS)
}

/// A town with lines from one end to the other, kerbs six centimetres apart, and a hole whose ring is far
/// inside its polygon.
fn town_with_long_lines(seed: usize) -> Vec<Feature> {
    let size = 20.0 * SIDE as f64;
    let line = |points: &[[f64; 2]]| Feature { points: points.to_vec(), kind: ChainKind::Line };
    let mut features = town(seed);
    let shift = (seed % 13) as f64;
    features.push(line(&[[-9.0, 17.5 + shift], [size + 9.0, 33.0 + shift]]));
    features.push(line(&[[11.5, -7.0], [0.7 * size, size + 3.0]]));
    for (row, by) in (0..SIDE).flat_map(|row| [(row, 0.0), (row, 6.0)]) {
        let (at, steps) = (20.0 * row as f64 - 1.5 + by / 100.0, size as usize / 13);
        let kerb = (0..steps).map(|i| [13.0 * i as f64 + by, at]);
        features.push(line(&kerb.clone().collect::<Vec<_>>()));
        features.push(line(&kerb.map(|[along, across]| [across, along]).collect::<Vec<_>>()));
    }
    let outer = [[-20.0, -20.0], [size + 20.0, -20.0], [size + 20.0, size + 20.0], [-20.0, size + 20.0]];
    let hole = [[-15.0, -15.0], [size + 15.0, -15.0], [size + 15.0, size + 15.0], [-15.0, size + 15.0]];
    features.push(Feature { points: outer.to_vec(), kind: ChainKind::Shell });
    features.push(Feature { points: hole.to_vec(), kind: ChainKind::Hole });
    features
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

fn ends(data: &MapData, coords: &[[f64; 2]]) -> Vec<[[f64; 2]; 2]> {
    data.segments.iter().map(|ends| ends.map(|v| coords[v as usize])).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn nothing_new_crosses_and_every_vertex_is_in_one_part(seed in 0usize..1000, part_size in 240usize..1200) {
        let data = data(&town_with_long_lines(seed));
        let vertices = data.vertices.len();
        let (marked, Divided { parts, census }) = mark(&data, part_size).unwrap();
        let census = census.unwrap();
        prop_assert_eq!(parts.len(), vertices.div_ceil(part_size));
        prop_assert_eq!(parts.iter().map(|part| part.vertices).sum::<usize>(), vertices);
        prop_assert_eq!(census.anchored + census.attached + census.free, vertices);
        let moved = data.vertices.coords().iter().zip(&marked.coords).filter(|(from, to)| from != to).count();
        prop_assert!(moved <= census.free + census.attached && 2 * moved > vertices, "{moved} {census:?}");
        let before = crossings(&ends(&data, data.vertices.coords()));
        let after = crossings(&ends(&data, &marked.coords));
        prop_assert!(after.is_subset(&before), "{:?}", after.difference(&before).collect::<Vec<_>>());
    }

    #[test]
    fn neither_threads_nor_the_order_of_features_change_a_bit(seed in 0usize..1000, part_size in 240usize..1200) {
        let features = town_with_long_lines(seed);
        let one = pool(1).install(|| mark(&data(&features), part_size).unwrap());
        for threads in [2, 8] {
            prop_assert!(pool(threads).install(|| mark(&data(&features), part_size).unwrap()) == one);
        }
        let last = features.len() - 1; // the hole comes after its shell
        let mut order: Vec<usize> = (0..last).collect();
        order.sort_by_key(|i| (i * 7919 + seed) % 1009);
        let place = order.iter().position(|i| *i == last - 1).unwrap();
        order.insert(place + 1, last);
        let shuffled: Vec<Feature> = order.into_iter().map(|i| features[i].clone()).collect();
        prop_assert!(mark(&data(&shuffled), part_size).unwrap() == one);
    }
}

#[test]
fn the_parts_of_the_reference_are_those_of_the_mark_and_their_evidence_adds_up() {
    let data = data(&town(7));
    let (marked, divided) = mark(&data, 600).unwrap();
    let parameters = parameters();
    let (patches, parts) = in_parts(&data, 600, &parameters).patches_on(&on(&data), COEFFICIENTS).unwrap();
    let names = |of: &Divided| of.parts.iter().map(|part| part.sha256).collect::<Vec<_>>();
    assert_eq!(parts.as_slice().iter().map(|part| part.digest).collect::<Vec<_>>(), names(&divided));
    assert_eq!(divided.parts.iter().map(|part| part.patches).sum::<usize>(), patches.as_slice().len());
    assert_eq!(marked.patches, patches.as_slice().len());
    let moved = data.vertices.coords().iter().zip(&marked.coords);
    let observed: Vec<_> = moved.map(|(from, to)| Some([to[0] - from[0], to[1] - from[1]])).collect();
    let noise = Prediction::of_noise(0.01, observed.len());
    let estimates = Estimates::new(&patches, &observed, COEFFICIENTS, &parameters, &noise, &|_| ()).unwrap();
    let evidence = Evidence::of_recipients(&estimates);
    let score = |recipient: &str| evidence.agreement(&recipient_signs(&key(), &parts, recipient)).score;
    assert!(score("ACME") > 20.0 && score("Other").abs() < 5.0, "{} {}", score("ACME"), score("Other"));
    let series = in_parts(&data, 600, &parameters);
    let key = key();
    let embedding = FingerprintEmbedding::new(&series, &key, COEFFICIENTS).unwrap();
    let read = |name: &str| embedding.score(&embedding.fingerprint(name), &marked.coords, 0.01).unwrap();
    assert!(read("ACME") > 20.0 && read("Other").abs() < 5.0);
}

#[test]
fn the_figures_of_all_boxes_are_those_of_the_whole_map() {
    let data = data(&town_with_long_lines(11));
    let map = on(&data);
    for part_size in [400, 1000] {
        let (marked, divided) = mark(&data, part_size).unwrap();
        assert!(divided.parts.len() > 1);
        assert_eq!(marked.displacement, Displacement::between(&data.vertices, &marked.coords, map.measure));
        assert_eq!(marked.angles, AngleChange::at(&Corner::all(&map, &marked.coords)));
        assert!(marked.angles.right_angles > 100 && marked.displacement.max_m > 0.1, "{marked:?}");
    }
}

/// Columns that have room for so many numbers each.
struct Room(usize);

struct Full(Box<dyn Column>, usize);

impl Columns for Room {
    fn column(&self) -> Result<Box<dyn Column>, Error> {
        Ok(Box::new(Full(InMemory.column()?, self.0)))
    }
}

impl Column for Full {
    fn append(&mut self, numbers: &[f64]) -> Result<(), Error> {
        self.1 = self.1.checked_sub(numbers.len()).ok_or(Error::Column { reason: "it is full".into() })?;
        self.0.append(numbers)
    }
    fn read(&self, first: usize, numbers: &mut [f64]) -> Result<(), Error> {
        self.0.read(first, numbers)
    }
}

#[test]
fn a_mark_does_not_depend_on_where_numbers_wait_and_no_map_is_marked_where_they_have_no_room() {
    let (data, parameters, key) = (data(&town(4)), parameters(), key());
    let series = in_parts(&data, 600, &parameters);
    let mark_with = |columns: &Room| {
        let embedding = FingerprintEmbedding::new(&series, &key, COEFFICIENTS)?.with_columns(columns);
        let fingerprint = embedding.fingerprint("ACME");
        let wanted = embedding.wanted(std::slice::from_ref(&fingerprint), &|_| ())?.pop().unwrap();
        embedding.settle(&fingerprint, wanted)
    };
    let places = 2 * data.vertices.len();
    assert!(mark_with(&Room(places)).unwrap() == mark(&data, 600).unwrap().0);
    let full = mark_with(&Room(places - 1)).unwrap_err();
    assert_eq!(full.to_string(), "it is full");
}

#[test]
fn recipients_marked_together_get_the_copies_of_recipients_marked_alone() {
    let (data, parameters, key) = (data(&town(3)), parameters(), key());
    let series = in_parts(&data, 700, &parameters);
    let embedding = FingerprintEmbedding::new(&series, &key, COEFFICIENTS).unwrap().for_many().unwrap();
    let names = ["Öster AB", "ACME"];
    let marks = names.map(|name| embedding.fingerprint(name));
    let wanted = embedding.wanted(&marks, &|_| ()).unwrap();
    let together: Vec<_> = marks.iter().zip(wanted).map(|(m, w)| embedding.settle(m, w).unwrap()).collect();
    assert!(together[0] != together[1]);
    assert!(together[1] == mark(&data, 700).unwrap().0);
}

#[test]
fn a_map_of_no_more_vertices_is_one_part_and_moves_as_without_an_option() {
    let (data, parameters) = (data(&town(5)), parameters());
    let whole = Series::of_one(on(&data), &parameters);
    let whole = fingerprint_embedding::embed(&whole, &key(), "ACME", COEFFICIENTS).unwrap();
    assert!(mark(&data, data.vertices.len()).unwrap() == whole);
    assert!(mark(&data, data.vertices.len() - 1).unwrap() != whole);
}

#[test]
fn an_edition_moves_what_its_base_in_parts_had_as_there() {
    let (parameters, key) = (parameters(), key());
    let base = town(9);
    let mut next = base.clone();
    next.drain(40..60);
    next.push(Feature { points: vec![[3.0, 9.5], [4.0, 9.6], [3.5, 10.0]], kind: ChainKind::Shell });
    let [base, next] = [data(&base), data(&next)];
    let edition = |data, bases, part_size| Edition { map: on(data), bases, anchors: &[], part_size };
    let editions = vec![edition(&base, vec![], Some(700)), edition(&next, vec![0], None)];
    let series = Series::new(editions, &parameters).unwrap();
    let (copy, divided) = fingerprint_embedding::embed(&series, &key, "ACME", COEFFICIENTS).unwrap();
    let (of_base, parts) = mark(&base, 700).unwrap();
    assert_eq!(divided.parts, parts.parts);
    let places: BTreeMap<[u64; 2], [f64; 2]> = places(&base.vertices, &of_base.coords);
    let standing = places_in(&next.vertices, &copy.coords, &places);
    assert!(standing.len() > 1000 && standing.iter().all(|[now, before]| now == before));
}

fn places(vertices: &VertexTable, coords: &[[f64; 2]]) -> BTreeMap<[u64; 2], [f64; 2]> {
    vertices.coords().iter().zip(coords).map(|(from, to)| (from.map(f64::to_bits), *to)).collect()
}

/// Returns where vertices are that both have, now and before.
fn places_in(
    vertices: &VertexTable,
    coords: &[[f64; 2]],
    before: &BTreeMap<[u64; 2], [f64; 2]>,
) -> Vec<[[f64; 2]; 2]> {
    let pairs = vertices.coords().iter().zip(coords);
    pairs.filter_map(|(from, to)| Some([*to, *before.get(&from.map(f64::to_bits))?])).collect()
}

#[test]
fn parts_without_room_stay_in_place_and_a_map_of_none_else_is_refused() {
    // Beside houses there is a long row of points, which some parts have alone.
    let mut features = town(2);
    let row = (0..1600).map(|i| [2000.0 + f64::from(i), -20.0]).collect();
    features.push(Feature { points: row, kind: ChainKind::Line });
    let data = data(&features);
    let (marked, divided) = mark(&data, 400).unwrap();
    assert!(divided.parts.iter().any(|part| part.patches == 0), "{divided:?}");
    let of_row = data.vertices.coords().iter().zip(&marked.coords).filter(|(from, _)| from[0] > 1990.0);
    assert!(of_row.filter(|(from, to)| from == to).count() > 400);
    let refused = mark(&data, 50).unwrap_err();
    assert!(matches!(refused, Error::TooFewInParts { .. }), "{refused}");
}
