//! Calibrates the likelihood ratios: those of recipients whose copy a damaged suspect is, of other
//! recipients of the same key, and of keys that have no part in it. Ratios are right if the first have
//! k times as often as the others what is stated as a ratio of k (D. Ramos, J. González-Rodríguez,
//! *Reliable support: measuring calibration of likelihood ratios*, Forensic Science International 230,
//! 2013).

use crate::{
    false_alarms::examine,
    misses::draw,
    plot::{Axis, Plot, Series},
};
use meshmark_core::{
    agreement::Evidence,
    fingerprint::{pilots, recipient_signs},
    key::SecretKey,
    options::Options,
};
use meshmark_detection::decision::likelihood::{LEAST_LOG10, MOST_LOG10, Ratios};
use meshmark_host_tests::{
    Result,
    attacks::{Map, Random, noise},
    product::{Marking, Product, Profile, random_key},
};
use meshmark_verification::verify::{FingerprintEvidence, Found, Sought};
use plotters::style::{BLUE, RED};
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;

/// The grid of the maps, as in the paper's experiments.
const PRECISION_M: f64 = 0.1;
const RECIPIENT: &str = "the recipient";
/// Ratios are stated in steps of a tenth of log₁₀.
const CLASSES: usize = ((MOST_LOG10 - LEAST_LOG10) * 10.0) as usize + 1;
/// More of the innocent than the stated ratio allows, by this many standard deviations, are no chance.
const DEVIATIONS: f64 = 4.0;

/// How many of each are examined, for every map.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    /// Damaged copies.
    pub copies: usize,
    /// Other recipients for each of these.
    pub others: usize,
    /// Wrong keys for each damaged map without a mark, of which there are half as many as copies.
    pub keys: usize,
}

/// How often a ratio is stated, by its class.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Counts(Vec<u64>);

/// The ratios on one map or on all.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Calibration {
    /// The recipient's copy against that of another, where it is the recipient's.
    pub copies_to_others: Counts,
    /// The same where it is that of another.
    pub others: Counts,
    /// The recipient's copy against no copy of the key, where it is the recipient's.
    pub copies_to_none: Counts,
    /// The same where no copy of the key has a part in it.
    pub none: Counts,
}

impl Default for Counts {
    fn default() -> Self {
        Counts(vec![0; CLASSES])
    }
}

impl Counts {
    fn add(&mut self, log10: f64) {
        self.0[((log10 - LEAST_LOG10) * 10.0).round() as usize] += 1;
    }

    fn merge(&mut self, other: &Counts) {
        self.0.iter_mut().zip(&other.0).for_each(|(own, other)| *own += other);
    }

    fn total(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Returns each class, log₁₀, with its number.
    fn classes(&self) -> impl Iterator<Item = (f64, u64)> {
        self.0.iter().enumerate().map(|(class, count)| (LEAST_LOG10 + class as f64 / 10.0, *count))
    }

    /// Returns how many are at least this, log₁₀.
    fn at_least(&self, log10: f64) -> u64 {
        self.classes().filter(|(class, _)| *class > log10 - 0.05).map(|(_, count)| count).sum()
    }

    fn mean(&self, of: impl Fn(f64) -> f64) -> f64 {
        let sum: f64 = self.classes().map(|(log10, count)| of(10f64.powf(log10)) * count as f64).sum();
        sum / self.total() as f64
    }
}

/// Returns the cost of the log-likelihood ratio, Cllr: 0 for ratios that are always right and certain,
/// 1 for ratios that say nothing (N. Brümmer, J. du Preez, *Application-independent evaluation of
/// speaker detection*, Computer Speech and Language 20, 2006).
pub fn cost(with: &Counts, without: &Counts) -> f64 {
    (with.mean(|ratio| (1.0 + 1.0 / ratio).log2()) + without.mean(|ratio| (1.0 + ratio).log2())) / 2.0
}

impl Calibration {
    /// Adds the ratios on another map.
    pub fn merge(&mut self, other: &Calibration) {
        self.copies_to_others.merge(&other.copies_to_others);
        self.others.merge(&other.others);
        self.copies_to_none.merge(&other.copies_to_none);
        self.none.merge(&other.none);
    }

