//! Spheres on the vertices that keep cloth from passing through cloth: radii, pairs that do not
//! count because they are neighbours along the cloth, and the grid that finds pairs.
//!
//! # Radii
//!
//! Two moving surfaces can begin to cross only where a vertex meets a triangle or an edge meets an
//! edge. If at that moment some two of the vertices concerned are nearer than the sum of their
//! radii, they have been pushing each other apart before.
//!
//! * Edge and edge (lengths `l1`, `l2`) meeting in a point: with the weights of that point on the
//!   edges, the weighted mean of the squared distances of the four end pairs is
//!   `s (l1 - s) + t (l2 - t) <= (l1^2 + l2^2) / 4`. So one pair is within
//!   `sqrt(l1^2 + l2^2) / 2`, attained by edges that halve each other at a right angle.
//! * Vertex and triangle: a corner is within the covering radius of the triangle: the circumradius
//!   if it is acute, else the larger of `b / (2 cos C)`, `c / (2 cos B)`, where the bisectors of the
//!   short sides meet the longest.
//!
//! With `r_i = kappa L_i`, `L_i` the longest rest edge at vertex `i`, and `q` the ratio of largest
//! to smallest `L_i`, the first asks for `kappa >= sqrt(1 + q^2) / (2 (1 + q))` (0.354 on a uniform
//! mesh, never above 0.5) and the second for `kappa >= rho / (min_i L_i + L_min)` over the triangles.
//! The larger of both is taken, times `1 + reserve`: the reserve is what spheres may be pressed
//! into each other, and edges be stretched, before an edge can slip through.
//!
//! # Neighbours
//!
//! Cloth folded as tightly as the spheres let it be is a half circle between two layers `d` apart
//! (`d = r_a + r_b`), of arc `d pi / 2`. Pairs nearer than that along the sewn cloth are left out:
//! they cannot be pushed apart without stretching it. The way along the cloth is the shortest one
//! over edges and seam links; inside a panel the straight line replaces it where the way over
//! edges is at most 1.5 times longer (a zigzag through the mesh, not a way around a hole).
//!
//! # Yarns
//!
//! A node's sphere has the radius of the yarn. Segments are ways like edges, and so is the way from a node that rides
//! on a triangle or is blended into it to the triangle's vertices; a node and another point of its panel are
//! neighbours if the straight line between them is short, since yarns of one layer touch. Nodes that have become neighbours
//! because yarns have slid are so too ([`rods`](super::rods)). Images of a periodic cell are nodes like others.

use super::rods::Rods;
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::math::topology::edges;
use crate::math::{Vec2, Vec3};
use crate::system::points::Points;
use crate::yarn::Yarns;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Ratio of the way over edges to the straight line up to which they count as one way.
const DETOUR: f64 = 1.5;
/// Arc of the tightest fold over the distance of its layers.
const FOLD: f64 = std::f64::consts::FRAC_PI_2;

/// Radii and excluded pairs.
#[derive(Clone, Debug, Default)]
pub struct Spheres {
    /// Radius on each vertex [m]; 0 on a vertex without triangles, which meets nothing.
    pub radii: Vec<f64>,
    /// Largest radius [m].
    pub largest: f64,
    /// Part of `r_a + r_b` above what keeps edges from slipping through.
    pub reserve: f64,
    /// Excluded partners `b > a` of vertex `a`: `partners[starts[a]..starts[a + 1]]`, sorted.
    starts: Vec<u32>,
    partners: Vec<u32>,
    rods: Rods,
}

