//! Blended kinematics: nodes of yarns follow triangles as a whole and move beside that as they like.
//!
//! ```text
//! p = B v + F x,   F = I - E G^-1 E^T,   G = E^T E,   E^T (p - B v) = 0
//! ```
//!
//! `B` holds the barycentric weights of the nodes in the flat panel, `E` those of its columns that are supported
//! ([`support`](super::support)): the vertices `v` are the best match of the nodes `p` (Casafranca et al. 2020, equations 2 and
//! 3). A vertex whose column is not in `E` is a coordinate of its own that triangles alone hold. On request `E` has
//! further columns, one for each triangle: the mean of `p - B v` over the nodes of the triangle vanishes too.
//!
//! The system's unknowns are `v` and `p`, with the last equation as a constraint; `F` is never formed. Forces in the
//! paper's coordinates `(v, x)` are `(f_v + B^T f_p, F f_p)`. Everything is the same for the three
//! components of a vector and constant in time.

use super::riders::Rider;
use super::support::{Entries, Factor, supported};
use crate::error::{Error, Result};
use crate::math::Vec3;

const NONE: u32 = u32::MAX;
/// Most columns of `E`, supported or not: their choice takes dense algebra.
const MOST: usize = 1500;
/// Violation of a constraint over what it sums that steps may leave.
const ROUND_OFF: f64 = 1e-9;
/// Largest row sum of `|B^+|`.
pub const AMPLIFICATION: f64 = 30.0;

/// The constraints of all blended nodes.
#[derive(Clone, Debug)]
pub struct Filter {
    /// Nodes and what `B` makes them of.
    nodes: Vec<Rider>,
    /// Columns of `E` that a node has entries in: of the vertices of its triangle, and of the triangle's mean.
    columns: Vec<[u32; 4]>,
    /// Entry of each node in the column of its triangle's mean.
    mean: Vec<f64>,
    /// Vertices of the first columns of `E`, ascending.
    kept: Vec<u32>,
    /// Vertices of `B` that `E` leaves out, ascending.
    dropped: Vec<u32>,
    /// Number of columns of `E`.
    width: usize,
    factor: Factor,
    amplification: f64,
    /// Vertices without energy or mass of their own.
    bare: Vec<u32>,
    /// Nodes that hold the yarns when the triangles are away.
    anchors: Vec<u32>,
    carriers: Vec<Rider>,
    covered: Vec<bool>,
}

/// What a filter is made of.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// Nodes by point, each with the vertices of its triangle and its barycentric weights.
    pub nodes: Vec<Rider>,
    /// Triangle of each node if its mean is to be held, else empty.
    pub triangles: Vec<u32>,
    /// Vertices without energy or mass of their own, ascending.
    pub bare: Vec<u32>,
    /// A few nodes of each piece of yarn, without which nothing but the constraints would hold the piece.
    pub anchors: Vec<u32>,
    /// Every node of the yarns by point, with its triangle, be it in a ring or not.
    pub carriers: Vec<Rider>,
    /// For each vertex whether it has triangles that are simulated.
    pub covered: Vec<bool>,
}

