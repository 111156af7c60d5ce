//! Recipients are named by their fingerprints, alone and in coalitions, and nobody else is.

use meshmark_core::{
    agreement::Evidence,
    fingerprint::{COEFFICIENTS, Fingerprint, pilots, recipient_signs},
    fingerprint_embedding::{FingerprintEmbedding, Wanted},
    ground::Ground,
    key::SecretKey,
    map_data::{ChainKind, MapData},
    options::Parameters,
    part::Parts,
    series::Series,
    signs::Sequence,
};
use meshmark_detection::{
    Estimated, Matched, Reference,
    decision::recipients::{Standing, name_recipients, needed_score, p_log10, shows_key},
    matching::RadiusChoice,
    power::Power,
    registration::{Registrar, Start},
};
use std::sync::LazyLock;

const HOUSES: usize = 900;
/// The corners of a house; the last one is the first one.
const HOUSE: [[f64; 2]; 6] = [[0.0, 0.0], [9.0, 0.0], [9.0, 7.0], [4.0, 7.0], [0.0, 6.0], [0.0, 0.0]];
/// The largest coalition.
const COPIES: usize = 8;
const CANDIDATES: usize = 1000;
const SIGNIFICANCE: f64 = 1e-6;

/// A town, and copies of it for the first candidates.
struct Town {
    data: MapData,
    key: SecretKey,
    part: Parts,
    /// Corner after corner, ring after ring.
    corners: Vec<[f64; 2]>,
    /// The same in the copies.
    copies: Vec<Vec<[f64; 2]>>,
}

static TOWN: LazyLock<Town> = LazyLock::new(|| {
    let house = |i: usize| [(i % 30 * 20 + i % 7) as f64, (i / 30 * 20 + i % 3) as f64];
    let corners = (0..HOUSES).flat_map(|i| HOUSE.map(|[x, y]| [x + house(i)[0], y + house(i)[1]]));
    let corners: Vec<[f64; 2]> = corners.collect();
    let (data, indices) = rings(corners.clone());
    let (key, parameters) = (SecretKey::from_bytes([7; 32]), Parameters::of_fingerprint());
    let map = data.on(&Ground::METRES, &Ground::METRES);
    let series = Series::of_one(map, &parameters);
    let embedding = FingerprintEmbedding::new(&series, &key, COEFFICIENTS).unwrap();
    let marks: Vec<_> = (0..COPIES).map(|k| embedding.fingerprint(&name(k))).collect();
    let wanted = embedding.wanted(&marks, &|_| ()).unwrap();
    let copy = |(mark, wanted): (_, Wanted)| {
        let coords = embedding.settle(mark, wanted).unwrap().coords;
        indices.iter().map(|&vertex| coords[vertex as usize]).collect()
    };
    let copies = marks.iter().zip(wanted).map(copy).collect();
    let part = embedding.parts().clone();
    Town { data, key, part, corners, copies }
});

fn rings(corners: Vec<[f64; 2]>) -> (MapData, Vec<u32>) {
    let starts: Vec<u32> = (0..corners.len() as u32).step_by(HOUSE.len()).collect();
    let kinds = vec![ChainKind::Shell; starts.len()];
    MapData::from_chains(corners, &starts, kinds).unwrap()
}

fn name(k: usize) -> String {
    format!("recipient {k}")
}

/// The signs of all candidates; the first ones have copies.
fn candidates() -> Vec<Sequence> {
    (0..CANDIDATES).map(|k| recipient_signs(&TOWN.key, &TOWN.part, &name(k))).collect()
}

/// Numbers between 0 and 1.
fn random(i: usize) -> f64 {
    let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / 2f64.powi(53)
}

/// Lets `f` see the suspect as matched with its reference.
fn with_suspect<T>(corners: Vec<[f64; 2]>, f: impl FnOnce(&Matched) -> T) -> T {
    let town = &TOWN;
    let (map, parameters) = (town.data.on(&Ground::METRES, &Ground::METRES), Parameters::of_fingerprint());
    let series = Series::of_one(map, &parameters);
    let reference = Reference::for_fingerprints(&town.data, &map, &series, COEFFICIENTS).unwrap();
    let (suspect, _) = rings(corners);
    let registration = Registrar::new(&town.data, &Ground::METRES, 1.0).register(&suspect, Start::None);
    f(&Matched::new(&reference, &suspect, &registration, RadiusChoice::FromData))
}

fn estimated(corners: Vec<[f64; 2]>) -> Estimated {
    with_suspect(corners, |matched| matched.estimate(&Parameters::of_fingerprint(), &|_| ()).unwrap())
}

