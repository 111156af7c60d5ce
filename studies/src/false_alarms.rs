//! Counts how often the verifier would accuse the innocent: p-values of wrong keys and of wrong
//! recipients, which must be uniform. A suspect is examined once as in `meshmark verify`; the steps
//! that depend on key and recipient are then repeated for many of them.

use crate::plot::{Axis, Plot, Series};
use meshmark_core::{
    carrier::{Carrier, bit_of_coefficient},
    demodulation::Demodulation,
    key::SecretKey,
    message::Message,
    options::Parameters,
};
use meshmark_detection::{
    Demodulator,
    decision::{Decision, Expected, Null, decide_among},
    matching::RadiusChoice,
    power::Power,
    registration::Start,
};
use meshmark_host_tests::{
    Result,
    attacks::{Attack, Map, OtherMaps, Random, extended_rows, noise, paper_rows},
    product::{Marking, Product, Profile, random_key},
};
use meshmark_verification::{
    Maps, Stages,
    verify::{self, Found, Request, Settings, Sought},
};
use meshmark_verifier::inputs::{map_files::MapFiles, private_copy::PrivateCopy};
use plotters::style::{BLACK, BLUE, RED};
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// The grid of the maps, as in the paper's experiments.
const PRECISION_M: f64 = 0.1;

/// A suspect and its p-values.
#[derive(Debug, Serialize)]
pub struct Sample {
    pub map: String,
    pub suspect: &'static str,
    /// log₁₀ of p_mark under wrong keys.
    pub wrong_keys: Vec<f64>,
    /// log₁₀ of p_recipient of wrong recipients under the right key.
    pub wrong_recipients: Vec<f64>,
}

/// The kinds of suspects: the name, whether it is marked, and the row of Table 2 by which it is
/// attacked.
const SUSPECTS: [(&str, bool, Option<&str>); 11] = [
    ("marked", true, None),
    ("marked, noise ±50 cm", true, Some("9c")),
    ("marked, middle 1/16", true, Some("10-8")),
    ("marked, local deformation", true, Some("6")),
    ("marked, Gaussian noise of 0.7 m", true, Some("gauss0.7")),
    ("marked, every building shifted by N(0, 1 m)", true, Some("shifted1")),
    ("marked, resampled every 2 m", true, Some("resampled2")),
    ("unmarked, noise ±10 cm", false, Some("9a")),
    ("unmarked, local deformation", false, Some("6")),
    ("marked, centroids of the polygons alone", true, Some("centroids")),
    ("marked, bounding boxes of the polygons alone", true, Some("boxes")),
];

