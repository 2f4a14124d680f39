//! Plane curves of pattern edges: straight, quadratic and cubic Bezier, circular arc.
//!
//! A [`Curve`] is a shape between two corners; a [`Segment`] is the shape with its corners. The
//! parameter `t` runs from 0 to 1 along the directed edge. Lengths in metres.
//!
//! Arc length of a Bezier curve is `int |c'(t)| dt`, by 10-point Gauss-Legendre quadrature on halved
//! intervals until two halves agree with the whole to 1e-12 of the control polygon's length. Arcs and
//! lines have closed forms. The area under a curve is `1/2 int (x dy - y dx)` (Green): exact by the
//! same rule for Beziers (degree 5 at most), in closed form for arcs.

use crate::math::Vec2;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Shape of an edge between its two corners; control points in panel coordinates [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// Straight.
    Line,
    /// Quadratic Bezier with one control point.
    Quadratic(Vec2),
    /// Cubic Bezier with two control points.
    Cubic(Vec2, Vec2),
    /// Circular arc: radius [m]; the larger of the two arcs or not; bulging to the right of the
    /// directed edge or to the left.
    Arc {
        /// Radius [m].
        radius: f64,
        /// The arc of more than half a turn.
        large: bool,
        /// Bulges to the right of the directed edge.
        right: bool,
    },
}

/// A curve with its two end points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Where it starts [m].
    pub start: Vec2,
    /// Where it ends [m].
    pub end: Vec2,
    /// Shape between the two.
    pub curve: Curve,
}

/// Centre form of a circular arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Centre [m].
    pub center: Vec2,
    /// Radius [m], never below half the chord.
    pub radius: f64,
    /// Signed angle from start to end [rad]; positive is counter-clockwise.
    pub sweep: f64,
}

// Positive nodes and weights of the 10-point Gauss-Legendre rule on [-1, 1].
const NODES: [f64; 5] = [
    0.148_874_338_981_631_2,
    0.433_395_394_129_247_2,
    0.679_409_568_299_024_4,
    0.865_063_366_688_984_5,
    0.973_906_528_517_171_7,
];
const WEIGHTS: [f64; 5] = [
    0.295_524_224_714_752_9,
    0.269_266_719_309_996_3,
    0.219_086_362_515_982,
    0.149_451_349_150_580_6,
    0.066_671_344_308_688_1,
];

/// Halvings allowed to the quadrature; a cusp needs about 25.
const MAX_DEPTH: u32 = 48;
/// Pieces of the table that inverts arc length.
const TABLE: usize = 32;

fn gauss(a: f64, b: f64, f: &impl Fn(f64) -> f64) -> f64 {
    let (mid, half) = (0.5 * (a + b), 0.5 * (b - a));
    let mut sum = 0.0;
    for (node, weight) in NODES.iter().zip(WEIGHTS) {
        sum += weight * (f(mid - half * node) + f(mid + half * node));
    }
    half * sum
}

fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

impl Segment {
    /// Centre form, for arcs with two different ends.
    pub fn circle(&self) -> Option<Circle> {
        let Curve::Arc {
            radius,
            large,
            right,
        } = self.curve
        else {
            return None;
        };
        let chord = self.end - self.start;
        let length = chord.norm();
        if length <= 0.0 || !length.is_finite() {
            return None;
        }
        let radius = radius.max(0.5 * length);
        let left = Vec2::new(-chord.y, chord.x) / length;
        let height = ((radius - 0.5 * length) * (radius + 0.5 * length)).sqrt();
        // The small arc's centre lies on the other side of the chord than its bulge.
        let side = if right == large { -1.0 } else { 1.0 };
        let center = 0.5 * (self.start + self.end) + side * height * left;
        let small = 2.0 * (0.5 * length / radius).min(1.0).asin();
        let sweep = if large { TAU - small } else { small };
        Some(Circle {
            center,
            radius,
            sweep: if right { sweep } else { -sweep },
        })
    }

