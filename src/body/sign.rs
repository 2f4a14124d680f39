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

use super::floor;
use crate::math::Vec3;
use crate::math::parallel::Workers;

/// Triangles that one piece of work rasterises.
const CHUNK: usize = 4096;

/// Lattice rows along the three axes in blocks of 4 x 4, some of them marked.
pub(super) struct Blocks {
    lo: [i64; 3],
    n: [usize; 3],
    marks: [Vec<bool>; 3],
}

impl Blocks {
    /// The rows of a box of bricks.
    pub(super) fn new(lo: [i64; 3], n: [usize; 3]) -> Self {
        let marks = [0, 1, 2].map(|a| vec![false; n[(a + 1) % 3] * n[(a + 2) % 3]]);
        Self { lo, n, marks }
    }

    fn index(&self, axis: usize, brick: [i64; 3]) -> usize {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        (brick[u] - self.lo[u]) as usize * self.n[v] + (brick[v] - self.lo[v]) as usize
    }

    /// Marks the rows through a brick of the box.
    pub(super) fn mark_brick(&mut self, brick: [i64; 3]) {
        for axis in 0..3 {
            let i = self.index(axis, brick);
            self.marks[axis][i] = true;
        }
    }

    /// Marks the rows that can meet `[lo, hi]`.
    pub(super) fn mark_box(&mut self, lo: &Vec3, hi: &Vec3, h: f64) {
        let range: [(i64, i64); 3] = [0, 1, 2].map(|d| {
            let (a, b) = range(lo[d], hi[d], h);
            let last = self.lo[d] + self.n[d] as i64;
            ((a >> 2).max(self.lo[d]), ((b + 3) >> 2).min(last))
        });
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for i in range[u].0..range[u].1 {
                let row = (i - self.lo[u]) as usize * self.n[v];
                for j in range[v].0..range[v].1 {
                    self.marks[axis][row + (j - self.lo[v]) as usize] = true;
                }
            }
        }
    }

    /// Whether a row through a brick of the box is marked.
    pub(super) fn touches(&self, brick: [i64; 3]) -> bool {
        (0..3).any(|axis| self.marks[axis][self.index(axis, brick)])
    }

    fn has_row(&self, axis: usize, i: i64, j: i64) -> bool {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (i, j) = ((i >> 2) - self.lo[u], (j >> 2) - self.lo[v]);
        i >= 0
            && j >= 0
            && i < self.n[u] as i64
            && j < self.n[v] as i64
            && self.marks[axis][i as usize * self.n[v] + j as usize]
    }
}

/// Crossings of the lattice rows along one axis.
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

/// Row, coordinate along the axis, change of the winding number.
type Crossing = (u32, f64, i8);

/// Rows that can meet `[lo, hi]`, at `(i + 1/2) h`, and none or few that cannot.
fn range(lo: f64, hi: f64, h: f64) -> (i64, i64) {
    let (a, b) = (lo / h - 0.5, hi / h - 0.5);
    let pad = 1e-6 + 1e-15 * a.abs().max(b.abs());
    (-floor(pad - a), floor(b + pad) + 1)
}

