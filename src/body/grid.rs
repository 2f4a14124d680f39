//! A body given by signed distances on the nodes of a dense regular grid.
//!
//! Reconstruction: the quadratic B-spline of `spline`, not the plain trilinear interpolant (whose
//! gradient jumps at cell faces); it passes the nodes by O(h^3) instead of exactly. One layer of
//! nodes around the grid is extrapolated quadratically so that the whole box has 27 coefficients.
//!
//! Outside the box: when no node of the border has the other sign, the surface lies inside the box
//! and the value is `sqrt(d(q)^2 + |p - q|^2)` with `q` the nearest point of the box, which is never
//! more than the true distance and has its sign. When the surface leaves the box (a floor, a
//! terrain), the body is continued with the value of `q`.

use super::{Distance, spline};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::hash::Hash;

/// Largest number of nodes [1].
const MAX_NODES: usize = 1 << 27;

#[derive(Debug)]
pub(super) struct Grid {
    /// Nodes per axis of the caller's grid.
    counts: [usize; 3],
    origin: Vec3,
    h: f64,
    /// Spline coefficients, one layer wider than the grid on every side, `k` fastest.
    coefficients: Vec<f64>,
    /// Whether all border nodes have one sign.
    closed: bool,
}

impl Grid {
    /// Takes all that makes the grid into a hash.
    pub(super) fn add_to(&self, hash: &mut Hash) {
        hash.add(b"grid");
        for count in self.counts {
            hash.add(&(count as u64).to_le_bytes());
        }
        hash.numbers(self.origin.iter().copied().chain([self.h]));
        hash.numbers(self.coefficients.iter().copied());
    }

    pub(super) fn new(
        counts: [usize; 3],
        origin: [f64; 3],
        h: f64,
        values: &[f64],
    ) -> Result<Self> {
        let h = super::analytic::positive("grid cell size", h)?;
        if let Some(axis) = (0..3).find(|&d| !origin[d].is_finite()) {
            return Err(Error::argument(format!(
                "grid origin[{axis}] is {}; it must be finite",
                origin[axis]
            )));
        }
        if let Some(axis) = (0..3).find(|&d| counts[d] < 2) {
            return Err(Error::argument(format!(
                "grid has {} nodes along axis {axis}; at least 2 are needed",
                counts[axis]
            )));
        }
        let nodes = counts
            .iter()
            .try_fold(1usize, |n, &c| n.checked_mul(c.checked_add(2)?))
            .filter(|&n| n <= MAX_NODES);
        let Some(padded) = nodes else {
            return Err(Error::limit(format!(
                "grid of {counts:?} nodes exceeds the limit of {MAX_NODES} nodes with its border"
            )));
        };
        let wanted = counts[0] * counts[1] * counts[2];
        if values.len() != wanted {
            return Err(Error::new(
                crate::error::Status::Size,
                format!(
                    "grid of {counts:?} nodes needs {wanted} values, got {}",
                    values.len()
                ),
            ));
        }
        if let Some(n) = values.iter().position(|v| !v.is_finite()) {
            return Err(Error::argument(format!(
                "grid value {n} is {}; it must be finite",
                values[n]
            )));
        }
        let size = counts.map(|c| c + 2);
        let strides = [size[1] * size[2], size[2], 1];
        let mut f = vec![0.0; padded];
        let mut negative = false;
        let mut positive = false;
        for i in 0..counts[0] {
            for j in 0..counts[1] {
                for k in 0..counts[2] {
                    let v = values[(i * counts[1] + j) * counts[2] + k];
                    f[(i + 1) * strides[0] + (j + 1) * strides[1] + k + 1] = v;
                    let border = i == 0
                        || j == 0
                        || k == 0
                        || i + 1 == counts[0]
                        || j + 1 == counts[1]
                        || k + 1 == counts[2];
                    if border {
                        negative |= v <= 0.0;
                        positive |= v >= 0.0;
                    }
                }
            }
        }
        // extrapolate one layer per axis; later axes also fill the corners of earlier ones
        for d in 0..3 {
            let s = strides[d];
            for_each_line(&size, d, |start| {
                let n = counts[d];
                let at = |m: usize| start + m * s;
                let (lo, hi) = if n >= 3 {
                    (
                        3.0 * f[at(1)] - 3.0 * f[at(2)] + f[at(3)],
                        3.0 * f[at(n)] - 3.0 * f[at(n - 1)] + f[at(n - 2)],
                    )
                } else {
                    (2.0 * f[at(1)] - f[at(2)], 2.0 * f[at(n)] - f[at(n - 1)])
                };
                f[at(0)] = lo;
                f[at(n + 1)] = hi;
            });
        }
        // take the spline's smoothing out; on the outer layer the second difference of its
        // neighbour serves (the extrapolation made them equal)
        let mut coefficients = f.clone();
        for d in 0..3 {
            let s = strides[d];
            for_each_line(&size, d, |start| {
                for m in 0..size[d] {
                    let c = m.clamp(1, size[d] - 2);
                    let at = start + c * s;
                    let second = f[at - s] - 2.0 * f[at] + f[at + s];
                    coefficients[start + m * s] -= 0.125 * second;
                }
            });
        }
        Ok(Self {
            counts,
            origin: Vec3::from(origin),
            h,
            coefficients,
            closed: !(negative && positive),
        })
    }

