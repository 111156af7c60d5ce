//! The report of a comparison: the effect of marking on a map, and its places.

use super::{
    chart::Chart,
    frame::Frame,
    map::{Arrows, marks},
    page::{count, counted, figure, page, section, table},
};
use crate::{
    compare::{
        Comparison,
        detail::{ComparedFiles, Detail, NOTABLE_DEG, Topology},
    },
    report::Digested,
};
use maud::{Markup, html};
use meshmark_detection::Histogram;
use std::fmt::Write as _;

/// Classes of cells by the change of their angles, degrees from which a class begins.
const CLASSES: [(f64, &str, &str); 4] = [
    (NOTABLE_DEG, "e0", "1° to 2°"),
    (2.0, "e1", "2° to 5°"),
    (5.0, "e2", "5° to 10°"),
    (10.0, "e3", "10° or more"),
];

/// Renders the report of a comparison, without the parts that it lacks (see
/// [`Comparison::detail`]).
pub fn comparison(comparison: &Comparison) -> String {
    let detail = comparison.detail.as_ref();
    let provenance = detail.and_then(|detail| detail.provenance.as_ref());
    let body = html! {
        section.verdict {
            p.answer { (if is_kept(comparison) { "Topology kept" } else { "Topology changed" }) }
            h1 { (sentence(comparison, provenance)) }
            (figures(comparison))
        }
        @if let Some(provenance) = provenance { (files(provenance)) }
        (section("What changed, in figures", &numbers(comparison)))
        @if let Some(detail) = detail {
            (section("Where on the map it changed", &maps(detail)))
            (section("How far and how much", &charts(detail)))
        }
        (section("What was not compared", &html! { ul {
            li { "Attributes, styles, and features that have no geometry." }
            li { "Whether the map carries a mark, and whose: " code { "meshmark verify" } " says that." }
            li { "Overlaps of polygons that are invalid in either map." }
        } }))
        @if let Some(provenance) = provenance { (section("How to repeat it", &repeat(provenance))) }
    };
    page("Quality of a marked map", concat!("meshmark ", env!("CARGO_PKG_VERSION")), "", &body)
}

fn is_kept(comparison: &Comparison) -> bool {
    let (validity, overlaps, crossings) = (&comparison.validity, &comparison.overlaps, &comparison.crossings);
    comparison.compared.torn_vertices + validity.newly_invalid + overlaps.new + crossings.new + crossings.lost
        == 0
}

fn sentence(comparison: &Comparison, provenance: Option<&ComparedFiles>) -> Markup {
    let d = &comparison.displacement;
    html! {
        @match provenance {
            Some(provenance) => { "In " span.name { (provenance.marked.path) } " the vertices of " span.name { (provenance.reference.path) } }
            None => "The vertices",
        }
        " are " (format!("{:.3} m", d.rms_m)) " from where they were (RMS), the furthest " (format!("{:.3} m", d.max_m))
        @if is_kept(comparison) {
            ", and nothing overlaps, crosses or is invalid that was not before"
            @if comparison.overlaps.new_slivers > 0 { ", but for " (counted(comparison.overlaps.new_slivers, "sliver")) " within the grid" }
            "."
        }
        @else { ", and the topology changed in " (changes(comparison)) "." }
    }
}

fn changes(comparison: &Comparison) -> String {
    let c = comparison;
    let all = [
        (c.compared.torn_vertices, "torn vertex"),
        (c.validity.newly_invalid, "newly invalid geometry"),
        (c.overlaps.new, "new overlap"),
        (c.crossings.new, "new crossing"),
        (c.crossings.lost, "lost crossing"),
    ];
    let some: Vec<String> = all.iter().filter(|(n, _)| *n > 0).map(|(n, what)| counted(*n, what)).collect();
    some.join(", ")
}

