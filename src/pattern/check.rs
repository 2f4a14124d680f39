//! Refuses garments that cannot be, naming panel, edge or seam, the limit and the value.
//!
//! Limits: coordinates within 1e4 m, edges longer than 1e-5 m, areas above 1e-8 m^2, outlines that
//! stay 1e-8 m clear of themselves (curves sampled every 1/16 of a half turn).

use super::curve::Curve;
use super::outline::{Piece, first_contact, inside, polylines};
use super::{BlendRegion, Garment, Panel, Seam, Shape, check_rings};
use crate::error::{Error, Result};
use crate::math::Vec2;
use std::collections::BTreeMap;

/// Largest size of a coordinate [m].
pub const MAX_COORDINATE: f64 = 1e4;
/// Largest radius of an arc [m].
pub const MAX_RADIUS: f64 = 1e6;
/// Shortest edge [m].
pub const MIN_EDGE: f64 = 1e-5;
/// Smallest panel or hole [m^2].
pub const MIN_AREA: f64 = 1e-8;
/// Most edges of one panel.
pub const MAX_EDGES: usize = 20_000;
/// Vertex limit for hosts that name none.
pub const DEFAULT_MAX_VERTICES: usize = 2_000_000;
/// Angle between sampled points of a curve [rad].
const TURN: f64 = std::f64::consts::PI / 16.0;

impl Garment {
    /// [`Garment::check_within`] of [`DEFAULT_MAX_VERTICES`].
    pub fn check(&self) -> Result<()> {
        self.check_within(DEFAULT_MAX_VERTICES)
    }

    /// [`Garment::check_geometry`], [`Garment::check_yarns`], and that the estimated vertex count of the triangulation is at
    /// most `max_vertices`.
    pub fn check_within(&self, max_vertices: usize) -> Result<()> {
        self.check_geometry()?;
        self.check_yarns()?;
        self.check_vertices(1.0, max_vertices)
    }

    /// Refuses blend regions of panels whose fabric has no yarns. A garment on its way may get its fabrics after its regions, so
    /// that this is asked of whole ones only.
    pub fn check_yarns(&self) -> Result<()> {
        for (k, region) in self.blend_regions.iter().enumerate() {
            let panel = &self.panels[region.panel as usize];
            let fabric = &self.fabrics[panel.fabric];
            if fabric.yarns.is_none() {
                return Err(Error::argument(format!(
                    "blend_regions[{k}]: panel '{}' has fabric '{}', which has no yarns",
                    panel.name, fabric.name
                )));
            }
        }
        Ok(())
    }

    /// Checks the estimated vertex count alone, with target lengths times `scale`. An error names the
    /// panel that asks for most.
    pub fn check_vertices(&self, scale: f64, max_vertices: usize) -> Result<()> {
        let mut estimate = 0.0;
        let mut most: Option<(f64, &Panel)> = None;
        for panel in &self.panels {
            let count = panel.estimated_vertices(scale * self.panel_edge_length(panel))?;
            estimate += count;
            if !most.is_some_and(|m| m.0 >= count) {
                most = Some((count, panel));
            }
        }
        let Some((count, panel)) = most.filter(|_| !(estimate <= max_vertices as f64)) else {
            return Ok(());
        };
        let whose = if panel.edge_length.is_some() {
            "its own"
        } else {
            "the garment's"
        };
        Err(Error::limit(format!(
            "{}: about {estimate:.3e} vertices, limit {max_vertices}; panel '{}' asks for about \
             {count:.3e} with {whose} edge length of {} m",
            self.title(),
            panel.name,
            scale * self.panel_edge_length(panel)
        )))
    }

    /// The first of [`Garment::problems`].
    pub fn check_geometry(&self) -> Result<()> {
        self.problems().into_iter().next().map_or(Ok(()), Err)
    }