impl Filter {
    /// The filter of some nodes.
    pub fn new(parts: Parts) -> Result<Self> {
        let mut vertices: Vec<u32> = parts.nodes.iter().flat_map(|n| n.vertices).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut triangles = parts.triangles.clone();
        triangles.sort_unstable();
        triangles.dedup();
        let (n, total) = (vertices.len(), vertices.len() + triangles.len());
        if total > MOST {
            return Err(Error::limit(format!(
                "{n} vertices of triangles are blended with yarns, with {} means of triangles; at most {MOST} can be: \
                 fewer rings, or rings = 0, or larger triangles",
                triangles.len()
            )));
        }
        let number = |v: &u32| vertices.partition_point(|w| w < v) as u32;
        let mut columns: Vec<[u32; 4]> = (parts.nodes.iter())
            .map(|node| {
                let [a, b, c] = node.vertices.map(|v| number(&v));
                [a, b, c, NONE]
            })
            .collect();
        let mut counts = vec![0.0; triangles.len()];
        for (t, columns) in parts.triangles.iter().zip(&mut columns) {
            let k = triangles.partition_point(|u| u < t);
            columns[3] = (n + k) as u32;
            counts[k] += 1.0;
        }
        let mean = columns.iter().map(|c| {
            let k = (c[3] as usize).wrapping_sub(n);
            counts.get(k).map_or(0.0, |count: &f64| 1.0 / count.sqrt())
        });
        let mean: Vec<f64> = mean.collect();
        let entries = gram(&parts.nodes, &columns, &mean);
        let mut support = supported(total, n, &entries);
        // of what is left the vertex that is thrown about most goes, until none is too much
        let amplification = loop {
            let (numbers, count) = numbered(&support[..n]);
            let factor = Factor::new(count, &of_vertices(&entries, n), &numbers)?;
            let (worst, size) = largest_row(&parts.nodes, &columns, &numbers, count, &factor);
            if size <= AMPLIFICATION {
                break size;
            }
            if let Some(k) = numbers.iter().position(|k| *k == worst) {
                support[k] = false;
            }
        };
        let (numbers, width) = numbered(&support);
        let pick = |wanted: bool| {
            let list = vertices.iter().zip(&support);
            list.filter(|(_, s)| **s == wanted)
                .map(|p| *p.0)
                .collect::<Vec<u32>>()
        };
        for list in &mut columns {
            *list = list.map(|k| numbers.get(k as usize).copied().unwrap_or(NONE));
        }
        Ok(Self {
            kept: pick(true),
            dropped: pick(false),
            factor: Factor::new(width, &entries, &numbers)?,
            nodes: parts.nodes,
            columns,
            mean,
            width,
            amplification,
            bare: parts.bare,
            anchors: parts.anchors,
            carriers: parts.carriers,
            covered: parts.covered,
        })
    }

    /// Blended nodes and what `B` makes them of.
    pub fn nodes(&self) -> &[Rider] {
        &self.nodes
    }

    /// Vertices that nodes determine.
    pub fn kept(&self) -> &[u32] {
        &self.kept
    }

    /// Vertices of the blended triangles that are too poorly supported by nodes.
    pub fn dropped(&self) -> &[u32] {
        &self.dropped
    }

    /// Vertices without energy or mass of their own.
    pub fn bare(&self) -> &[u32] {
        &self.bare
    }

    /// Nodes that hold the yarns when the triangles are away.
    pub fn anchors(&self) -> &[u32] {
        &self.anchors
    }

    /// The triangle that a node lies in, by point.
    pub fn carrier(&self, point: u32) -> Option<&Rider> {
        let first = self.carriers.first()?.point;
        self.carriers.get(point.checked_sub(first)? as usize)
    }

    /// Number of vertices, simulated or not.
    pub fn vertex_count(&self) -> usize {
        self.covered.len()
    }

    /// Whether a vertex has triangles that are simulated.
    pub fn is_covered(&self, vertex: u32) -> bool {
        self.covered[vertex as usize]
    }

    /// Largest row sum of `|B^+|`: how far a vertex may go when each node goes by one.
    pub fn amplification(&self) -> f64 {
        self.amplification
    }

    /// Number of constraints, for one component of space.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Whether nodes determine a vertex.
    pub fn keeps(&self, vertex: u32) -> bool {
        self.kept.binary_search(&vertex).is_ok()
    }

    /// Whether a host cannot hold a point, as the constraints place it.
    pub fn places(&self, point: u32) -> bool {
        let found = |list: &[u32]| list.binary_search(&point).is_ok();
        found(&self.bare)
            || self.bare.is_empty()
                && (self.nodes.binary_search_by_key(&point, |n| n.point)).is_ok()
    }

