//! Editions: what stands moves as before, what is new is moved around it, and the evidence adds up.

use meshmark_core::{
    agreement::Evidence,
    deformation::Prediction,
    estimation::Estimates,
    fingerprint::recipient_signs,
    fingerprint_embedding::{self, FingerprintEmbedding},
    ground::Ground,
    key::SecretKey,
    map::Map,
    map_data::{ChainKind, MapData},
    options::Parameters,
    orientation::orientation,
    series::{Edition, Series},
    vertices::VertexTable,
};
use proptest::prelude::*;
use std::collections::BTreeMap;

const COEFFICIENTS: usize = 24;
const SIDE: usize = 14;

fn parameters() -> Parameters {
    Parameters { patch_size: 60, ..Parameters::of_fingerprint() }
}

fn key() -> SecretKey {
    SecretKey::from_bytes([42; 32])
}

/// The version of a house that has a new neighbour this near to its wall, metres.
const BESIDE: usize = 9;
const GAP: f64 = 0.05;

/// A house of an edition: which plot it is on, and which version of it stands there.
type House = (usize, usize);

/// Returns a town of houses, of which some touch their neighbour or have a corner on its wall, with a
/// road along each row.
fn town(houses: &[House]) -> MapData {
    let (mut coords, mut starts, mut kinds) = (Vec::new(), Vec::new(), Vec::new());
    for &(plot, version) in houses {
        // Version 2 adds a bay to version 1, whose other corners stay, and version 9 a kiosk beside it.
        let shape = if [2, BESIDE].contains(&version) { 1 } else { version };
        let jitter = |n: usize| ((plot * 7919 + shape * 104_729 + n * 31) % 101) as f64 / 50.0;
        let (x, y) = ((plot % SIDE * 20) as f64 + jitter(3), (plot / SIDE * 20) as f64);
        let (width, depth) = (8.0 + jitter(1), 7.0 + jitter(2));
        let mut ring = vec![[x, y], [x + width, y]];
        if version == 2 {
            ring.extend([
                [x + width, y + 2.0],
                [x + width + 1.5, y + 2.0],
                [x + width + 1.5, y + 4.0],
                [x + width, y + 4.0],
            ]);
        }
        ring.extend([[x + width, y + depth], [x, y + depth], [x, y]]);
        starts.push(coords.len() as u32);
        coords.extend(ring);
        kinds.push(ChainKind::Shell);
        if version == BESIDE {
            let kiosk = [[x + 1.0, y + depth + GAP], [x + 3.0, y + depth + 2.0], [x + 1.0, y + depth + 2.0]];
            starts.push(coords.len() as u32);
            coords.extend([kiosk[0], kiosk[1], kiosk[2], kiosk[0]]);
            kinds.push(ChainKind::Shell);
        }
        if version == 3 {
            // A shed has a corner on the wall.
            let shed = [[x + 1.0, y + depth], [x + 3.0, y + depth], [x + 3.0, y + depth + 2.0]];
            starts.push(coords.len() as u32);
            coords.extend([shed[0], shed[1], shed[2], shed[0]]);
            kinds.push(ChainKind::Shell);
        }
    }
    for row in 0..SIDE {
        starts.push(coords.len() as u32);
        coords.extend((0..2 * SIDE).map(|i| [10.0 * i as f64, 20.0 * row as f64 - 4.0 + (i % 3) as f64]));
        kinds.push(ChainKind::Line);
    }
    MapData::from_chains(coords, &starts, kinds).unwrap().0
}

