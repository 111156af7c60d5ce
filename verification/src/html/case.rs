//! The case: what the examiner wrote, or room for it; and its name on every printed page.

use super::page::{section, table};
use crate::{report::Report, words::clipped};
use maud::{Markup, html};
use std::fmt::Write as _;

/// Renders the fields of the case, those that were not given as lines to write on.
pub fn case(report: &Report) -> Markup {
    let case = report.case.as_ref();
    let given = |text: Option<&String>| {
        Some(match text {
            Some(text) => html! { (clipped(text)) },
            None => html! { span.blank { } },
        })
    };
    let custody = match case.map(|case| case.custody.as_slice()) {
        Some(steps @ [_, ..]) => html! { ol { @for step in steps { li { (clipped(step)) } } } },
        _ => html! { span.blank { } },
    };
    section(
        "The case",
        &table(&[
            ("Number", given(case.and_then(|case| case.number.as_ref()))),
            ("Examiner", given(case.and_then(|case| case.examiner.as_ref()))),
            ("Date", given(case.and_then(|case| case.date.as_ref()))),
            ("Custody of the suspect", Some(custody)),
        ]),
    )
}

/// Returns a style that writes the number of the case and the digest of the suspect on every printed
/// page.
pub fn running_head(report: &Report) -> String {
    let number = report.case.as_ref().and_then(|case| case.number.as_ref());
    let number = number.map_or(String::new(), |number| format!("Case {}", clipped(number)));
    let digest = report.provenance.as_ref().map(|provenance| provenance.inputs.suspect.digest.as_str());
    let digest = digest.map_or(String::new(), |digest| format!("Suspect: {digest}"));
    let boxes = [("top-left", number), ("bottom-left", digest)];
    let rules = boxes.iter().filter(|(_, text)| !text.is_empty());
    let rules = rules.map(|(place, text)| {
        format!("@page {{ @{place} {{ content: {}; font: 7.5pt serif; }} }}\n", css_string(text))
    });
    rules.collect()
}

/// Returns a string of CSS, in which nothing but letters, digits and spaces of ASCII stands for itself.
fn css_string(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            ' ' | '0'..='9' | 'A'..='Z' | 'a'..='z' => quoted.push(c),
            _ => {
                let _ = write!(quoted, "\\{:06x}", u32::from(c));
            }
        }
    }
    quoted + "\""
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_ends_a_string_of_css() {
        assert_eq!(css_string("Case 7"), "\"Case 7\"");
        assert_eq!(css_string("\"</style>"), "\"\\000022\\00003c\\00002fstyle\\00003e\"");
    }
}
