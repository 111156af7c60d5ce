//! The limits of the finding: what it leaves open, what weakens it, what makes it evidence, and how
//! to repeat it.

use super::page::{count, counted, section};
use crate::report::{Report, error_rates::error_rates, explain};
use maud::{Markup, html};
use meshmark_detection::{
    Observations,
    decision::{Decoys, Verdict},
};

pub fn limits(report: &Report) -> Markup {
    html! {
        (section("What was not tested", &list(&explain::not_tested(report))))
        (section("What would weaken this finding", &list(&weaknesses(report))))
        (section("How often such findings are wrong", &list(&error_rates(report))))
        (section("Five words", &glossary()))
        @let deposit = explain::deposit(report.provenance.as_ref().map(|provenance| &provenance.inputs), report);
        (section("What makes this evidence", &html! {
            p { (deposit[0]) " " (deposit[1]) }
            ul { @for text in &deposit[2..] { li.digest { (text) } } }
        }))
        @if let Some(provenance) = &report.provenance {
            (section("How to repeat it", &html! {
                p { "With the files above in their places:" }
                pre { code { (provenance.command) } }
                p { "Made with " (provenance.versions.join(", ")) ". Equal files and versions give an equal report, byte by byte." }
            }))
        }
    }
}

/// The words that a reader who never saw a watermark needs.
const WORDS: [[&str; 2]; 5] = [
    [
        "Mark",
        "displacements of centimetres that were hidden in a copy of the map, and that are different in every copy.",
    ],
    ["Reference", "the map as it was before it was marked."],
    ["Suspect", "the map in question."],
    ["Patch", "a piece of the map that carries the mark by itself."],
    [
        "By chance",
        "the probability that a key and a recipient that have nothing to do with the suspect fit as well.",
    ],
];

fn glossary() -> Markup {
    html! { dl.words { @for [word, meaning] in WORDS { div { dt { (word) } dd { (meaning) } } } } }
}

fn list(sentences: &[String]) -> Markup {
    html! { ul { @for text in sentences { li { (text) } } } }
}

/// A deviation of decoy scores by this many standard errors is reported; honest decoys rarely reach
/// it.
const STANDARD_ERRORS: f64 = 5.0;

fn weaknesses(report: &Report) -> Vec<String> {
    let mut found = seen(report);
    let has_odds = report.p_value_log10.is_some();
    let common = [
        (
            has_odds,
            "The probability is that of such a fit without the mark. It is not the probability that the recipient is \
             innocent: that also depends on who else had the copy, and on everything else that is known.",
        ),
        (
            has_odds && report.fingerprint.is_none(),
            "For the key, the probability is that of the normal distribution; the exact one is at most 3.18 times as large, \
             whatever the map (Bentkus and Dzindzalieta 2015).",
        ),
        (
            report.shows_mark(),
            "Whoever held the key and the reference could have made this mark. If they could have, and nothing was deposited \
             before the copy was handed out, the finding says only that the map was marked with this key.",
        ),
        (
            has_odds,
            "If other keys, references, records or options were tried before, and are not counted here, the probability is \
             to be multiplied by how many they were.",
        ),
        (
            report.verdict == Verdict::Inconclusive,
            "A larger or less worn piece of the map, another record or another key may give another answer.",
        ),
    ];
    found.extend(common.into_iter().filter(|(holds, _)| *holds).map(|(_, text)| text.into()));
    if report.verdict == Verdict::NoMatch {
        found.push(
            "Another key, another reference or other options than those above may have been used: the finding is about this \
             mark alone."
                .into(),
        );
    }
    found
}

fn breaks_the_law(decoys: &Decoys) -> bool {
    let error = 1.0 / (decoys.count as f64).sqrt();
    let off = [decoys.mean, decoys.standard_deviation - 1.0];
    off.iter().any(|off| off.abs() > STANDARD_ERRORS * error)
}

/// Returns weaknesses that this report shows.
fn seen(report: &Report) -> Vec<String> {
    let mut found = Vec::new();
    let v = &report.vertices;
    let has_features = report.parameters.observations.is_some_and(Observations::is_of_features);
    if has_features {
        found.push(
            "The suspect has no vertices of the reference: the finding rests on one centroid or one box for each polygon."
                .into(),
        );
    } else if 10 * v.matched < v.reference {
        found.push(format!(
            "Only {} of {} of the reference were found: the finding rests on a small part of the map.",
            count(v.matched),
            counted(v.reference, "vertex")
        ));
    }
    let of_signs = report.fingerprint.iter().flat_map(|f| [&f.recipient_decoys, &f.key_decoys]).flatten();
    if report.decoys.iter().chain(of_signs).any(breaks_the_law) {
        found.push(
            "The decoys do not follow the law that the probabilities rest on: do not rely on the probabilities.".into(),
        );
    }
    if let Some(errors) = report.bit_errors.filter(|errors| *errors > 0 && report.verdict == Verdict::Match) {
        let were = if errors == 1 { "was" } else { "were" };
        found.push(format!(
            "{} of the message {were} read wrong, so the mark is worn.",
            counted(errors, "bit")
        ));
    }
    if let Some(evidence) = &report.evidence {
        let against = evidence.patch_scores.iter().flatten().filter(|score| **score < -3.0).count();
        if against > 0 {
            let score = if against == 1 { "scores" } else { "score" };
            found.push(format!(
                "{} {score} clearly against the mark (3 standard deviations or more): parts of the suspect may come from \
                 elsewhere.",
                counted(against, "patch")
            ));
        }
    }
    found
}
