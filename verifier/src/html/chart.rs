//! Histograms.

use super::{
    frame::rounded,
    page::{count, figure, section},
};
use crate::report::Report;
use maud::{Markup, html};
use meshmark_detection::{Histogram, round_up};
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

/// Draws the score and those of decoys.
pub fn decoys(report: &Report) -> Markup {
    let content = match &report.decoys {
        None => html! { p { "Nothing was demodulated, or nothing moved, so no key has a score." } },
        Some(decoys) => {
            let tested = decoys.tested;
            let to = tested.map_or(5.0, |t| (t + 2.0).clamp(5.0, FARTHEST));
            let broken = tested.is_some_and(|t| t > to);
            let from = decoys.histogram.from.min(tested.unwrap_or(0.0)).min(-5.0).floor();
            let chart = Chart {
                histogram: &decoys.histogram,
                from,
                to,
                label: "score, in standard deviations of a wrong key",
            };
            let more = html! {
                path.law d=(normal(&chart, decoys.count)) {}
                @if let Some(tested) = tested {
                    (line(chart.x(tested.min(to - 1.0)), &format!("this key and message: {tested:.1}")))
                    @if broken { path.break d=(format!("M{:.1} {}l6-14m4 14l6-14", chart.x(to - 4.0), HEIGHT + 7.0)) {} }
                }
            };
            let caption = html! {
                b { "The score among decoys. " }
                (count(decoys.count)) " keys that were made up score " (format!("{:.2}", decoys.mean).replace('-', "−")) " on average, with a standard \
                 deviation of " (format!("{:.2}", decoys.standard_deviation)) " and at most " (format!("{:.1}", decoys.largest))
                "; the curve is the law that the probabilities rest on, mean 0 and standard deviation 1. "
                @match tested {
                    Some(tested) => {
                        "The key and message in question score " (format!("{tested:.1}"))
                        @if broken { ", beyond the break of the axis" } "."
                    }
                    None => { "No message was expected, so the key in question has no score." }
                }
            };
            figure(&chart.draw(&more), &caption)
        }
    };
    section("The score against chance", &content)
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