    /// Everything in panels, seams, fabrics and blend regions that is impossible or inconsistent.
    pub fn problems(&self) -> Vec<Error> {
        if self.panels.is_empty() {
            let text = format!("{} has no panels", self.title());
            return vec![Error::geometry(text)];
        }
        if self.fabrics.is_empty() {
            let text = format!("{} has no fabrics", self.title());
            return vec![Error::material(text)];
        }
        let mut problems = Vec::new();
        let mut keep = |result: Result<()>| problems.extend(result.err());
        let mut names = BTreeMap::new();
        for (k, fabric) in self.fabrics.iter().enumerate() {
            keep(fabric.check());
            keep(match names.insert(fabric.name.as_str(), k) {
                None => Ok(()),
                Some(first) => Err(Error::material(format!(
                    "fabrics {first} and {k} are both named '{}'",
                    fabric.name
                ))),
            });
        }
        keep(check_edge_length(&self.title(), self.edge_length));
        let mut names = BTreeMap::new();
        for (k, panel) in self.panels.iter().enumerate() {
            keep(match names.insert(panel.name.as_str(), k) {
                None => Ok(()),
                Some(first) => Err(Error::geometry(format!(
                    "panels {first} and {k} are both named '{}'",
                    panel.name
                ))),
            });
        }
        let mut used = BTreeMap::new();
        for (k, seam) in self.seams.iter().enumerate() {
            keep(self.check_seam(k, seam, &mut used));
        }
        for (k, panel) in self.panels.iter().enumerate() {
            let checked = check_panel_numbers(panel, self.fabrics.len())
                .and_then(|()| check_panel_shape(panel, &self.darts_of(k)));
            keep(checked.map_err(|e| e.at(format!("panel '{}'", panel.name))));
        }
        for (k, region) in self.blend_regions.iter().enumerate() {
            keep(self.check_blend_region(k, region));
        }
        problems
    }

    /// `seam of each edge` for seams between two edges of this panel.
    fn darts_of(&self, panel: usize) -> BTreeMap<usize, usize> {
        let mut darts = BTreeMap::new();
        for (k, seam) in self.seams.iter().enumerate() {
            if seam.a.panel as usize == panel && seam.b.panel as usize == panel {
                darts.insert(seam.a.edge as usize, k);
                darts.insert(seam.b.edge as usize, k);
            }
        }
        darts
    }

    /// `used` holds the edges of the seams before this one.
    fn check_seam(
        &self,
        k: usize,
        seam: &Seam,
        used: &mut BTreeMap<(u32, u32), usize>,
    ) -> Result<()> {
        for (side, edge) in [("a", seam.a), ("b", seam.b)] {
            let Some(panel) = self.panels.get(edge.panel as usize) else {
                return Err(Error::geometry(format!(
                    "seam {k} side {side}: panel {} of {}",
                    edge.panel,
                    self.panels.len()
                )));
            };
            let count = panel.edge_count();
            if edge.edge as usize >= count {
                return Err(Error::geometry(format!(
                    "seam {k} side {side}: edge {} of panel '{}', which has {count}",
                    edge.edge, panel.name
                )));
            }
            if side == "b" && seam.a == seam.b {
                return Err(Error::geometry(format!(
                    "seam {k} joins edge {} of panel '{}' to itself",
                    edge.edge, panel.name
                )));
            }
            if let Some(first) = used.insert((edge.panel, edge.edge), k) {
                return Err(Error::geometry(format!(
                    "edge {} of panel '{}' is used by seams {first} and {k}",
                    edge.edge, panel.name
                )));
            }
        }
        if !seam.rest_angle.is_finite() || seam.rest_angle.abs() > std::f64::consts::PI {
            return Err(Error::geometry(format!(
                "seam {k}: rest angle {} rad must lie within a half turn",
                seam.rest_angle
            )));
        }
        Ok(())
    }