/// Returns the editions of a town, in each of which every `every`-th house is changed or gone.
fn editions(count: usize, every: usize, seed: usize) -> Vec<MapData> {
    let mut versions: Vec<usize> = vec![1; SIDE * SIDE];
    let mut editions = Vec::new();
    for edition in 0..count {
        let houses: Vec<House> =
            versions.iter().enumerate().filter(|(_, v)| **v > 0).map(|(p, v)| (p, *v)).collect();
        editions.push(town(&houses));
        for (plot, version) in versions.iter_mut().enumerate() {
            let chance = (plot * 2_654_435_761 + edition * 40_503 + seed * 9_176_741) >> 7;
            if chance.is_multiple_of(every) {
                *version = match (*version, chance / every % 4) {
                    (_, 0) => 0,
                    (1, 1) => 2,
                    (version, 2) => version.max(1) + 3,
                    _ => 3,
                };
            }
        }
    }
    editions
}

fn on(data: &MapData) -> Map<'_> {
    data.on(&Ground::METRES, &Ground::METRES)
}

/// The series of the first editions, each of which rests on all before it.
fn series<'a>(editions: &'a [MapData], parameters: &'a Parameters) -> Series<'a> {
    let edition = |(number, data): (usize, &'a MapData)| Edition {
        map: on(data),
        bases: (0..number).collect(),
        anchors: &[],
        part_size: None,
    };
    Series::new(editions.iter().enumerate().map(edition).collect(), parameters).unwrap()
}

fn copy(editions: &[MapData], recipient: &str) -> Vec<[f64; 2]> {
    let parameters = parameters();
    fingerprint_embedding::embed(&series(editions, &parameters), &key(), recipient, COEFFICIENTS)
        .unwrap()
        .0
        .coords
}

fn places(vertices: &VertexTable, coords: &[[f64; 2]]) -> BTreeMap<[u64; 2], [f64; 2]> {
    vertices.coords().iter().zip(coords).map(|(from, to)| (from.map(f64::to_bits), *to)).collect()
}

/// Returns the pairs of segments that cross.
fn crossings(segments: &[[u32; 2]], coords: &[[f64; 2]]) -> usize {
    let at = |v: u32| coords[v as usize];
    let apart = |p: [f64; 2], q: [f64; 2], r: [f64; 2], s: [f64; 2]| {
        orientation(p, q, r) * orientation(p, q, s) < 0.0
    };
    let cross = |a: &[u32; 2], b: &[u32; 2]| {
        let [p, q, r, s] = [a[0], a[1], b[0], b[1]].map(at);
        let near = (0..2).all(|i| p[i].max(q[i]) >= r[i].min(s[i]) && r[i].max(s[i]) >= p[i].min(q[i]));
        near && apart(p, q, r, s) && apart(r, s, p, q)
    };
    segments.iter().enumerate().map(|(i, a)| segments[..i].iter().filter(|b| cross(a, b)).count()).sum()
}

/// Returns the score of a recipient on a copy of the last edition, with the evidence of all parts.
fn score(editions: &[MapData], coords: &[[f64; 2]], recipient: &str) -> f64 {
    let (newest, earlier) = editions.split_last().unwrap();
    let all = newest.with_earlier(&earlier.iter().collect::<Vec<_>>()).unwrap();
    let parameters = parameters();
    let (patches, parts) = series(editions, &parameters).patches_on(&on(&all), COEFFICIENTS).unwrap();
    let seen = |point: &[f64; 2]| {
        let to = coords[newest.vertices.index_of(*point)?];
        Some([to[0] - point[0], to[1] - point[1]])
    };
    let observed: Vec<_> = all.vertices.coords().iter().map(seen).collect();
    let noise = Prediction::of_noise(0.01, observed.len());
    let estimates = Estimates::new(&patches, &observed, COEFFICIENTS, &parameters, &noise, &|_| ()).unwrap();
    Evidence::of_recipients(&estimates).agreement(&recipient_signs(&key(), &parts, recipient)).score
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn what_stands_moves_as_in_its_base_and_what_is_new_crosses_nothing(
        seed in 0usize..1000, every in 4usize..12,
    ) {
        let editions = editions(3, every, seed);
        let copies: Vec<_> = (1..=3).map(|count| copy(&editions[..count], "ACME")).collect();
        let placed: Vec<_> =
            editions.iter().zip(&copies).map(|(data, coords)| places(&data.vertices, coords)).collect();
        for later in 1..3 {
            let shared = placed[later].keys().filter(|v| placed[..later].iter().any(|p| p.contains_key(*v)));
            let shared: Vec<_> = shared.collect();
            prop_assert!(shared.len() > placed[later].len() / 3);
            for vertex in shared {
                let first = placed[..later].iter().find_map(|places| places.get(vertex)).unwrap();
                prop_assert_eq!(placed[later][vertex].map(f64::to_bits), first.map(f64::to_bits));
            }
            let segments = &editions[later].segments;
            let before = crossings(segments, editions[later].vertices.coords());
            prop_assert!(crossings(segments, &copies[later]) <= before);
        }
    }
}

