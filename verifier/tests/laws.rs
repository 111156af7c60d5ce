//! What a verdict rests on: the message survives any affine map, and nobody else is accused.

use meshmark_core::{
    carrier::Carrier,
    deformation::Deformation,
    demodulation::{self, Demodulation},
    embedding::embed,
    ground::Ground,
    key::SecretKey,
    map_data::{Dimension, Label, MapData},
    message::Message,
    options::Parameters,
    patches::Patches,
    vertices::VertexTable,
};
use meshmark_dataset::{Selection, survey};
use meshmark_detection::{
    decision::{Decision, Expected, Null, Verdict, decide_among},
    matching::Matcher,
    power::Power,
    registration::{Affine, Registrar, Start},
};
use proptest::prelude::*;

fn random(carried: Message) -> Expected {
    Expected { carried, null: Null::RandomMessage }
}

/// A marked map with labels on every twentieth vertex.
struct Case {
    reference: MapData,
    ground: Ground,
    key: SecretKey,
    marked: Vec<[f64; 2]>,
}

impl Case {
    /// fixtures/kotka.gpkg, marked for ACME GmbH.
    fn kotka() -> Self {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/kotka.gpkg");
        let map = survey(&gdal::Dataset::open(path).unwrap(), &Selection::default()).unwrap();
        let (parameters, key) = (Parameters::default(), SecretKey::from_bytes([7; 32]));
        let on_ground = map.map(&parameters).unwrap();
        let message = key.recipient_message("ACME GmbH");
        let marked = embed(&on_ground, &key, &message, &parameters).unwrap();
        let ground = on_ground.ground.clone();
        Case { reference: map.data, ground, key, marked: marked.coords }
    }

    fn labels(&self, coords: &[[f64; 2]]) -> Vec<Label> {
        let label = |(i, p): (usize, &[f64; 2])| Label {
            value: format!("building {i}"),
            point: *p,
            dimension: Dimension::Area,
        };
        coords.iter().enumerate().step_by(20).map(label).collect()
    }

    /// Registers, matches and demodulates a suspect whose vertices are `moved`, in canonical order
    /// of the reference, under a key.
    fn demodulate(&self, moved: &[[f64; 2]], key: &SecretKey) -> Demodulation {
        let vertices = &self.reference.vertices;
        let labelled = |vertices: VertexTable, labels| MapData { labels, ..MapData::of_points(vertices) };
        let reference = labelled(vertices.clone(), self.labels(vertices.coords()));
        let suspect = labelled(VertexTable::new(moved.to_vec()).unwrap(), self.labels(moved));
        let found = Registrar::new(&reference, &self.ground, 1.0).register(&suspect, Start::Auto);
        let coords = found.apply(suspect.vertices.coords());
        let matches = Matcher::new(vertices.coords(), &self.ground, vertices.centre()).all(&coords, 1.0);
        let pairs = vertices.coords().iter().zip(&matches.suspect_of);
        let metres =
            |(r, s): (&[f64; 2], &Option<u32>)| s.map(|s| self.ground.metres_between(*r, coords[s as usize]));
        let observed: Vec<_> = pairs.map(metres).collect();
        let parameters = Parameters::default();
        let patches = Patches::new(&self.reference.on(&self.ground, &self.ground), &parameters).unwrap();
        let disturbance = Deformation::estimate(&patches, &observed, 256, &parameters).unwrap().predict(
            &patches,
            &observed,
            256,
            parameters.amplitude_m,
        );
        let carrier = Carrier::new(key);
        demodulation::joint(&patches, &carrier, &observed, 128, &parameters, &disturbance, &|_| ()).unwrap()
    }

    fn decide(&self, found: &Demodulation, message: &Message) -> Decision {
        decide_among(found, SHOWS, &random(message.clone()), 1, 1e-6)
    }
}