    fn check_blend_region(&self, k: usize, region: &BlendRegion) -> Result<()> {
        if region.panel as usize >= self.panels.len() {
            return Err(Error::geometry(format!(
                "blend_regions[{k}]: panel {} of {}",
                region.panel,
                self.panels.len()
            )));
        }
        let name = &self.panels[region.panel as usize].name;
        let place = |e: Error| e.at(format!("blend_regions[{k}] of panel '{name}'"));
        check_rings(region.rings).map_err(place)?;
        match &region.shape {
            Shape::Polygon(corners) => {
                if corners.len() < 3 {
                    return Err(Error::geometry(format!(
                        "blend_regions[{k}]: {} corners, at least 3 needed",
                        corners.len()
                    )));
                }
                for (corner, p) in corners.iter().enumerate() {
                    check_point(p)
                        .map_err(|e| e.at(format!("blend_regions[{k}] corner {corner}")))?;
                }
                Ok(())
            }
            Shape::Disc { center, radius } => check_point(center)
                .and_then(|()| check_reach("radius", *radius))
                .map_err(place),
            Shape::Edge { edge, width } => {
                let panel = &self.panels[region.panel as usize];
                if *edge as usize >= panel.edge_count() {
                    return Err(Error::geometry(format!(
                        "blend_regions[{k}]: edge {edge} of {} of panel '{}'",
                        panel.edge_count(),
                        panel.name
                    )));
                }
                check_reach("width", *width).map_err(place)
            }
        }
    }
}

fn check_edge_length(place: &str, h: f64) -> Result<()> {
    if !h.is_finite() || h <= 0.0 {
        return Err(Error::geometry(format!(
            "{place}: edge length {h} m must be finite and positive"
        )));
    }
    Ok(())
}

fn check_reach(what: &str, reach: f64) -> Result<()> {
    if !(reach > 0.0 && reach <= MAX_COORDINATE) {
        return Err(Error::geometry(format!(
            "{what} {reach} m must be positive and within {MAX_COORDINATE} m"
        )));
    }
    Ok(())
}

fn check_point(p: &Vec2) -> Result<()> {
    for x in p.iter() {
        if !x.is_finite() || x.abs() > MAX_COORDINATE {
            return Err(Error::geometry(format!(
                "coordinate {x} m must be finite and within {MAX_COORDINATE} m"
            )));
        }
    }
    Ok(())
}

/// Numbers, indices and closed loops of one panel.
fn check_panel_numbers(panel: &Panel, fabrics: usize) -> Result<()> {
    if panel.fabric >= fabrics {
        return Err(Error::geometry(format!(
            "fabric {} of {fabrics}",
            panel.fabric
        )));
    }
    if let Some(h) = panel.edge_length {
        check_edge_length("own", h)?;
    }
    if !panel.grain.is_finite() {
        return Err(Error::geometry(format!(
            "grain {} rad is not finite",
            panel.grain
        )));
    }
    for (k, x) in panel.placement.translation.iter().enumerate() {
        if !x.is_finite() || x.abs() > MAX_COORDINATE {
            return Err(Error::geometry(format!(
                "translation[{k}] = {x} m must be finite and within {MAX_COORDINATE} m"
            )));
        }
    }
    let norm = panel.placement.rotation.quaternion().norm();
    if !((norm - 1.0).abs() < 1e-6) {
        return Err(Error::geometry(format!(
            "rotation quaternion of length {norm} must be of length 1"
        )));
    }
    for (k, p) in panel.vertices.iter().enumerate() {
        check_point(p).map_err(|e| e.at(format!("vertex {k}")))?;
    }
    let count = panel.edge_count();
    if count > MAX_EDGES {
        return Err(Error::limit(format!("{count} edges, limit {MAX_EDGES}")));
    }
    let corners = panel.vertices.len();
    let edges: Vec<_> = panel.edges().collect();
    for (ring, range) in panel.loops().into_iter().enumerate() {
        let place = ring_name(ring);
        if range.is_empty() {
            return Err(Error::geometry(format!("{place} has no edges")));
        }
        for k in range.clone() {
            let edge = edges[k];
            for corner in [edge.start, edge.end] {
                if corner as usize >= corners {
                    return Err(Error::geometry(format!(
                        "edge {k}: corner {corner} of {corners}"
                    )));
                }
            }
            let next = if k + 1 == range.end {
                range.start
            } else {
                k + 1
            };
            if edge.end != edges[next].start {
                return Err(Error::geometry(format!(
                    "{place} is open: edge {k} ends in corner {}, edge {next} starts in corner {}",
                    edge.end, edges[next].start
                )));
            }
        }
    }
    for (k, segment) in panel.segments()?.iter().enumerate() {
        check_curve(segment).map_err(|e| e.at(format!("edge {k}")))?;
    }
    Ok(())
}

