//! The report as a page: one HTML file without scripts that needs nothing else. It shows what the JSON report
//! says, and works nothing out that is not in it.

mod chart;
mod compared;
mod comparison;
mod frame;
mod limits;
mod map;
mod message;
mod registration;
mod verdict;
mod words;

pub use comparison::comparison;

use crate::report::Report;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The report of a verification. What it does not hold (see [`Report::evidence`]) is left out.
pub fn verification(report: &Report) -> String {
    let body = html! {
        (verdict::verdict(report))
        (compared::compared(report))
        (map::evidence(report))
        (message::message(report))
        (chart::decoys(report))
        (registration::registration(report))
        (compared::settings(report))
        (limits::limits(report))
    };
    page("Verification of a watermark", &report.parameters.software, &body)
}

fn page(title: &str, software: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content=(software);
                title { (title) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body {
                main {
                    header { p.kind { (title) } p.software { (software) } }
                    (body)
                }
            }
        }
    };
    page.into_string() + "\n"
}

/// A part of the page under a heading.
fn section(title: &str, content: &Markup) -> Markup {
    html! { section { h2 { (title) } (content) } }
}

/// A picture and what it shows.
fn figure(drawing: &Markup, caption: &Markup) -> Markup {
    html! { figure { (drawing) figcaption { (caption) } } }
}

/// Rows of a name and a value; rows without a value are left out.
fn table(rows: &[(&str, Option<Markup>)]) -> Markup {
    html! {
        table.facts { tbody {
            @for (name, value) in rows {
                @if let Some(value) = value { tr { th scope="row" { (name) } td { (value) } } }
            }
        } }
    }
}

/// A count, in groups of three digits from 10 000 on.
fn count(number: usize) -> String {
    let digits = number.to_string();
    if number < 10_000 {
        return digits;
    }
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|g| std::str::from_utf8(g).expect("digits")).collect();
    groups.join("\u{202f}")
}

/// A number and its noun, which is given in the singular.
fn counted(number: usize, noun: &str) -> String {
    let words = meshmark_core::counted(number, noun);
    let (_, noun) = words.split_once(' ').expect("a number and a noun");
    format!("{} {noun}", count(number))
}

/// `text` as one of the document's own: sentences of the explanation are complete, and begin with a capital letter.
fn sentence(text: &str) -> Markup {
    html! { (text) " " }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_counts_are_grouped() {
        assert_eq!(
            [0, 3833, 10_000, 1_234_567].map(count),
            ["0", "3833", "10\u{202f}000", "1\u{202f}234\u{202f}567"]
        );
    }
}
