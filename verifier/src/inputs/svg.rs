//! SVG drawings as lines: what has outlines, under its transforms, curves as chords.
//!
//! Coordinates are those of the drawing, y downwards; the registration finds where they lie. Nothing outside the
//! file is read.

use super::{suspect_formats, unsuitable::BadDrawing};
use crate::{Error, Result};
use gdal::{
    Dataset, DriverManager,
    errors::GdalError,
    vector::{Geometry, LayerAccess, LayerOptions, OGRwkbGeometryType as Type},
};
use roxmltree::{Document, Node, ParsingOptions};
use std::{
    collections::{HashMap, HashSet},
    path::Path,
    str::FromStr,
};
use svgtypes::{PointsParser, SimplePathSegment, SimplifyingPathParser, Transform, ViewBox};

/// The largest file.
const MOST_BYTES: u64 = 100_000_000;
/// The most points, and the most elements with those that `use` repeats.
const MOST_POINTS: usize = 10_000_000;
/// The most nodes of the XML tree.
const MOST_NODES: u32 = 4_000_000;
/// The most attributes of one element, of which the parser compares each two.
const MOST_ATTRIBUTES: usize = 256;
/// The most prefixes of namespaces, and the most declarations of them, at each of which the parser compares
/// each two prefixes around it.
const MOST_NAMESPACES: [usize; 2] = [100, 100_000];
/// The most `use` elements inside each other.
const MOST_USES: u32 = 16;
/// The greatest distance of a curve from its chords, pixels.
const FLATNESS: f64 = 0.1;
/// The width of a drawing of which [`FLATNESS`] is meant, pixels; a smaller one is scaled to it.
const WIDTH: f64 = 1600.0;

/// An outline: one point is a place, and a closed line repeats its first point.
type Line = Vec<[f64; 2]>;

type Refused<T> = std::result::Result<T, BadDrawing>;

/// Returns whether the name of a file is that of a drawing.
pub(super) fn is_named(path: &Path) -> bool {
    path.is_file() && path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg"))
}

/// Reads a drawing as a dataset without CRS.
pub(super) fn open(copy: &Path, path: &Path) -> Result<Dataset> {
    let refused = |reason: BadDrawing| suspect_formats::unread_drawing(path, reason);
    let lines = text(copy).and_then(|text| lines(&text)).map_err(refused)?;
    dataset(&lines).map_err(|error| Error::Unread { path: path.into(), source: Box::new(error.into()) })
}

fn text(path: &Path) -> Refused<String> {
    let size = path.metadata()?.len();
    if size > MOST_BYTES {
        return Err(format!("has {size} bytes, where an SVG file may have {MOST_BYTES}").into());
    }
    String::from_utf8(std::fs::read(path)?).map_err(|_| BadDrawing::NotUtf8)
}

fn dataset(lines: &[Line]) -> std::result::Result<Dataset, GdalError> {
    // From GDAL 3.11 on, MEM holds vector data too.
    let driver =
        DriverManager::get_driver_by_name("Memory").or_else(|_| DriverManager::get_driver_by_name("MEM"))?;
    let mut dataset = driver.create_vector_only("")?;
    let mut layer =
        dataset.create_layer(LayerOptions { name: "drawing", ty: Type::wkbUnknown, ..Default::default() })?;
    for line in lines {
        let ty = if line.len() == 1 { Type::wkbPoint } else { Type::wkbLineString };
        let mut geometry = Geometry::empty(ty)?;
        line.iter().for_each(|&[x, y]| geometry.add_point_2d((x, y)));
        layer.create_feature(geometry)?;
    }
    Ok(dataset)
}

/// Reads the lines of a drawing.
fn lines(text: &str) -> Refused<Vec<Line>> {
    check_declarations(text)?;
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MOST_NODES, entity_resolver: None };
    let document = Document::parse_with_options(text, options)?;
    let root = document.root_element();
    if root.tag_name().name() != "svg" {
        return Err("is no SVG drawing: its root element is another".into());
    }
    let targets = document.descendants().filter_map(|node| Some((node.attribute("id")?, node)));
    let mut drawing = Drawing { lines: Vec::new(), points: 0, flatness: flatness(root) };
    drawing.walk(root, &targets.collect())?;
    Ok(drawing.lines)
}

