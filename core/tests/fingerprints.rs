//! What a fingerprint shows, and that nobody can make one without the key.

use meshmark_core::{
    Error,
    agreement::{Agreement, Evidence},
    carrier::Carrier,
    deformation::Prediction,
    embedding::{self, Marked},
    estimation::Estimates,
    fingerprint::{self, Fingerprint, PilotsAlone, check_score, pilots, recipient_signs},
    fingerprint_embedding::{self, FingerprintEmbedding},
    ground::Ground,
    key::SecretKey,
    map::Map,
    map_data::{ChainKind, MapData},
    message::Message,
    modulation::{SpreadMessage, displacements_m},
    mosaic::{View, wealth_log10},
    options::{Parameters, Rigidity},
    part::Parts,
    patches::Patches,
    series::Series,
    signs::Signs,
};

const COEFFICIENTS: usize = fingerprint::COEFFICIENTS;

fn key() -> SecretKey {
    SecretKey::from_bytes([42; 32])
}

/// 400 houses of five corners, unevenly placed.
fn town() -> MapData {
    const HOUSE: [[f64; 2]; 6] = [[0.0, 0.0], [9.0, 0.0], [9.0, 7.0], [4.0, 7.0], [0.0, 6.0], [0.0, 0.0]];
    let house = |i: usize| [(i % 20 * 20 + i % 7) as f64, (i / 20 * 20 + i % 3) as f64];
    let coords = (0..400).flat_map(|i| HOUSE.map(|[x, y]| [x + house(i)[0], y + house(i)[1]]));
    let starts: Vec<u32> = (0..2400).step_by(6).collect();
    MapData::from_chains(coords.collect(), &starts, vec![ChainKind::Shell; 400]).unwrap().0
}

/// Displacements of the vertices of a copy, metres.
fn displaced(town: &MapData, coords: &[[f64; 2]]) -> Vec<Option<[f64; 2]>> {
    let pairs = town.vertices.coords().iter().zip(coords);
    pairs.map(|(from, to)| Some([to[0] - from[0], to[1] - from[1]])).collect()
}

/// Marks a map of one part for a recipient.
fn embed(
    map: &Map,
    key: &SecretKey,
    recipient: &str,
    coefficients: usize,
    parameters: &Parameters,
) -> Result<Marked, Error> {
    let series = Series::of_one(*map, parameters);
    fingerprint_embedding::embed(&series, key, recipient, coefficients).map(|(marked, _)| marked)
}

fn estimates(map: &Map, observed: &[Option<[f64; 2]>], parameters: &Parameters) -> Estimates {
    let patches = Patches::new(map, parameters).unwrap();
    let noise = Prediction::of_noise(0.01, observed.len());
    Estimates::new(&patches, observed, COEFFICIENTS, parameters, &noise, &|_| ()).unwrap()
}

fn agreement(town: &MapData, seen: &Estimates, recipient: &str) -> Agreement {
    let signs = recipient_signs(&key(), &Parts::whole(&town.vertices), recipient);
    Evidence::of_recipients(seen).agreement(&signs)
}

#[test]
fn a_copy_names_its_recipient_and_nobody_else_whole_or_damaged_in_every_shape() {
    let town = town();
    let map = town.on(&Ground::METRES, &Ground::METRES);
    for shape in [Rigidity::Free, Rigidity::Rigid, Rigidity::Stiff] {
        let parameters = Parameters { shape, ..Parameters::of_fingerprint() };
        let copy = embed(&map, &key(), "ACME", COEFFICIENTS, &parameters).unwrap();
        let mut observed = displaced(&town, &copy.coords);
        let whole = estimates(&map, &observed, &parameters);
        let own = agreement(&town, &whole, "ACME");
        assert_eq!(own.signs, 4 * 2 * COEFFICIENTS * 7 / 8, "{shape:?}");
        // A free map shows every sign; a body of five corners has three degrees of freedom for ten.
        let (least_score, least_share) = if shape == Rigidity::Free { (42.0, 0.99) } else { (28.0, 0.75) };
        assert!(own.score > least_score, "{shape:?} {own:?}");
        assert!(own.agreeing as f64 > least_share * own.signs as f64, "{shape:?} {own:?}");
        let part = Parts::whole(&town.vertices);
        assert!(Evidence::of_pilots(&whole).agreement(&pilots(&key(), &part)).score > 10.0);
        observed.iter_mut().enumerate().filter(|(i, _)| i % 3 > 0).for_each(|(_, o)| *o = None);
        let third = estimates(&map, &observed, &parameters);
        assert!(agreement(&town, &third, "ACME").score > 20.0, "{shape:?}");
        for seen in [&whole, &third] {
            for other in 0..40 {
                let other = agreement(&town, seen, &format!("ACME {other}"));
                assert!(other.score.abs() < 5.0, "{shape:?} {other:?}");
            }
            let wrong = pilots(&SecretKey::from_bytes([43; 32]), &part);
            assert!(Evidence::of_pilots(seen).agreement(&wrong).score.abs() < 5.0);
        }
    }
}

