//! Lower bounds of the distance from a point to eight things at once, in f32.
//!
//! A group of triangles is bounded by a thick disc: centre `c`, unit normal `n`, radius `R` and half
//! thickness `t`. A point at `e` from the centre, with height `z = n . e` and `rho = |e - z n|` off
//! the axis, is at least
//!
//! ```text
//! sqrt( max(0, |z| - t)^2 + max(0, rho - R)^2 )
//! ```
//!
//! away from all of it. A patch of a smooth surface is nearly flat and a box around it is not, which
//! is why discs reject far more than boxes do.
//!
//! A single triangle is bounded by a prism: the same slab, cut by three half spaces
//! `m_k . e <= o_k` with `m_k` across `n` and the edges,
//!
//! ```text
//! sqrt( max(0, |z| - t)^2 + max(0, m_1 . e - o_1, m_2 . e - o_2, m_3 . e - o_3)^2 )
//! ```
//!
//! which is the distance itself unless a corner is nearest. Thickness and offsets are taken from the
//! corners, so that a normal spoilt by a sliver makes a bound poor, never wrong.
//!
//! Rounding is the caller's to allow for (`tree::Probe::reach2`). What is not a number counts as 0.

use super::triangle::Tri;
use crate::math::Vec3;

/// Things to a block.
pub(super) const WIDE: usize = 8;

pub(super) type Lanes = [f32; WIDE];

/// Eight thick discs.
#[derive(Clone, Debug)]
pub(super) struct Discs {
    center: [Lanes; 3],
    normal: [Lanes; 3],
    radius: Lanes,
    height: Lanes,
}

/// Bounds of eight triangles.
#[derive(Clone, Debug)]
pub(super) struct Prisms {
    center: [Lanes; 3],
    normal: [Lanes; 3],
    height: Lanes,
    sides: [[Lanes; 3]; 3],
    offsets: [Lanes; 3],
}

