//! Counts how often the verifier would exclude a guilty recipient: verdicts on copies that carry
//! the mark, at increasing damage. A copy may be too damaged for a match, but "no match" is then a
//! false statement.

use meshmark_host_tests::{
    Result,
    attacks::{
        Attack, Map, Random, bodies::Motion, curves::Redrawing, noise, outlines::Outline,
        quantisation::Quantisation,
    },
    product::{Asked, Marking, Product, Profile, write_key},
};
use serde::Serialize;
use std::{collections::BTreeMap, path::Path};

/// The grid of the maps, as in the paper's experiments.
const PRECISION_M: f64 = 0.1;

/// The verdict on one damaged copy.
#[derive(Debug, Clone, Serialize)]
pub struct Damaged {
    pub map: String,
    pub damage: String,
    pub verdict: String,
    pub p_value_log10: Option<f64>,
    pub reason: String,
}

/// A way to damage a map: its name, the least and the largest strength, and the attack of a
/// strength.
type Way = (&'static str, f64, f64, fn(f64) -> Attack);

const WAYS: [Way; 17] = [
    ("noise", 0.3, 4.0, |half_width| Attack::Noise { half_width }),
    ("gauss", 0.2, 2.5, |deviation| Attack::GaussianNoise { deviation }),
    ("redrawn", 0.3, 3.0, |deviation| Attack::Redraw { share: 0.7, deviation }),
    ("shifted", 0.3, 6.0, |deviation| Attack::MoveBodies(Motion { deviation, degrees: 0.0 })),
    ("turned", 1.0, 20.0, |degrees| Attack::MoveBodies(Motion { deviation: 0.5, degrees })),
    ("sheet", 1.0, 20.0, |amplitude| Attack::RubberSheet { amplitude }),
    ("resampled", 0.5, 15.0, |spacing| Attack::DrawAnew(Redrawing::Resample { spacing })),
    ("traced", 0.05, 1.5, |deviation| Attack::DrawAnew(Redrawing::Trace { spacing: 2.0, deviation })),
    ("chaikin", 1.0, 4.0, |rounds| Attack::DrawAnew(Redrawing::Chaikin { rounds: rounds as usize })),
    ("simplified", 0.5, 20.0, |tolerance| Attack::Simplify { tolerance }),
    ("vectorised", 0.3, 3.0, |pixel| Attack::Vectorise { pixel }),
    ("snapped", 0.3, 6.0, |spacing| Attack::Snap { spacing }),
    ("tiles", 10.0, 15.0, |zoom| Attack::Quantise(Quantisation::VectorTiles { zoom: zoom as i32 })),
    ("vertices deleted", 0.3, 0.99, |share| Attack::DeleteVertices { share }),
    ("features deleted", 0.3, 0.99, |share| Attack::DeleteFeatures { share }),
    ("piece", 20.0, 1000.0, |vertices| Attack::Piece { vertices: vertices as usize }),
    ("boxes", 0.0, 1.0, |_| Attack::Outline(Outline::BoundingBox)),
];

/// Damages `count` copies of a map, each in one or two ways of random strength, and verifies them
/// for their recipient.
///
/// # Errors
/// Fails on a map that cannot be read or marked.
pub fn study(product: &Product, map: &Path, count: usize, seed: u64) -> Result<Vec<Damaged>> {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let (key, reference, marked, record) =
        (path("key.json"), path("reference.gpkg"), path("marked.gpkg"), path("record.json"));
    write_key(&key, seed)?;
    noise::snap(&Map::read(map)?, PRECISION_M).write(&reference)?;
    let marking =
        Marking { key: &key, recipient: "the recipient", profile: Profile::LDPC, precision: PRECISION_M };
    product.mark(&reference, &marked, &record, marking)?;
    let marked = Map::read(&marked)?;
    let name = map.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut random = Random::new(seed);
    let mut copies = Vec::new();
    while copies.len() < count {
        let (damage, attack) = draw(&mut random);
        let suspect = attack.apply(&marked, random.seed())?;
        if suspect.coords().next().is_none() {
            continue; // nothing is left to verify
        }
        let file = path("suspect.gpkg");
        suspect.write(&file)?;
        let report = product.verify(&key, &reference, Asked::Record(&record), "joint", "auto", &file)?;
        std::fs::remove_file(&file)?;
        let (map, verdict, reason) = (name.clone(), report.verdict, report.reason);
        copies.push(Damaged { map, damage, verdict, p_value_log10: report.p_value_log10, reason });
    }
    Ok(copies)
}

/// Draws the damage of a copy: one way, or two in sequence.
pub(crate) fn draw(random: &mut Random) -> (String, Attack) {
    let mut one = || {
        let (name, least, most, attack) = WAYS[random.below(WAYS.len())];
        let strength = if least > 0.0 { least * (most / least).powf(random.unit()) } else { most };
        (format!("{name} {strength:.2}"), attack(strength), random.unit() < 0.5)
    };
    let (first, attack, is_alone) = one();
    if is_alone {
        return (first, attack);
    }
    let (second, more, _) = one();
    (format!("{first}, {second}"), Attack::Sequence(vec![attack, more]))
}

/// Returns the result as Markdown: verdicts by the first way, and every false "no match".
pub fn markdown(copies: &[Damaged], seed: u64) -> String {
    let mut rows: BTreeMap<&str, [usize; 3]> = BTreeMap::new();
    for w in copies {
        let way = w.damage.rsplit_once(", ").map_or(w.damage.as_str(), |(first, _)| first);
        let way = way.rsplit_once(' ').map_or(way, |(name, _)| name);
        let index = ["match", "inconclusive", "no-match"].iter().position(|v| *v == w.verdict).unwrap_or(1);
        rows.entry(way).or_default()[index] += 1;
        rows.entry("~ all").or_default()[index] += 1;
    }
    let mut text = format!(
        "Seed {seed}. Copies that carry the mark, damaged in one or two ways of random strength; the first way is named.\n\n\
         | damage | match | inconclusive | no match |\n|---|---|---|---|\n"
    );
    for (way, [matches, unclear, missed]) in rows {
        text += &format!("| {} | {matches} | {unclear} | {missed} |\n", way.trim_start_matches("~ "));
    }
    for w in copies.iter().filter(|w| w.verdict == "no-match") {
        text += &format!("\nFalse no match: {}, {}, log10 p {:.1?}.\n", w.map, w.damage, w.p_value_log10);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_false_no_match_is_counted_and_named() {
        let copy = |damage: &str, verdict: &str| Damaged {
            map: "town".into(),
            damage: damage.into(),
            verdict: verdict.into(),
            p_value_log10: Some(-0.3),
            reason: String::new(),
        };
        let text = markdown(&[copy("noise 3.00, piece 50.00", "no-match"), copy("noise 0.30", "match")], 7);
        assert!(text.contains("| noise | 1 | 0 | 1 |") && text.contains("| all | 1 | 0 | 1 |"), "{text}");
        assert!(text.contains("False no match: town, noise 3.00, piece 50.00"), "{text}");
    }

    #[test]
    fn equal_seeds_draw_equal_damage() {
        let draws = |seed| {
            let mut random = Random::new(seed);
            (0..20).map(|_| draw(&mut random).0).collect::<Vec<_>>()
        };
        assert_eq!(draws(1), draws(1));
        assert_ne!(draws(1), draws(2));
    }
}
