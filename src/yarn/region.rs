//! A panel in the frame of its yarns: x across the cloth, y along the warp or the wales, and the
//! viewer in front of the outside.
//!
//! The outline is a polygon inscribed to the curves, turning by at most 1/64 of a half turn from side
//! to side and within 10 micrometres of the curve; its corners lie at equal steps of arc length, so that a
//! point of it has a fraction of its edge.

use super::layout::Cell;
use crate::error::Result;
use crate::math::{Mat2, Vec2};
use crate::pattern::Panel;
use std::f64::consts::PI;

/// Angle between neighbouring sides of the polygon [rad].
const TURN: f64 = PI / 64.0;
/// Distance of the polygon from the curve [m].
const SAGITTA: f64 = 1e-5;
/// Most sides of one edge.
const MOST: f64 = 1024.0;

/// A point of the outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rim {
    /// Edge number in the panel.
    pub edge: u32,
    /// Fraction of the edge's arc length.
    pub fraction: f64,
    /// Where, in the yarns' frame [m].
    pub point: Vec2,
}

struct Side {
    a: Vec2,
    b: Vec2,
    edge: u32,
    /// Fractions of the edge's arc length at the two ends.
    span: [f64; 2],
}

/// The panel's outline and holes in the yarns' frame.
pub(super) struct Region {
    /// Directions of the frame's axes in the panel.
    axes: [Vec2; 2],
    sides: Vec<Side>,
    low: Vec2,
    high: Vec2,
    /// Sides that reach into strips of equal height, strip after strip.
    strips: Vec<Vec<u32>>,
    strip: f64,
}

impl Region {
    pub(super) fn new(panel: &Panel) -> Result<Self> {
        let (sin, cos) = panel.grain.sin_cos();
        // seen from the outside an outline runs counter-clockwise: else the frame is turned over
        let side = if panel.signed_outline_area()? < 0.0 {
            -1.0
        } else {
            1.0
        };
        let axes = [Vec2::new(cos, sin) * side, Vec2::new(-sin, cos)];
        let mut sides = Vec::new();
        for (edge, segment) in panel.segments()?.iter().enumerate() {
            let turning = segment.turning();
            // a side of length l that turns by a stands off its arc by l a / 8
            let flat = (segment.length() * turning / (8.0 * SAGITTA)).sqrt();
            let count = (turning / TURN).max(flat).ceil().clamp(1.0, MOST);
            let fractions: Vec<f64> = (0..=count as usize).map(|k| k as f64 / count).collect();
            let points = segment.points_at(&fractions);
            for (p, f) in points.windows(2).zip(fractions.windows(2)) {
                let turn = |q: Vec2| Vec2::new(axes[0].dot(&q), axes[1].dot(&q));
                sides.push(Side {
                    a: turn(p[0]),
                    b: turn(p[1]),
                    edge: edge as u32,
                    span: [f[0], f[1]],
                });
            }
        }
        let (mut low, mut high) = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
        for side in &sides {
            low = low.inf(&side.a);
            high = high.sup(&side.a);
        }
        let count = sides.len().clamp(1, 4096);
        let strip = ((high.y - low.y) / count as f64).max(f64::MIN_POSITIVE);
        let mut region = Self {
            axes,
            sides,
            low,
            high,
            strips: vec![Vec::new(); count],
            strip,
        };
        for k in 0..region.sides.len() {
            let (a, b) = (region.sides[k].a.y, region.sides[k].b.y);
            for strip in region.strip_of(a.min(b))..=region.strip_of(a.max(b)) {
                region.strips[strip].push(k as u32);
            }
        }
        Ok(region)
    }

    fn strip_of(&self, y: f64) -> usize {
        // below the first strip the cast gives 0
        (((y - self.low.y) / self.strip) as usize).min(self.strips.len() - 1)
    }

    /// Lower and upper corner of the box around the outline [m].
    pub(super) fn bounds(&self) -> [Vec2; 2] {
        [self.low, self.high]
    }

