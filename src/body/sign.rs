//! Inside or outside of a closed triangle mesh.
//!
//! On a lattice: rays along the three axes through all nodes. Every triangle is rasterised once per
//! axis onto the rows it covers; along a row the winding number at a node is the number of entries
//! minus exits below it, and the node is inside where that is positive. Coverage uses edge
//! functions evaluated once per undirected edge (from the lower to the higher vertex number), so
//! that two triangles always agree about their common edge; a zero is decided as if the ray stood
//! at `(u + e, v + e^2)` (simulation of simplicity, Edelsbrunner and Muecke 1990), so that rays
//! through edges and vertices are no special case. A row whose crossings do not cancel abstains;
//! the three axes vote. Self-overlaps (winding 2) are inside, inverted folds (winding -1) outside.
//!
//! At a point: the generalized winding number (Jacobson, Kavan, Sorkine 2013) as the sum of exact
//! solid angles (Van Oosterom and Strackee 1983).

use crate::math::Vec3;

/// Crossings of all lattice rows along one axis.
pub(super) struct Rows {
    /// Axes of the row's place.
    u: usize,
    v: usize,
    lo: [i64; 2],
    n: [usize; 2],
    offsets: Vec<u32>,
    /// Coordinate along the axis and change of the winding number there, ascending per row.
    crossings: Vec<(f64, i8)>,
}

/// Rows covering `[lo, hi]` in units of `h`, at `(i + 1/2) h`.
fn range(lo: f64, hi: f64, h: f64) -> (i64, i64) {
    (
        (lo / h - 0.5).floor() as i64,
        (hi / h - 0.5).ceil() as i64 + 1,
    )
}

impl Rows {
    /// Number of rows that a mesh of these bounds has along an axis.
    pub(super) fn count(lo: &Vec3, hi: &Vec3, h: f64, axis: usize) -> f64 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        ((hi[u] - lo[u]) / h + 3.0) * ((hi[v] - lo[v]) / h + 3.0)
    }

    pub(super) fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        bounds: (Vec3, Vec3),
        h: f64,
        axis: usize,
    ) -> Self {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (u0, u1) = range(bounds.0[u], bounds.1[u], h);
        let (v0, v1) = range(bounds.0[v], bounds.1[v], h);
        let n = [(u1 - u0) as usize, (v1 - v0) as usize];
        let mut found: Vec<(u32, f64, i8)> = Vec::with_capacity(triangles.len());
        for tri in triangles {
            let p = tri.map(|i| positions[i as usize]);
            let us = p.map(|p| p[u]);
            let vs = p.map(|p| p[v]);
            let (a0, a1) = range(min3(us), max3(us), h);
            let (b0, b1) = range(min3(vs), max3(vs), h);
            for i in a0..a1 {
                let x = (i as f64 + 0.5) * h;
                for j in b0..b1 {
                    let y = (j as f64 + 0.5) * h;
                    // edge k is opposite to corner k
                    let mut e = [0.0; 3];
                    let mut positive = 0;
                    for k in 0..3 {
                        let (s, t) = ((k + 1) % 3, (k + 2) % 3);
                        let (value, up) = edge(tri[s], tri[t], us[s], vs[s], us[t], vs[t], x, y);
                        e[k] = value;
                        positive += i32::from(up);
                    }
                    let sum = e[0] + e[1] + e[2];
                    if (positive != 0 && positive != 3) || sum == 0.0 {
                        continue;
                    }
                    let at = (e[0] * p[0][axis] + e[1] * p[1][axis] + e[2] * p[2][axis]) / sum;
                    let at = at.clamp(min3(p.map(|p| p[axis])), max3(p.map(|p| p[axis])));
                    let row = (i - u0) as usize * n[1] + (j - v0) as usize;
                    // a triangle seen counter-clockwise from above is left, else entered
                    found.push((row as u32, at, if positive == 3 { -1 } else { 1 }));
                }
            }
        }
        found.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut offsets = vec![0u32; n[0] * n[1] + 1];
        for f in &found {
            offsets[f.0 as usize + 1] += 1;
        }
        for r in 0..n[0] * n[1] {
            offsets[r + 1] += offsets[r];
        }
        Self {
            u,
            v,
            lo: [u0, v0],
            n,
            offsets,
            crossings: found.into_iter().map(|f| (f.1, f.2)).collect(),
        }
    }

    /// Crossings of the row through a node, `None` if they do not cancel.
    fn row(&self, node: [i64; 3]) -> Option<&[(f64, i8)]> {
        let (i, j) = (node[self.u] - self.lo[0], node[self.v] - self.lo[1]);
        if i < 0 || j < 0 || i >= self.n[0] as i64 || j >= self.n[1] as i64 {
            return Some(&[]);
        }
        let r = i as usize * self.n[1] + j as usize;
        let row = &self.crossings[self.offsets[r] as usize..self.offsets[r + 1] as usize];
        (row.iter().map(|c| i32::from(c.1)).sum::<i32>() == 0).then_some(row)
    }
}

/// Whether the node `(i + 1/2) h` is inside, by vote of three axes; `None` when they tie.
pub(super) fn vote(rows: &[Rows; 3], node: [i64; 3], h: f64) -> Option<bool> {
    let mut balance = 0;
    for (axis, rows) in rows.iter().enumerate() {
        if let Some(row) = rows.row(node) {
            let x = (node[axis] as f64 + 0.5) * h;
            let winding: i32 = row
                .iter()
                .take_while(|c| c.0 < x)
                .map(|c| i32::from(c.1))
                .sum();
            balance += if winding > 0 { 1 } else { -1 };
        }
    }
    (balance != 0).then_some(balance > 0)
}

/// Twice the signed area of `(s, t, (x, y))` and the sign it counts with.
fn edge(s: u32, t: u32, su: f64, sv: f64, tu: f64, tv: f64, x: f64, y: f64) -> (f64, bool) {
    let flip = s > t;
    let (pu, pv, qu, qv) = if flip {
        (tu, tv, su, sv)
    } else {
        (su, sv, tu, tv)
    };
    let (du, dv) = (qu - pu, qv - pv);
    let value = du * (y - pv) - dv * (x - pu);
    let up = if value == 0.0 {
        dv < 0.0 || (dv == 0.0 && du > 0.0)
    } else {
        value > 0.0
    };
    (if flip { -value } else { value }, up != flip)
}

fn min3(x: [f64; 3]) -> f64 {
    x[0].min(x[1]).min(x[2])
}

fn max3(x: [f64; 3]) -> f64 {
    x[0].max(x[1]).max(x[2])
}

/// Generalized winding number at a point: 1 inside, 0 outside of a simple closed mesh. Costs one
/// solid angle per triangle.
pub(super) fn winding_number(positions: &[Vec3], triangles: &[[u32; 3]], p: &Vec3) -> f64 {
    let mut sum = 0.0;
    for tri in triangles {
        let [a, b, c] = tri.map(|v| positions[v as usize] - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let volume = a.dot(&b.cross(&c));
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        sum += volume.atan2(below);
    }
    sum / std::f64::consts::TAU
}
