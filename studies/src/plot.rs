//! Line plots as SVG, drawn by plotters.

use plotters::prelude::*;

/// One line of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    pub points: Vec<(f64, f64)>,
    pub colour: RGBColor,
    /// Whether the line is thin and has no mark at its points: a result to compare ours with.
    pub thin: bool,
}

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub label: String,
    /// Logarithmic; values must be positive.
    pub log: bool,
}

/// A plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
}

impl Axis {
    /// Returns an axis with equal steps.
    pub fn linear(label: &str) -> Self {
        Axis { label: label.into(), log: false }
    }

    /// Returns an axis with equal factors.
    pub fn log(label: &str) -> Self {
        Axis { label: label.into(), log: true }
    }

    fn scale(&self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }

    /// Returns the label of a place on the axis, with three digits.
    fn tick(&self, scaled: f64) -> String {
        let value = if self.log { 10f64.powf(scaled) } else { scaled };
        let digits = (2.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 12.0) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
    }

    /// Returns the range that shows all `values`; a linear axis shows 0, too.
    fn range(&self, values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
        let start = if self.log { (f64::INFINITY, f64::NEG_INFINITY) } else { (0.0, 0.0) };
        let (low, high) = values.fold(start, |(low, high), value| {
            let value = self.scale(value);
            (low.min(value), high.max(value))
        });
        if low < high { low..high + 0.05 * (high - low) } else { 0.0..1.0 }
    }
}

impl Plot {
    /// Returns the drawing.
    ///
    /// # Errors
    /// Fails when plotters fails; no cause is known, as no file is written.
    pub fn to_svg(&self) -> Result<String, Box<dyn std::error::Error + Send + Sync>> {
        let mut svg = String::new();
        self.draw(&SVGBackend::with_string(&mut svg, (680, 380)).into_drawing_area())
            .map_err(|error| error.to_string())?;
        Ok(svg)
    }

    fn draw(
        &self,
        area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
    ) -> Result<(), Box<dyn std::error::Error + '_>> {
        area.fill(&WHITE)?;
        let all = || self.series.iter().flat_map(|series| &series.points);
        let (x, y) = (self.x.range(all().map(|p| p.0)), self.y.range(all().map(|p| p.1)));
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", 16))
            .margin(10)
            .x_label_area_size(45)
            .y_label_area_size(60)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .x_label_formatter(&|value| self.x.tick(*value))
            .y_label_formatter(&|value| self.y.tick(*value))
            .light_line_style(WHITE)
            .draw()?;
        for series in &self.series {
            let scaled = series.points.iter().map(|p| (self.x.scale(p.0), self.y.scale(p.1)));
            let points: Vec<(f64, f64)> = scaled.collect();
            let (colour, width) = (series.colour, if series.thin { 1 } else { 2 });
            let style = colour.stroke_width(width);
            chart
                .draw_series(LineSeries::new(points.iter().copied(), style))?
                .label(&series.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
            if !series.thin {
                chart.draw_series(points.iter().map(|&p| Circle::new(p, 3, colour.filled())))?;
            }
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .draw()?;
        area.present()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(x: Axis, points: &[(f64, f64)]) -> Plot {
        let series = Series { name: "a < b".into(), points: points.to_vec(), colour: RED, thin: false };
        Plot { title: "Noise".into(), x, y: Axis::linear("%"), series: vec![series] }
    }

    #[test]
    fn the_drawing_is_xml_whatever_it_shows() {
        let (linear, log) = (Axis::linear("metres"), Axis::log("share"));
        for plot in [
            plot(linear.clone(), &[(1.0, 2.0), (2.0, 3.0)]),
            plot(log, &[(0.0625, 2.0), (1.0, 9.0)]),
            plot(linear, &[]),
        ] {
            let svg = plot.to_svg().unwrap();
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
            assert!(svg.contains("a &lt; b") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn ticks_are_values_with_three_digits() {
        assert_eq!(Axis::log("").tick(-1.204_12), "0.0625");
        assert_eq!(Axis::log("").tick(6.0), "1000000");
        assert_eq!(Axis::linear("").tick(12.5), "12.5");
        assert_eq!(Axis::linear("").tick(0.0), "0");
    }
}