    /// Coefficients of the constraints `C (v, p) = 0`, `C = [-E^T B, E^T]`, by point.
    pub fn rows(&self) -> Vec<Vec<(u32, f64)>> {
        let mut rows = vec![Vec::new(); self.width];
        for (i, node) in self.nodes.iter().enumerate() {
            for (column, e) in self.entries(i) {
                let row: &mut Vec<(u32, f64)> = &mut rows[column];
                row.push((node.point, e));
                for (v, w) in node.vertices.iter().zip(&node.weights) {
                    row.push((*v, -e * w));
                }
            }
        }
        for row in &mut rows {
            row.sort_by_key(|entry| entry.0);
            let mut merged: Vec<(u32, f64)> = Vec::with_capacity(row.len());
            for (point, c) in row.iter() {
                match merged.last_mut() {
                    Some(last) if last.0 == *point => last.1 += c,
                    _ => merged.push((*point, *c)),
                }
            }
            *row = merged;
        }
        rows
    }

    /// Entries of node `i` in `E`.
    fn entries(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let [a, b, c] = self.nodes[i].weights;
        let list = self.columns[i].into_iter().zip([a, b, c, self.mean[i]]);
        list.filter(|(column, _)| *column != NONE)
            .map(|(column, e)| (column as usize, e))
    }

    /// `E^T y` of values `y` of the nodes.
    fn collect(&self, y: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
        let mut out = vec![Vec3::zeros(); self.width];
        for i in 0..self.nodes.len() {
            let y = y(i);
            for (column, e) in self.entries(i) {
                out[column] += y * e;
            }
        }
        out
    }

    /// `p - B v` of node `i`.
    fn beside(&self, i: usize, values: &[Vec3]) -> Vec3 {
        let node = &self.nodes[i];
        let base: Vec3 = (node.vertices.iter().zip(&node.weights))
            .map(|(v, w)| values[*v as usize] * *w)
            .sum();
        values[node.point as usize] - base
    }

    /// `p <- B v + F (p - B v)`: moves nodes, by as little as can be, to where the constraints hold. Vertices that have
    /// nothing of their own go to the nodes instead, `v <- B^+ p`.
    pub fn project(&self, values: &mut [Vec3]) {
        let mut r = self.collect(|i| self.beside(i, values));
        self.factor.solve(&mut r);
        if self.bare.is_empty() {
            self.subtract(&r, values);
        } else {
            for (v, r) in self.kept.iter().zip(&r) {
                values[*v as usize] += r;
            }
        }
    }

    /// Lets the constraints hold where they do not: nodes follow the vertices, as [`project`](Self::project) moves them, and
    /// vertices that have nothing of their own go to the nodes. Nothing moves where round-off alone breaks them.
    pub fn settle(&self, values: &mut [Vec3]) {
        let r = self.excess(values);
        if self.bare.is_empty() {
            self.subtract(&r, values);
        }
        for (v, r) in self.kept.iter().zip(&r) {
            if self.bare.binary_search(v).is_ok() {
                values[*v as usize] += r;
            }
        }
    }

    /// `G^-1 E^T (p - B v)`, zero where that is round-off.
    fn excess(&self, values: &[Vec3]) -> Vec<Vec3> {
        let mut sizes = vec![0.0; self.width];
        for (i, node) in self.nodes.iter().enumerate() {
            for (column, e) in self.entries(i) {
                sizes[column] += e.abs() * values[node.point as usize].norm();
            }
        }
        let mut r = self.collect(|i| self.beside(i, values));
        for (r, size) in r.iter_mut().zip(&sizes) {
            if r.norm() <= ROUND_OFF * size {
                *r = Vec3::zeros();
            }
        }
        self.factor.solve(&mut r);
        r
    }

    /// `p -= E r`.
    fn subtract(&self, r: &[Vec3], values: &mut [Vec3]) {
        for (i, node) in self.nodes.iter().enumerate() {
            let moved: Vec3 = self.entries(i).map(|(column, e)| r[column] * e).sum();
            values[node.point as usize] -= moved;
        }
    }