/// Refuses what would let the parser work without end: entities, and too many names.
fn check_declarations<'a>(text: &'a str) -> Refused<()> {
    if text.contains("<!ENTITY") {
        return Err("declares entities, which are not expanded".into());
    }
    let is_value = |rest: &str| rest.trim_start().starts_with(['"', '\'']);
    let attributes = |tag: &str| tag.split('=').skip(1).filter(|rest| is_value(rest)).count();
    if text.split('<').any(|tag| attributes(tag) > MOST_ATTRIBUTES) {
        return Err(format!("has an element of more than {MOST_ATTRIBUTES} attributes").into());
    }
    let declarations = || text.match_indices("xmlns").map(|(at, _)| &text[at..]);
    let prefix = |rest: &'a str| rest.split(['=', '"', '\'', '<', '>']).next().unwrap_or_default().trim();
    let prefixes: HashSet<&str> = declarations().map(prefix).collect();
    let [most_prefixes, most] = MOST_NAMESPACES;
    if prefixes.len() > most_prefixes || declarations().count() > most {
        return Err(format!(
            "has more than {most_prefixes} namespaces, or declares them more than {most} times"
        )
        .into());
    }
    Ok(())
}

/// Returns the greatest distance of a curve from its chords in units of the drawing.
fn flatness(root: Node) -> f64 {
    let view_box = root.attribute("viewBox").and_then(|text| ViewBox::from_str(text).ok());
    let extent = view_box.map_or(WIDTH, |view_box| view_box.w.max(view_box.h));
    FLATNESS * (extent / WIDTH).min(1.0)
}

struct Drawing {
    lines: Vec<Line>,
    points: usize,
    flatness: f64,
}

/// An element, the transform of its surroundings, and the number of `use` elements around it.
type Pending<'a, 'input> = (Node<'a, 'input>, Affine, u32);

impl Drawing {
    /// Draws an element and all in it. Definitions are drawn where they are used.
    fn walk<'a>(&mut self, root: Node<'a, '_>, targets: &HashMap<&str, Node<'a, '_>>) -> Refused<()> {
        let mut pending: Vec<Pending> = vec![(root, Affine::IDENTITY, 0)];
        let mut elements = 0;
        while let Some((node, around, uses)) = pending.pop() {
            elements += 1;
            if elements > MOST_POINTS || pending.len() > MOST_POINTS {
                return Err(format!("draws more than {MOST_POINTS} elements").into());
            }
            let transform = around.then_inner(Affine::of_node(node));
            match node.tag_name().name() {
                "svg" | "g" | "a" | "switch" => {
                    pending.extend(node.children().rev().map(|child| (child, transform, uses)));
                }
                "use" if uses < MOST_USES => {
                    let target = href(node).and_then(|id| targets.get(id)).copied();
                    let transform = transform.then_inner(Affine::shift(place(node, "x", "y")));
                    pending.extend(target.into_iter().flat_map(|target| {
                        // A symbol is drawn by its content.
                        let is_symbol = target.tag_name().name() == "symbol";
                        let content = is_symbol.then(|| target.children().rev()).into_iter().flatten();
                        let whole = (!is_symbol).then_some(target);
                        whole.into_iter().chain(content).map(|node| (node, transform, uses + 1))
                    }));
                }
                "use" => return Err(format!("has more than {MOST_USES} uses inside each other").into()),
                _ => self.shape(node, transform)?,
            }
        }
        Ok(())
    }

    fn shape(&mut self, node: Node, transform: Affine) -> Refused<()> {
        let points = || {
            let points = PointsParser::from(node.attribute("points").unwrap_or_default());
            points.map(|(x, y)| transform.apply([x, y])).collect::<Line>()
        };
        match node.tag_name().name() {
            "path" => self.path(node.attribute("d").unwrap_or_default(), transform),
            "polyline" => self.push(points()),
            "polygon" => self.push(closed(points())),
            "line" => self
                .push([["x1", "y1"], ["x2", "y2"]].map(|[x, y]| transform.apply(place(node, x, y))).into()),
            "rect" => {
                let [[x, y], [width, height]] = [place(node, "x", "y"), place(node, "width", "height")];
                let corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]];
                self.push(closed(corners.map(|corner| transform.apply(corner)).into()))
            }
            // The symbol of a place.
            "circle" | "ellipse" => self.push(vec![transform.apply(place(node, "cx", "cy"))]),
            _ => Ok(()),
        }
    }

    /// Draws a path up to its first error, as SVG demands.
    fn path(&mut self, data: &str, transform: Affine) -> Refused<()> {
        let mut line = Line::new();
        for segment in SimplifyingPathParser::from(data).map_while(|segment| segment.ok()) {
            match segment {
                SimplePathSegment::MoveTo { x, y } => {
                    self.push_stroke(std::mem::replace(&mut line, vec![transform.apply([x, y])]))?;
                }
                SimplePathSegment::LineTo { x, y } => line.push(transform.apply([x, y])),
                SimplePathSegment::Quadratic { x1, y1, x, y } => {
                    let [middle, end] = [[x1, y1], [x, y]].map(|point| transform.apply(point));
                    let Some(&start) = line.last() else { continue };
                    let toward =
                        |[x, y]: [f64; 2]| [x + 2.0 / 3.0 * (middle[0] - x), y + 2.0 / 3.0 * (middle[1] - y)];
                    self.curve([start, toward(start), toward(end), end], &mut line)?;
                }
                SimplePathSegment::CurveTo { x1, y1, x2, y2, x, y } => {
                    let [first, second, end] = [[x1, y1], [x2, y2], [x, y]].map(|p| transform.apply(p));
                    let Some(&start) = line.last() else { continue };
                    self.curve([start, first, second, end], &mut line)?;
                }
                SimplePathSegment::ClosePath => line = closed(line),
            }
        }
        self.push_stroke(line)
    }

    /// Appends a cubic curve as chords, as many as the bound of its second derivative demands (Wang's formula).
    fn curve(&self, [start, first, second, end]: [[f64; 2]; 4], line: &mut Line) -> Refused<()> {
        let bend = |[a, b, c]: [[f64; 2]; 3]| (a[0] - 2.0 * b[0] + c[0]).hypot(a[1] - 2.0 * b[1] + c[1]);
        let bend = bend([start, first, second]).max(bend([first, second, end]));
        let count = (0.75 * bend / self.flatness).sqrt().ceil().max(1.0);
        self.check(line.len() as f64 + count)?;
        for step in 1..count as usize {
            let t = step as f64 / count;
            let (weight, rest) = (t, 1.0 - t);
            let at = |axis: usize| {
                rest.powi(3) * start[axis]
                    + 3.0 * rest * rest * weight * first[axis]
                    + 3.0 * rest * weight * weight * second[axis]
                    + weight.powi(3) * end[axis]
            };
            line.push([at(0), at(1)]);
        }
        line.push(end);
        Ok(())
    }

    /// Adds a line of a path, in which a single point draws nothing.
    fn push_stroke(&mut self, line: Line) -> Refused<()> {
        if line.len() > 1 { self.push(line) } else { Ok(()) }
    }

    fn push(&mut self, line: Line) -> Refused<()> {
        self.check(line.len() as f64)?;
        if line.iter().flatten().any(|number| !number.is_finite()) {
            return Err("has a coordinate that is too large".into());
        }
        self.points += line.len();
        self.lines.extend(Some(line).filter(|line| !line.is_empty()));
        Ok(())
    }

    /// Checks that so many points may be added. NaN is none.
    fn check(&self, more: f64) -> Refused<()> {
        let is_allowed = self.points as f64 + more <= MOST_POINTS as f64;
        if is_allowed { Ok(()) } else { Err(format!("has more than {MOST_POINTS} points").into()) }
    }
}