#[test]
fn recipients_marked_together_get_the_copies_of_recipients_marked_alone() {
    let town = town();
    let (map, key, parameters) =
        (town.on(&Ground::METRES, &Ground::METRES), key(), Parameters::of_fingerprint());
    let series = Series::of_one(map, &parameters);
    let embedding = FingerprintEmbedding::new(&series, &key, COEFFICIENTS).unwrap();
    let embedding = embedding.for_many().unwrap();
    let names = ["ACME", "Öster AB"];
    let all = names.map(|name| embedding.fingerprint(name));
    let wanted = embedding.wanted(&all, &|_| ()).unwrap();
    for ((name, fingerprint), wanted) in names.iter().zip(&all).zip(wanted) {
        let together = embedding.settle(fingerprint, wanted).unwrap();
        assert_eq!(together, embed(&map, &key, name, COEFFICIENTS, &parameters).unwrap());
    }
}

#[test]
fn the_displacement_is_that_of_a_message() {
    let town = town();
    let (map, parameters) = (town.on(&Ground::METRES, &Ground::METRES), Parameters::of_fingerprint());
    let of_recipient = embed(&map, &key(), "ACME", COEFFICIENTS, &parameters).unwrap().displacement;
    let message = Message::from_bytes(&[0x5a; 16]);
    let of_message = embedding::embed(&map, &key(), &message, &Parameters::default()).unwrap().displacement;
    assert!((of_recipient.rms_m / of_message.rms_m - 1.0).abs() < 0.05);
}

#[test]
fn a_map_without_room_and_a_mark_without_effect_are_refused() {
    let town = town();
    let map = town.on(&Ground::METRES, &Ground::METRES);
    let small = Parameters { patch_size: 250, ..Parameters::of_fingerprint() };
    let refused = embed(&map, &key(), "ACME", COEFFICIENTS, &small).unwrap_err();
    assert!(matches!(refused, Error::TooManySigns { coefficients: COEFFICIENTS, vertices: 250, .. }));
    assert!(refused.to_string().ends_with("use a larger PATCH_SIZE"), "{refused}");
    let coarse =
        Parameters { precision_crs_units: Some(0.7), amplitude_m: 0.01, ..Parameters::of_fingerprint() };
    let lost = embed(&map, &key(), "ACME", COEFFICIENTS, &coarse).unwrap_err();
    assert!(matches!(lost, Error::FingerprintLost { .. }), "{lost}");
    assert!(check_score(7.9).is_err() && check_score(8.1).is_ok());
}

/// Signs that somebody made up.
struct Forged<F>(F);

impl<F: Fn(usize, usize, usize) -> Vec<f64> + Sync> Signs for Forged<F> {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        self.0(patch, axis, count)
    }
}

/// The signs that a copy shows to whoever has the unmarked map, too.
fn signs_of_copy(map: &Map, town: &MapData, coords: &[[f64; 2]], parameters: &Parameters) -> Vec<f64> {
    let seen = estimates(map, &displaced(town, coords), parameters);
    seen.values.iter().map(|value| value.signum()).collect()
}

fn of_axis(all: &[f64], patch: usize, axis: usize, count: usize) -> Vec<f64> {
    all[(2 * patch + axis) * count..][..count].to_vec()
}

