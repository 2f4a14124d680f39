//! Perspective cameras, one for each view, fitted to the garment and the bounded bodies near it.
//!
//! A camera at `eye` with axes `right`, `up`, `forward` maps `x` to
//! `(cx + f (x . right) / w, cy - f (x . up) / w)` with `w = x . forward` relative to the eye. The
//! views share one scale: columns get widths in proportion to what they show.

use super::super::Part;
use super::backdrop::is_backdrop;
use crate::math::Vec3;

/// Half of the vertical field of view as a tangent: a long lens, so that proportions stay true.
const TAN_HALF: f64 = 0.16;
/// How much of a body is shown around the garment, in garment sizes.
const AROUND: f64 = 0.42;

/// What is to be seen, in axes (side, up, front).
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) side: Vec3,
    pub(crate) up: Vec3,
    pub(crate) front: Vec3,
    /// Middle of what is shown [m].
    pub(crate) centre: Vec3,
    /// Half extents along (side, up, front) [m].
    pub(crate) half: [f64; 3],
    /// Lowest point of everything that has an end, along `up` [m].
    pub(crate) lowest: f64,
    /// Highest point of the same along `up` [m].
    pub(crate) highest: f64,
    /// Bounding sphere of everything: middle, radius [m].
    pub(crate) ball: (Vec3, f64),
}

impl Frame {
    pub(crate) fn of(parts: &[Part], up: &Vec3, front: &Vec3) -> Self {
        let side = up.cross(front);
        let axes = [side, *up, *front];
        let extent = |cloth_only: bool| {
            let mut lo = [f64::INFINITY; 3];
            let mut hi = [f64::NEG_INFINITY; 3];
            let counts = |p: &&Part| p.cloth || !(cloth_only || is_backdrop(p));
            for part in parts.iter().filter(counts) {
                for x in &part.positions {
                    for k in 0..3 {
                        let c = x.dot(&axes[k]);
                        lo[k] = lo[k].min(c);
                        hi[k] = hi[k].max(c);
                    }
                }
            }
            (lo[0] <= hi[0]).then_some((lo, hi))
        };
        let all = extent(false).unwrap_or(([-0.5; 3], [0.5; 3]));
        let cloth = extent(true).unwrap_or(all);
        let size = (0..3).map(|k| cloth.1[k] - cloth.0[k]).fold(1e-3, f64::max);
        let mut lo = [0.0; 3];
        let mut hi = [0.0; 3];
        for k in 0..3 {
            lo[k] = all.0[k].max(cloth.0[k] - AROUND * size);
            hi[k] = all.1[k].min(cloth.1[k] + AROUND * size);
        }
        let at = |f: &dyn Fn(usize) -> f64| side * f(0) + up * f(1) + front * f(2);
        let centre = at(&|k| 0.5 * (lo[k] + hi[k]));
        // the sphere holds what is drawn near the garment; a far end of a ground square is let go
        let reach = (0..3)
            .map(|k| (0.5 * (hi[k] - lo[k])).powi(2))
            .sum::<f64>()
            .sqrt();
        Self {
            side,
            up: *up,
            front: *front,
            centre,
            half: [0, 1, 2].map(|k| (0.5 * (hi[k] - lo[k])).max(1e-3)),
            lowest: all.0[1],
            highest: all.1[1],
            ball: (centre, reach.max(1e-3) * 1.35),
        }
    }
}

/// One view.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    pub(crate) eye: Vec3,
    pub(crate) right: Vec3,
    pub(crate) up: Vec3,
    pub(crate) forward: Vec3,
    /// Focal length [pixel].
    pub(crate) focal: f64,
    /// Principal point [pixel].
    pub(crate) centre: [f64; 2],
    /// First and past-the-last column it may draw in.
    pub(crate) columns: [usize; 2],
}

impl Camera {
    /// Cameras for all views of one picture, left to right.
    pub(crate) fn fit_all(frame: &Frame, views: &[f64], width: usize, height: usize) -> Vec<Self> {
        let n = views.len().max(1) as f64;
        let half_width = |a: f64| (a.cos() * frame.half[0]).abs() + (a.sin() * frame.half[2]).abs();
        let half_depth = |a: f64| (a.sin() * frame.half[0]).abs() + (a.cos() * frame.half[2]).abs();
        // perspective enlarges the near side: margins are taken at the near face
        let margin = 1.10;
        let distance = frame.half[1].max(frame.half[0]).max(frame.half[2]) * margin / TAN_HALF;
        let near = |a: f64| distance / (distance - half_depth(a)).max(0.2 * distance);
        let gap = 0.05 * views.iter().map(|&a| half_width(a)).fold(0.0, f64::max);
        let wants: Vec<f64> = views
            .iter()
            .map(|&a| 2.0 * (half_width(a) * near(a) + gap))
            .collect();
        let tall = views
            .iter()
            .map(|&a| 2.0 * frame.half[1] * near(a))
            .fold(1e-9, f64::max)
            * margin;
        let total: f64 = wants.iter().sum::<f64>().max(1e-9);
        // pixels for one metre at the middle of the scene
        let scale = (width as f64 / total).min(height as f64 / tall);
        let spare = (width as f64 - scale * total) / n;
        // spare height shows more of the body
        let shown = 0.5 * height as f64 / (scale * margin);
        let middle = frame.centre.dot(&frame.up);
        let lift = if 2.0 * shown >= frame.highest - frame.lowest {
            0.5 * (frame.highest + frame.lowest) - middle
        } else {
            let down = (middle - shown - frame.lowest).min(0.0);
            let up = (middle + shown - frame.highest).max(0.0);
            -(up + down)
        };
        let target = frame.centre + frame.up * lift;
        let mut left = 0.0;
        let mut out = Vec::new();
        for (&a, want) in views.iter().zip(&wants) {
            let column = scale * want + spare;
            let back = frame.front * a.cos() + frame.side * a.sin();
            // a slightly raised eye shows the ground as a surface
            let raise = 0.10;
            let direction = (back + frame.up * raise).normalize();
            let forward = -direction;
            let right = forward.cross(&frame.up).normalize();
            out.push(Self {
                eye: target + direction * distance,
                right,
                up: right.cross(&forward),
                forward,
                focal: scale * distance,
                centre: [left + 0.5 * column, 0.5 * height as f64],
                columns: [
                    (left.max(0.0) as usize).min(width),
                    ((left + column).ceil().max(0.0) as usize).min(width),
                ],
            });
            left += column;
        }
        out
    }

    /// Screen position [pixel] and nearness `1 / w` [1/m]; `None` behind the eye.
    pub(crate) fn project(&self, x: &Vec3) -> Option<[f64; 3]> {
        let d = x - self.eye;
        let w = d.dot(&self.forward);
        if w < 1e-3 {
            return None;
        }
        Some([
            self.centre[0] + self.focal * d.dot(&self.right) / w,
            self.centre[1] - self.focal * d.dot(&self.up) / w,
            1.0 / w,
        ])
    }

    /// Direction of the ray through a screen point; its component along `forward` is 1.
    pub(crate) fn ray(&self, x: f64, y: f64) -> Vec3 {
        self.forward
            + self.right * ((x - self.centre[0]) / self.focal)
            + self.up * ((self.centre[1] - y) / self.focal)
    }
}