#[test]
fn the_evidence_of_all_parts_adds_up_and_a_stranger_has_none() {
    let editions = editions(3, 4, 7);
    let coords = copy(&editions, "ACME");
    let all = score(&editions, &coords, "ACME");
    assert!(all > 20.0 && score(&editions, &coords, "Other").abs() < 5.0, "{all}");
    // A reference without bases has no part in common with the copy.
    assert!(score(&editions[2..], &coords, "ACME").abs() < 5.0);
    let parameters = parameters();
    let (of_three, key) = (series(&editions, &parameters), key());
    let embedding = FingerprintEmbedding::new(&of_three, &key, COEFFICIENTS).unwrap();
    assert_eq!(embedding.parts().as_slice().len(), 3, "each edition has enough new vertices");
}

#[test]
fn few_new_vertices_are_no_part_and_the_copy_still_names_its_recipient() {
    let mut houses: Vec<House> = (0..SIDE * SIDE).map(|plot| (plot, 1)).collect();
    let before = town(&houses);
    houses[5].1 = 4;
    let editions = [before, town(&houses)];
    let parameters = parameters();
    let (of_both, key) = (series(&editions, &parameters), key());
    let embedding = FingerprintEmbedding::new(&of_both, &key, COEFFICIENTS).unwrap();
    assert_eq!(embedding.parts().as_slice().len(), 1);
    assert!(score(&editions, &copy(&editions, "New Ltd"), "New Ltd") > 20.0);
}

/// Returns how many corners of kiosks are on the other side of the wall that they stand beside.
fn through_walls(data: &MapData, coords: &[[f64; 2]]) -> usize {
    let from = data.vertices.coords();
    let beside = |v: usize, [a, b]: [usize; 2]| {
        let is_wall = from[a][1] == from[b][1] && from[v][0] > from[a][0] && from[v][0] < from[b][0];
        is_wall && (from[v][1] - from[a][1] - GAP).abs() < 1e-6
    };
    let walls = data.segments.iter().map(|segment| segment.map(|v| v as usize));
    let walls: Vec<[usize; 2]> = walls.collect();
    let through = |v: usize| {
        let mut own = walls.iter().filter(|wall| beside(v, **wall));
        own.any(|&[a, b]| orientation(coords[a], coords[b], coords[v]) <= 0.0)
    };
    assert!((0..from.len()).any(|v| walls.iter().any(|wall| beside(v, *wall))));
    (0..from.len()).filter(|&v| through(v)).count()
}

#[test]
fn what_is_new_beside_a_standing_wall_gives_way_to_it() {
    // Few kiosks stay in place unless a wall moves them, many carry signs.
    for count in [15, SIDE * SIDE] {
        let before: Vec<House> = (0..SIDE * SIDE).map(|plot| (plot, 1)).collect();
        let after: Vec<House> =
            before.iter().map(|&(plot, _)| (plot, if plot < count { BESIDE } else { 1 })).collect();
        let editions = [town(&before), town(&after)];
        assert_eq!(through_walls(&editions[1], &copy(&editions, "ACME")), 0, "{count}");
    }
}