impl Spheres {
    /// Spheres of a garment. `reserve` is relative and must not be negative.
    pub fn new(
        cloth: &Cloth,
        points: &Points,
        yarns: Option<&Yarns>,
        reserve: f64,
    ) -> Result<Self> {
        if !(reserve.is_finite() && reserve >= 0.0) {
            return Err(Error::argument(format!(
                "reserve of the contact spheres {reserve} must not be negative"
            )));
        }
        let uv = &cloth.mesh.uv;
        let length = |a: u32, b: u32| (uv[a as usize] - uv[b as usize]).norm();
        let edges = edges(&cloth.mesh.triangles);
        let mut longest = vec![0.0_f64; uv.len()];
        for &[a, b] in &edges {
            for v in [a, b] {
                longest[v as usize] = longest[v as usize].max(length(a, b));
            }
        }
        let used = || longest.iter().copied().filter(|&l| l > 0.0);
        let smallest = used().fold(f64::INFINITY, f64::min);
        let mut kappa = 0.0;
        if smallest.is_finite() {
            let q = used().fold(0.0, f64::max) / smallest;
            kappa = (1.0 + q * q).sqrt() / (2.0 * (1.0 + q));
        }
        for t in &cloth.mesh.triangles {
            let around = t
                .iter()
                .map(|&v| longest[v as usize])
                .fold(f64::INFINITY, f64::min);
            let [a, b, c] = *t;
            let cover = covering_radius(length(b, c), length(c, a), length(a, b));
            kappa = kappa.max(cover / (around + smallest));
        }
        let mut radii = points.radii.clone();
        for (r, l) in radii.iter_mut().zip(&longest) {
            *r = kappa * (1.0 + reserve) * l;
        }
        let mut spheres = Self {
            largest: radii.iter().copied().fold(0.0, f64::max),
            radii,
            reserve,
            starts: vec![0],
            partners: Vec::new(),
            rods: yarns.map_or_else(Rods::default, |y| Rods::new(y, points.vertex_count as u32)),
        };
        let mut ways = ways(cloth, &edges, yarns);
        let coupling = &points.coupling;
        let blended = coupling.filter.iter().flat_map(|f| f.nodes());
        for rider in coupling.riders.list().iter().chain(blended) {
            // images lie as far from others as their yarns say
            if rider.vertices[0] as usize >= uv.len() {
                continue;
            }
            let place = |v: u32| uv[v as usize];
            let carried = rider.vertices.iter().zip(&rider.weights);
            let own: Vec2 = carried.map(|(v, w)| place(*v) * *w).sum();
            for v in rider.vertices {
                ways.push((rider.point, v, (place(v) - own).norm()));
            }
        }
        spheres.exclude(&Flat::new(cloth, yarns), &ways);
        Ok(spheres)
    }

    /// Distance below which two spheres press on each other [m].
    pub fn rest_distance(&self, a: u32, b: u32) -> f64 {
        self.radii[a as usize] + self.radii[b as usize]
    }

    /// Distance above which no edge can slip through between two spheres [m].
    pub fn safe_distance(&self, a: u32, b: u32) -> f64 {
        self.rest_distance(a, b) / (1.0 + self.reserve)
    }

    /// Takes the material coordinates of the yarns at the start of a step.
    pub fn follow(&mut self, u: &[f64]) {
        self.rods.follow(u);
    }

    /// Whether two vertices are neighbours along the cloth and so never meet.
    pub fn excluded(&self, a: u32, b: u32) -> bool {
        let (a, b) = (a.min(b), a.max(b));
        let (from, to) = (
            self.starts[a as usize] as usize,
            self.starts[a as usize + 1] as usize,
        );
        a == b
            || self.partners[from..to].binary_search(&b).is_ok()
            || self.rods.near(a, b, FOLD * self.rest_distance(a, b))
    }

    /// Number of excluded pairs.
    pub fn excluded_count(&self) -> usize {
        self.partners.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        8 * self.radii.len() + 4 * (self.starts.len() + self.partners.len()) + self.rods.bytes()
    }