    /// Position at parameter `t` [m].
    pub fn point(&self, t: f64) -> Vec2 {
        let (p0, p1, s) = (self.start, self.end, 1.0 - t);
        match self.curve {
            Curve::Line => s * p0 + t * p1,
            Curve::Quadratic(c) => s * s * p0 + 2.0 * s * t * c + t * t * p1,
            Curve::Cubic(c, d) => {
                s * s * s * p0 + 3.0 * s * s * t * c + 3.0 * s * t * t * d + t * t * t * p1
            }
            Curve::Arc { .. } => match self.circle() {
                Some(circle) => {
                    let (sin, cos) = (circle.sweep * t).sin_cos();
                    let r = p0 - circle.center;
                    circle.center + Vec2::new(cos * r.x - sin * r.y, sin * r.x + cos * r.y)
                }
                None => p0,
            },
        }
    }

    /// Derivative by `t` [m].
    pub fn derivative(&self, t: f64) -> Vec2 {
        let (p0, p1, s) = (self.start, self.end, 1.0 - t);
        match self.curve {
            Curve::Line => p1 - p0,
            Curve::Quadratic(c) => 2.0 * s * (c - p0) + 2.0 * t * (p1 - c),
            Curve::Cubic(c, d) => {
                3.0 * s * s * (c - p0) + 6.0 * s * t * (d - c) + 3.0 * t * t * (p1 - d)
            }
            Curve::Arc { .. } => match self.circle() {
                Some(circle) => {
                    let r = self.point(t) - circle.center;
                    circle.sweep * Vec2::new(-r.y, r.x)
                }
                None => Vec2::zeros(),
            },
        }
    }

    /// Length of the control polygon: never below the arc length of a line or Bezier curve.
    fn scale(&self) -> f64 {
        match self.curve {
            Curve::Line => (self.end - self.start).norm(),
            Curve::Quadratic(c) => (c - self.start).norm() + (self.end - c).norm(),
            Curve::Cubic(c, d) => (c - self.start).norm() + (d - c).norm() + (self.end - d).norm(),
            Curve::Arc { .. } => self.circle().map_or(0.0, |c| c.radius * c.sweep.abs()),
        }
    }

    /// Arc length between two parameters [m], negative if `b < a`.
    pub fn length_between(&self, a: f64, b: f64) -> f64 {
        match self.curve {
            Curve::Line | Curve::Arc { .. } => (b - a) * self.scale(),
            Curve::Quadratic(_) | Curve::Cubic(..) => {
                let speed = |t: f64| self.derivative(t).norm();
                let whole = gauss(a, b, &speed);
                adapt(a, b, whole, 1e-12 * self.scale(), MAX_DEPTH, &speed)
            }
        }
    }

    /// Arc length [m].
    pub fn length(&self) -> f64 {
        self.length_between(0.0, 1.0)
    }

    /// Parameters at these fractions (0 to 1) of the arc length.
    pub fn parameters_at(&self, fractions: &[f64]) -> Vec<f64> {
        if matches!(self.curve, Curve::Line | Curve::Arc { .. }) {
            return fractions.to_vec();
        }
        let mut table = [0.0; TABLE + 1];
        for k in 0..TABLE {
            let (a, b) = (k as f64 / TABLE as f64, (k + 1) as f64 / TABLE as f64);
            table[k + 1] = table[k] + self.length_between(a, b);
        }
        let invert = |fraction: &f64| match *fraction {
            f if f <= 0.0 => 0.0,
            f if f >= 1.0 => 1.0,
            f => self.invert(&table, table[TABLE] * f),
        };
        fractions.iter().map(invert).collect()
    }

