//! Histograms.

use super::{
    frame::rounded,
    page::{count, figure, section},
};
use crate::report::Report;
use maud::{Markup, html};
use meshmark_detection::{Histogram, decision::Decoys, round_up};
use std::fmt::Write as _;

const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 150.0;
/// A score beyond this is drawn after a break of the axis.
const FARTHEST: f64 = 40.0;

/// A histogram with room on its axis for further marks.
pub struct Chart<'a> {
    pub histogram: &'a Histogram,
    /// Ends of the axis.
    pub from: f64,
    pub to: f64,
    /// Label of the axis.
    pub label: &'a str,
}

impl Chart<'_> {
    fn x(&self, value: f64) -> f64 {
        (value - self.from) / (self.to - self.from) * WIDTH
    }

    fn y(&self, count: f64) -> f64 {
        let most = self.histogram.counts.iter().max().copied().unwrap_or(0).max(1);
        HEIGHT - count / most as f64 * (HEIGHT - 12.0)
    }

    pub fn draw(&self, more: &Markup) -> Markup {
        let bins = self.histogram.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        let mut bars = String::new();
        for (bin, count) in bins {
            let [left, right] =
                [bin, bin + 1].map(|b| self.x(self.histogram.from + b as f64 * self.histogram.width));
            let y = self.y(*count as f64);
            let _ = write!(bars, "M{left:.1} {HEIGHT}V{y:.1}H{right:.1}V{HEIGHT}z");
        }
        let step = round_up((self.to - self.from) / 9.0);
        let first = (self.from / step).ceil() as i64;
        let ticks: Vec<f64> =
            (first..=(self.to / step).floor() as i64).map(|i| rounded(i as f64 * step)).collect();
        html! {
            svg.chart viewBox=(format!("-24 -4 {} {}", WIDTH + 48.0, HEIGHT + 46.0)) role="img" aria-label=(self.label) {
                path.bars d=(bars) {}
                (more)
                path.axis d=(format!("M0 {HEIGHT}H{WIDTH}")) {}
                @for tick in ticks {
                    @let x = self.x(tick);
                    path.axis d=(format!("M{x:.1} {HEIGHT}v4")) {}
                    text x=(format!("{x:.1}")) y=(HEIGHT + 17.0) { (tick.to_string().replace('-', "−")) }
                }
                text.label x=(WIDTH / 2.0) y=(HEIGHT + 36.0) { (self.label) }
            }
        }
    }
}

/// Draws a line across a chart, with a name at its top.
fn line(x: f64, name: &str) -> Markup {
    let (side, beside) = if x > WIDTH / 2.0 { ("before", x - 7.0) } else { ("after", x + 7.0) };
    html! {
        path.tested d=(format!("M{x:.1} {HEIGHT}V0")) {}
        path.tested-head d=(format!("M{x:.1} {HEIGHT}l-5-9h10z")) {}
        text.tested.(side) x=(format!("{beside:.1}")) y="12" { (name) }
    }
}

/// What decoys were tried for: how a page names one in question, and those that were made up.
struct Kind {
    wrong: &'static str,
    made_up: &'static str,
    tested: &'static str,
    none_tested: &'static str,
}

const MESSAGES: Kind = Kind {
    wrong: "a wrong key",
    made_up: "keys that were made up",
    tested: "key and message",
    none_tested: "No message was expected, so the key in question has no score.",
};
const RECIPIENTS: Kind = Kind {
    wrong: "a recipient who had no part",
    made_up: "recipients who were made up",
    tested: "recipient",
    none_tested: "No recipient was named, so nobody has a score.",
};
const KEYS: Kind = Kind { tested: "key", none_tested: "", ..MESSAGES };

/// Draws the scores of what is in question and those of decoys.
pub fn decoys(report: &Report) -> Markup {
    let all = match &report.fingerprint {
        None => vec![(&report.decoys, MESSAGES)],
        Some(fingerprint) => {
            vec![(&fingerprint.recipient_decoys, RECIPIENTS), (&fingerprint.key_decoys, KEYS)]
        }
    };
    let drawn: Vec<Markup> =
        all.iter().filter_map(|(decoys, kind)| Some(among_decoys(decoys.as_ref()?, kind))).collect();
    let content = html! {
        @if drawn.is_empty() { p { "Nothing was demodulated, or nothing moved, so no key has a score." } }
        @for figure in drawn { (figure) }
    };
    section("The score against chance", &content)
}

fn among_decoys(decoys: &Decoys, kind: &Kind) -> Markup {
    let tested = decoys.tested;
    let to = tested.map_or(5.0, |t| (t + 2.0).clamp(5.0, FARTHEST));
    let broken = tested.is_some_and(|t| t > to);
    let from = decoys.histogram.from.min(tested.unwrap_or(0.0)).min(-5.0).floor();
    let label = format!("score, in standard deviations of {}", kind.wrong);
    let chart = Chart { histogram: &decoys.histogram, from, to, label: &label };
    let more = html! {
        path.law d=(normal(&chart, decoys.count)) {}
        @if let Some(tested) = tested {
            (line(chart.x(tested.min(to - 1.0)), &format!("this {}: {tested:.1}", kind.tested)))
            @if broken { path.break d=(format!("M{:.1} {}l6-14m4 14l6-14", chart.x(to - 4.0), HEIGHT + 7.0)) {} }
        }
    };
    let number = |value: f64, decimals: usize| format!("{value:.decimals$}").replace('-', "−");
    let caption = html! {
        b { "The score among decoys. " }
        (count(decoys.count)) " " (kind.made_up) " score " (number(decoys.mean, 2)) " on average, with a standard \
         deviation of " (number(decoys.standard_deviation, 2)) " and at most " (number(decoys.largest, 1))
        "; the curve is the law that the probabilities rest on, mean 0 and standard deviation 1. "
        @match tested {
            Some(tested) => {
                "The " (kind.tested) " in question " @if kind.tested.contains(" and ") { "score " } @else { "scores " } (number(tested, 1))
                @if broken { ", beyond the break of the axis" } "."
            }
            None => (kind.none_tested),
        }
    };
    figure(&chart.draw(&more), &caption)
}

/// Returns the path of the histogram that the normal distribution predicts.
fn normal(chart: &Chart, count: usize) -> String {
    let height = |x: f64| {
        let density = (-x * x / 2.0).exp() / (2.0 * std::f64::consts::PI).sqrt();
        chart.y(density * count as f64 * chart.histogram.width).max(0.0)
    };
    let point = |i: i32| f64::from(i) / 8.0;
    let mut path = String::new();
    for x in (-36..=36).map(point) {
        let _ = write!(path, "{}{:.1} {:.1}", if path.is_empty() { "M" } else { "L" }, chart.x(x), height(x));
    }
    path
}