    /// Shortest ways from every point, as far as a pair can count as neighbours.
    fn exclude(&mut self, flat: &Flat<'_>, ways: &[(u32, u32, f64)]) {
        let n = self.radii.len();
        let mut starts = vec![0_usize; n + 1];
        for &(a, b, _) in ways {
            starts[a as usize + 1] += 1;
            starts[b as usize + 1] += 1;
        }
        for v in 0..n {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut graph = vec![(0_u32, 0.0); starts[n]];
        for &(a, b, l) in ways {
            for (a, b) in [(a, b), (b, a)] {
                graph[next[a as usize]] = (b, l);
                next[a as usize] += 1;
            }
        }

        let mut distance = vec![f64::INFINITY; n];
        let mut touched = Vec::new();
        let mut heap = BinaryHeap::new();
        for a in 0..n as u32 {
            let reach = DETOUR * FOLD * (self.radii[a as usize] + self.largest);
            distance[a as usize] = 0.0;
            touched.push(a);
            heap.push(Reverse((Metres(0.0), a)));
            while let Some(Reverse((Metres(d), v))) = heap.pop() {
                if d > distance[v as usize] {
                    continue;
                }
                for &(w, l) in &graph[starts[v as usize]..starts[v as usize + 1]] {
                    let far = d + l;
                    if far <= reach && far < distance[w as usize] {
                        if distance[w as usize].is_infinite() {
                            touched.push(w);
                        }
                        distance[w as usize] = far;
                        heap.push(Reverse((Metres(far), w)));
                    }
                }
            }
            touched.sort_unstable();
            for b in touched.drain(..) {
                let way = std::mem::replace(&mut distance[b as usize], f64::INFINITY);
                let limit = FOLD * self.rest_distance(a, b);
                let straight = flat
                    .line(a, b)
                    .is_some_and(|(l, yarns)| l <= limit && (yarns || way <= DETOUR * l));
                if b > a && (way <= limit || straight) {
                    self.partners.push(b);
                }
            }
            self.starts.push(self.partners.len() as u32);
        }
    }
}

/// Where the points lie on their panels.
struct Flat<'a> {
    cloth: &'a Cloth,
    yarns: Option<&'a Yarns>,
}

impl<'a> Flat<'a> {
    fn new(cloth: &'a Cloth, yarns: Option<&'a Yarns>) -> Self {
        Self { cloth, yarns }
    }

    /// Panel, place, and whether it is a node of a yarn.
    fn place(&self, point: u32) -> (u32, Vec2, bool) {
        let (mesh, p) = (&self.cloth.mesh, point as usize);
        match self.yarns {
            Some(yarns) if p >= mesh.uv.len() => {
                let node = p - mesh.uv.len();
                (yarns.mesh.node_panel[node], yarns.mesh.uv[node], true)
            }
            _ => (mesh.vertex_panel[p], mesh.uv[p], false),
        }
    }

    /// Length of the straight line between points of one panel, and whether one is a node.
    fn line(&self, a: u32, b: u32) -> Option<(f64, bool)> {
        let (a, b) = (self.place(a), self.place(b));
        (a.0 == b.0).then(|| ((b.1 - a.1).norm(), a.2 || b.2))
    }
}

/// Ways along the sewn cloth: edges, links of seams, segments of yarns and their ties.
fn ways(cloth: &Cloth, edges: &[[u32; 2]], yarns: Option<&Yarns>) -> Vec<(u32, u32, f64)> {
    let uv = &cloth.mesh.uv;
    let length = |a: u32, b: u32| (uv[a as usize] - uv[b as usize]).norm();
    let mut ways: Vec<(u32, u32, f64)> = edges.iter().map(|&[a, b]| (a, b, length(a, b))).collect();
    for link in cloth.mesh.seams.iter().flat_map(|s| &s.links) {
        let [e0, e1] = link.edge;
        let whole = length(e0, e1);
        ways.push((link.vertex, e0, link.t.abs() * whole));
        ways.push((link.vertex, e1, (1.0 - link.t).abs() * whole));
    }
    if let Some(Yarns { mesh, split, .. }) = yarns {
        let first = uv.len() as u32;
        // yarns that have parted were in contact, and lie in one place at first
        let laid = (mesh.uv.len() - split.len()) as u32;
        for (new, origin) in (laid..).zip(split) {
            ways.push((first + origin, first + new, 0.0));
        }
        for y in 0..mesh.yarn_count() {
            for pair in mesh.yarn(y).windows(2) {
                let du = pair[1].u - pair[0].u;
                ways.push((first + pair[0].node, first + pair[1].node, du));
            }
        }
        for tie in &mesh.ties {
            let [a, b] = tie.segment.map(|n| mesh.uv[n as usize]);
            let whole = (b - a).norm();
            ways.push((first + tie.node, first + tie.segment[0], tie.t * whole));
            ways.push((
                first + tie.node,
                first + tie.segment[1],
                (1.0 - tie.t) * whole,
            ));
        }
    }
    ways
}

/// A length that a heap can order.
#[derive(Clone, Copy, PartialEq)]
struct Metres(f64);