fn standings(corners: Vec<[f64; 2]>) -> Vec<Standing> {
    let parameters = Parameters::of_fingerprint();
    let marks: Vec<_> = (0..CANDIDATES).map(|k| Fingerprint::new(&TOWN.key, &TOWN.part, &name(k))).collect();
    with_suspect(corners, |matched| {
        let seen = matched.estimate(&parameters, &|_| ()).unwrap();
        matched.name_recipients(&seen, &marks, &parameters, (marks.len(), SIGNIFICANCE)).unwrap()
    })
}

/// Every coordinate of the first `count` copies becomes what `choose` makes of them and of its
/// number.
fn mixture(count: usize, choose: impl Fn(usize, &mut [f64]) -> f64) -> Vec<[f64; 2]> {
    let copies = &TOWN.copies[..count];
    let corner = |i: usize| {
        // The last corner of a ring is the first one.
        let of_ring = i % HOUSE.len();
        let vertex = if of_ring == HOUSE.len() - 1 { i + 1 - HOUSE.len() } else { i };
        [0, 1].map(|axis| {
            let mut values: Vec<f64> = copies.iter().map(|copy| copy[vertex][axis]).collect();
            choose(2 * vertex + axis, &mut values)
        })
    };
    (0..copies[0].len()).map(corner).collect()
}

#[test]
fn a_clean_copy_names_its_recipient_beyond_any_doubt_and_nobody_else() {
    let standings = standings(TOWN.copies[0].clone());
    assert!(standings[0].p_value_log10 < -200.0 && standings[0].is_named, "{:?}", standings[0]);
    // A body of few corners shows fewer degrees of freedom than there are signs.
    let own = standings[0].agreement;
    assert!(own.agreeing as f64 > 0.8 * own.signs as f64, "{own:?}");
    assert!(standings[1..].iter().all(|other| !other.is_named));
}

#[test]
fn coalitions_name_all_their_members_and_no_innocent() {
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let sorted = |values: &mut [f64]| values.sort_by(f64::total_cmp);
    type Attack<'a> = &'a dyn Fn(usize, &mut [f64]) -> f64;
    let attacks: [(&str, Attack, usize); 7] = [
        ("average", &|_, values| sum(values) / values.len() as f64, COPIES),
        ("minimum", &|_, values| values.iter().copied().fold(f64::INFINITY, f64::min), COPIES),
        ("maximum", &|_, values| values.iter().copied().fold(f64::NEG_INFINITY, f64::max), COPIES),
        (
            "median",
            &|_, values| {
                sorted(values);
                (values[(values.len() - 1) / 2] + values[values.len() / 2]) / 2.0
            },
            COPIES,
        ),
        // Of eight copies it leaves six deviations to each on a town as small as this.
        (
            "farthest from the average",
            &|_, values| {
                let mean = sum(values) / values.len() as f64;
                let far = |a: &&f64, b: &&f64| (*a - mean).abs().total_cmp(&(*b - mean).abs());
                *values.iter().max_by(far).unwrap()
            },
            4,
        ),
        ("mosaic of vertices", &|i, values| values[(random(i / 2) * values.len() as f64) as usize], COPIES),
        (
            "mosaic of houses",
            &|i, values| values[(random(i / 2 / HOUSE.len() + 5000) * values.len() as f64) as usize],
            COPIES,
        ),
    ];
    for (attack, choose, most) in attacks {
        for members in [2, 4, 8].into_iter().filter(|members| *members <= most) {
            let standings = standings(mixture(members, choose));
            for (k, standing) in standings.iter().enumerate() {
                assert_eq!(standing.is_named, k < members, "{attack} of {members}: {k} {standing:?}");
            }
            let scores = standings[members..].iter().map(|standing| standing.agreement.score);
            assert!(is_standard_normal(scores.collect()), "{attack} of {members}");
        }
    }
}

/// The test of Kolmogorov and Smirnov at a significance of 0.001.
fn is_standard_normal(mut scores: Vec<f64>) -> bool {
    scores.sort_by(f64::total_cmp);
    let count = scores.len() as f64;
    let normal = |score: f64| statrs::function::erf::erfc(-score / 2f64.sqrt()) / 2.0;
    let distance = |(i, score): (usize, &f64)| {
        (normal(*score) - i as f64 / count).abs().max((normal(*score) - (i + 1) as f64 / count).abs())
    };
    let largest = scores.iter().enumerate().map(distance).fold(0.0, f64::max);
    largest * count.sqrt() < 1.95
}

#[test]
fn members_hidden_by_the_noise_of_others_are_named_after_those_are_taken_out() {
    // The second member gave one house in eleven.
    let mixed = mixture(2, |i, values| values[usize::from((i / 2 / HOUSE.len()).is_multiple_of(11))]);
    let evidence = Evidence::of_recipients(&estimated(mixed).estimates);
    let standings = name_recipients(&evidence, &candidates(), SIGNIFICANCE);
    let named: Vec<usize> = (0..CANDIDATES).filter(|&k| standings[k].is_named).collect();
    assert_eq!(named, [0, 1]);
    let second = standings[1];
    assert_eq!(second.round, 2, "{second:?}");
    assert!(second.agreement.score < needed_score(CANDIDATES, SIGNIFICANCE), "{second:?}");
    assert!(second.score > 1.2 * second.agreement.score, "{second:?}");
}