/// Tests `count` wrong keys and as many wrong recipients on every suspect made of one map. The
/// right key and, after it, the wrong ones follow from `seed`. No two suspects share wrong keys, as
/// p-values of one key on two copies of a map are not independent.
///
/// # Errors
/// Fails on a map that cannot be read, marked or registered.
pub fn study(product: &Product, map: &Path, count: usize, seed: u64) -> Result<Vec<Sample>> {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let (key, reference, marked) = (path("key.json"), path("reference.gpkg"), path("marked.gpkg"));
    let mut random = Random::new(seed);
    let right = random_key(&mut random);
    std::fs::write(&key, right.to_json().as_bytes())?;
    let original = noise::snap(&Map::read(map)?, PRECISION_M);
    original.write(&reference)?;
    let (recipient, profile) = ("the recipient", Profile::LDPC); // what `examine` takes, by default
    let marking = Marking { key: &key, recipient, profile, precision: PRECISION_M };
    product.mark(&reference, &marked, &path("record.json"), marking)?;
    let marked = Map::read(&marked)?;
    let name = map.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let sample = |(number, (suspect, is_marked, row)): (usize, (&'static str, bool, Option<&str>))| {
        let file = path("suspect.gpkg");
        let attacked = attack(row).apply(if is_marked { &marked } else { &original }, seed)?;
        attacked.write(&file)?;
        let parameters = Parameters { precision_crs_units: Some(PRECISION_M), ..Parameters::default() };
        let sought = Sought::Message { bits: 128 };
        let Found::Message(found) = examine(&right, [&reference, &file], sought, parameters)?? else {
            unreachable!("a message is sought")
        };
        let found = found.demodulation;
        std::fs::remove_file(&file)?;
        let innocent = |i: usize| wrong_recipient(&found, &right, number * count + i);
        Ok(Sample {
            map: name.clone(),
            suspect,
            wrong_keys: (0..count).map(|_| wrong_key(&found, &random_key(&mut random))).collect(),
            wrong_recipients: (0..count).map(innocent).collect(),
        })
    };
    SUSPECTS.into_iter().enumerate().map(sample).collect()
}

fn attack(row: Option<&str>) -> Attack {
    let nothing = Arc::new(Map { layers: Vec::new() });
    let others = OtherMaps { foreign: nothing.clone(), unmarked: nothing };
    let found = paper_rows().into_iter().chain(extended_rows(&others)).find(|r| Some(r.id.as_str()) == row);
    found.map_or(Attack::Sequence(Vec::new()), |row| row.attack)
}

/// Examines a suspect as `meshmark verify` does. Returns the reason where there is no evidence.
pub(crate) fn examine(
    key: &SecretKey,
    [reference, suspect]: [&Path; 2],
    sought: Sought,
    parameters: Parameters,
) -> Result<std::result::Result<Found, String>> {
    let settings = Settings {
        key: key.clone(),
        registration: Start::Auto,
        demodulator: Demodulator::Joint,
        radius: RadiusChoice::FromData,
        significance: 1e-6,
        sketch: false,
        evidence_map: false,
        exact_displacements: false,
    };
    let request = Request {
        settings,
        record: None,
        subject: None,
        sought,
        lineage: Default::default(),
        part_size: 0,
        tried: 1,
        parameters,
        layers: None,
        srs: None,
        recorded_crs: None,
    };
    let suspect = PrivateCopy::make("suspect", suspect)?;
    let mut maps = MapFiles { references: vec![reference.into()], suspect, landmarks: Vec::new() };
    let mut stages = Stages::new(&|_| ());
    let map = verify::read_reference(&mut maps, 0, &request, &mut stages)?.or_fail()?;
    let map = (&map, maps.name(0), &Default::default());
    Ok(verify::examine(&mut maps, &request, map, &mut stages)?.or_fail()?.found)
}

fn decide(found: &Demodulation, carried: Message) -> Decision {
    decide_among(found, Power::KeyShows, &Expected { carried, null: Null::RandomMessage }, 1, 1e-6)
}

/// Returns log₁₀ of p_mark of another key and its message for the recipient.
fn wrong_key(found: &Demodulation, key: &SecretKey) -> f64 {
    let (carrier, chip_rate) = (Carrier::new(key), Parameters::default().chip_rate);
    let carriers = found.scores.len() * chip_rate;
    let mut scores = vec![0.0; found.scores.len()];
    for (number, correlations) in found.chip_correlations.chunks(carriers).enumerate() {
        let chips = carrier.chips(number / 2, number % 2, carriers);
        for (i, (chip, correlation)) in chips.iter().zip(correlations).enumerate() {
            scores[bit_of_coefficient(i + 1, chip_rate)] += chip * correlation;
        }
    }
    let under_key = Demodulation { scores, ..found.clone() };
    decide(&under_key, key.recipient_message("the recipient")).p_mark_log10.expect("a message was expected")
}

fn wrong_recipient(found: &Demodulation, key: &SecretKey, number: usize) -> f64 {
    let message = key.recipient_message(&format!("innocent {number}"));
    decide(found, message).p_recipient_log10.expect("a message was expected")
}

/// The deviation of values from the uniform distribution on [0, 1].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Uniformity {
    pub count: usize,
    /// The Kolmogorov–Smirnov distance.
    pub distance: f64,
    /// The probability of that distance or more if they were uniform.
    pub p_value: f64,
    /// The smallest value.
    pub least: f64,
}

impl Uniformity {
    /// Performs the Kolmogorov–Smirnov test with the small-sample factor of Stephens 1970.
    pub fn measure(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let n = values.len() as f64;
        let gap = |(i, v): (usize, &f64)| ((i + 1) as f64 / n - v).max(v - i as f64 / n);
        let distance = values.iter().enumerate().map(gap).fold(0.0, f64::max);
        let lambda = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance;
        let term = |k: i32| (-1f64).powi(k - 1) * (-2.0 * f64::from(k * k) * lambda * lambda).exp();
        let p_value = (2.0 * (1..100).map(term).sum::<f64>()).clamp(0.0, 1.0);
        Uniformity { count: values.len(), distance, p_value, least: values[0] }
    }
}