    /// Parameter where the arc length from the start is `target`, by Newton inside a bracket.
    fn invert(&self, table: &[f64; TABLE + 1], target: f64) -> f64 {
        let cell = table.partition_point(|s| *s <= target).clamp(1, TABLE) - 1;
        let origin = cell as f64 / TABLE as f64;
        let (mut low, mut high) = (origin, (cell + 1) as f64 / TABLE as f64);
        let span = table[cell + 1] - table[cell];
        let mut t = if span > 0.0 {
            low + (high - low) * ((target - table[cell]) / span).clamp(0.0, 1.0)
        } else {
            low
        };
        for _ in 0..60 {
            let excess = table[cell] + self.length_between(origin, t) - target;
            if excess.abs() <= 1e-13 * table[TABLE] {
                break;
            }
            if excess > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let newton = t - excess / self.derivative(t).norm();
            t = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            if high - low <= f64::EPSILON {
                break;
            }
        }
        t
    }

    /// Points at these fractions of the arc length; 0 and 1 give the ends exactly.
    pub fn points_at(&self, fractions: &[f64]) -> Vec<Vec2> {
        let place = |(fraction, t): (&f64, f64)| match *fraction {
            f if f <= 0.0 => self.start,
            f if f >= 1.0 => self.end,
            _ => self.point(t),
        };
        fractions
            .iter()
            .zip(self.parameters_at(fractions))
            .map(place)
            .collect()
    }

    /// `pieces + 1` points (at least 2) at equal steps of arc length, ends included.
    pub fn sample(&self, pieces: usize) -> Vec<Vec2> {
        let pieces = pieces.max(1);
        let even: Vec<f64> = (0..=pieces).map(|k| k as f64 / pieces as f64).collect();
        self.points_at(&even)
    }

    /// Upper bound of the angle [rad] through which the tangent turns in all; exact for arcs.
    ///
    /// For a Bezier curve it is the turning of the control polygon, which the curve never exceeds.
    pub fn turning(&self) -> f64 {
        let chain = |points: &[Vec2]| {
            let legs: Vec<Vec2> = points
                .windows(2)
                .map(|w| w[1] - w[0])
                .filter(|leg| leg.norm() > 0.0)
                .collect();
            legs.windows(2)
                .map(|w| cross(w[0], w[1]).atan2(w[0].dot(&w[1])).abs())
                .sum::<f64>()
        };
        match self.curve {
            Curve::Line => 0.0,
            Curve::Quadratic(c) => chain(&[self.start, c, self.end]),
            Curve::Cubic(c, d) => chain(&[self.start, c, d, self.end]),
            Curve::Arc { .. } => self.circle().map_or(0.0, |c| c.sweep.abs()),
        }
    }

    /// Smallest axis-parallel box: lower and upper corner [m].
    pub fn bounds(&self) -> [Vec2; 2] {
        let mut low = self.start.inf(&self.end);
        let mut high = self.start.sup(&self.end);
        let mut take = |t: f64| {
            if t > 0.0 && t < 1.0 {
                let p = self.point(t);
                low = low.inf(&p);
                high = high.sup(&p);
            }
        };
        match self.curve {
            Curve::Line => {}
            Curve::Quadratic(c) => {
                let (a, b) = (c - self.start, self.end - c);
                for k in 0..2 {
                    take(a[k] / (a[k] - b[k]));
                }
            }
            Curve::Cubic(c, d) => {
                let (e0, e1, e2) = (c - self.start, d - c, self.end - d);
                for k in 0..2 {
                    // e0 (1-t)^2 + 2 e1 t (1-t) + e2 t^2 = qa t^2 + qb t + qc
                    let (qa, qb, qc) = (e0[k] - 2.0 * e1[k] + e2[k], 2.0 * (e1[k] - e0[k]), e0[k]);
                    let root = (qb * qb - 4.0 * qa * qc).max(0.0).sqrt();
                    let q = -0.5 * (qb + root.copysign(qb));
                    take(q / qa);
                    take(qc / q);
                }
            }
            Curve::Arc { .. } => {
                if let Some(circle) = self.circle() {
                    let r = self.start - circle.center;
                    let first = r.y.atan2(r.x);
                    for quarter in 0..4 {
                        let angle = f64::from(quarter) * FRAC_PI_2 - PI;
                        let turn = if circle.sweep > 0.0 {
                            (angle - first).rem_euclid(TAU)
                        } else {
                            -(first - angle).rem_euclid(TAU)
                        };
                        take(turn / circle.sweep);
                    }
                }
            }
        }
        [low, high]
    }