#[test]
fn exact_copies_of_others_forge_a_message_but_no_fingerprint() {
    let town = town();
    // A free map shows every sign.
    let parameters = Parameters { shape: Rigidity::Free, ..Parameters::of_fingerprint() };
    let map = town.on(&Ground::METRES, &Ground::METRES);
    let patches = Patches::new(&map, &parameters).unwrap();
    // Messages: the copy of A and its message give the chips, and the chips any other message.
    let [a, b] = ["A", "B"].map(|name| key().recipient_message(name));
    let copy_of_a = embedding::embed(&map, &key(), &a, &parameters).unwrap();
    let shown = signs_of_copy(&map, &town, &copy_of_a.coords, &parameters);
    let code = parameters.code;
    let turned: Vec<f64> = code.encode(&a).iter().zip(code.encode(&b)).map(|(a, b)| a * b).collect();
    let turn = |patch, axis, count| -> Vec<f64> {
        of_axis(&shown, patch, axis, count).iter().zip(&turned).map(|(sign, turn)| sign * turn).collect()
    };
    let score_of_b = |forged: &dyn Signs| {
        let mut moved = displacements_m(&patches, &[forged], COEFFICIENTS, &parameters).unwrap();
        let observed: Vec<_> = moved.remove(0).into_iter().map(Some).collect();
        let seen = estimates(&map, &observed, &parameters);
        let carrier = Carrier::new(&key());
        let real = SpreadMessage::new(&carrier, &b, &parameters);
        let axes = (0..patches.as_slice().len()).flat_map(|patch| [(patch, 0), (patch, 1)]);
        let real: Vec<f64> = axes.flat_map(|(patch, axis)| real.signs(patch, axis, COEFFICIENTS)).collect();
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let message = dot(&real, &seen.values) / dot(&seen.values, &seen.values).sqrt();
        (message, agreement(&town, &seen, "B").score)
    };
    let (message, fingerprint) = score_of_b(&Forged(turn));
    assert!(message > 40.0, "the attack succeeds against messages: {message}");
    assert!(fingerprint.abs() < 5.0, "{fingerprint}");

    // Fingerprints: the copies of others, turned by whatever their names give without the key,
    // mixed, or as they are.
    let copies = ["A", "C", "D"].map(|name| {
        let copy = embed(&map, &key(), name, COEFFICIENTS, &parameters).unwrap();
        signs_of_copy(&map, &town, &copy.coords, &parameters)
    });
    let public =
        |name: &str| recipient_signs(&SecretKey::from_bytes([0; 32]), &Parts::whole(&town.vertices), name);
    let product = |x: Vec<f64>, y: Vec<f64>| x.iter().zip(&y).map(|(x, y)| x * y).collect::<Vec<_>>();
    let as_it_is = |patch, axis, count| of_axis(&copies[0], patch, axis, count);
    let renamed = |patch, axis, count| {
        let names = product(public("A").signs(patch, axis, count), public("B").signs(patch, axis, count));
        product(of_axis(&copies[0], patch, axis, count), names)
    };
    let coded = |patch, axis, count| product(of_axis(&copies[0], patch, axis, count), turned.clone());
    let mixed = |patch, axis, count| {
        let [a, c, d] = copies.each_ref().map(|copy| of_axis(copy, patch, axis, count));
        product(product(a, c), d)
    };
    let majority = |patch, axis, count| {
        let [a, c, d] = copies.each_ref().map(|copy| of_axis(copy, patch, axis, count));
        (0..count).map(|i| (a[i] + c[i] + d[i]).signum()).collect()
    };
    let attempts: [&dyn Signs; 5] =
        [&Forged(as_it_is), &Forged(renamed), &Forged(coded), &Forged(mixed), &Forged(majority)];
    for (number, attempt) in attempts.into_iter().enumerate() {
        let (_, fingerprint) = score_of_b(attempt);
        assert!(fingerprint.abs() < 5.0, "attempt {number}: {fingerprint}");
    }
}

