//! The compared files with their digests, and the records that were tried.

use super::{
    page::{count, section, sentence, table},
    words,
};
use crate::{
    report::{Candidates, Digested, MarkParameters, Provenance, Report, explain},
    words::{clipped, printable},
};
use maud::{Markup, html};
use meshmark_core::{
    code::Code,
    counted,
    options::{Parameters, join_list},
};
use meshmark_detection::decision::Verdict;

pub fn compared(report: &Report) -> Markup {
    let content = html! {
        @match &report.provenance {
            Some(provenance) => (files(report, provenance)),
            None => (maps(report)),
        }
        p { @for text in explain::bound(report) { (sentence(&text)) } }
        @if let Some(candidates) = &report.candidates { (tried(report, candidates)) }
    };
    section("What was compared", &content)
}

fn files(report: &Report, provenance: &Provenance) -> Markup {
    let inputs = &provenance.inputs;
    let [suspect, reference] = described(report);
    let notice = explain::same_file(inputs).map(|text| html! { " " b { (text) } });
    let others = inputs
        .other_references
        .iter()
        .map(|other| file(other, &html! { "given besides, such as an earlier edition" }));
    let others: Vec<Markup> = others.collect();
    table(&[
        (
            "Suspect",
            Some(
                html! { (file(&inputs.suspect, &suspect)) br; (explain::UNTOUCHED) @if let Some(notice) = notice { (notice) } },
            ),
        ),
        ("Reference", Some(file(&inputs.reference, &reference))),
        (
            "Other references",
            (!others.is_empty()).then(|| html! { @for other in &others { div { (other) } } }),
        ),
        ("Key", Some(file(&inputs.key, &html! { "public id " code { (report.parameters.key_id) } }))),
        ("Record", Some(record(report, inputs.record.as_ref()))),
        ("Recipient", recipient(report)),
    ])
}

/// Returns the maps and the key of a report without files.
fn maps(report: &Report) -> Markup {
    let [suspect, reference] = described(report);
    table(&[
        ("Suspect", Some(suspect)),
        ("Reference", Some(reference)),
        ("Key", Some(html! { "public id " code { (report.parameters.key_id) } })),
        ("Recipient", recipient(report)),
    ])
}

/// Describes suspect and reference.
fn described(report: &Report) -> [Markup; 2] {
    let suspect_crs = match report.suspect_crs.as_slice() {
        [] => "no layer".into(),
        crs => crs.join(", "),
    };
    let reference_crs = report.parameters.crs.as_deref().unwrap_or("no CRS");
    let map = |vertices: usize, crs: &str| html! { (count(vertices)) " vertices, " (crs) };
    let reference = html! {
        (map(report.vertices.reference, reference_crs))
        @if let Some(sentence) = explain::other_crs(report) { br; (sentence) }
    };
    [map(report.vertices.suspect, &suspect_crs), reference]
}

/// Returns the recipient. Among the records that were tried, only a matching one is named.
fn recipient(report: &Report) -> Option<Markup> {
    let is_named = report.candidates.is_none() || report.verdict == Verdict::Match;
    let recipient = report.parameters.recipient.as_ref().filter(|_| is_named)?;
    Some(html! { b { (clipped(recipient)) } })
}

fn file(file: &Digested, about: &Markup) -> Markup {
    html! { b { (file.path) } br; (about) br; span.digest { (file.digest) } }
}

fn record(report: &Report, record: Option<&Digested>) -> Markup {
    html! {
        @match (record, &report.candidates) {
            (Some(record), None) => (file(record, &html! { "of this key and this reference" })),
            (Some(record), Some(_)) if report.verdict == Verdict::Match => {
                (file(record, &html! { "the best of those that were tried" }))
            },
            (None, Some(_)) => "those of a folder were tried, none of which matches; the recipients of other copies are not named",
            (Some(record), Some(_)) => {
                (file(record, &html! { "one of those that were tried, none of which matches; the settings below are its own" }))
            },
            (None, None) => "none: how the map was marked was taken from the command line",
        }
    }
}

