//! A report as JSON, as a table of comma-separated values, and as a page with a plot.

use super::{Report, Row};
use serde_json::{Value, json};
use std::fmt::Write;

/// Columns of the table.
const COLUMNS: &str = "name,kind,outcome,reason,vertices,yarn_nodes,unknowns,bytes,newton_iterations,\
                       residual_N,seconds,error_m,height,correlation,reference,front";

/// Size of the plot and its margin [pixels].
const PLOT: [f64; 3] = [720.0, 400.0, 60.0];

impl Report {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|r| {
                json!({
                    "name": r.name,
                    "kind": r.kind.name(),
                    "outcome": r.outcome.map(|o| o.name()),
                    "reason": r.reason,
                    "vertices": r.vertices,
                    "yarn_nodes": r.yarn_nodes,
                    "unknowns": r.unknowns,
                    "bytes": r.bytes,
                    "newton_iterations": r.newton_iterations,
                    "residual": r.residual,
                    "seconds": r.seconds,
                    "error": r.deviation.map(|d| d.error),
                    "height": r.deviation.map(|d| d.height),
                    "correlation": r.deviation.map(|d| d.correlation),
                    "reference": r.reference,
                    "front": r.front,
                })
            })
            .collect();
        json!({ "name": self.name, "points": self.points, "models": rows })
    }

    /// As a table; text in quotes, nothing where there is no number.
    pub fn to_csv(&self) -> String {
        let mut text = format!("{COLUMNS}\n");
        for r in &self.rows {
            let quoted = |s: &str| format!("\"{}\"", s.replace('"', "\"\""));
            let d = |f: fn(&super::Deviation) -> f64| {
                r.deviation
                    .as_ref()
                    .map_or(String::new(), |d| format!("{:e}", f(d)))
            };
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{},{},{},{:e},{},{},{},{},{},{}",
                quoted(&r.name),
                r.kind.name(),
                r.outcome.map_or("", |o| o.name()),
                quoted(&r.reason),
                r.vertices,
                r.yarn_nodes,
                r.unknowns,
                r.bytes,
                r.newton_iterations,
                r.residual,
                r.seconds,
                d(|d| d.error),
                d(|d| d.height),
                d(|d| d.correlation),
                r.reference,
                r.front
            );
        }
        text
    }

    /// As a page that stands alone.
    pub fn to_html(&self) -> String {
        let mut rows = String::new();
        for r in &self.rows {
            let number = |v: Option<f64>, factor: f64| {
                v.map_or("-".into(), |v| format!("{:.4}", factor * v))
            };
            let state = match (r.reference, r.reason.is_empty()) {
                (true, _) => "reference".into(),
                (_, true) if r.front => "front".into(),
                (_, true) => String::new(),
                _ => escaped(&r.reason),
            };
            let _ = writeln!(
                rows,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.1}</td><td>{}</td><td>{:.2}</td>\
                 <td>{}</td><td>{}</td><td>{}</td><td>{state}</td></tr>",
                escaped(&r.name),
                r.yarn_nodes,
                r.unknowns,
                r.bytes as f64 / 1048576.0,
                r.newton_iterations,
                r.seconds,
                number(r.deviation.map(|d| d.error), 1e3),
                number(r.deviation.map(|d| d.height), 1.0),
                number(r.deviation.map(|d| d.correlation), 1.0),
            );
        }
        format!(
            "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>{0}</title>\n\
             <style>body{{font:15px sans-serif;margin:2em}}td,th{{padding:.2em .8em;text-align:right}}\
             td:first-child,td:last-child{{text-align:left}}</style>\n\
             <h1>{0}</h1>\n<p>Drapes by several models, compared at {1} places of yarns in the scene's \
             regions. What did not come to rest is not compared.</p>\n{2}\n<table><tr><th>model</th>\
             <th>yarn nodes</th><th>unknowns</th><th>MiB</th><th>Newton</th><th>seconds</th>\
             <th>error [mm]</th><th>height</th><th>correlation</th><th></th></tr>\n{rows}</table></html>\n",
            escaped(&self.name),
            self.points,
            self.plot()
        )
    }

    /// Error over time of what is compared, both in decades; those on the front are filled.
    fn plot(&self) -> String {
        let dots: Vec<(&Row, [f64; 2])> = self
            .rows
            .iter()
            .filter_map(|r| {
                let error = r.deviation?.error;
                let fits = error > 0.0 && r.seconds > 0.0;
                fits.then(|| (r, [r.seconds.log10(), (1e3 * error).log10()]))
            })
            .collect();
        if dots.is_empty() {
            return "<p>No two models to compare.</p>".into();
        }
        let [width, height, margin] = PLOT;
        let range = |k: usize| {
            let low = dots
                .iter()
                .map(|d| d.1[k])
                .fold(f64::INFINITY, f64::min)
                .floor();
            let high = dots
                .iter()
                .map(|d| d.1[k])
                .fold(f64::NEG_INFINITY, f64::max)
                .ceil();
            (low, high.max(low + 1.0))
        };
        let (x, y) = (range(0), range(1));
        let at = |p: [f64; 2]| {
            [
                margin + (p[0] - x.0) / (x.1 - x.0) * (width - 2.0 * margin),
                height - margin - (p[1] - y.0) / (y.1 - y.0) * (height - 2.0 * margin),
            ]
        };
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             font-size=\"12\"><text x=\"{}\" y=\"{}\">seconds</text>\
             <text x=\"5\" y=\"20\">error [mm]</text>",
            width - margin,
            height - 10.0
        );
        let mut line = |a: [f64; 2], b: [f64; 2], label: String| {
            let _ = write!(
                svg,
                "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"#ccc\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\">{label}</text>",
                a[0],
                a[1],
                b[0],
                b[1],
                a[0] - 25.0,
                a[1] + 14.0
            );
        };
        for decade in x.0 as i32..=x.1 as i32 {
            let v = f64::from(decade);
            line(at([v, y.0]), at([v, y.1]), format!("1e{decade}"));
        }
        for decade in y.0 as i32..=y.1 as i32 {
            let v = f64::from(decade);
            line(at([x.0, v]), at([x.1, v]), format!("1e{decade}"));
        }
        for (row, place) in dots {
            let [px, py] = at(place);
            let fill = if row.front { "#06c" } else { "none" };
            let _ = write!(
                svg,
                "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"5\" fill=\"{fill}\" stroke=\"#06c\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                px + 8.0,
                py + 4.0,
                escaped(&row.name)
            );
        }
        svg + "</svg>"
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
