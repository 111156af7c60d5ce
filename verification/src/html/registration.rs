//! The registration of the suspect, and its residuals.

use super::{
    chart::Chart,
    page::{count, figure, section, sentence, table},
};
use crate::report::{Evidence, Report, explain};
use maud::{Markup, html};
use meshmark_core::deformation::LEAST_NOISE_M;
use meshmark_detection::{decision::Verdict, registration::Method};

pub fn registration(report: &Report) -> Markup {
    let r = &report.registration;
    let method = match r.method {
        Method::Identity => "from where it lay",
        Method::Landmarks => "by features with the same attribute values",
        Method::Geometry => "by features of the same shape",
        Method::Curves => "by the course of its lines",
    };
    let is_found = report.message.is_some() || report.fingerprint.is_some();
    let alignment = report.evidence.as_ref().filter(|_| is_found).map(|e| &e.sketch.alignment);
    let content = html! {
        p {
            @for text in explain::assumed(report).into_iter().chain(explain::left_out(report)) { (sentence(&text)) }
            @if is_found {
                "The suspect was brought onto the reference " (method) ", without the key. What is left between matched vertices is "
                @if report.verdict == Verdict::Match { "the mark, and whatever else moved them." }
                @else { "whatever moved them, be it a mark or not." }
            } @else {
                "Too few of its vertices were found on the reference to compare the two."
            }
        }
        (table(&[
            ("Landmarks", (r.landmarks > 0).then(|| html! { (count(r.landmarks)) " agree" })),
            ("Shift", alignment.map(|a| html! { (signed(a.shift_m[0], 3)) " m in x, " (signed(a.shift_m[1], 3)) " m in y" })),
            ("Turn", alignment.map(|a| html! { (signed(a.turn_deg, 4)) "°" @if a.mirrored { ", mirrored" } })),
            ("Stretch", alignment.map(|a| html! { (format!("by {:.6}, across by {:.6}", a.stretch[0], a.stretch[1])) })),
            ("Beyond that", r.polynomial.map(|_| html! { "a cubic polynomial" })),
            ("Residual", r.rms_m.map(|rms| html! { (format!("{rms:.3} m RMS of matched vertices")) })),
            ("Deformation", report.evidence.as_ref().map(deformation)),
            ("Noise", report.parameters.noise_m.map(|noise| html! {
                @if noise <= LEAST_NOISE_M { (format!("none beyond {LEAST_NOISE_M} m per axis, the least that is assumed")) }
                @else { (format!("{noise:.3} m per axis, neither mark nor deformation")) }
            })),
        ]))
        @if let Some(evidence) = &report.evidence { (residuals(evidence)) }
    };
    section("How the maps were brought together", &content)
}

/// Formats a value with a minus sign, which zero lacks.
fn signed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.chars().all(|c| "-0.".contains(c));
    if is_zero { text.replace('-', "") } else { text.replace('-', "−") }
}

fn deformation(evidence: &Evidence) -> Markup {
    html! {
        @match &evidence.sketch.deformation {
            None => "not estimated",
            Some(d) if d.deviation_m == 0.0 && d.group_shift_m == 0.0 => "none found",
            Some(d) => {
                @if d.deviation_m > 0.0 {
                    (format!(
                        "smooth, {} m (standard deviation), changing over some {} m; ",
                        d.deviation_m, d.range_m
                    ))
                }
                @if d.group_shift_m > 0.0 {
                    (format!("groups of polygons shifted by {} m (standard deviation); ", d.group_shift_m))
                }
                "taken into account"
            },
        }
    }
}

fn residuals(evidence: &Evidence) -> Markup {
    let Some(histogram) = &evidence.sketch.displacement_m else { return html! {} };
    let to = histogram.from + histogram.width * histogram.counts.len() as f64;
    let chart = Chart { histogram, from: 0.0, to, label: "displacement of matched vertices, metres" };
    let caption = html! {
        b { "Residuals. " }
        "How far matched vertices are from their places in the reference, after registration."
    };
    figure(&chart.draw(&html! {}), &caption)
}