/// Ends a line at its first point.
fn closed(mut line: Line) -> Line {
    if line.first() != line.last() {
        line.extend_from_within(..1);
    }
    line
}

/// Returns the id in this file that a `use` names.
fn href<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    let href = node.attribute("href").or_else(|| node.attribute(("http://www.w3.org/1999/xlink", "href")));
    href?.strip_prefix('#')
}

/// Returns a pair of lengths in pixels, zero where they are missing or relative.
fn place(node: Node, x: &str, y: &str) -> [f64; 2] {
    [x, y].map(|name| {
        let text = node.attribute(name).unwrap_or_default().trim();
        text.strip_suffix("px").unwrap_or(text).parse().unwrap_or(0.0)
    })
}

/// An affine map as SVG writes it: x′ = a x + c y + e, y′ = b x + d y + f.
#[derive(Clone, Copy)]
struct Affine([f64; 6]);

impl Affine {
    const IDENTITY: Affine = Affine([1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);

    fn shift([x, y]: [f64; 2]) -> Self {
        Affine([1.0, 0.0, 0.0, 1.0, x, y])
    }

    /// Returns the transform of an element; one that is malformed changes nothing.
    fn of_node(node: Node) -> Self {
        let transform = node.attribute("transform").and_then(|text| Transform::from_str(text).ok());
        transform.map_or(Affine::IDENTITY, |Transform { a, b, c, d, e, f }| Affine([a, b, c, d, e, f]))
    }

    fn apply(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d, e, f] = self.0;
        [a * x + c * y + e, b * x + d * y + f]
    }

    /// Returns the map that applies `inner` first.
    fn then_inner(self, inner: Affine) -> Affine {
        let [a, b, c, d, ..] = self.0;
        let turned = |x: f64, y: f64| [a * x + c * y, b * x + d * y];
        let [ia, ib, ic, id, ie, iff] = inner.0;
        let ([x0, x1], [y0, y1], [e, f]) = (turned(ia, ib), turned(ic, id), self.apply([ie, iff]));
        Affine([x0, x1, y0, y1, e, f])
    }
}
