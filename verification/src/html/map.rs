//! The evidence on the map: patches with their scores, vertices with their displacements.

use super::{
    frame::{Frame, MOST_LABELLED, largest_below, metres},
    members::members,
    page::{count, counted, figure, section},
};
use crate::report::{Evidence, Report};
use maud::{Markup, html};
use meshmark_detection::{Observations, decision::Verdict};
use std::fmt::Write as _;

/// Classes of patches: the score from which a class begins, standard deviations, its name and its
/// meaning.
const CLASSES: [(f64, &str, &str); 5] = [
    (f64::NEG_INFINITY, "against", "below −2: against the mark"),
    (-2.0, "e0", "−2 to 2: no evidence by itself"),
    (2.0, "e1", "2 to 4"),
    (4.0, "e2", "4 to 8"),
    (8.0, "e3", "8 or more"),
];

/// A patch of which fewer vertices were found is not coloured, as it shows nothing by itself.
const FEW: usize = 5;

pub fn evidence(report: &Report) -> Markup {
    let Some(evidence) = &report.evidence else { return html! {} };
    let frame = Frame::new(&evidence.sketch.extent);
    let content = html! {
        (patterns())
        (patches(report, evidence, &frame))
        (members(evidence, &frame))
        (vertices(report, evidence, &frame))
    };
    section("Where on the map the evidence is", &content)
}

/// Returns hatching patterns, so that no distinction depends on colour alone.
fn patterns() -> Markup {
    let lines = |id: &str, path: &str| {
        html! {
            pattern id=(id) width="60" height="60" patternUnits="userSpaceOnUse" {
                rect width="60" height="60" class="pattern-ground" {}
                path d=(path) {}
            }
        }
    };
    html! {
        svg.patterns width="0" height="0" aria-hidden="true" { defs {
            (lines("hatch-against", "M-10 70L70-10M-40 40L40-40M20 100L100 20"))
            (lines("hatch-unseen", "M30 26v8"))
        } }
    }
}

fn class(score: Option<f64>) -> &'static str {
    let of = |score| {
        CLASSES.iter().rev().find(|(from, ..)| score >= *from).map_or("against", |(_, class, _)| class)
    };
    score.map_or("unseen", of)
}

fn patches(report: &Report, evidence: &Evidence, frame: &Frame) -> Markup {
    let places = &evidence.sketch.patches;
    let counts_vertices = report.parameters.observations == Some(Observations::Vertices);
    let is_few = |patch: usize| counts_vertices && (1..FEW).contains(&places[patch].matched);
    let score = |patch: usize| evidence.patch_scores.get(patch).copied().flatten().filter(|_| !is_few(patch));
    let scored = !evidence.patch_scores.is_empty();
    let drawing = html! {
        svg.map viewBox=(frame.view_box()) role="img" aria-label="Map of the reference, patches by their evidence" {
            @for (number, place) in places.iter().enumerate() {
                path class=(if scored && is_few(number) { "e0" } else if scored { class(score(number)) } else { "plain" })
                    d=(frame.path(std::iter::once(&place.outline), true)) {}
            }
            (frame.lines(&evidence.sketch.lines))
            @if scored && places.len() <= MOST_LABELLED {
                @for (number, place) in places.iter().enumerate() {
                    @let [x, y] = frame.middle(&place.outline);
                    @if let Some(score) = score(number) { text x=(x) y=(y + 35) { (format!("{score:.1}").replace('-', "−")) } }
                }
            }
            (frame.foot(None))
        }
    };
    let seen: Vec<f64> = (0..places.len()).filter_map(score).collect();
    let caption = html! {
        b { "Evidence by patch. " }
        @if scored {
            @if report.verdict == Verdict::Match { "The mark is in " } @else { "A mark would be in " }
            (count(places.len())) " patches, each with its own secret pattern. The numbers say \
             how many standard deviations each of them by itself is above what a wrong key would show; a wrong key gives \
             values around 0, hardly one above 3. "
            @if seen.is_empty() { "In none of them did anything move." }
            @else {
                "Of the " (counted(seen.len(), "patch")) " that " @if seen.len() == 1 { "was" } @else { "were" } " seen, "
                (count(seen.iter().filter(|s| **s >= 2.0).count())) " reached 2 alone."
            }
            @let few = (0..places.len()).filter(|patch| is_few(*patch)).count();
            @if few > 0 {
                " In " (counted(few, "patch")) " fewer than " (FEW) " vertices were found, which show nothing by themselves: no "
                "number is given there."
            }
            (legend(evidence))
        } @else {
            "The reference and its " (count(places.len())) " patches. No patch has a score: nothing was demodulated, or no \
             message and no recipient was in question."
        }
    };
    figure(&drawing, &caption)
}

fn legend(evidence: &Evidence) -> Markup {
    let used = |class_: &str| evidence.patch_scores.iter().any(|score| class(*score) == class_);
    let entry = |class: &str, text: &str| {
        html! { li { svg.swatch viewBox="0 0 120 80" aria-hidden="true" { rect class=(class) width="120" height="80" {} } (text) } }
    };
    html! {
        ul.legend {
            @for (_, class, text) in CLASSES { (entry(class, text)) }
            @if used("unseen") { (entry("unseen", "nothing found")) }
        }
    }
}