    /// Clamped point, its coefficients, its place in the knot interval.
    fn locate(&self, p: &Vec3) -> (Vec3, [f64; 27], [f64; 3]) {
        let mut q = *p;
        let mut cell = [0usize; 3];
        let mut t = [0.0; 3];
        for d in 0..3 {
            let top = (self.counts[d] - 1) as f64;
            let u = (p[d] - self.origin[d]) / self.h;
            // a NaN point lands on node 0 and keeps its NaN in t
            let inside = u.clamp(0.0, top);
            if inside != u {
                q[d] = self.origin[d] + inside * self.h;
            }
            let node = (inside + 0.5).floor().clamp(0.0, top);
            cell[d] = node as usize;
            t[d] = inside - node;
        }
        let size = self.counts.map(|c| c + 2);
        let mut c = [0.0; 27];
        for i in 0..3 {
            for j in 0..3 {
                let row = ((cell[0] + i) * size[1] + cell[1] + j) * size[2] + cell[2];
                c[(3 * i + j) * 3..(3 * i + j) * 3 + 3]
                    .copy_from_slice(&self.coefficients[row..row + 3]);
            }
        }
        (q, c, t)
    }

    pub(super) fn distance(&self, p: &Vec3) -> Distance {
        let (q, c, t) = self.locate(p);
        let at = spline::evaluate(&c, &t, 1.0 / self.h);
        if q == *p {
            return at;
        }
        let e = p - q;
        if self.closed {
            return spline::beyond_box(&at, &e);
        }
        let keep = e.map(|c| if c == 0.0 { 1.0 } else { 0.0 });
        Distance {
            value: at.value,
            gradient: at.gradient.component_mul(&keep),
            hessian: at.hessian.component_mul(&(keep * keep.transpose())),
        }
    }

    /// Length of a cell [m].
    pub(super) fn cell_size(&self) -> f64 {
        self.h
    }

    /// Lowest and highest corner of the box [m].
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let top = Vec3::from_fn(|d, _| (self.counts[d] - 1) as f64 * self.h);
        (self.origin, self.origin + top)
    }
}

/// Calls `f` with the first index of every line along axis `d` of an array of `size`.
fn for_each_line(size: &[usize; 3], d: usize, mut f: impl FnMut(usize)) {
    let strides = [size[1] * size[2], size[2], 1];
    let (a, b) = ((d + 1) % 3, (d + 2) % 3);
    for i in 0..size[a] {
        for j in 0..size[b] {
            f(i * strides[a] + j * strides[b]);
        }
    }
}
