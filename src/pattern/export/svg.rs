//! The flat pattern as SVG, true to scale: one user unit is one millimetre.
//!
//! Panels stand side by side, as seen in their planes with `v` up. Solid: the cutting line, the
//! seam allowance outside the sewing line. Dashed: the sewing line. Short strokes across the
//! allowance with the seam's number: both ends of every seam. Arrow: the warp.

use super::offset::outside;
use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::curve::{Curve, Segment};
use crate::pattern::outline::polylines;
use crate::pattern::{Garment, Panel};
use std::fmt::Write as _;

/// Space between panels and around the sheet [m].
const MARGIN: f64 = 0.03;
/// Length of notches where there is no allowance [m].
const NOTCH: f64 = 0.006;
/// Angle between points of the curves that the cutting line follows [rad].
const TURN: f64 = std::f64::consts::PI / 48.0;

/// Draws a garment with this seam allowance [m], 0 to 0.1; 0 draws no cutting line of its own.
pub fn to_svg(garment: &Garment, seam_allowance: f64) -> Result<String> {
    if !(0.0..=0.1).contains(&seam_allowance) {
        return Err(Error::argument(format!(
            "seam allowance {seam_allowance} m must be from 0 to 0.1 m"
        )));
    }
    garment.check_geometry()?;
    let mut body = String::new();
    let mut x = MARGIN;
    let mut height: f64 = 0.0;
    for (k, panel) in garment.panels.iter().enumerate() {
        let Some([low, high]) = panel.bounds()? else {
            continue;
        };
        // page coordinates [mm]: left edge of this panel at x, its top at the margin
        let origin = Vec2::new(x + seam_allowance - low.x, MARGIN + seam_allowance + high.y);
        let page = Page { origin };
        draw_panel(&mut body, garment, k, panel, &page, seam_allowance)
            .map_err(|e| e.at(format!("panel '{}'", panel.name)))?;
        x += high.x - low.x + 2.0 * seam_allowance + MARGIN;
        height = height.max(high.y - low.y);
    }
    let (width, height) = (
        1e3 * x,
        1e3 * (height + 2.0 * seam_allowance + 2.0 * MARGIN),
    );
    let mut svg = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.3}mm\" height=\"{height:.3}mm\" viewBox=\"0 0 {width:.3} {height:.3}\">"
    );
    let _ = writeln!(svg, "<title>{}</title>", escape(&garment.name));
    svg.push_str(
        "<style>path{fill:none;stroke:#000;stroke-width:0.5} .sew{stroke-dasharray:4 2;stroke:#555} \
         .notch,.grain{stroke:#000} text{font:5px sans-serif} .name{font-size:9px;text-anchor:middle}</style>\n",
    );
    svg.push_str(&body);
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// From panel coordinates [m] to the page [mm], y down.
struct Page {
    origin: Vec2,
}

impl Page {
    fn at(&self, p: Vec2) -> String {
        format!(
            "{:.3} {:.3}",
            1e3 * (p.x + self.origin.x),
            1e3 * (self.origin.y - p.y)
        )
    }

    fn xy(&self, p: Vec2) -> String {
        format!(
            "x=\"{:.3}\" y=\"{:.3}\"",
            1e3 * (p.x + self.origin.x),
            1e3 * (self.origin.y - p.y)
        )
    }
}

fn draw_panel(
    out: &mut String,
    garment: &Garment,
    index: usize,
    panel: &Panel,
    page: &Page,
    allowance: f64,
) -> Result<()> {
    let segments = panel.segments()?;
    let loops = panel.loops();
    let _ = writeln!(out, "<g id=\"panel{index}\">");
    if allowance > 0.0 {
        let pieces = polylines(&segments, &loops, TURN);
        for line in outside(&pieces, allowance)? {
            let points: Vec<String> = line.iter().map(|p| page.at(*p)).collect();
            let _ = writeln!(out, "<path class=\"cut\" d=\"M{}\"/>", points.join("L"));
        }
    }
    let mut path = String::new();
    for range in &loops {
        for (k, segment) in segments[range.clone()].iter().enumerate() {
            if k == 0 {
                let _ = write!(path, "M{}", page.at(segment.start));
            }
            path.push_str(&command(segment, page));
        }
        path.push('Z');
    }
    let _ = writeln!(out, "<path class=\"sew\" d=\"{path}\"/>");
    for (number, seam) in garment.seams.iter().enumerate() {
        for side in [seam.a, seam.b] {
            if side.panel as usize == index {
                notches(
                    out,
                    panel,
                    &segments,
                    side.edge as usize,
                    number,
                    page,
                    allowance,
                )?;
            }
        }
    }
    let center = label_place(panel, &segments);
    let _ = writeln!(
        out,
        "<text class=\"name\" {}>{}</text>",
        page.xy(center),
        escape(&panel.name)
    );
    grain_arrow(out, panel, &segments, center, page);
    out.push_str("</g>\n");
    Ok(())
}

