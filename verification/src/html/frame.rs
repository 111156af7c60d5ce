//! The page frame: converts CRS units to whole page units, 4000 along the longer side.

use crate::report::Extent;
use maud::{Markup, html};
use meshmark_detection::round_up;
use std::fmt::Write as _;

const SIDE: f64 = 4000.0;
/// Height of the strip for the scale under the map.
const FOOT: f64 = 230.0;
/// From this number of points of rings and lines on, a map is drawn fainter.
const DENSE: usize = 10_000;
/// With more patches the labels of single ones are illegible.
pub const MOST_LABELLED: usize = 60;
/// White margin around the map.
const MARGIN: f64 = 30.0;

pub struct Frame {
    extent: Extent,
    /// Page units per metre.
    per_metre: f64,
    width: f64,
    height: f64,
}

impl Frame {
    pub fn new(extent: &Extent) -> Self {
        let [width_m, height_m] = extent.size_m();
        let longer_m = width_m.max(height_m);
        let per_metre = if longer_m > 0.0 { SIDE / longer_m } else { 1.0 };
        // Narrow maps need room for their scale.
        let width = (width_m * per_metre).max(SIDE / 2.0);
        Frame { extent: *extent, per_metre, width, height: (height_m * per_metre).max(SIDE / 20.0) }
    }

    /// Returns the page coordinates of a place in CRS units.
    pub fn at(&self, place: [f64; 2]) -> [i64; 2] {
        let metres =
            [0, 1].map(|axis| (place[axis] - self.extent.lower[axis]) * self.extent.metres_per_unit[axis]);
        [metres[0] * self.per_metre, self.height - metres[1] * self.per_metre].map(|v| v.round() as i64)
    }

    /// Returns the page coordinates of the middle of an outline.
    pub fn middle(&self, outline: &[[f64; 2]]) -> [i64; 2] {
        self.at([0, 1].map(|axis| {
            let values = outline.iter().map(|p| p[axis]);
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
            low + (high - low) / 2.0
        }))
    }

    /// Returns a length in metres as page units.
    pub fn length(&self, metres: f64) -> f64 {
        metres * self.per_metre
    }

    pub fn view_box(&self) -> String {
        let (w, h) = (self.width + 2.0 * MARGIN, self.height + 2.0 * MARGIN + FOOT);
        format!("{} {} {w:.0} {h:.0}", -MARGIN, -MARGIN)
    }

    /// Returns lines as path data, relative to the start of each line.
    pub fn path<'a>(&self, lines: impl Iterator<Item = &'a Vec<[f64; 2]>>, closed: bool) -> String {
        let mut path = String::new();
        for line in lines {
            let mut points = line.iter().map(|place| self.at(*place));
            let Some(mut last) = points.next() else { continue };
            let _ = write!(path, "M{} {}", last[0], last[1]);
            for point in points.filter({
                let mut before = last;
                move |point| std::mem::replace(&mut before, *point) != *point
            }) {
                let _ = write!(path, "l{} {}", point[0] - last[0], point[1] - last[1]);
                last = point;
            }
            if closed {
                path.push('z');
            }
        }
        path
    }

    /// Draws the rings and lines of a map, for reuse as `#lines`; they are fainter where they would
    /// cover other content.
    pub fn lines(&self, lines: &[Vec<[f64; 2]>]) -> Markup {
        let points: usize = lines.iter().map(Vec::len).sum();
        html! { path #lines class=[(points > DENSE).then_some("dense")] d=(self.path(lines.iter(), false)) {} }
    }

    /// Draws a scale bar and, beside it, further content that extends from (0, 0) to the right.
    pub fn foot(&self, more: Option<&Markup>) -> Markup {
        let bar_m = largest_below(self.width / 3.0 / self.per_metre);
        let bar = self.length(bar_m);
        let y = self.height + MARGIN + 70.0;
        html! {
            g.scale transform=(format!("translate(0 {y:.0})")) {
                path d=(format!("M0-22v44M0 0h{bar:.0}M{bar:.0}-22v44")) {}
                text x=(format!("{:.0}", bar + 40.0)) y="38" { (metres(bar_m)) }
            }
            @if let Some(more) = more {
                g.scale transform=(format!("translate({:.0} {y:.0})", self.width / 2.0 + 100.0)) { (more) }
            }
        }
    }
}

/// Returns the largest of 1, 2 and 5 times a power of ten that is at most `value`, which is
/// positive.
pub fn largest_below(value: f64) -> f64 {
    1.0 / round_up(1.0 / value)
}

/// Formats a length, for example "20 m", "5 km" or "0.1 m".
pub fn metres(length_m: f64) -> String {
    match length_m {
        1000.0.. => format!("{} km", rounded(length_m / 1000.0)),
        0.0..0.001 => format!("{length_m:.1e} m"),
        _ => format!("{} m", rounded(length_m)),
    }
}

/// Removes the digits of rounding errors.
pub fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