fn check_curve(segment: &super::curve::Segment) -> Result<()> {
    let chord = (segment.end - segment.start).norm();
    match segment.curve {
        Curve::Line => {}
        Curve::Quadratic(c) => check_point(&c)?,
        Curve::Cubic(c, d) => {
            check_point(&c)?;
            check_point(&d)?;
        }
        Curve::Arc { radius, .. } => {
            if !radius.is_finite() || radius <= 0.0 || radius > MAX_RADIUS {
                return Err(Error::geometry(format!(
                    "arc radius {radius} m must be positive and at most {MAX_RADIUS} m"
                )));
            }
            // files print semicircles with rounded radii
            if radius < 0.5 * chord * (1.0 - 1e-6) {
                return Err(Error::geometry(format!(
                    "arc radius {radius} m is smaller than half the chord, {} m",
                    0.5 * chord
                )));
            }
            if chord < MIN_EDGE {
                return Err(Error::geometry(format!(
                    "arc between ends {chord} m apart, at least {MIN_EDGE} m needed: draw a full circle as two arcs"
                )));
            }
        }
    }
    let length = segment.length();
    if !(length >= MIN_EDGE) {
        return Err(Error::geometry(format!(
            "length {length} m, at least {MIN_EDGE} m needed"
        )));
    }
    Ok(())
}

fn ring_name(ring: usize) -> String {
    match ring {
        0 => "outline".into(),
        ring => format!("hole {}", ring - 1),
    }
}

/// Areas, crossings and nesting of one panel whose numbers are good.
fn check_panel_shape(panel: &Panel, darts: &BTreeMap<usize, usize>) -> Result<()> {
    let segments = panel.segments()?;
    let loops = panel.loops();
    for (ring, range) in loops.iter().enumerate() {
        let area: f64 = segments[range.clone()].iter().map(|s| s.area_term()).sum();
        if !(area.abs() >= MIN_AREA) {
            return Err(Error::geometry(format!(
                "{} has area {:e} m^2, at least {MIN_AREA:e} m^2 needed",
                ring_name(ring),
                area.abs()
            )));
        }
    }
    let pieces = polylines(&segments, &loops, TURN);
    if let Some((p, q)) = first_contact(&pieces)? {
        return Err(Error::geometry(contact_text(&p, &q, darts)));
    }
    // nothing crosses: one point of a hole tells where all of it lies
    for ring in 1..loops.len() {
        let point = segments[loops[ring].start].start;
        if !inside(point, &pieces, 0) {
            return Err(Error::geometry(format!(
                "{} lies outside the outline, at ({}, {}) m",
                ring_name(ring),
                point.x,
                point.y
            )));
        }
        if let Some(other) = (1..loops.len()).find(|o| *o != ring && inside(point, &pieces, *o)) {
            return Err(Error::geometry(format!(
                "{} lies inside {}",
                ring_name(ring),
                ring_name(other)
            )));
        }
    }
    Ok(())
}

fn contact_text(p: &Piece, q: &Piece, darts: &BTreeMap<usize, usize>) -> String {
    let near = 0.25 * (p.a + p.b + q.a + q.b);
    let place = format!("near ({:.6}, {:.6}) m", near.x, near.y);
    match (darts.get(&p.edge), darts.get(&q.edge)) {
        (Some(s), Some(t)) if s != t => {
            format!(
                "darts of seams {s} and {t} overlap: edges {} and {} cross or touch {place}",
                p.edge, q.edge
            )
        }
        _ if p.ring != q.ring => format!(
            "{} and {} cross or touch: edges {} and {} {place}",
            ring_name(p.ring),
            ring_name(q.ring),
            p.edge,
            q.edge
        ),
        _ if p.edge == q.edge => {
            format!(
                "{} edge {} crosses or touches itself {place}",
                ring_name(p.ring),
                p.edge
            )
        }
        _ => format!(
            "{} edges {} and {} cross or touch {place}",
            ring_name(p.ring),
            p.edge,
            q.edge
        ),
    }
}
