//! Line plots as SVG: bit error rate against an attack's strength.

use std::fmt::Write;

/// One line of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    /// Strength and bit error rate in per cent, by strength.
    pub points: Vec<(f64, f64)>,
    /// Any CSS colour.
    pub colour: &'static str,
    pub dashed: bool,
}

/// A plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    pub title: String,
    pub x_label: String,
    /// A logarithmic x axis.
    pub log_x: bool,
    pub series: Vec<Series>,
}

/// Margins and size of the drawing area, pixels.
const LEFT: f64 = 60.0;
const TOP: f64 = 40.0;
const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 260.0;
const LEGEND: f64 = 170.0;
const BELOW: f64 = 50.0;

impl Plot {
    /// The drawing.
    pub fn to_svg(&self) -> String {
        let (width, height) = (LEFT + WIDTH + LEGEND, TOP + HEIGHT + BELOW);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        let title = text(LEFT + WIDTH / 2.0, TOP - 16.0, "middle", &self.title);
        svg += &title.replace("<text", "<text font-size=\"15\"");
        self.draw_axes(&mut svg);
        for (number, series) in self.series.iter().enumerate() {
            self.draw_series(&mut svg, series, number);
        }
        svg + "</svg>\n"
    }

    fn draw_axes(&self, svg: &mut String) {
        let top = self.top_percent();
        for tick in 0..=5 {
            let percent = top * f64::from(tick) / 5.0;
            let y = self.y(percent);
            let _ = writeln!(svg, "<path d=\"M{LEFT} {y:.1}h{WIDTH}\" stroke=\"#ddd\"/>");
            *svg += &text(LEFT - 8.0, y + 4.0, "end", &format!("{percent} %"));
        }
        for x in self.strengths() {
            let at = self.x(x);
            let _ = writeln!(svg, "<path d=\"M{at:.1} {:.1}v5\" stroke=\"black\"/>", TOP + HEIGHT);
            *svg += &text(at, TOP + HEIGHT + 18.0, "middle", &format!("{x}"));
        }
        let _ = writeln!(svg, "<path d=\"M{LEFT} {TOP}v{HEIGHT}h{WIDTH}\" fill=\"none\" stroke=\"black\"/>");
        *svg += &text(LEFT + WIDTH / 2.0, TOP + HEIGHT + 38.0, "middle", &self.x_label);
    }

    fn draw_series(&self, svg: &mut String, series: &Series, number: usize) {
        let points: Vec<String> =
            series.points.iter().map(|&(x, y)| format!("{:.1},{:.1}", self.x(x), self.y(y))).collect();
        let dash = if series.dashed { " stroke-dasharray=\"5 4\"" } else { "" };
        let style = format!("fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{dash}", series.colour);
        let _ = writeln!(svg, "<polyline points=\"{}\" {style}/>", points.join(" "));
        for point in &points {
            let (x, y) = point.split_once(',').expect("two numbers");
            let _ = writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"3\" fill=\"{}\"/>", series.colour);
        }
        let (x, y) = (LEFT + WIDTH + 12.0, TOP + 10.0 + 20.0 * number as f64);
        let _ = writeln!(svg, "<path d=\"M{x} {y}h24\" {style}/>");
        *svg += &text(x + 30.0, y + 4.0, "start", &series.name);
    }

    fn x(&self, strength: f64) -> f64 {
        let scale = |value: f64| if self.log_x { value.ln() } else { value };
        let strengths = self.strengths();
        let (low, high) = match (strengths.first(), strengths.last()) {
            (Some(low), Some(high)) if low < high => (scale(*low), scale(*high)),
            _ => return LEFT + WIDTH / 2.0,
        };
        LEFT + 20.0 + (WIDTH - 40.0) * (scale(strength) - low) / (high - low)
    }

    fn y(&self, percent: f64) -> f64 {
        TOP + HEIGHT * (1.0 - percent / self.top_percent())
    }

    /// The end of the y axis: the next multiple of 5 %.
    fn top_percent(&self) -> f64 {
        let most = self.series.iter().flat_map(|s| &s.points).fold(0f64, |most, p| most.max(p.1));
        ((most / 5.0).ceil() * 5.0).max(5.0)
    }

    fn strengths(&self) -> Vec<f64> {
        let mut strengths: Vec<f64> = self.series.iter().flat_map(|s| &s.points).map(|p| p.0).collect();
        strengths.sort_by(f64::total_cmp);
        strengths.dedup();
        strengths
    }
}

fn text(x: f64, y: f64, anchor: &str, content: &str) -> String {
    let content = content.replace('&', "&amp;").replace('<', "&lt;");
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{content}</text>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(log_x: bool, points: &[(f64, f64)]) -> Plot {
        let series = Series { name: "a < b".into(), points: points.to_vec(), colour: "red", dashed: true };
        Plot { title: "Noise".into(), x_label: "metres".into(), log_x, series: vec![series] }
    }

    #[test]
    fn strengths_span_the_axis_and_rates_the_height() {
        let linear = plot(false, &[(0.1, 0.0), (0.3, 4.0), (0.5, 10.0)]);
        assert!((linear.x(0.3) - (linear.x(0.1) + linear.x(0.5)) / 2.0).abs() < 1e-9);
        assert_eq!((linear.y(0.0), linear.y(10.0)), (TOP + HEIGHT, TOP));
        let log = plot(true, &[(0.0625, 0.0), (0.25, 4.0), (1.0, 10.0)]);
        assert!((log.x(0.25) - (log.x(0.0625) + log.x(1.0)) / 2.0).abs() < 1e-9);
    }

    #[test]
    fn the_drawing_is_xml_whatever_it_shows() {
        for plot in [plot(false, &[(1.0, 2.0), (2.0, 3.0)]), plot(true, &[(1.0, 2.0)]), plot(false, &[])] {
            let svg = plot.to_svg();
            assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && svg.contains("a &lt; b"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