    /// The same curve run through from its end to its start.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let curve = match self.curve {
            Curve::Cubic(c, d) => Curve::Cubic(d, c),
            Curve::Arc {
                radius,
                large,
                right,
            } => Curve::Arc {
                radius,
                large,
                right: !right,
            },
            other => other,
        };
        Self {
            start: self.end,
            end: self.start,
            curve,
        }
    }

    /// `1/2 int (x dy - y dx)` [m^2]: a closed loop's sum is its area, positive counter-clockwise.
    pub fn area_term(&self) -> f64 {
        let chord = 0.5 * cross(self.start, self.end);
        match self.curve {
            Curve::Line => chord,
            // relative to the start, so that a panel far from the origin loses no digits
            Curve::Quadratic(_) | Curve::Cubic(..) => {
                let f = |t: f64| cross(self.point(t) - self.start, self.derivative(t));
                chord + 0.5 * gauss(0.0, 1.0, &f)
            }
            Curve::Arc { .. } => self.circle().map_or(chord, |c| {
                chord + 0.5 * c.radius * c.radius * (c.sweep - c.sweep.sin())
            }),
        }
    }

    /// Every number is finite.
    pub fn is_finite(&self) -> bool {
        let control = match self.curve {
            Curve::Line => true,
            Curve::Quadratic(c) => c.iter().all(|x| x.is_finite()),
            Curve::Cubic(c, d) => c.iter().chain(d.iter()).all(|x| x.is_finite()),
            Curve::Arc { radius, .. } => radius.is_finite(),
        };
        control
            && self
                .start
                .iter()
                .chain(self.end.iter())
                .all(|x| x.is_finite())
    }
}

