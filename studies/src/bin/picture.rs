//! Draws a piece of a map before and after marking, with exaggerated displacement, as SVG on
//! stdout.
//!
//! Usage: picture REFERENCE MARKED LAYER WEST SOUTH EAST NORTH EXAGGERATION > picture.svg

use gdal::{Dataset, vector::LayerAccess};
use std::{collections::BTreeMap, fmt::Write};

/// Width of the picture, pixels.
const WIDTH: f64 = 900.0;

struct View {
    west: f64,
    north: f64,
    pixels_per_unit: f64,
}

impl View {
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [(x - self.west) * self.pixels_per_unit, (self.north - y) * self.pixels_per_unit]
    }

    fn path(&self, ring: &[[f64; 2]]) -> String {
        let points: Vec<String> = ring
            .iter()
            .map(|p| {
                let [x, y] = self.place(*p);
                format!("{x:.1} {y:.1}")
            })
            .collect();
        format!("M{}", points.join("L"))
    }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [reference, marked, layer, window @ .., exaggeration] = args.as_slice() else {
        eprintln!("usage: picture REFERENCE MARKED LAYER WEST SOUTH EAST NORTH EXAGGERATION");
        std::process::exit(2);
    };
    let number = |text: &String| text.parse::<f64>().unwrap_or_else(|_| panic!("{text} is not a number"));
    let [west, south, east, north] = window else { panic!("a window has four numbers") };
    let (west, south, east, north) = (number(west), number(south), number(east), number(north));
    let rings = |path: &String| rings(path, layer, [west, south, east, north]);
    let view = View { west, north, pixels_per_unit: WIDTH / (east - west) };
    println!(
        "{}",
        draw(&view, (north - south) / (east - west), &rings(reference), &rings(marked), number(exaggeration))
    );
}

/// Rings and lines by feature id.
type Features = BTreeMap<u64, Vec<Vec<[f64; 2]>>>;

/// Returns the features of a layer that touch a window.
fn rings(path: &str, layer: &str, [west, south, east, north]: [f64; 4]) -> Features {
    let dataset = Dataset::open(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let mut layer = dataset.layer_by_name(layer).unwrap_or_else(|error| panic!("{path}: {error}"));
    layer.set_spatial_filter_rect(west, south, east, north);
    let mut features = Features::new();
    for feature in layer.features() {
        let Some(geometry) = feature.geometry() else { continue };
        let geometry: geo::Geometry = geometry.to_geo().expect("a simple geometry");
        collect(&geometry, features.entry(feature.fid().expect("an id")).or_default());
    }
    features
}

fn collect(geometry: &geo::Geometry, rings: &mut Vec<Vec<[f64; 2]>>) {
    let mut push = |line: &geo::LineString| rings.push(line.0.iter().map(|c| [c.x, c.y]).collect());
    match geometry {
        geo::Geometry::LineString(line) => push(line),
        geo::Geometry::Polygon(polygon) => {
            push(polygon.exterior());
            polygon.interiors().iter().for_each(push);
        }
        geo::Geometry::MultiPolygon(parts) => {
            parts.iter().for_each(|part| collect(&part.clone().into(), rings));
        }
        _ => {}
    }
}

fn draw(view: &View, aspect: f64, before: &Features, after: &Features, exaggeration: f64) -> String {
    let (mut grey, mut blue) = (String::new(), String::new());
    for (fid, rings) in before {
        let Some(marked) = after.get(fid) else { continue };
        for (before, after) in rings.iter().zip(marked) {
            let moved = |(a, b): (&[f64; 2], &[f64; 2])| [0, 1].map(|i| a[i] + exaggeration * (b[i] - a[i]));
            let moved: Vec<[f64; 2]> = before.iter().zip(after).map(moved).collect();
            grey += &view.path(before);
            blue += &view.path(&moved);
        }
    }
    let height = WIDTH * aspect;
    let metre = view.pixels_per_unit;
    let mut svg = String::new();
    let _ = write!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0}" font-family="sans-serif" font-size="15">
<rect width="{WIDTH}" height="{height:.0}" fill="#fff"/>
<path d="{grey}" fill="#e8e4da" fill-rule="evenodd" stroke="#888" stroke-width="1.2"/>
<path d="{blue}" fill="none" stroke="#0b5cad" stroke-width="1.6"/>
<rect y="{bar_top:.0}" width="{WIDTH}" height="34" fill="#fff" opacity="0.9"/>
<text x="12" y="{text:.0}">grey: before   <tspan fill="#0b5cad">blue: after, displacement × {exaggeration}</tspan></text>
<path d="M{x0:.1} {text:.0}h{bar:.1}" stroke="#000" stroke-width="2"/><text x="{label:.1}" y="{text:.0}">10 m</text>
</svg>"##,
        bar_top = height - 34.0,
        text = height - 12.0,
        x0 = WIDTH - 60.0 - 10.0 * metre,
        bar = 10.0 * metre,
        label = WIDTH - 52.0,
    );
    svg
}