    /// Returns a sentence for each ratio that the innocent have more often than it allows: one of k
    /// once in k times.
    pub fn faults(&self) -> Vec<String> {
        let sides = [("other recipients", &self.others), ("wrong keys", &self.none)];
        let fault = |(who, counts): (&str, &Counts), power: i32| {
            let (seen, all) = (counts.at_least(f64::from(power)), counts.total());
            let allowed = all as f64 / 10f64.powi(power);
            (seen as f64 > allowed + DEVIATIONS * allowed.sqrt() + 1.0)
                .then(|| format!("{seen} of {all} {who} have a ratio of 10^{power} or more"))
        };
        let powers = 1..=MOST_LOG10 as i32;
        sides
            .into_iter()
            .flat_map(|side| powers.clone().filter_map(move |power| fault(side, power)))
            .collect()
    }
}

/// Examines damaged copies of a map for their recipient and for others, and damaged maps without a
/// mark for keys that have no part in them.
///
/// # Errors
/// Fails on a map that cannot be read or marked.
pub fn study(product: &Product, map: &Path, sizes: Sizes, seed: u64) -> Result<Calibration> {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let (key_file, reference, marked) = (path("key.json"), path("reference.gpkg"), path("marked.gpkg"));
    let mut random = Random::new(seed);
    let key = random_key(&mut random);
    std::fs::write(&key_file, key.to_json().as_bytes())?;
    let original = noise::snap(&Map::read(map)?, PRECISION_M);
    original.write(&reference)?;
    let profile = Profile::FINGERPRINT;
    let marking = Marking { key: &key_file, recipient: RECIPIENT, profile, precision: PRECISION_M };
    product.mark(&reference, &marked, &path("record.json"), marking)?;
    let marked = Map::read(&marked)?;
    let mut calibration = Calibration::default();
    let mut number = 0;
    let examined = |of: &Map, random: &mut Random| -> Result<Option<FingerprintEvidence>> {
        let (_, damage) = draw(random);
        let suspect = damage.apply(of, random.seed())?;
        let file = path("suspect.gpkg");
        if suspect.coords().next().is_none() {
            return Ok(None); // nothing is left to examine
        }
        suspect.write(&file)?;
        let found = examine_for(&key, [&reference, &file]);
        std::fs::remove_file(&file)?;
        found
    };
    for _ in 0..sizes.copies {
        let Some(found) = examined(&marked, &mut random)? else { continue };
        let Ratios { another_recipient_log10, no_copy_log10 } = found.recipients[0].1.likelihood;
        calibration.copies_to_others.add(another_recipient_log10);
        calibration.copies_to_none.add(no_copy_log10);
        let others = (number..number + sizes.others).into_par_iter().map(|n| other(&found, &key, n));
        others.collect::<Vec<_>>().into_iter().for_each(|log10| calibration.others.add(log10));
        number += sizes.others;
    }
    for _ in 0..sizes.copies / 2 {
        let Some(found) = examined(&original, &mut random)? else { continue };
        let keys: Vec<SecretKey> = (0..sizes.keys).map(|_| random_key(&mut random)).collect();
        let ratios: Vec<f64> = keys.par_iter().map(|key| wrong_key(&found, key)).collect();
        ratios.into_iter().for_each(|log10| calibration.none.add(log10));
    }
    Ok(calibration)
}

/// Returns the evidence of a suspect about the recipient; none where no vertex matches.
fn examine_for(key: &SecretKey, maps: [&Path; 2]) -> Result<Option<FingerprintEvidence>> {
    let options = Options::parse_for_recipients([("PRECISION", PRECISION_M.to_string().as_str())])?;
    let coefficients = options.coefficients.ok_or("a fingerprint has coefficients")?;
    let recipients = vec![RECIPIENT.to_string()];
    let sought = Sought::Fingerprint { coefficients, recipients, tried: 1 };
    Ok(match examine(key, maps, sought, options.parameters)? {
        Ok(Found::Fingerprint(found)) => Some(found),
        Ok(Found::Message(_)) => unreachable!("a fingerprint is sought"),
        Err(_) => None,
    })
}

/// Returns log₁₀ of the ratio of a recipient who had no part in a copy.
fn other(found: &FingerprintEvidence, key: &SecretKey, number: usize) -> f64 {
    let signs = recipient_signs(key, &found.parts, &format!("innocent {number}"));
    let score = Evidence::of_recipients(&found.estimates).agreement(&signs).score;
    found.grounds.laws().ratios_of_score(score).another_recipient_log10
}

/// Returns log₁₀ of the ratio of a recipient of a key that had no part in a suspect.
fn wrong_key(found: &FingerprintEvidence, key: &SecretKey) -> f64 {
    let score = |evidence: Evidence, signs| evidence.agreement(&signs).score;
    let of_pilots = score(Evidence::of_pilots(&found.estimates), pilots(key, &found.parts));
    let signs = recipient_signs(key, &found.parts, RECIPIENT);
    let laws = found.grounds.laws().for_pilots(of_pilots);
    laws.ratios_of_score(score(Evidence::of_recipients(&found.estimates), signs)).no_copy_log10
}

/// Returns a Tippett plot: the share of each side whose ratio is at least so large.
///
/// # Errors
/// Fails like [`Plot::to_svg`].
pub fn tippett_plot(calibration: &Calibration) -> Result<String> {
    let series = |name: &str, counts: &Counts, colour, thin| {
        let share = |log10: f64| 100.0 * counts.at_least(log10) as f64 / counts.total() as f64;
        let points = counts.classes().map(|(log10, _)| (log10, share(log10))).collect();
        Series { name: name.into(), points, colour, thin }
    };
    let Calibration { copies_to_others, others, copies_to_none, none } = calibration;
    Plot {
        title: "Likelihood ratios: share of cases with this ratio or a larger one".into(),
        x: Axis::linear("log10 of the likelihood ratio"),
        y: Axis::linear("%"),
        series: vec![
            series("copies of the recipient, against another recipient", copies_to_others, BLUE, false),
            series("copies of another recipient", others, RED, false),
            series("copies of the recipient, against no copy", copies_to_none, BLUE, true),
            series("no copy of the key", none, RED, true),
        ],
    }
    .to_svg()
}

/// Returns the result as Markdown.
pub fn markdown(calibration: &Calibration, maps: &[String], seed: u64) -> String {
    let Calibration { copies_to_others, others, copies_to_none, none } = calibration;
    let mut text = format!(
        "Seed {seed}, {}. Cllr is 0 for ratios that are always right and certain, 1 for ratios that say nothing.\n\n\
         | ratio against | Cllr | copies | ratio at least 10^6 | below 1 | without it | ratio above 1 | at least 10 | \
         at least 100 | at least 1000 | at least 10^4 | largest |\n|{}\n",
        maps.join(", "),
        "---|".repeat(12)
    );
    let sides = [("another recipient", copies_to_others, others), ("no copy", copies_to_none, none)];
    for (name, with, without) in sides {
        let largest = without.classes().filter(|(_, count)| *count > 0).map(|(log10, _)| log10).last();
        text += &format!(
            "| {name} | {:.4} | {} | {} | {} | {} | {} | {} | {} | {} | {} | 10^{:.1} |\n",
            cost(with, without),
            with.total(),
            with.at_least(MOST_LOG10),
            with.total() - with.at_least(0.0),
            without.total(),
            without.at_least(0.1),
            without.at_least(1.0),
            without.at_least(2.0),
            without.at_least(3.0),
            without.at_least(4.0),
            largest.unwrap_or(LEAST_LOG10),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(ratios: &[(f64, u64)]) -> Counts {
        let mut counts = Counts::default();
        ratios.iter().for_each(|(log10, count)| (0..*count).for_each(|_| counts.add(*log10)));
        counts
    }

    #[test]
    fn the_cost_of_ratios_is_one_without_information_and_small_for_right_ones() {
        let even = counts(&[(0.0, 10)]);
        assert_eq!(cost(&even, &even), 1.0);
        let (with, without) = (counts(&[(6.0, 10)]), counts(&[(-2.0, 10)]));
        assert!(cost(&with, &without) < 0.01);
        assert!(cost(&without, &with) > 10.0, "wrong ones cost more than none");
    }

    #[test]
    fn ratios_that_the_innocent_have_too_often_are_faults() {
        let of = |others| Calibration { others, none: counts(&[(0.0, 10)]), ..Calibration::default() };
        assert!(of(counts(&[(-1.0, 10_000), (2.0, 90)])).faults().is_empty());
        let faults = of(counts(&[(-1.0, 10_000), (2.0, 200)])).faults();
        assert_eq!(faults, ["200 of 10200 other recipients have a ratio of 10^2 or more"]);
    }

    #[test]
    fn the_plot_and_the_table_hold_all_sides() {
        let mut all = Calibration::default();
        let one = Calibration {
            copies_to_others: counts(&[(6.0, 3), (-0.5, 1)]),
            others: counts(&[(-2.0, 50)]),
            copies_to_none: counts(&[(6.0, 4)]),
            none: counts(&[(-1.0, 5)]),
        };
        all.merge(&one);
        assert_eq!(all, one);
        let text = markdown(&all, &["town".into()], 7);
        assert!(
            text.contains("| another recipient | 0.") && text.contains("| 4 | 3 | 1 | 50 | 0 |"),
            "{text}"
        );
        assert!(tippett_plot(&all).unwrap().contains("no copy of the key"));
    }
}