/// Halves `[a, b]` until the halves agree with the whole to `tolerance`, which is absolute.
fn adapt(a: f64, b: f64, whole: f64, tolerance: f64, depth: u32, f: &impl Fn(f64) -> f64) -> f64 {
    let mid = 0.5 * (a + b);
    let (left, right) = (gauss(a, mid, f), gauss(mid, b, f));
    let halves = left + right;
    // a NaN or infinite integrand must not recurse
    if depth == 0 || !halves.is_finite() || (halves - whole).abs() <= tolerance {
        return halves;
    }
    adapt(a, mid, left, 0.5 * tolerance, depth - 1, f)
        + adapt(mid, b, right, 0.5 * tolerance, depth - 1, f)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64) -> Vec2 {
        Vec2::new(x, y)
    }

    fn all() -> Vec<Segment> {
        let (start, end) = (v(0.1, -0.2), v(1.3, 0.4));
        let mut curves = vec![
            Curve::Line,
            Curve::Quadratic(v(0.4, 1.1)),
            Curve::Cubic(v(0.0, 1.0), v(0.9, -1.2)),
            Curve::Cubic(v(2.5, 1.0), v(-1.0, 1.0)),
        ];
        for large in [false, true] {
            for right in [false, true] {
                curves.push(Curve::Arc {
                    radius: 0.8,
                    large,
                    right,
                });
            }
        }
        curves
            .into_iter()
            .map(|curve| Segment { start, end, curve })
            .collect()
    }

    #[test]
    fn derivative_matches_central_differences() {
        for segment in all() {
            for k in 1..10 {
                let (t, h) = (0.1 * f64::from(k), 1e-6);
                let fd = (segment.point(t + h) - segment.point(t - h)) / (2.0 * h);
                assert!((fd - segment.derivative(t)).norm() < 1e-8, "{segment:?}");
            }
        }
    }

    #[test]
    fn length_is_the_limit_of_inscribed_polygons() {
        for segment in all() {
            let polygon = |n: usize| {
                let p: Vec<Vec2> = (0..=n)
                    .map(|k| segment.point(k as f64 / n as f64))
                    .collect();
                p.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>()
            };
            // Richardson of the second-order polygon lengths
            let (a, b) = (polygon(4000), polygon(8000));
            let limit = (4.0 * b - a) / 3.0;
            let error = (segment.length() - limit).abs() / limit;
            assert!(error < 1e-10, "{segment:?} {error}");
        }
    }

    #[test]
    fn parabola_length_matches_its_closed_form() {
        // y = x^2 on [0, 1]: 1/2 sqrt 5 + 1/4 asinh 2
        let segment = Segment {
            start: v(0.0, 0.0),
            end: v(1.0, 1.0),
            curve: Curve::Quadratic(v(0.5, 0.0)),
        };
        let exact = 0.5 * 5.0_f64.sqrt() + 0.25 * 2.0_f64.asinh();
        assert!((segment.length() / exact - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_cusp_and_a_folded_quadratic_have_finite_exact_length() {
        // folds back on itself: goes to x = 2/3 (t = 2/3) and returns to 1/2... speed |2 - 3 t|
        let fold = Segment {
            start: v(0.0, 0.0),
            end: v(0.5, 0.0),
            curve: Curve::Quadratic(v(1.0, 0.0)),
        };
        assert!((fold.length() - (4.0 / 3.0 - 0.5)).abs() < 1e-12);
        let cusp = Segment {
            start: v(0.0, 0.0),
            end: v(1.0, 0.0),
            curve: Curve::Cubic(v(1.0, 1.0), v(0.0, 1.0)),
        };
        let points = cusp.sample(100);
        assert_eq!(points.len(), 101);
        assert!(cusp.length().is_finite());
    }

    #[test]
    fn samples_are_at_equal_arc_length() {
        for segment in all() {
            let n = 37;
            let even: Vec<f64> = (0..=n).map(|k| k as f64 / n as f64).collect();
            let parameters = segment.parameters_at(&even);
            let step = segment.length() / n as f64;
            for w in parameters.windows(2) {
                let error = (segment.length_between(w[0], w[1]) / step - 1.0).abs();
                assert!(error < 1e-9, "{segment:?} {error}");
            }
        }
    }

    #[test]
    fn reversed_curve_meets_the_same_points() {
        for segment in all() {
            let back = segment.reversed();
            assert!((segment.length() - back.length()).abs() < 1e-12);
            assert!((segment.area_term() + back.area_term()).abs() < 1e-12);
            for k in 0..=10 {
                let t = 0.1 * f64::from(k);
                assert!((segment.point(t) - back.point(1.0 - t)).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn bounds_are_tight() {
        for segment in all() {
            let [low, high] = segment.bounds();
            let (mut l, mut h) = (segment.start, segment.start);
            for k in 0..=20_000 {
                let p = segment.point(f64::from(k) / 20_000.0);
                l = l.inf(&p);
                h = h.sup(&p);
            }
            assert!(
                (l - low).norm() < 1e-7 && (h - high).norm() < 1e-7,
                "{segment:?}"
            );
        }
    }

    #[test]
    fn arcs_bulge_to_the_side_they_name() {
        for segment in all() {
            let Curve::Arc { right, large, .. } = segment.curve else {
                continue;
            };
            let side = cross(
                segment.end - segment.start,
                segment.point(0.5) - segment.start,
            );
            assert_eq!(side < 0.0, right);
            assert_eq!(segment.turning() > PI, large);
            assert!((segment.point(1.0) - segment.end).norm() < 1e-12);
        }
    }

    #[test]
    fn a_disc_of_two_arcs_has_its_area() {
        let arc = |start, end| Segment {
            start,
            end,
            curve: Curve::Arc {
                radius: 0.5,
                large: false,
                right: true,
            },
        };
        let (a, b) = (v(3.0, 4.0), v(4.0, 4.0));
        let area = arc(a, b).area_term() + arc(b, a).area_term();
        assert!((area - PI * 0.25).abs() < 1e-13, "{area}");
    }
}