fn figures(comparison: &Comparison) -> Markup {
    let c = comparison;
    html! {
        dl.figures {
            div { dt { "Features" } dd { (count(c.compared.features)) } }
            div { dt { "Vertices" } dd { (count(c.compared.vertices)) } }
            div { dt { "Displacement, 99 %" } dd { (format!("{:.3} m", c.displacement.p99_m)) } }
            @if c.angles.right_angles > 0 {
                div { dt { "Right angles kept" } dd { (percent(c.angles.right_angles_kept, 1)) } }
            }
        }
    }
}

fn percent(share: f64, decimals: usize) -> String {
    format!("{:.decimals$}\u{a0}%", 100.0 * share)
}

fn files(provenance: &ComparedFiles) -> Markup {
    let file = |file: &Digested| Some(html! { b { (file.path) } br; span.digest { (file.digest) } });
    section(
        "What was compared",
        &html! {
            p { "Features correspond by their order in each layer, vertices by their order in each feature." }
            (table(&[("Reference", file(&provenance.reference)), ("Marked map", file(&provenance.marked))]))
        },
    )
}

fn numbers(comparison: &Comparison) -> Markup {
    let c = comparison;
    let (d, h, a, r) = (&c.displacement, &c.hausdorff, &c.angles, &c.areas);
    let text = |text: String| Some(html! { (text) });
    table(&[
        (
            "Displacement",
            text(format!("{:.3} m RMS; 99 % up to {:.3} m, all up to {:.3} m", d.rms_m, d.p99_m, d.max_m)),
        ),
        (
            "Features",
            text(format!(
                "99 % within {:.3} m of where they were, all within {:.3} m (Hausdorff distance)",
                h.p99_m, h.max_m
            )),
        ),
        (
            "Angles",
            text(format!(
                "turn by {:.2}° on average; 99 % by up to {:.2}°",
                a.mean_change_deg, a.p99_change_deg
            )),
        ),
        (
            "Right angles",
            text(format!("{} of {} kept within 1°", percent(a.right_angles_kept, 1), count(a.right_angles))),
        ),
        (
            "Areas",
            text(format!(
                "of {} change by {} on average; 99 % by up to {}, all by up to {}",
                counted(r.polygons, "polygon"),
                percent(r.mean_change, 3),
                percent(r.p99_change, 3),
                percent(r.max_change, 3)
            )),
        ),
        ("Vertices", text(format!("{} torn apart", count(c.compared.torn_vertices)))),
        (
            "Validity",
            text(format!(
                "{} invalid before, {} after; {} newly invalid",
                counted(c.validity.invalid_before, "geometry"),
                count(c.validity.invalid_after),
                count(c.validity.newly_invalid)
            )),
        ),
        (
            "Overlaps",
            text(format!(
                "{} of polygons before, {} after; {} new ({:.6} m²), {}",
                counted(c.overlaps.before, "pair"),
                count(c.overlaps.after),
                count(c.overlaps.new),
                c.overlaps.new_area_m2,
                counted(c.overlaps.new_slivers, "new sliver")
            )),
        ),
        (
            "Crossings",
            text(format!(
                "{} of segments before, {} after; {} new, {} lost",
                counted(c.crossings.before, "pair"),
                count(c.crossings.after),
                count(c.crossings.new),
                count(c.crossings.lost)
            )),
        ),
    ])
}

fn maps(detail: &Detail) -> Markup {
    let frame = Frame::new(&detail.extent);
    html! {
        (angles(detail, &frame))
        @if let Some(vertices) = &detail.moved { (moved(vertices, &frame)) }
    }
}

