//! The verdict in one sentence, with its figures.

use super::{page::count, words};
use crate::{
    report::Report,
    words::{clipped, printable},
};
use maud::{Markup, html};
use meshmark_detection::decision::Verdict;

pub fn verdict(report: &Report) -> Markup {
    let class = match report.verdict {
        Verdict::Match => "match",
        Verdict::NoMatch => "no-match",
        Verdict::Inconclusive => "inconclusive",
    };
    html! {
        section.verdict.(class) {
            p.answer { (name(report.verdict)) }
            h1 { (sentence(report)) }
            @if report.verdict != Verdict::Match && report.shows_key() {
                @match (report.verdict, &report.fingerprint) {
                    (_, Some(_)) => p { "Some mark of this key is in the map, whoever its recipient is." }
                    (Verdict::NoMatch, None) => p { "Some mark of this key is in the map, of another message or made with other options." }
                    (_, None) => p { "Some mark of this key is in the map, whatever its message." }
                }
            }
            (figures(report))
        }
    }
}

fn name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Match => "Match",
        Verdict::NoMatch => "No match",
        Verdict::Inconclusive => "Inconclusive",
    }
}

fn sentence(report: &Report) -> Markup {
    let odds = report.p_value_log10.map(words::how_often);
    let suspect = report.provenance.as_ref().map(|p| p.inputs.suspect.path.as_str());
    let map = html! { "The map" @if let Some(name) = suspect { " " span.name { (name) } } };
    let chance = "a key and a recipient that have nothing to do with it would fit so well";
    html! {
        (map)
        @match (report.verdict, odds) {
            (Verdict::Match, odds) => {
                " carries the mark of " (mark(report))
                @if let Some(odds) = odds { ": by chance, " (chance) " " (odds) } "."
            }
            (Verdict::NoMatch, odds) => {
                " does not carry the mark of " (mark(report)) ", which would have shown"
                @if let Some(odds) = odds { ": by chance, " (chance) " " (odds) } "."
            }
            (Verdict::Inconclusive, _) if !report.is_of_somebody() => {
                " was not compared with any copy: " (printable(&report.reason)) "."
            }
            (Verdict::Inconclusive, odds) => {
                " cannot tell whether it carries the mark of " (mark(report)) ": " (printable(&report.reason))
                @match odds {
                    Some(odds) => { "; by chance, " (chance) " " (odds) "." }
                    None => { "; so how often chance fits as well cannot be said." }
                }
            }
        }
    }
}

/// Names the mark in question.
fn mark(report: &Report) -> Markup {
    let p = &report.parameters;
    let several = report.candidates.as_ref().map(|c| if c.matches > 0 { c.matches } else { c.tried });
    html! {
        @match (several, &p.recipient, &p.expected_message) {
            (Some(several), ..) if several > 1 && report.verdict == Verdict::Match => {
                (count(several)) " of the copies that were tried"
            }
            (Some(several), ..) if several > 1 => {
                "any of the " (count(several)) " copies that were tried"
            }
            (_, Some(recipient), _) => { "the copy made for “" span.name { (clipped(recipient)) } "”" }
            (_, None, Some(message)) => { "the copy with the message " code { (message) } }
            _ if report.candidates.is_some() => { "the one copy that was tried" }
            _ if report.is_of_somebody() => { "the copy that the record is of" }
            _ => { "key " code { (p.key_id) } }
        }
    }
}

fn figures(report: &Report) -> Markup {
    let v = &report.vertices;
    html! {
        dl.figures {
            @if let Some(p) = report.p_value_log10 {
                div { dt { "Probability by chance" } dd { (words::probability(p)) } }
            }
            @if let Some(p) = report.p_missed_log10 {
                div { dt { "Probability that a present mark is missed, at most" } dd { (words::probability(p)) } }
            }
            @if let Some(errors) = report.bit_errors {
                div { dt { "Message bits that differ" } dd {
                    (count(errors)) " of " (count(report.bits.len()))
                    @if errors > 0 { ", by chance " (count(report.bits.len() / 2)) }
                } }
            }
            div { dt { "Vertices found" } dd { (count(v.matched)) " of " (count(v.reference)) } }
            div { dt { "Match means below" } dd { (words::probability(report.parameters.significance.log10())) } }
        }
    }
}
