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
//! A single triangle is bounded by a disc without thickness that three half spaces
//! `m_k . e <= o_k` cut to its shape, with `m_k` across `n` and the edges,
//!
//! ```text
//! sqrt( z^2 + max(0, m_1 . e - o_1, m_2 . e - o_2, m_3 . e - o_3, rho - R)^2 )
//! ```
//!
//! which is the distance itself unless a corner is nearest. Offsets and radius are taken from the
//! corners, and a normal spoilt by a sliver is given up, so that such a bound is poor but never
//! wrong.
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

/// Bound of a triangle: centre and radius, normal, the three half spaces with their offsets.
#[derive(Clone, Debug, Default)]
pub(super) struct Prism([[f32; 4]; 5]);

/// Bounds of eight triangles.
#[derive(Clone, Debug)]
pub(super) struct Prisms([[Lanes; 4]; 5]);

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

/// Bits of the bounds that do not exceed their squared reaches.
#[inline]
pub(super) fn within_each(bounds: &Lanes, reach2: &Lanes) -> u32 {
    let mut out = [0u32; WIDE];
    for i in 0..WIDE {
        out[i] = u32::from(!(bounds[i] > reach2[i]));
    }
    // most often there are none
    let mut bits = out.iter().fold(0, |a, b| a | b);
    if bits != 0 {
        bits = (0..WIDE).fold(0, |a, i| a | out[i] << i);
    }
    bits
}

/// Bits of the bounds that do not exceed a squared reach.
#[inline]
pub(super) fn within(bounds: &Lanes, reach2: f32) -> u32 {
    within_each(bounds, &[reach2; WIDE])
}

/// Bits of the smallest bounds; of all where one is not a number.
#[inline]
pub(super) fn lowest(bounds: &Lanes) -> u32 {
    let mut low = [0.0; 4];
    for i in 0..4 {
        let (a, b) = (bounds[i], bounds[i + 4]);
        low[i] = if b < a { b } else { a };
    }
    let low = low
        .iter()
        .fold(f32::INFINITY, |a, &b| if b < a { b } else { a });
    within(bounds, low)
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

impl Prism {
    /// Bounds a triangle, about `middle`. A thickness up to `flat` [m] is left to the caller's
    /// allowance for rounding.
    pub(super) fn new(t: &Tri, middle: &Vec3, flat: f64) -> Self {
        let center = t.a + (t.ab + t.ac) / 3.0;
        let e = t.a - center;
        let corners = [e, e + t.ab, e + t.ac];
        let edges = [t.ab, t.ac - t.ab, -t.ac];
        let mut normal = unit(&t.ab.cross(&t.ac));
        if corners.iter().any(|c| normal.dot(c).abs() > flat) {
            normal = Vec3::zeros();
        }
        let pack = |m: &Vec3, o: f64| [m.x as f32, m.y as f32, m.z as f32, o as f32];
        let radius = corners.iter().map(Vec3::norm).fold(0.0, f64::max);
        let mut parts = [pack(&(center - middle), radius); 5];
        parts[1] = pack(&normal, 0.0);
        for k in 0..3 {
            // across the edge and outward; along it where there is no normal
            let side = if normal == Vec3::zeros() {
                unit(&edges[k])
            } else {
                unit(&edges[k].cross(&normal))
            };
            let top = |o: f64, c: &Vec3| o.max(side.dot(c));
            let offset = corners.iter().fold(f64::NEG_INFINITY, top);
            parts[k + 2] = pack(&side, offset);
        }
        Self(parts)
    }

    /// Squared lower bounds of the distances to eight points.
    #[inline]
    pub(super) fn bounds(&self, points: &[Lanes; 3]) -> Lanes {
        let mut out = [0.0; WIDE];
        for i in 0..WIDE {
            let p = [points[0][i], points[1][i], points[2][i]];
            out[i] = prism(&p, |k, d| self.0[k][d]);
        }
        out
    }
}

impl Prisms {
    /// Places for triangles, all so far away that nothing finds them.
    pub(super) const NONE: Self = {
        let mut all = [[[0.0; WIDE]; 4]; 5];
        all[0][0] = [1e15; WIDE];
        Self(all)
    };

    /// Puts a triangle in its place.
    pub(super) fn set(&mut self, i: usize, prism: &Prism) {
        for (to, from) in self.0.iter_mut().zip(&prism.0) {
            for (lanes, &value) in to.iter_mut().zip(from) {
                lanes[i] = value;
            }
        }
    }

    /// Squared lower bounds of the distances to `p`.
    #[inline]
    pub(super) fn bounds(&self, p: &[f32; 3]) -> Lanes {
        let mut out = [0.0; WIDE];
        for i in 0..WIDE {
            out[i] = prism(p, |k, d| self.0[k][d][i]);
        }
        out
    }
}

/// The bound of a triangle with the numbers `b(k, d)`.
#[inline(always)]
fn prism(p: &[f32; 3], b: impl Fn(usize, usize) -> f32) -> f32 {
    let e = [p[0] - b(0, 0), p[1] - b(0, 1), p[2] - b(0, 2)];
    let z = e[0] * b(1, 0) + e[1] * b(1, 1) + e[2] * b(1, 2);
    let e2 = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    // less what the difference loses by rounding
    let rho2 = positive(e2 - z * z - 1e-6 * e2);
    let off = positive(rho2.sqrt() - b(0, 3));
    let s0 = e[0] * b(2, 0) + e[1] * b(2, 1) + e[2] * b(2, 2) - b(2, 3);
    let s1 = e[0] * b(3, 0) + e[1] * b(3, 1) + e[2] * b(3, 2) - b(3, 3);
    let s2 = e[0] * b(4, 0) + e[1] * b(4, 1) + e[2] * b(4, 2) - b(4, 3);
    let off = if s0 > off { s0 } else { off };
    let off = if s1 > off { s1 } else { off };
    let off = if s2 > off { s2 } else { off };
    z * z + off * off
}

fn unit(v: &Vec3) -> Vec3 {
    v.try_normalize(f64::MIN_POSITIVE).unwrap_or_default()
}