/// Returns log₁₀ of the wealth of bets on members, who have a copy each, and on as many others, for
/// mixtures of the copies of members.
fn bets(members: usize, others: usize) -> Vec<(&'static str, Vec<f64>, Vec<f64>)> {
    let town = town();
    let map = town.on(&Ground::METRES, &Ground::METRES);
    let (key, part, parameters) = (key(), Parts::whole(&town.vertices), Parameters::of_fingerprint());
    let copy =
        |n: usize| embed(&map, &key, &format!("member {n}"), COEFFICIENTS, &parameters).unwrap().coords;
    let copies: Vec<Vec<[f64; 2]>> = (0..members).map(copy).collect();
    let names = (0..members).map(|n| format!("member {n}")).chain((0..others).map(|n| format!("other {n}")));
    let names: Vec<String> = names.collect();
    let signs: Vec<_> = names.iter().map(|name| recipient_signs(&key, &part, name)).collect();
    let marks: Vec<_> = names.iter().map(|name| Fingerprint::new(&key, &part, name)).collect();
    let patches = Patches::new(&map, &parameters).unwrap();
    let copies_m = displacements_m(&patches, &marks, COEFFICIENTS, &parameters).unwrap();
    let pilots_m = displacements_m(&patches, &[PilotsAlone(pilots(&key, &part))], COEFFICIENTS, &parameters);
    let pilots_m = pilots_m.unwrap().remove(0);
    let owner = |n: usize| n * 7919 % 101 % members;
    let least = |v: usize| [0, 1].map(|a| copies.iter().map(|copy| copy[v][a]).fold(f64::MAX, f64::min));
    let vertices = 0..town.vertices.coords().len();
    let mixtures: [(&str, Vec<[f64; 2]>); 3] = [
        ("the least values", vertices.clone().map(least).collect()),
        ("a mosaic of vertices", vertices.clone().map(|v| copies[owner(v)][v]).collect()),
        ("a mosaic of pieces", vertices.map(|v| copies[owner(v / 20)][v]).collect()),
    ];
    let bet = |(name, suspect): (&'static str, Vec<[f64; 2]>)| {
        let observed = displaced(&town, &suspect);
        let views = [View::new(&observed, &copies_m, &pilots_m)];
        let how = (COEFFICIENTS, &parameters);
        let wealth = wealth_log10(&patches, &views, how, &pilots(&key, &part), (&signs, &copies_m)).unwrap();
        (name, wealth[..members].to_vec(), wealth[members..].to_vec())
    };
    mixtures.into_iter().map(bet).collect()
}

#[test]
fn every_member_of_a_mosaic_wins_and_the_others_win_no_more_often_than_they_may() {
    for (mixture, members, others) in bets(8, 150) {
        assert!(members.iter().all(|wealth| *wealth > 60.0), "{mixture}: {members:?}");
        // A wealth of w comes with a probability of at most 1 / w; the bounds have p < 10⁻⁶.
        let above = |wealth: f64| others.iter().filter(|other| **other >= wealth).count();
        assert!(above(0.5) <= 80 && above(1.0) <= 40 && above(4.0) == 0, "{mixture}: {others:?}");
        let mean = others.iter().map(|wealth| 10f64.powf(*wealth)).sum::<f64>() / others.len() as f64;
        assert!(mean < 10.0, "{mixture}: {mean}");
    }
}

#[test]
fn an_average_of_many_copies_shows_its_members_once_the_pilots_are_taken_out() {
    const MEMBERS: usize = 24;
    let town = town();
    let map = town.on(&Ground::METRES, &Ground::METRES);
    let (key, part, parameters) = (key(), Parts::whole(&town.vertices), Parameters::of_fingerprint());
    let name = |n: usize| format!("member {n}");
    let copies: Vec<Vec<[f64; 2]>> = (0..MEMBERS)
        .map(|n| embed(&map, &key, &name(n), COEFFICIENTS, &parameters).unwrap().coords)
        .collect();
    let mean = |v: usize| [0, 1].map(|a| copies.iter().map(|copy| copy[v][a]).sum::<f64>() / MEMBERS as f64);
    let average: Vec<[f64; 2]> = (0..town.vertices.coords().len()).map(mean).collect();
    let observed = displaced(&town, &average);
    let patches = Patches::new(&map, &parameters).unwrap();
    let pilots = PilotsAlone(pilots(&key, &part));
    let of_pilots = displacements_m(&patches, &[pilots], COEFFICIENTS, &parameters).unwrap().remove(0);
    let without = |(o, p): (&Option<[f64; 2]>, [f64; 2])| o.map(|o| [o[0] - p[0], o[1] - p[1]]);
    let rest: Vec<_> = observed.iter().zip(of_pilots).map(without).collect();
    let score = |seen: &[Option<[f64; 2]>], recipient: &str| {
        let noise = Prediction::of_noise(0.001, seen.len());
        let estimates = Estimates::new(&patches, seen, COEFFICIENTS, &parameters, &noise, &|_| ()).unwrap();
        agreement(&town, &estimates, recipient).score
    };
    let sum = |seen: &[Option<[f64; 2]>]| (0..MEMBERS).map(|n| score(seen, &name(n))).sum::<f64>();
    let (with, without) = (sum(&observed), sum(&rest));
    assert!(without > 1.3 * with && without > 5.0 * MEMBERS as f64, "{with} {without}");
    assert!((0..10).all(|n| score(&rest, &format!("other {n}")).abs() < 5.0));
}