impl Rows {
    /// Number of rows that a mesh of these bounds has along an axis.
    pub(super) fn count(lo: &Vec3, hi: &Vec3, h: f64, axis: usize) -> f64 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        ((hi[u] - lo[u]) / h + 3.0) * ((hi[v] - lo[v]) / h + 3.0)
    }

    /// The rows along the three axes; with `wanted`, the marked ones alone.
    pub(super) fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        bounds: (Vec3, Vec3),
        h: f64,
        wanted: Option<&Blocks>,
        workers: &Workers,
    ) -> [Self; 3] {
        let mut all: [Self; 3] = std::array::from_fn(|axis| {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let (u0, u1) = range(bounds.0[u], bounds.1[u], h);
            let (v0, v1) = range(bounds.0[v], bounds.1[v], h);
            let n = [(u1 - u0).max(0) as usize, (v1 - v0).max(0) as usize];
            Self {
                u,
                v,
                lo: [u0, v0],
                n,
                offsets: vec![0; n[0] * n[1] + 1],
                crossings: Vec::new(),
            }
        });
        let mut found: Vec<[Vec<Crossing>; 3]> = Vec::new();
        found.resize_with(triangles.len().div_ceil(CHUNK), Default::default);
        let rows = &all;
        workers.chunks(&mut found, 1, |chunk, out| {
            let end = triangles.len().min((chunk + 1) * CHUNK);
            for tri in &triangles[chunk * CHUNK..end] {
                let p = tri.map(|i| positions[i as usize]);
                for axis in 0..3 {
                    rows[axis].rasterise(axis, tri, &p, h, wanted, &mut out[0][axis]);
                }
            }
        });
        workers.chunks(&mut all, 1, |axis, rows| {
            rows[0].gather(found.iter().flat_map(|f| f[axis].iter().copied()));
        });
        all
    }

    /// Crossings of one triangle.
    fn rasterise(
        &self,
        axis: usize,
        tri: &[u32; 3],
        p: &[Vec3; 3],
        h: f64,
        wanted: Option<&Blocks>,
        out: &mut Vec<Crossing>,
    ) {
        let us = p.map(|p| p[self.u]);
        let vs = p.map(|p| p[self.v]);
        let (a0, a1) = range(min3(us), max3(us), h);
        let (b0, b1) = range(min3(vs), max3(vs), h);
        // the mesh's own rows hold all of it but for what `range` pads
        let (a0, a1) = (a0.max(self.lo[0]), a1.min(self.lo[0] + self.n[0] as i64));
        let (b0, b1) = (b0.max(self.lo[1]), b1.min(self.lo[1] + self.n[1] as i64));
        for i in a0..a1 {
            let x = (i as f64 + 0.5) * h;
            for j in b0..b1 {
                if wanted.is_some_and(|w| !w.has_row(axis, i, j)) {
                    continue;
                }
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
                let row = (i - self.lo[0]) as usize * self.n[1] + (j - self.lo[1]) as usize;
                // a triangle seen counter-clockwise from above is left, else entered
                out.push((row as u32, at, if positive == 3 { -1 } else { 1 }));
            }
        }
    }

    /// Sorts crossings into their rows.
    fn gather(&mut self, found: impl Iterator<Item = Crossing> + Clone) {
        for f in found.clone() {
            self.offsets[f.0 as usize + 1] += 1;
        }
        for r in 1..self.offsets.len() {
            self.offsets[r] += self.offsets[r - 1];
        }
        let total = self.offsets.last().map_or(0, |&o| o as usize);
        self.crossings = vec![(0.0, 0); total];
        let mut next = self.offsets.clone();
        for (row, at, change) in found {
            let place = &mut next[row as usize];
            self.crossings[*place as usize] = (at, change);
            *place += 1;
        }
        for r in self.offsets.windows(2) {
            self.crossings[r[0] as usize..r[1] as usize]
                .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        }
    }

    /// Crossings of the row through a node, `None` if they do not cancel.
    fn row(&self, i: i64, j: i64) -> Option<&[(f64, i8)]> {
        let (i, j) = (i - self.lo[0], j - self.lo[1]);
        if i < 0 || j < 0 || i >= self.n[0] as i64 || j >= self.n[1] as i64 {
            return Some(&[]);
        }
        let r = i as usize * self.n[1] + j as usize;
        let row = &self.crossings[self.offsets[r] as usize..self.offsets[r + 1] as usize];
        (row.iter().map(|c| i32::from(c.1)).sum::<i32>() == 0).then_some(row)
    }
}

/// Which nodes of a brick are inside by vote of the three axes, and which have no majority; bit
/// `(4 x + y) 4 + z` stands for node `(x, y, z)`.
pub(super) fn vote(rows: &[Rows; 3], brick: [i64; 3], h: f64) -> (u64, u64) {
    let mut balance = [0i8; 64];
    for (axis, rows) in rows.iter().enumerate() {
        let stride = 1usize << (4 - 2 * axis);
        let (su, sv) = (1usize << (4 - 2 * rows.u), 1usize << (4 - 2 * rows.v));
        for i in 0..4 {
            for j in 0..4 {
                let Some(row) = rows.row(4 * brick[rows.u] + i, 4 * brick[rows.v] + j) else {
                    continue;
                };
                let mut crossings = row.iter().peekable();
                let mut winding = 0;
                for k in 0..4 {
                    let x = ((4 * brick[axis] + k) as f64 + 0.5) * h;
                    while let Some(c) = crossings.next_if(|c| c.0 < x) {
                        winding += i32::from(c.1);
                    }
                    let n = i as usize * su + j as usize * sv + k as usize * stride;
                    balance[n] += if winding > 0 { 1 } else { -1 };
                }
            }
        }
    }
    let (mut inside, mut open) = (0, 0);
    for (n, &b) in balance.iter().enumerate() {
        inside |= u64::from(b > 0) << n;
        open |= u64::from(b == 0) << n;
    }
    (inside, open)
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