/// Renders the assumed parameters of the mark, and those of the test.
pub fn settings(report: &Report) -> Markup {
    let p = &report.parameters;
    let (what, carried, mark) = match &p.mark {
        MarkParameters::Message(mark) => ("Message", message(mark), mark.clone()),
        MarkParameters::Fingerprint(mark) => {
            let coefficients = counted(mark.coefficients, "coefficient");
            ("Fingerprint", format!("{coefficients} in every patch and axis"), mark.parameters())
        }
    };
    let Parameters { amplitude_m, patch_size, tolerance_m, shape, basis, precision_crs_units, .. } = mark;
    let text = |text: String| Some(html! { (text) });
    let carried = format!("{carried}; patches of {patch_size} vertices or more; basis {}", word(&basis));
    let grid = precision_crs_units.map(|grid| html! { (grid) " CRS units" });
    let layers = p.layers.as_ref().map(|layers| html! { (printable(&join_list(layers))) });
    let content = table(&[
        ("Amplitude", text(format!("{amplitude_m} m on the ground, no vertex further than {tolerance_m} m"))),
        (what, text(carried)),
        ("Shape", text(format!("{} vertices", word(&shape)))),
        ("Layers", Some(layers.unwrap_or_else(|| html! { "all" }))),
        ("Grid", Some(grid.unwrap_or_else(|| html! { "none" }))),
        ("Matching radius", text(format!("{} m{}", p.radius_m, report.radius_reason()))),
        ("Demodulator", text(p.demodulator.into())),
        ("Observed on", p.observations.as_ref().map(|observations| html! { (word(observations)) })),
    ]);
    section("How the mark was assumed to be made and tested", &content)
}

/// Describes how a message is carried.
fn message(mark: &Parameters) -> String {
    format!(
        "{}, {} for each of its bits in every patch and axis",
        if mark.code == Code::Ldpc { "as an error-correcting code word (LDPC)" } else { "repeated bits" },
        counted(mark.chip_rate, "coefficient")
    )
}

/// Returns the name of a value in the JSON report.
fn word(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(String::from)).unwrap_or_default()
}

fn tried(report: &Report, candidates: &Candidates) -> Markup {
    let significance = report.parameters.significance.log10();
    let has_bits = candidates.list.iter().any(|entry| entry.bit_errors.is_some());
    html! {
        h3 { "Copies that were tried" }
        p {
            @match candidates.tried {
                1 => "One record of this key and this reference was tried.",
                tried => {
                    (count(tried)) " records of this key and this reference were tried; for that, every probability is \
                     multiplied by " (count(tried)) "."
                }
            }
            @if candidates.skipped > 0 {
                " Files of the folder that are no such record and were left out: " (count(candidates.skipped)) "."
            }
            @if candidates.tried > candidates.list.len() {
                @if candidates.matches > 0 { " Those that match are listed." }
                @else if !candidates.list.is_empty() { " The nearest ones are listed." }
                @if let Some(p) = candidates.next_p_value_log10 {
                    " The best of the others fits so well by chance with the probability " (words::probability(p)) "."
                }
            }
        }
        @if !candidates.list.is_empty() { table.list {
            thead { tr { th { "Recipient" } th { "Record" } @if has_bits { th.number { "Bits that differ" } } th.number { "By chance" } th { "" } } }
            tbody {
                @for (number, entry) in candidates.list.iter().enumerate() {
                    tr {
                        td { @match &entry.recipient {
                            Some(recipient) => (clipped(recipient)),
                            None => "–",
                        } }
                        td { (printable(&entry.record)) }
                        @if has_bits { td.number { @if let Some(errors) = entry.bit_errors { (errors) } @else { "–" } } }
                        td.number { @if let Some(p) = entry.p_value_log10 { (words::probability(p)) } @else { "–" } }
                        td.whole { @if number < candidates.matches && entry.p_value_log10.is_some_and(|p| p < significance) { b { "match" } } }
                    }
                }
            }
        } }
    }
}
