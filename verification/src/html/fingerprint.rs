//! The agreement of the secret signs.

use super::page::{count, section, sentence, table};
use crate::report::{
    FingerprintEntry, PatchAgreement, Report, SignAgreement,
    explain::{self, SECRET_SIGNS},
};
use maud::{Markup, html};

pub fn fingerprint(report: &Report) -> Markup {
    let content = match &report.fingerprint {
        None => html! { p { "Nothing was observed, so there are no signs to show." } },
        Some(fingerprint) => agreement(fingerprint),
    };
    let likelihood = explain::likelihood(report);
    html! {
        (section("The secret signs", &content))
        @if !likelihood.is_empty() {
            (section("Whose copy it is: likelihood ratios", &html! {
                ul { @for text in &likelihood[..2] { li { (text) } } }
                p { @for text in &likelihood[2..] { (sentence(text)) } }
            }))
        }
    }
}

fn agreement(fingerprint: &FingerprintEntry) -> Markup {
    let FingerprintEntry { recipient, key, patches, .. } = fingerprint;
    let recipient = recipient.as_ref().map(signs);
    let patches = patches.map(|PatchAgreement { seen, clear }| {
        html! {
            (count(clear)) " of the " (count(seen)) " patches that were seen show the recipient by themselves, by "
            (PatchAgreement::CLEAR) " standard deviations or more"
        }
    });
    let rows = [
        ("Signs of the recipient", recipient),
        ("Signs of the key, which all copies have", Some(signs(key))),
        ("Patches", patches),
    ];
    html! {
        p { (SECRET_SIGNS) }
        (table(&rows.into_iter().filter(|(_, value)| value.is_some()).collect::<Vec<_>>()))
    }
}

fn signs(agreement: &SignAgreement) -> Markup {
    let SignAgreement { signs, agreeing, by_chance, by_chance_deviation, score, .. } = agreement;
    html! {
        "of " (count(*signs)) " secret signs " (count(*agreeing)) " agree; by chance " (format!("{by_chance:.0} ± {by_chance_deviation:.0}"))
        " would. The score is " (format!("{score:.1}").replace('-', "−")) " standard deviations"
    }
}