/// `f32::max(x, 0)` would also sort out what is not a number, which costs vector width.
#[inline]
fn positive(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

/// Point less centres. Every step of the bounds is a loop of its own over the lanes, which the
/// compiler turns into vectors.
#[inline]
fn from_centers(p: &[f32; 3], centers: &[Lanes; 3]) -> [Lanes; 3] {
    let mut out = [[0.0; WIDE]; 3];
    for d in 0..3 {
        for i in 0..WIDE {
            out[d][i] = p[d] - centers[d][i];
        }
    }
    out
}

#[inline]
fn dot(a: &[Lanes; 3], b: &[Lanes; 3]) -> Lanes {
    let mut out = [0.0; WIDE];
    for i in 0..WIDE {
        out[i] = a[0][i] * b[0][i] + a[1][i] * b[1][i] + a[2][i] * b[2][i];
    }
    out
}

fn put(v: &mut [Lanes; 3], i: usize, x: &Vec3) {
    for d in 0..3 {
        v[d][i] = x[d] as f32;
    }
}

/// Bits of the bounds that do not exceed a squared reach.
#[inline]
pub(super) fn within(bounds: &Lanes, reach2: f32) -> u32 {
    let mut bits = 0;
    for (i, &b) in bounds.iter().enumerate() {
        bits |= u32::from(!(b > reach2)) << i;
    }
    bits
}

/// Place of the smallest bound.
#[inline]
pub(super) fn lowest(bounds: &Lanes) -> usize {
    let mut best = 0;
    for i in 1..WIDE {
        if bounds[i] < bounds[best] {
            best = i;
        }
    }
    best
}

impl Discs {
    /// Places for discs, all so far away that nothing finds them.
    pub(super) const NONE: Self = Self {
        center: [[1e15; WIDE]; 3],
        normal: [[0.0; WIDE]; 3],
        radius: [0.0; WIDE],
        height: [0.0; WIDE],
    };

    /// Copies one disc.
    #[inline]
    pub(super) fn set(&mut self, to: usize, other: &Self, from: usize) {
        for d in 0..3 {
            self.center[d][to] = other.center[d][from];
            self.normal[d][to] = other.normal[d][from];
        }
        self.radius[to] = other.radius[from];
        self.height[to] = other.height[from];
    }

    /// Squared lower bounds of the distances to `p`.
    #[inline]
    pub(super) fn bounds(&self, p: &[f32; 3]) -> Lanes {
        let e = from_centers(p, &self.center);
        let z = dot(&e, &self.normal);
        let mut s = [[0.0; WIDE]; 3];
        for d in 0..3 {
            for i in 0..WIDE {
                s[d][i] = e[d][i] - z[i] * self.normal[d][i];
            }
        }
        let s2 = dot(&s, &s);
        let mut out = [0.0; WIDE];
        for i in 0..WIDE {
            let up = positive(z[i].abs() - self.height[i]);
            let off = positive(s2[i].sqrt() - self.radius[i]);
            out[i] = up * up + off * off;
        }
        out
    }

    /// Centre of a disc and radius of the ball around it.
    pub(super) fn ball(&self, i: usize) -> (Vec3, f64) {
        let c = [0, 1, 2].map(|d: usize| f64::from(self.center[d][i]));
        let radius = f64::from(self.radius[i]).hypot(f64::from(self.height[i]));
        (Vec3::from(c), radius)
    }

    /// Bounds triangles, about `middle`: centre at the mean of theirs and halfway up, normal along
    /// the sum of their areas.
    pub(super) fn bound(&mut self, i: usize, tris: &[Tri], middle: &Vec3) {
        let (mut center, mut normal) = (Vec3::zeros(), Vec3::zeros());
        for t in tris {
            center += t.a + (t.ab + t.ac) / 3.0;
            normal += t.ab.cross(&t.ac);
        }
        center /= tris.len() as f64;
        let normal = unit(&normal);
        let (mut lo, mut hi, mut r2) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
        for t in tris {
            let e = t.a - center;
            for e in [e, e + t.ab, e + t.ac] {
                let z = normal.dot(&e);
                lo = lo.min(z);
                hi = hi.max(z);
                r2 = r2.max((e - normal * z).norm_squared());
            }
        }
        let c = center + normal * (0.5 * (lo + hi)) - middle;
        put(&mut self.center, i, &c);
        put(&mut self.normal, i, &normal);
        self.radius[i] = r2.sqrt() as f32;
        self.height[i] = (0.5 * (hi - lo)) as f32;
    }
}

impl Prisms {
    /// Places for triangles, all so far away that nothing finds them.
    pub(super) const NONE: Self = Self {
        center: [[1e15; WIDE]; 3],
        normal: [[0.0; WIDE]; 3],
        height: [0.0; WIDE],
        sides: [[[-1.0; WIDE]; 3]; 3],
        offsets: [[0.0; WIDE]; 3],
    };

    /// Squared lower bounds of the distances to `p`.
    #[inline]
    pub(super) fn bounds(&self, p: &[f32; 3]) -> Lanes {
        let e = from_centers(p, &self.center);
        let z = dot(&e, &self.normal);
        let s = [
            dot(&e, &self.sides[0]),
            dot(&e, &self.sides[1]),
            dot(&e, &self.sides[2]),
        ];
        let mut out = [0.0; WIDE];
        for i in 0..WIDE {
            let up = positive(z[i].abs() - self.height[i]);
            let a = positive(s[0][i] - self.offsets[0][i]);
            let b = s[1][i] - self.offsets[1][i];
            let b = if b > a { b } else { a };
            let c = s[2][i] - self.offsets[2][i];
            let c = if c > b { c } else { b };
            out[i] = up * up + c * c;
        }
        out
    }

    /// Bounds one triangle, about `middle`.
    pub(super) fn bound(&mut self, i: usize, t: &Tri, middle: &Vec3) {
        let normal = unit(&t.ab.cross(&t.ac));
        let mean = (t.ab + t.ac) / 3.0;
        let corners = [-mean, t.ab - mean, t.ac - mean];
        let edges = [t.ab, t.ac - t.ab, -t.ac];
        for k in 0..3 {
            // across the edge and outward; along it where there is no normal
            let side = if normal == Vec3::zeros() {
                unit(&edges[k])
            } else {
                unit(&edges[k].cross(&normal))
            };
            let top = |o: f64, e: &Vec3| o.max(side.dot(e));
            put(&mut self.sides[k], i, &side);
            self.offsets[k][i] = corners.iter().fold(f64::NEG_INFINITY, top) as f32;
        }
        let high = |h: f64, e: &Vec3| h.max(normal.dot(e).abs());
        self.height[i] = corners.iter().fold(0.0, high) as f32;
        put(&mut self.normal, i, &normal);
        put(&mut self.center, i, &(t.a + mean - middle));
    }
}

fn unit(v: &Vec3) -> Vec3 {
    v.try_normalize(f64::MIN_POSITIVE).unwrap_or_default()
}