    /// A gradient by `(v, p)` as one by the paper's coordinates: `(g_v + B^T g_p, F g_p)`.
    pub fn gather(&self, gradient: &mut [Vec3]) {
        for node in &self.nodes {
            let g = gradient[node.point as usize];
            for (v, w) in node.vertices.iter().zip(&node.weights) {
                gradient[*v as usize] += g * *w;
            }
        }
        let mut r = self.collect(|i| gradient[self.nodes[i].point as usize]);
        self.factor.solve(&mut r);
        self.subtract(&r, gradient);
    }

    /// A residual by `(v, p)` without what it has along `C^T`: `r - C^T G^-1 E^T r_p`, which does the same work in every motion that
    /// the constraints admit.
    pub fn restrict(&self, residual: &mut [Vec3]) {
        let mut r = self.collect(|i| residual[self.nodes[i].point as usize]);
        self.factor.solve(&mut r);
        for (i, node) in self.nodes.iter().enumerate() {
            let part: Vec3 = self.entries(i).map(|(column, e)| r[column] * e).sum();
            residual[node.point as usize] -= part;
            for (v, w) in node.vertices.iter().zip(&node.weights) {
                residual[*v as usize] += part * *w;
            }
        }
    }

    /// How far the constraints are from holding: the largest weighted mean of `p - B v` over the nodes of a column.
    pub fn violation(&self, values: &[Vec3]) -> f64 {
        let mut sums = vec![0.0; self.width];
        for i in 0..self.nodes.len() {
            for (column, e) in self.entries(i) {
                sums[column] += e.abs();
            }
        }
        let r = self.collect(|i| self.beside(i, values));
        let means = r.iter().zip(&sums).map(|(r, s)| r.norm() / s);
        means.fold(0.0, f64::max)
    }

    /// Bytes held, the factor not counted.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * (size_of::<Rider>() + 24) + 4 * (self.kept.len() + self.dropped.len())
    }
}

fn gram(nodes: &[Rider], columns: &[[u32; 4]], mean: &[f64]) -> Entries {
    let mut entries = Entries::new();
    for ((node, columns), mean) in nodes.iter().zip(columns).zip(mean) {
        let [a, b, c] = node.weights;
        let e = [a, b, c, *mean];
        for i in 0..4 {
            for j in 0..4 {
                let (k, l) = (columns[i], columns[j]);
                if k != NONE && l != NONE && k >= l {
                    entries.push((k, l, e[i] * e[j]));
                }
            }
        }
    }
    entries
}

fn of_vertices(entries: &Entries, n: usize) -> Entries {
    let list = entries.iter().copied();
    list.filter(|(i, j, _)| (*i as usize) < n && (*j as usize) < n)
        .collect()
}

/// Numbers of those that stay, and how many there are.
fn numbered(stay: &[bool]) -> (Vec<u32>, usize) {
    let mut count = 0;
    let numbers = stay
        .iter()
        .map(|s| {
            let number = if *s { count } else { NONE };
            count += u32::from(*s);
            number
        })
        .collect();
    (numbers, count as usize)
}

/// The row of `B^+ = G^-1 B^T` with the largest sum of absolute entries, and that sum.
fn largest_row(
    nodes: &[Rider],
    columns: &[[u32; 4]],
    numbers: &[u32],
    count: usize,
    factor: &Factor,
) -> (u32, f64) {
    let mut worst = (0, 0.0);
    for k in 0..count {
        let g = factor.column(k);
        let sum: f64 = nodes
            .iter()
            .zip(columns)
            .map(|(node, columns)| {
                let entry = (columns.iter().zip(&node.weights))
                    .map(|(c, w)| g.get(numbers[*c as usize] as usize).map_or(0.0, |g| g * w));
                entry.sum::<f64>().abs()
            })
            .sum();
        if sum > worst.1 || sum.is_nan() {
            worst = (k as u32, if sum.is_nan() { f64::INFINITY } else { sum });
        }
    }
    worst
}