fn vertices(report: &Report, evidence: &Evidence, frame: &Frame) -> Markup {
    let (sketch, sample) = (&evidence.sketch, &evidence.sketch.sample);
    let displaced = sample.displacements_m.as_ref().map(|displacements_m| {
        let pairs = sample.matched.iter().zip(displacements_m);
        pairs.map(|([x, y], [dx, dy])| [*x, *y, *dx, *dy]).collect::<Vec<_>>()
    });
    let arrows = displaced.map(|displaced| {
        (Arrows::fitting(frame, displaced.iter().map(|[_, _, dx, dy]| [*dx, *dy])), displaced)
    });
    let key = arrows.as_ref().and_then(|(arrows, _)| arrows.key(frame));
    let drawing = html! {
        svg.map.vertices viewBox=(frame.view_box()) role="img" aria-label="Map of matched, missing and inserted vertices" {
            use href="#lines" {}
            path.missing d=(marks(frame, &sample.missing, CROSS)) {}
            path.inserted d=(marks(frame, &sample.inserted, TRIANGLE)) {}
            @match &arrows {
                Some((arrows, displaced)) => path.arrows d=(arrows.path(frame, displaced)) {},
                None => path.matched d=(marks(frame, &sample.matched, DOT)) {},
            }
            (frame.foot(key.as_ref()))
        }
    };
    let v = &report.vertices;
    let swatch = |class: &str, path: &str| html! { svg.swatch viewBox="-60 -40 120 80" aria-hidden="true" { path class=(class) d=(path) {} } };
    let shown = |shown: usize, all: usize| html! { @if shown < all { ", " (count(shown)) " of them drawn" } };
    let caption = html! {
        b { "Vertices. " }
        @match &arrows {
            Some((arrows, _)) => {
                "How far each vertex of the reference is displaced in the suspect, after registration" (arrows.scale()) ". "
                b { "These displacements make the mark of this copy again: keep this report as secret as the records." }
            }
            None => "Which vertices of the reference are in the suspect, after registration.",
        }
        ul.legend {
            li {
                @match arrows { Some(_) => (swatch("arrows", "M-40 20L30-15m-28-2l28 2l-14 24")), None => (swatch("matched", &format!("M0 0{DOT}"))) }
                "matched: " (count(v.matched)) (shown(sample.matched.len(), v.matched))
            }
            li { (swatch("missing", &format!("M0 0{CROSS}"))) "missing from the suspect: " (count(sketch.missing)) (shown(sample.missing.len(), sketch.missing)) }
            li { (swatch("inserted", &format!("M0 0{TRIANGLE}"))) "only in the suspect: " (count(sketch.inserted)) (shown(sample.inserted.len(), sketch.inserted)) }
        }
    };
    figure(&drawing, &caption)
}

const DOT: &str = "m0-11l11 11l-11 11l-11-11z";
const CROSS: &str = "m-14-14l28 28m0-28l-28 28";
const TRIANGLE: &str = "m0-18l17 30h-34z";

pub fn marks(frame: &Frame, places: &[[f64; 2]], shape: &str) -> String {
    let mut path = String::new();
    for place in places {
        let [x, y] = frame.at(*place);
        let _ = write!(path, "M{x} {y}{shape}");
    }
    path
}

/// Displacements as arrows, drawn at an enlarged scale.
pub struct Arrows {
    times: f64,
    rms_m: f64,
}

/// Length of an arrow of typical displacement, page units.
const ORDINARY: f64 = 75.0;

impl Arrows {
    pub fn fitting(frame: &Frame, displacements_m: impl Iterator<Item = [f64; 2]>) -> Self {
        let (sum, n) = displacements_m.fold((0.0, 0), |(sum, n), [x, y]| (sum + x * x + y * y, n + 1));
        let rms_m = (sum / f64::from(n.max(1))).sqrt();
        let length = frame.length(rms_m);
        let times = if length > 0.0 { largest_below(ORDINARY / length).max(1.0) } else { 1.0 };
        Arrows { times, rms_m }
    }

    /// Returns arrows as path data; `vertices` holds places, CRS units, and displacements, metres.
    pub fn path(&self, frame: &Frame, vertices: &[[f64; 4]]) -> String {
        let mut path = String::new();
        for [x, y, dx, dy] in vertices {
            let [x, y] = frame.at([*x, *y]);
            let _ = write!(path, "M{x} {y}{}", self.arrow(frame, [*dx, *dy]));
        }
        path
    }

    /// Returns one arrow from the current point.
    fn arrow(&self, frame: &Frame, displacement_m: [f64; 2]) -> String {
        let [dx, dy] = displacement_m.map(|d| frame.length(d) * self.times);
        let (length, dy) = (dx.hypot(dy), -dy);
        if length < 4.0 {
            return "h0".into();
        }
        // Half of the arrowhead is on either side of the shaft.
        let head = (length / 3.0).min(26.0) / length;
        let side = |sign: f64| [head * (-dx - sign * 0.5 * dy), head * (-dy + sign * 0.5 * dx)];
        let ([ax, ay], [bx, by]) = (side(1.0), side(-1.0));
        format!("l{dx:.0} {dy:.0}l{ax:.0} {ay:.0}m{:.0} {:.0}l{bx:.0} {by:.0}", -ax, -ay)
    }

    /// Returns the end of a sentence that gives the enlargement.
    pub fn scale(&self) -> Markup {
        html! { @if self.times > 1.0 { ", drawn " (count(self.times as usize)) " times as long as it is" } }
    }

    /// Draws an arrow of a round length with its length in metres.
    pub fn key(&self, frame: &Frame) -> Option<Markup> {
        let length_m = largest_below(2.0 * self.rms_m.max(f64::MIN_POSITIVE));
        let end = frame.length(length_m) * self.times;
        (self.rms_m > 1e-6).then(|| {
            html! {
                path.arrows d=(format!("M0 0{}", self.arrow(frame, [length_m, 0.0]))) {}
                text x=(format!("{:.0}", end + 40.0)) y="38" { "moved by " (metres(length_m)) }
            }
        })
    }
}
