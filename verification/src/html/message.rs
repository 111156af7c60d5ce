//! The message bit by bit, with the odds of each bit.

use super::page::{count, figure, section, sentence};
use crate::report::Report;
use maud::{Markup, html};
use meshmark_core::message::Message;

/// Number of bits in a row.
const ROW: usize = 16;

/// Classes of bits by the odds from which a class begins.
const CLASSES: [(f64, &str, &str); 4] = [
    (0.0, "s0", "a guess: less than 3 to 1"),
    (3.0, "s1", "3 to 1 or better"),
    (30.0, "s2", "30 to 1 or better"),
    (1000.0, "s3", "1000 to 1 or better"),
];

pub fn message(report: &Report) -> Markup {
    let content = match &report.message {
        None => html! { p { "Nothing was demodulated, so there is no message to show." } },
        Some(message) => decoded(report, message),
    };
    section("The message, bit by bit", &content)
}

fn decoded(report: &Report, message: &str) -> Markup {
    let expected = report.parameters.expected_message.as_deref();
    html! {
        p {
            "The suspect was read as " code { (message) }
            @match (report.bit_errors, expected) {
                (Some(0), _) => { ", the expected message to the last bit. " }
                (Some(errors), expected) => {
                    ", which differs from the expected message "
                    @if let Some(expected) = expected { code { (expected) } " " }
                    "in " (count(errors)) " of " (count(report.bits.len())) " bits; by chance " (count(report.bits.len() / 2)) " would. "
                }
                _ => { "; no message was expected. " }
            }
            @if let Some(how) = report.decoding() { (sentence(&format!("How it was decoded: {how}."))) }
            @match report.certainty_of_mark() {
                Some(certainty) => { "Bits: " (certainty) "." }
                None => { "No mark of this key shows, so these bits are no better than guessed: noise, too, reads as some message." }
            }
        }
        (figure(&bits(report), &legend(report)))
    }
}

fn bits(report: &Report) -> Markup {
    let message = |hex: &Option<String>| hex.as_deref().and_then(|hex| Message::from_hex(hex).ok());
    let (expected, read) = (message(&report.expected_carried), message(&report.carried_message));
    let read = read.as_ref().map_or(&[][..], Message::bits);
    let rows = report.bits.chunks(ROW).enumerate();
    html! {
        table.bits {
            caption.hidden { "Bits of the message, " (ROW) " in a row" }
            @for (row, llrs) in rows {
                tr {
                    th scope="row" { (row * ROW) }
                    @for (column, llr) in llrs.iter().enumerate() {
                        @let bit = row * ROW + column;
                        @let wrong = expected.as_ref().is_some_and(|expected| expected.bits()[bit] != read[bit]);
                        td class=(format!("{}{}", class(*llr), if wrong { " wrong" } else { "" })) {
                            (if read[bit] { "1" } else { "0" })
                        }
                    }
                }
            }
        }
    }
}

fn class(llr: f64) -> &'static str {
    let odds = llr.abs().min(700.0).exp();
    CLASSES.iter().rev().find(|(from, ..)| odds >= *from).map_or("s0", |(_, class, _)| class)
}

fn legend(report: &Report) -> Markup {
    html! {
        b { "Bits of the message. " }
        "First bit first; the darker, the surer. "
        @if !report.shows_mark() { "These odds suppose a mark, which does not show. " }
        ul.legend {
            @for (_, class, text) in CLASSES { li { span.bit.(class) { "1" } (text) } }
            @if report.expected_carried.is_some() && report.bit_errors.is_some_and(|errors| errors > 0) {
                li { span.bit.s1.wrong { "1" } "differs from the expected message" }
            }
        }
    }
}