#[test]
fn a_mosaic_names_those_who_gave_little_once_the_vertices_of_others_are_known() {
    // The first copy gives three vertices of five, the other seven the rest.
    let mosaic = mixture(COPIES, |i, values| {
        let chosen = random(i / 2 + 9000);
        values[if chosen < 0.6 { 0 } else { 1 + ((chosen - 0.6) / 0.4 * 7.0) as usize }]
    });
    let evidence = Evidence::of_recipients(&estimated(mosaic.clone()).estimates);
    let alone = name_recipients(&evidence, &candidates(), SIGNIFICANCE);
    assert!(alone[..COPIES].iter().any(|standing| !standing.is_named), "{:?}", &alone[..COPIES]);
    for (k, standing) in standings(mosaic).iter().enumerate() {
        assert_eq!(standing.is_named, k < COPIES, "{k} {standing:?}");
    }
}

#[test]
fn patches_show_whose_part_of_a_mosaic_they_are() {
    // The west is the first copy's, the east the second one's.
    let corners = &TOWN.corners;
    let choose = |i: usize, values: &mut [f64]| values[usize::from(corners[i / 2][0] > 300.0)];
    let estimated = estimated(mixture(2, choose));
    let evidence = Evidence::of_recipients(&estimated.estimates);
    let [west, east] =
        [0, 1].map(|k| evidence.patch_agreements(&recipient_signs(&TOWN.key, &TOWN.part, &name(k))));
    let mut owners: Vec<bool> = west.iter().zip(&east).map(|(w, e)| w.score > e.score).collect();
    assert!(west.iter().zip(&east).all(|(w, e)| w.score.max(e.score) > 12.0), "{west:?} {east:?}");
    owners.sort();
    owners.dedup();
    assert_eq!(owners, [false, true]);
}

#[test]
fn the_key_shows_in_an_average_and_no_other_key_does() {
    let average = mixture(COPIES, |_, values| values.iter().sum::<f64>() / values.len() as f64);
    let seen = estimated(average);
    let of = |byte: u8| seen.key_agreement(&pilots(&SecretKey::from_bytes([byte; 32]), &TOWN.part)).score;
    assert!(shows_key(of(7)));
    assert!((8..108).all(|other| of(other) < 5.0 && !shows_key(of(other))));
}

#[test]
fn the_power_is_that_of_a_trial_mark_unless_the_key_shows_or_nothing_moved() {
    let (town, parameters) = (&TOWN, Parameters::of_fingerprint());
    let pilots = pilots(&town.key, &town.part);
    let power = |corners: Vec<[f64; 2]>| {
        with_suspect(corners, |matched| {
            let seen = matched.estimate(&parameters, &|_| ()).unwrap();
            Power::of_fingerprint(matched, &seen, &pilots, &parameters, &|_| ()).unwrap()
        })
    };
    assert_eq!(power(town.corners.clone()), Power::Unmoved);
    assert_eq!(power(town.copies[0].clone()), Power::KeyShows);
    let noisy = |deviation_m: f64| -> Vec<[f64; 2]> {
        let moved = |(i, [x, y]): (usize, &[f64; 2])| {
            let vertex = if i % HOUSE.len() == HOUSE.len() - 1 { i + 1 - HOUSE.len() } else { i };
            let [dx, dy] = [0, 1].map(|axis| 3.4 * deviation_m * (random(2 * vertex + axis) - 0.5));
            [x + dx, y + dy]
        };
        town.corners.iter().enumerate().map(moved).collect()
    };
    let [Power::Trial(quiet), Power::Trial(loud)] = [0.05, 0.4].map(|m| power(noisy(m))) else {
        panic!("no mark is there")
    };
    assert!(quiet > 25.0 && loud < 0.6 * quiet, "{quiet} {loud}");
}

#[test]
fn p_values_of_many_candidates_are_larger_and_never_above_one() {
    assert!((needed_score(1, 1e-6) - 4.983).abs() < 1e-3, "{}", needed_score(1, 1e-6));
    assert!(needed_score(CANDIDATES, 1e-6) > needed_score(1, 1e-6) + 1.0);
    assert_eq!(p_log10(-1.0), 0.0);
    assert!(p_log10(30.0) < -190.0);
    let nothing = standings(TOWN.corners.clone());
    assert!(nothing.iter().all(|standing| standing.p_value_log10 == 0.0 && !standing.is_named));
}
