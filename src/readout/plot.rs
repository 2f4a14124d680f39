//! Curves as SVG files, for benchmark tables and documentation.

use crate::error::{Error, Result};
use plotters::prelude::*;

/// One curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y); points that are not finite, or not positive on a logarithmic axis, are left
    /// out.
    pub points: Vec<[f64; 2]>,
}

/// A plot of curves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// Quantity and unit along x.
    pub x: String,
    /// Quantity and unit along y.
    pub y: String,
    /// Logarithmic x axis.
    pub log_x: bool,
    /// Logarithmic y axis.
    pub log_y: bool,
    /// Curves.
    pub curves: Vec<Curve>,
}

impl Plot {
    /// The plot as SVG text, 800 x 500. Refused without a single point to draw.
    pub fn to_svg(&self) -> Result<String> {
        let fits = |p: &[f64; 2]| {
            p.iter().all(|c| c.is_finite())
                && (!self.log_x || p[0] > 0.0)
                && (!self.log_y || p[1] > 0.0)
        };
        // a logarithmic axis is drawn in decades, with the exponent as its number
        let map = |p: &[f64; 2]| {
            (
                if self.log_x { p[0].log10() } else { p[0] },
                if self.log_y { p[1].log10() } else { p[1] },
            )
        };
        let curves: Vec<(&str, Vec<(f64, f64)>)> = self
            .curves
            .iter()
            .map(|c| {
                let points = c.points.iter().filter(|p| fits(p)).map(map).collect();
                (c.name.as_str(), points)
            })
            .collect();
        let all = || curves.iter().flat_map(|c| c.1.iter());
        if all().next().is_none() {
            return Err(Error::argument(format!(
                "plot '{}' has no point to draw",
                self.title
            )));
        }
        let range = |get: &dyn Fn(&(f64, f64)) -> f64| {
            let lo = all().map(get).fold(f64::INFINITY, f64::min);
            let hi = all().map(get).fold(f64::NEG_INFINITY, f64::max);
            let pad = (0.05 * (hi - lo)).max(1e-9 * hi.abs().max(lo.abs()).max(1e-9));
            lo - pad..hi + pad
        };
        let mut text = String::new();
        let fail = |e: &dyn std::fmt::Display| Error::io(format!("plot '{}': {e}", self.title));
        {
            let root = SVGBackend::with_string(&mut text, (800, 500)).into_drawing_area();
            root.fill(&WHITE).map_err(|e| fail(&e))?;
            let mut chart = ChartBuilder::on(&root)
                .caption(&self.title, ("sans-serif", 18))
                .margin(14)
                .x_label_area_size(44)
                .y_label_area_size(66)
                .build_cartesian_2d(range(&|p| p.0), range(&|p| p.1))
                .map_err(|e| fail(&e))?;
            let label = |log: bool, v: f64| {
                if log {
                    format!("{:.3e}", 10.0_f64.powf(v))
                } else {
                    format!("{v:.4}")
                }
            };
            chart
                .configure_mesh()
                .light_line_style(RGBColor(240, 240, 240))
                .x_desc(&self.x)
                .y_desc(&self.y)
                .x_label_formatter(&|v| label(self.log_x, *v))
                .y_label_formatter(&|v| label(self.log_y, *v))
                .draw()
                .map_err(|e| fail(&e))?;
            for (i, (name, points)) in curves.iter().enumerate() {
                let [r, g, b] = super::palette::panel(i as u32).map(|c| (c * 255.0) as u8);
                let ink = RGBColor(r, g, b);
                chart
                    .draw_series(LineSeries::new(points.iter().copied(), ink.stroke_width(2)))
                    .map_err(|e| fail(&e))?
                    .label(*name)
                    .legend(move |(x, y)| {
                        PathElement::new([(x, y), (x + 18, y)], ink.stroke_width(2))
                    });
                chart
                    .draw_series(points.iter().map(|&p| Circle::new(p, 3, ink.filled())))
                    .map_err(|e| fail(&e))?;
            }
            chart
                .configure_series_labels()
                .background_style(WHITE.mix(0.8))
                .draw()
                .map_err(|e| fail(&e))?;
            root.present().map_err(|e| fail(&e))?;
        }
        Ok(text)
    }

    /// Writes the SVG file.
    pub fn write(&self, path: &std::path::Path) -> Result<()> {
        std::fs::write(path, self.to_svg()?)
            .map_err(|e| Error::io(format!("{}: {e}", path.display())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_and_names_are_in_the_svg_and_an_empty_plot_is_refused() {
        let mut plot = Plot {
            title: "cost".into(),
            x: "vertices".into(),
            y: "time [s]".into(),
            log_x: true,
            log_y: true,
            curves: vec![Curve {
                name: "cholesky".into(),
                points: vec![[100.0, 0.1], [1000.0, 2.0], [0.0, 1.0]],
            }],
        };
        let svg = plot.to_svg().unwrap();
        assert!(svg.contains("cholesky") && svg.contains("time [s]"));
        assert_eq!(svg.matches("<circle").count(), 2, "0 has no logarithm");
        plot.curves[0].points.truncate(0);
        assert!(plot.to_svg().is_err());
    }
}
