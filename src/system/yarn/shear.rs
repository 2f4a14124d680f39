//! Shear of a woven crossing, with jamming.
//!
//! With the angle `phi` between a neighbour along one yarn and a neighbour along the other, and
//! `g = phi - pi/2`:
//!
//! ```text
//! V = k_x L [g^2/2 + (K - 1) R(|g| - g_j)],   k_x = S R^2 [N],   g_j = pi/2 - 2 asin(R/L)
//! ```
//!
//! (Cirio et al. 2014; the jam by its moment, `K = 1000` blended over 0.1 rad from where neighbouring yarns
//! of radius `R` at the pitch `L` touch). Four corners make a crossing. Damping acts on `phi`. `Psd` keeps the
//! square of the gradient and the positive part across the plane. At 0 and at a half turn `phi` has a
//! tip, far inside the jam. SI units.

use super::angle::{Angle, Jam, Moment, angle};
use super::kernel::{Damped, Kernel, Local, Lower, add_square, point, set_point};
use crate::math::Vec3;
use std::f64::consts::FRAC_PI_2;

const FLOOR: f64 = 1e-4;
const WEIGHTS: [[f64; 3]; 2] = [[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]];

/// Shear of one corner; scalars `(crossing, neighbour, neighbour)`.
pub struct Shear {
    /// `k_x L` [N m].
    pub stiffness: f64,
    /// Pitch at rest [m].
    pub length: f64,
    /// Jamming by the size of `g`.
    pub jam: Jam,
    /// Stiffness-proportional damping [s].
    pub damping: f64,
}

/// Shear at which yarns of radius `radius` at the pitch `length` touch [rad].
pub fn lock(radius: f64, length: f64) -> f64 {
    FRAC_PI_2 - 2.0 * (radius / length).clamp(0.0, 1.0).asin()
}

fn edges(q: &[f64; 9]) -> [Vec3; 2] {
    let middle = point(q, 0);
    [point(q, 1) - middle, point(q, 2) - middle]
}

/// `-(a + b)`, `a` and `b` at the three nodes.
fn by_nodes([a, b]: &[Vec3; 2]) -> [f64; 9] {
    let mut out = [0.0; 9];
    set_point(&mut out, 0, &-(a + b));
    set_point(&mut out, 1, a);
    set_point(&mut out, 2, b);
    out
}

impl Shear {
    /// Corner of the stiffness `k_x` [N] at the pitch `length` between yarns of radius `radius` [m].
    pub fn new(stiffness: f64, radius: f64, length: f64, damping: f64) -> Self {
        Self {
            stiffness: stiffness * length,
            length,
            jam: Jam {
                factor: 1000.0,
                from: lock(radius, length),
                width: 0.1,
            },
            damping,
        }
    }

    fn corner(&self, q: &[f64; 9]) -> Angle {
        let [a, b] = edges(q);
        Angle::new(&a, &b, FLOOR * self.length)
    }

    fn moment(&self, at: &Local<'_, 9>, corner: &Angle) -> Moment {
        let g = corner.theta - FRAC_PI_2;
        let jam = self.jam.at(g.abs());
        let (c, since) = (at.start.weight, corner.theta - at.start.measure);
        let value = self.stiffness * (g + jam[1] * g.signum()) + c * since;
        let slope = self.stiffness * (1.0 + jam[2]) + c;
        Moment {
            value,
            over_sin: value / corner.sin.max(1e-6),
            slope: [slope; 2],
        }
    }
}

impl Kernel<9> for Shear {
    const NAME: &'static str = "yarn_shear";
    const POSITIONS: usize = 3;
    const DAMPED: bool = true;

    fn value(&self, at: &Local<'_, 9>) -> f64 {
        let [a, b] = edges(at.q);
        let phi = angle(&a, &b);
        let g = phi - FRAC_PI_2;
        let (c, since) = (at.start.weight, phi - at.start.measure);
        self.stiffness * (0.5 * g * g + self.jam.at(g.abs())[0]) + 0.5 * c * since * since
    }

    fn gradient(&self, at: &Local<'_, 9>, out: &mut [f64; 9]) {
        let corner = self.corner(at.q);
        let moment = self.moment(at, &corner).value;
        *out = by_nodes(&corner.gradient().map(|g| g * moment));
    }

    fn derivatives(
        &self,
        at: &Local<'_, 9>,
        exactness: f64,
        gradient: &mut [f64; 9],
        out: &mut Lower<9>,
    ) {
        let corner = self.corner(at.q);
        let moment = self.moment(at, &corner);
        let by_edges = corner.gradient();
        let j = by_nodes(&by_edges);
        *gradient = by_nodes(&by_edges.map(|g| g * moment.value));
        add_square(out, moment.square(exactness), &j);
        corner.add_curvature(&WEIGHTS, &moment, exactness, out);
    }

    fn start(&self, q0: &[f64; 9], inv_dt: f64) -> Damped {
        let [a, b] = edges(q0);
        Damped {
            weight: self.damping * inv_dt * self.stiffness,
            measure: angle(&a, &b),
        }
    }
}