impl Eq for Metres {}

impl PartialOrd for Metres {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Metres {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Smallest radius with which discs on the corners of a triangle cover it; sides in any order.
pub fn covering_radius(a: f64, b: f64, c: f64) -> f64 {
    let mut sides = [a, b, c];
    sides.sort_unstable_by(f64::total_cmp);
    let [c, b, a] = sides;
    if a * a > b * b + c * c {
        // Cosines at the ends of the longest side, from the law of cosines.
        let cos_c = ((a * a + b * b - c * c) / (2.0 * a * b)).max(0.5);
        let cos_b = (a * a + c * c - b * b) / (2.0 * a * c);
        let on_c = if cos_b > 0.0 {
            c / (2.0 * cos_b)
        } else {
            0.5 * a
        };
        return (b / (2.0 * cos_c)).max(on_c).min(0.5 * a);
    }
    let s = 0.5 * (a + b + c);
    let area = (s * (s - a) * (s - b) * (s - c)).max(0.0).sqrt();
    if area > 0.0 {
        a * b * c / (4.0 * area)
    } else {
        0.5 * a
    }
}

/// Finds pairs of points near each other: points sorted by the cell of a regular grid.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    /// Cell and point, sorted.
    cells: Vec<(u64, u32)>,
}

/// Bits of a cell's coordinate in its key.
const BITS: u32 = 20;

impl Grid {
    /// Calls `visit(a, b)`, `a < b`, once for every two points nearer than
    /// `reach[a] + reach[b]`, in an order that depends on the points alone.
    pub fn pairs(&mut self, x: &[Vec3], reach: &[f64], mut visit: impl FnMut(u32, u32)) {
        let largest = reach.iter().copied().fold(0.0, f64::max);
        let low = x.iter().fold(Vec3::repeat(f64::INFINITY), |m, p| m.inf(p));
        let high = x
            .iter()
            .fold(Vec3::repeat(f64::NEG_INFINITY), |m, p| m.sup(p));
        let extent = (high - low).max();
        // No cell is so small that coordinates overflow their bits.
        let cell = (2.0 * largest).max(extent / f64::from((1 << BITS) - 4));
        if !(cell.is_finite() && cell > 0.0) {
            return;
        }
        let key = |p: &Vec3| {
            let c = (p - low) / cell;
            // One cell is kept free below, so that a neighbour's coordinate is never negative.
            ((c.x as u64 + 1) << (2 * BITS)) | ((c.y as u64 + 1) << BITS) | (c.z as u64 + 1)
        };
        self.cells.clear();
        self.cells.extend(
            x.iter()
                .zip(0..)
                .filter(|(_, i)| reach[*i as usize] > 0.0)
                .map(|(p, i)| (key(p), i)),
        );
        self.cells.sort_unstable();

        let cells = &self.cells;
        let mut test = |a: u32, b: u32| {
            let d = reach[a as usize] + reach[b as usize];
            if (x[a as usize] - x[b as usize]).norm_squared() < d * d {
                visit(a.min(b), a.max(b));
            }
        };
        // Rows of three cells along z that come after a cell's own row: (dx, dy).
        let rows = [(0_i64, 1_i64), (1, -1), (1, 0), (1, 1)]
            .map(|(dx, dy)| ((dx << (2 * BITS)) + (dy << BITS)) as u64);
        // Keys grow along the walk, so each row's window only moves forward.
        let mut windows = [0_usize; 4];
        let mut from = 0;
        while from < cells.len() {
            let here = cells[from].0;
            let to = from + cells[from..].partition_point(|c| c.0 == here);
            let above = to + cells[to..].iter().take_while(|c| c.0 == here + 1).count();
            for k in from..to {
                for other in &cells[k + 1..above] {
                    test(cells[k].1, other.1);
                }
            }
            for (row, window) in rows.iter().zip(&mut windows) {
                let first = here.wrapping_add(*row) - 1;
                while *window < cells.len() && cells[*window].0 < first {
                    *window += 1;
                }
                for other in cells[*window..].iter().take_while(|c| c.0 <= first + 2) {
                    for own in &cells[from..to] {
                        test(own.1, other.1);
                    }
                }
            }
            from = to;
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        16 * self.cells.len()
    }
}