    /// A point of the frame in the panel's coordinates.
    pub(super) fn to_panel(&self, p: Vec2) -> Vec2 {
        self.axes[0] * p.x + self.axes[1] * p.y
    }

    /// From a step on the panel to the one in the nominal layout of a fabric laid by a cell, as long as the yarn.
    pub(super) fn nominal(&self, cell: &Cell) -> Mat2 {
        let size = Vec2::new(cell.rest / cell.across, cell.rest / cell.along);
        Mat2::from_diagonal(&size) * Mat2::from_columns(&self.axes).transpose()
    }

    /// A point of the panel in the frame.
    pub(super) fn to_frame(&self, p: Vec2) -> Vec2 {
        Vec2::new(self.axes[0].dot(&p), self.axes[1].dot(&p))
    }

    /// Where the line `coordinate[axis] = value` crosses the outline, ascending: the even number of
    /// points between which it lies inside in turn.
    pub(super) fn line(&self, axis: usize, value: f64) -> Vec<Rim> {
        let other = 1 - axis;
        let mut cuts: Vec<Rim> = self
            .sides
            .iter()
            .filter(|s| (s.a[axis] > value) != (s.b[axis] > value))
            .map(|s| {
                let t = (value - s.a[axis]) / (s.b[axis] - s.a[axis]);
                let mut point = s.a + (s.b - s.a) * t;
                point[axis] = value;
                s.rim(t, point)
            })
            .collect();
        cuts.sort_by(|p, q| p.point[other].total_cmp(&q.point[other]));
        cuts
    }

    /// Whether a point lies inside the outline and outside the holes.
    pub(super) fn inside(&self, p: Vec2) -> bool {
        if !(p.y >= self.low.y && p.y <= self.high.y) {
            return false;
        }
        let mut odd = false;
        for k in &self.strips[self.strip_of(p.y)] {
            let Side { a, b, .. } = &self.sides[*k as usize];
            if (a.y > p.y) != (b.y > p.y) {
                let x = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                odd ^= x > p.x;
            }
        }
        odd
    }

    /// Where the straight way from `a` to `b` crosses the outline, with the fraction of the way, in
    /// order.
    pub(super) fn crossings(&self, a: Vec2, b: Vec2) -> Vec<(f64, Rim)> {
        let d = b - a;
        let mut found: Vec<(f64, Rim)> = Vec::new();
        let strips = self.strip_of(a.y.min(b.y))..=self.strip_of(a.y.max(b.y));
        let (left, right) = (a.x.min(b.x), a.x.max(b.x));
        let mut seen: Vec<u32> = Vec::new();
        for strip in strips {
            for k in &self.strips[strip] {
                let s = &self.sides[*k as usize];
                if s.a.x.max(s.b.x) < left || s.a.x.min(s.b.x) > right || seen.contains(k) {
                    continue;
                }
                let turn = |p: Vec2| d.x * (p.y - a.y) - d.y * (p.x - a.x);
                let (from, to) = (turn(s.a), turn(s.b));
                if (from > 0.0) == (to > 0.0) {
                    continue;
                }
                let t = from / (from - to);
                let point = s.a + (s.b - s.a) * t;
                let along = (point - a).dot(&d) / d.norm_squared();
                if (0.0..1.0).contains(&along) {
                    seen.push(*k);
                    found.push((along, s.rim(t, point)));
                }
            }
        }
        found.sort_by(|p, q| p.0.total_cmp(&q.0));
        found
    }

    /// The nearest point of the outline, and its distance [m].
    pub(super) fn nearest(&self, p: Vec2) -> Option<(f64, Rim)> {
        self.sides
            .iter()
            .map(|s| {
                let d = s.b - s.a;
                let t = ((p - s.a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
                let point = s.a + d * t;
                ((point - p).norm(), s.rim(t, point))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

impl Side {
    fn rim(&self, t: f64, point: Vec2) -> Rim {
        Rim {
            edge: self.edge,
            fraction: self.span[0] + (self.span[1] - self.span[0]) * t,
            point,
        }
    }
}
