//! The yarns on their flat panels as SVG, true to scale: one user unit is one millimetre.
//!
//! Panels stand side by side, seen from the outside of the cloth. Yarns are drawn at a third of their
//! width, so that loops can be told apart; where two cross, the hind one is interrupted. Dots are nodes of
//! one yarn: ends, selvedges, rods of seams. Courses change colour at every turn.

use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::Garment;
use crate::yarn::{Family, YarnMesh};
use std::fmt::Write as _;

/// Most passages that are drawn: beyond, no viewer shows the file.
const MOST: usize = 400_000;
/// Space between panels and around the sheet [m].
const MARGIN: f64 = 0.005;
const COURSES: [&str; 6] = [
    "#d95f02", "#1f6fb2", "#2a9d4a", "#9c3fb5", "#b08a00", "#0b7d7d",
];

/// Draws laid yarns.
pub fn flat_yarns_svg(garment: &Garment, mesh: &YarnMesh) -> Result<String> {
    mesh.check_on(garment)?;
    if mesh.incidences.len() > MOST {
        return Err(Error::limit(format!(
            "{} passages of yarns to draw, limit {MOST}",
            mesh.incidences.len()
        )));
    }
    let sheet = Sheet::new(garment, mesh)?;
    let mut strokes: Vec<(usize, String)> = Vec::with_capacity(mesh.incidences.len());
    let mut dots = String::new();
    for y in 0..mesh.yarn_count() {
        let fabric = &garment.fabrics[mesh.yarn_fabric[y] as usize];
        let width = fabric
            .yarns
            .as_ref()
            .map_or(0.0, |yarns| 0.67e3 * yarns.radius);
        let yarn = mesh.yarn(y);
        let at = |k: usize| sheet.place(mesh, yarn[k].node as usize);
        let mut single = 0;
        for (k, incidence) in yarn.iter().enumerate() {
            let stack = mesh.stack(incidence.node as usize);
            let own = mesh.starts[y] + k as u32;
            let rank = stack.iter().position(|s| s.incidence == own).unwrap_or(0);
            let here = at(k);
            if stack.len() == 1 {
                single += 1;
                let _ = writeln!(
                    dots,
                    "<circle cx=\"{:.3}\" cy=\"{:.3}\" r=\"{:.3}\"/>",
                    here.x,
                    here.y,
                    0.35 * width
                );
            }
            let before = k.checked_sub(1).map_or(here, |k| 0.5 * (at(k) + here));
            let after = if k + 1 < yarn.len() {
                0.5 * (at(k + 1) + here)
            } else {
                here
            };
            let colour = match mesh.yarn_family[y] {
                Family::Warp => COURSES[0],
                Family::Weft => COURSES[1],
                Family::Seam => "#000",
                Family::Course => COURSES[(y + single / 2) % COURSES.len()],
            };
            let way = [before, here, after].map(|p| format!("{:.3} {:.3}", p.x, p.y));
            let path = format!("M{}L{}L{}", way[0], way[1], way[2]);
            let mut stroke = String::new();
            // what lies behind is interrupted beside it
            if rank > 0 {
                let gap = 1.5 * width;
                let _ = writeln!(
                    stroke,
                    "<path d=\"{path}\" stroke=\"#fff\" stroke-width=\"{gap:.3}\"/>"
                );
            }
            let _ = writeln!(
                stroke,
                "<path d=\"{path}\" stroke=\"{colour}\" stroke-width=\"{width:.3}\"/>"
            );
            strokes.push((rank, stroke));
        }
    }
    strokes.sort_by_key(|(rank, _)| *rank);
    let mut svg = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let [width, height] = sheet.size;
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.3}mm\" height=\"{height:.3}mm\" viewBox=\"0 0 {width:.3} {height:.3}\">"
    );
    svg.push_str("<style>path{fill:none;stroke-linejoin:round}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
    svg.extend(strokes.into_iter().map(|(_, stroke)| stroke));
    svg.push_str(&dots);
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// Where the panels stand on the sheet.
struct Sheet {
    /// Side from which each panel is seen (1 or -1), and the sheet's place of its origin [m].
    panels: Vec<(f64, Vec2)>,
    /// Width and height [mm].
    size: [f64; 2],
}

impl Sheet {
    fn new(garment: &Garment, mesh: &YarnMesh) -> Result<Self> {
        let mut drawn = vec![false; garment.panels.len()];
        for panel in &mesh.node_panel {
            drawn[*panel as usize] = true;
        }
        let mut panels = Vec::with_capacity(garment.panels.len());
        let (mut x, mut height) = (MARGIN, 0.0_f64);
        for (panel, drawn) in garment.panels.iter().zip(drawn) {
            let side = if panel.signed_outline_area()? < 0.0 {
                -1.0
            } else {
                1.0
            };
            let (true, Some([low, high])) = (drawn, panel.bounds()?) else {
                panels.push((side, Vec2::zeros()));
                continue;
            };
            let left = if side > 0.0 { low.x } else { -high.x };
            panels.push((side, Vec2::new(x - left, MARGIN + high.y)));
            x += high.x - low.x + MARGIN;
            height = height.max(high.y - low.y);
        }
        Ok(Self {
            panels,
            size: [1e3 * x, 1e3 * (height + 2.0 * MARGIN)],
        })
    }

    /// A node on the sheet [mm], y down.
    fn place(&self, mesh: &YarnMesh, node: usize) -> Vec2 {
        let (side, origin) = self.panels[mesh.node_panel[node] as usize];
        let uv = mesh.uv[node];
        Vec2::new(origin.x + side * uv.x, origin.y - uv.y) * 1e3
    }
}
