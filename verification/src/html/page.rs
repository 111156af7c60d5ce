//! The elements of pages: sections, figures, tables, counts.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Renders a complete page, with a style of its own beside that of all pages.
pub fn page(title: &str, software: &str, style: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content=(software);
                title { (title) }
                style { (PreEscaped(include_str!("style.css"))) (PreEscaped(style)) }
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

/// Renders a section under a heading.
pub fn section(title: &str, content: &Markup) -> Markup {
    html! { section { h2 { (title) } (content) } }
}

/// Renders a drawing with its caption.
pub fn figure(drawing: &Markup, caption: &Markup) -> Markup {
    html! { figure { (drawing) figcaption { (caption) } } }
}

/// Renders rows of a name and a value, without the rows that lack a value.
pub fn table(rows: &[(&str, Option<Markup>)]) -> Markup {
    html! {
        table.facts { tbody {
            @for (name, value) in rows {
                @if let Some(value) = value { tr { th scope="row" { (name) } td { (value) } } }
            }
        } }
    }
}

/// Formats a count, in groups of three digits from 10 000 on.
pub fn count(number: usize) -> String {
    let digits = number.to_string();
    if number < 10_000 {
        return digits;
    }
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|g| std::str::from_utf8(g).expect("digits")).collect();
    groups.join("\u{202f}")
}

/// Formats a number with its noun, which is given in the singular.
pub fn counted(number: usize, noun: &str) -> String {
    let words = meshmark_core::counted(number, noun);
    let (_, noun) = words.split_once(' ').expect("a number and a noun");
    format!("{} {noun}", count(number))
}

/// Renders `text` as a complete sentence, which begins with a capital letter.
pub fn sentence(text: &str) -> Markup {
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