/// The SVG path command from the segment's start to its end.
fn command(segment: &Segment, page: &Page) -> String {
    let end = page.at(segment.end);
    match segment.curve {
        Curve::Line => format!("L{end}"),
        Curve::Quadratic(c) => format!("Q{} {end}", page.at(c)),
        Curve::Cubic(c, d) => format!("C{} {} {end}", page.at(c), page.at(d)),
        Curve::Arc { large, right, .. } => {
            let radius = 1e3 * segment.circle().map_or(0.0, |c| c.radius);
            // bulging right is counter-clockwise with v up: against SVG's positive sweep
            format!(
                "A{radius:.3} {radius:.3} 0 {} {} {end}",
                u8::from(large),
                u8::from(!right)
            )
        }
    }
}

/// Strokes across the allowance at both ends of a sewn edge, and the seam's number.
fn notches(
    out: &mut String,
    panel: &Panel,
    segments: &[Segment],
    edge: usize,
    number: usize,
    page: &Page,
    allowance: f64,
) -> Result<()> {
    let Some(segment) = segments.get(edge) else {
        return Ok(());
    };
    let hole = edge >= panel.outline.len();
    let range = panel
        .loops()
        .into_iter()
        .find(|r| r.contains(&edge))
        .unwrap_or(0..segments.len());
    let area: f64 = segments[range].iter().map(Segment::area_term).sum();
    let side = if (area > 0.0) != hole { 1.0 } else { -1.0 };
    let length = if allowance > 0.0 { allowance } else { NOTCH };
    // a little inside the edge, so that two seams meeting in a corner stay apart
    let inset = (0.1 * segment.length()).min(0.005) / segment.length();
    for fraction in [inset, 1.0 - inset] {
        let t = segment.parameters_at(&[fraction])[0];
        let (p, d) = (segment.point(t), segment.derivative(t));
        let outward = side * Vec2::new(d.y, -d.x) / d.norm().max(f64::MIN_POSITIVE);
        let _ = writeln!(
            out,
            "<path class=\"notch\" d=\"M{}L{}\"/>",
            page.at(p),
            page.at(p + length * outward)
        );
        if fraction < 0.5 {
            let _ = writeln!(
                out,
                "<text {}>{number}</text>",
                page.xy(p - 0.006 * outward)
            );
        }
    }
    Ok(())
}

/// Centroid of the outline's corners, good enough for a label.
fn label_place(panel: &Panel, segments: &[Segment]) -> Vec2 {
    let outline = &segments[..panel.outline.len()];
    let sum: Vec2 = outline.iter().map(|s| s.start).sum();
    sum / outline.len().max(1) as f64
}

fn grain_arrow(out: &mut String, panel: &Panel, segments: &[Segment], center: Vec2, page: &Page) {
    let size = segments
        .iter()
        .map(Segment::bounds)
        .reduce(|[a, b], [c, d]| [a.inf(&c), b.sup(&d)])
        .map_or(0.0, |[a, b]| (b - a).min());
    let (sin, cos) = panel.grain.sin_cos();
    let warp = Vec2::new(-sin, cos);
    let across = Vec2::new(cos, sin);
    let half = 0.2 * size;
    let foot = center - 0.012 * warp;
    let (from, to) = (foot - half * warp, foot);
    let head = 0.1 * size.min(0.1);
    let _ = writeln!(
        out,
        "<path class=\"grain\" d=\"M{}L{}M{}L{}L{}\"/>",
        page.at(from),
        page.at(to),
        page.at(to - head * warp + 0.5 * head * across),
        page.at(to),
        page.at(to - head * warp - 0.5 * head * across)
    );
}

/// Text for XML; control characters become spaces.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