/// The mark of these cases shows with a large score.
const SHOWS: Power = Power::Trial(60.0);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn the_message_comes_back_under_any_affine_map(
        turn in 0.0..std::f64::consts::TAU,
        scales in (0.2..5.0f64, 0.2..5.0f64),
        shear in -0.5..0.5f64,
        mirrored: bool,
        shift in (-1e6..1e6f64, -1e6..1e6f64),
    ) {
        let case = Case::kotka();
        let (sin, cos) = turn.sin_cos();
        let flip = if mirrored { -1.0 } else { 1.0 };
        let affine = Affine { coefficients: [
            flip * scales.0 * cos, -scales.1 * sin + shear * cos, shift.0,
            flip * scales.0 * sin, scales.1 * cos + shear * sin, shift.1,
        ]};
        let moved: Vec<[f64; 2]> = case.marked.iter().map(|p| affine.apply(*p)).collect();
        let message = case.key.recipient_message("ACME GmbH");
        let found = case.demodulate(&moved, &case.key);
        prop_assert_eq!(found.message(), message.clone());
        prop_assert_eq!(case.decide(&found, &message).verdict, Verdict::Match);
    }
}

#[test]
fn of_a_thousand_other_recipients_of_the_same_key_none_is_accused_and_nearly_all_are_cleared() {
    let case = Case::kotka();
    let found = case.demodulate(&case.marked, &case.key);
    assert_eq!(case.decide(&found, &case.key.recipient_message("ACME GmbH")).verdict, Verdict::Match);
    let others = (0..1000).map(|i| case.key.recipient_message(&format!("recipient {i}")));
    let decisions: Vec<Decision> = others.map(|message| case.decide(&found, &message)).collect();
    let cleared = |decision: &&Decision| match decision.verdict {
        Verdict::Match => panic!("{decision:?}"),
        Verdict::NoMatch => true,
        Verdict::Inconclusive => {
            assert!(decision.p_value_log10().unwrap() < -2.0, "{decision:?}");
            false
        }
    };
    // A p-value below 0.01 clears nobody: 10 ± 3 of a thousand.
    assert!(decisions.iter().filter(cleared).count() > 970);
}

#[test]
fn the_mean_of_two_copies_names_both_recipients_and_nobody_else() {
    let case = Case::kotka();
    let message = |name: &str| case.key.recipient_message(name);
    let parameters = Parameters::default();
    let other = embed(
        &case.reference.on(&case.ground, &case.ground),
        &case.key,
        &message("Another Ltd"),
        &parameters,
    )
    .unwrap();
    let pairs = case.marked.iter().zip(&other.coords);
    let mean: Vec<[f64; 2]> = pairs.map(|(a, b)| [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]).collect();
    let found = case.demodulate(&mean, &case.key);
    let matches = |name: &str| {
        decide_among(&found, SHOWS, &random(message(name)), 1000, 1e-6).verdict == Verdict::Match
    };
    assert!(matches("ACME GmbH") && matches("Another Ltd"));
    assert!(!(0..998).any(|i| matches(&format!("recipient {i}"))));
}

#[test]
fn of_forty_other_keys_none_matches_and_their_p_values_are_spread_evenly() {
    let case = Case::kotka();
    let patches =
        Patches::new(&case.reference.on(&case.ground, &case.ground), &Parameters::default()).unwrap();
    let pairs = case.reference.vertices.coords().iter().zip(&case.marked);
    let observed: Vec<_> = pairs.map(|(r, s)| Some(case.ground.metres_between(*r, *s))).collect();
    let p_mark = |seed: u8| {
        let key = SecretKey::from_bytes([seed; 32]);
        let found = demodulation::paper(
            &patches,
            &Carrier::new(&key),
            &observed,
            128,
            &Parameters::default(),
            &|_| (),
        )
        .unwrap();
        let decision = case.decide(&found, &key.recipient_message("ACME GmbH"));
        assert_ne!(decision.verdict, Verdict::Match);
        10f64.powf(decision.p_mark_log10.unwrap())
    };
    let mut p: Vec<f64> = (100..140).map(p_mark).collect();
    p.sort_by(f64::total_cmp);
    // Kolmogorov-Smirnov distance to the uniform distribution; 0.301 is exceeded once in a
    // thousand.
    let step = |(i, p): (usize, &f64)| (p - i as f64 / 40.0).abs().max((p - (i + 1) as f64 / 40.0).abs());
    let distance = p.iter().enumerate().map(step).fold(0.0, f64::max);
    assert!(distance < 0.301, "{distance}");
}

#[test]
fn an_unmarked_map_is_no_match() {
    let case = Case::kotka();
    let found = case.demodulate(case.reference.vertices.coords(), &case.key);
    let decision = case.decide(&found, &case.key.recipient_message("ACME GmbH"));
    assert_eq!(decision.verdict, Verdict::NoMatch);
}