/// Draws cells by the change of their angles, and the places of changed topology.
fn angles(detail: &Detail, frame: &Frame) -> Markup {
    let t = &detail.topology;
    let class = |change: f64| {
        CLASSES.iter().rev().find(|(from, ..)| change >= *from).map_or("e0", |(_, class, _)| class)
    };
    let of_class = |wanted: &str| {
        let mut path = String::new();
        for [x, y, _] in detail.angle_cells.iter().filter(|cell| class(cell[2]) == wanted) {
            let corner =
                |sign: f64| frame.at([x + sign * detail.cell[0] / 2.0, y + sign * detail.cell[1] / 2.0]);
            let ([left, bottom], [right, top]) = (corner(-1.0), corner(1.0));
            let _ = write!(path, "M{left} {bottom}H{right}V{top}H{left}z");
        }
        path
    };
    let drawing = html! {
        svg.map.cells viewBox=(frame.view_box()) role="img" aria-label="Map of the reference, by how much angles turned" {
            @for (_, class, _) in CLASSES { path class=(class) d=(of_class(class)) {} }
            (frame.lines(&detail.lines))
            @for (class, shape, places, _) in KINDS.map(|(class, shape, places, name)| (class, shape, places(t), name)) {
                path class=(class) d=(marks(frame, places, shape)) {}
            }
            (frame.foot(None))
        }
    };
    let caption = html! {
        b { "Angles and topology. " }
        "Squares show the largest turn of an angle in them, where it is 1° or more; marks show where the topology changed."
        ul.legend {
            @for (_, class, text) in CLASSES {
                li { svg.swatch viewBox="0 0 120 80" aria-hidden="true" { rect class=(class) width="120" height="80" {} } (text) }
            }
            @for (class, shape, places, name) in KINDS {
                li {
                    svg.swatch viewBox="-60 -40 120 80" aria-hidden="true" { path class=(class) d=(format!("M0 0{shape}")) {} }
                    (name) ": " (count(places(t).len()))
                }
            }
        }
    };
    figure(&drawing, &caption)
}

type Kind = (&'static str, &'static str, fn(&Topology) -> &[[f64; 2]], &'static str);

/// Class, shape, places and name of the kinds of topology change.
const KINDS: [Kind; 4] = [
    ("missing", "m-30-30l60 60m0-60l-60 60", |t| &t.crossings, "crossing new or lost"),
    ("inserted", "m0-36l34 60h-68z", |t| &t.overlaps, "new overlap"),
    ("invalid", "m-30-30h60v60h-60z", |t| &t.invalid, "newly invalid"),
    ("torn", "m0-40l40 40l-40 40l-40-40z", |t| &t.torn, "torn vertex"),
];

fn moved(vertices: &[[f64; 4]], frame: &Frame) -> Markup {
    let arrows = Arrows::fitting(frame, vertices.iter().map(|v| [v[2], v[3]]));
    let drawing = html! {
        svg.map.vertices viewBox=(frame.view_box()) role="img" aria-label="Map of displacements" {
            use href="#lines" {}
            path.arrows d=(arrows.path(frame, vertices)) {}
            (frame.foot(arrows.key(frame).as_ref()))
        }
    };
    let caption = html! {
        b { "Displacement. " }
        "How far vertices moved" (arrows.scale()) "; " (count(vertices.len())) " vertices are drawn. "
        b { "These displacements make the mark of this copy again: keep this report as secret as the records." }
    };
    figure(&drawing, &caption)
}

fn charts(detail: &Detail) -> Markup {
    let chart = |histogram: &Option<Histogram>, label: &str, caption: Markup| {
        let Some(histogram) = histogram else { return html! {} };
        let to = histogram.from + histogram.width * histogram.counts.len() as f64;
        let chart = Chart { histogram, from: histogram.from, to, label };
        figure(&chart.draw(&html! {}), &caption)
    };
    html! {
        (chart(&detail.displacement_m, "displacement of vertices, metres", html! { b { "Displacement. " } "How far the vertices moved." }))
        (chart(&detail.angle_change_deg, "change of angles, degrees", html! { b { "Angles. " } "How far the angles between consecutive segments turned." }))
    }
}

fn repeat(provenance: &ComparedFiles) -> Markup {
    html! {
        p { "With the files above in their places:" }
        pre { code { (provenance.command) } }
        p { "Made with " (provenance.versions.join(", ")) ". Equal files and versions give an equal report, byte by byte." }
    }
}