/// Returns the p-values of some samples, wrong keys first.
pub fn pooled<'a>(samples: impl Iterator<Item = &'a Sample>) -> [Vec<f64>; 2] {
    let mut pools = [Vec::new(), Vec::new()];
    for sample in samples {
        pools[0].extend(sample.wrong_keys.iter().map(|p| 10f64.powf(*p)));
        pools[1].extend(sample.wrong_recipients.iter().map(|p| 10f64.powf(*p)));
    }
    pools
}

/// Plots observed against expected p-values, −log₁₀: a straight line when they are uniform.
///
/// # Errors
/// Fails like [`Plot::to_svg`].
pub fn quantile_plot(pools: &[Vec<f64>; 2]) -> Result<String> {
    let series = |name: &str, values: &Vec<f64>, colour| {
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len() as f64;
        let point = |(i, p): (usize, &f64)| (-((i as f64 + 0.5) / n).log10(), -p.log10());
        // The many large values would hide each other, so fewer and fewer are drawn after the first
        // hundred.
        let shown = |i: &usize| *i < 100 || i.is_multiple_of(*i / 50);
        let points = sorted.iter().enumerate().filter(|(i, _)| shown(i)).map(point).collect();
        Series { name: name.into(), points, colour, thin: false }
    };
    let ends = (0.0, (2.0 * pools[0].len() as f64).log10());
    let diagonal = vec![(ends.0, ends.0), (ends.1, ends.1)];
    Plot {
        title: "p-values of the innocent".into(),
        x: Axis::linear("expected, −log10 p"),
        y: Axis::linear("observed, −log10 p"),
        series: vec![
            Series { name: "uniform".into(), points: diagonal, colour: BLACK, thin: true },
            series("wrong keys", &pools[0], BLUE),
            series("wrong recipients", &pools[1], RED),
        ],
    }
    .to_svg()
}

/// Returns the result as Markdown.
pub fn markdown(samples: &[Sample], seed: u64) -> String {
    let mut text = format!(
        "Seed {seed}. Kolmogorov–Smirnov distance D from the uniform distribution, and the probability of as much or more.\n\n\
         | suspects | wrong keys | D | p of D | least p | wrong recipients | D | p of D | least p |\n|{}\n",
        "---|".repeat(9)
    );
    let mut row = |name: &str, samples: Vec<&Sample>| {
        let [keys, recipients] = pooled(samples.into_iter()).map(Uniformity::measure);
        let cells =
            |u: Uniformity| format!("{} | {:.4} | {:.2} | {:.1e}", u.count, u.distance, u.p_value, u.least);
        text += &format!("| {name} | {} | {} |\n", cells(keys), cells(recipients));
    };
    for (name, ..) in SUSPECTS {
        row(name, samples.iter().filter(|s| s.suspect == name).collect());
    }
    row("all", samples.iter().collect());
    text
}

/// Writes the results: `false_alarms.md`, `.json` and `.svg`.
///
/// # Errors
/// Fails when a file cannot be written.
pub fn write(folder: &Path, samples: &[Sample], seed: u64) -> Result<PathBuf> {
    std::fs::create_dir_all(folder)?;
    let table = folder.join("false_alarms.md");
    std::fs::write(&table, markdown(samples, seed))?;
    let json = serde_json::json!({ "seed": seed, "samples": samples });
    std::fs::write(folder.join("false_alarms.json"), serde_json::to_string(&json)? + "\n")?;
    std::fs::write(folder.join("false_alarms.svg"), quantile_plot(&pooled(samples.iter()))?)?;
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_numbers_pass_and_squares_of_them_do_not() {
        let mut random = Random::new(1);
        let uniform: Vec<f64> = (0..5000).map(|_| random.unit()).collect();
        assert!(Uniformity::measure(uniform.clone()).p_value > 0.01);
        assert!(Uniformity::measure(uniform.iter().map(|u| u * u).collect()).p_value < 1e-9);
        // Stephens 1970: 1.358 is the 5 % point of (√n + 0.12 + 0.11/√n) D.
        let distance = 1.358 / (10.0 + 0.12 + 0.011);
        let shifted = (1..=100).map(|i| (f64::from(i) / 100.0 - distance).max(0.0)).collect();
        assert!((Uniformity::measure(shifted).p_value - 0.05).abs() < 0.001);
    }
}
