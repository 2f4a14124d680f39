//! Checked topology of a closed triangle mesh.
//!
//! Accepted: closed, consistently oriented surfaces of any number of parts, which may intersect
//! each other, touch in a vertex (a pinched vertex) or share an edge between two pairs of
//! triangles; vertices repeated at the same place (texture seams) are welded for topology and
//! field, but keep their numbers. If the enclosed volume is negative every triangle is turned.
//! Refused: numbers that are not finite, indices out of range, fewer than 4 triangles, edges whose
//! triangles do not pair up in opposite directions, no volume.

use crate::error::{Error, Result, Status};
use crate::math::Vec3;

/// Most vertices or triangles of a body mesh.
const MAX_COUNT: usize = 20_000_000;

/// What was found in a body's mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshReport {
    /// Vertices that lie exactly on an earlier one and were welded to it.
    pub welded: usize,
    /// Vertices used by triangles, after welding.
    pub vertices: usize,
    /// Edges, after welding.
    pub edges: usize,
    /// Triangles.
    pub triangles: usize,
    /// Edges of more than two triangles.
    pub crowded_edges: usize,
    /// Vertices whose triangles form more than one fan.
    pub pinched: usize,
    /// Parts that hang together by edges.
    pub components: usize,
    /// Whether all triangles were turned because the volume was negative.
    pub flipped: bool,
    /// Enclosed volume [m^3].
    pub volume: f64,
    /// Area [m^2].
    pub area: f64,
    /// Median edge length [m].
    pub median_edge: f64,
}

impl MeshReport {
    /// Vertices - edges + triangles; 2 for a sphere.
    pub fn euler(&self) -> i64 {
        self.vertices as i64 - self.edges as i64 + self.triangles as i64
    }
}

/// Checked mesh: the caller's arrays and the welded triangles.
#[derive(Debug)]
pub(super) struct Topology {
    /// The caller's triangles, turned outward.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The same on welded vertices.
    pub(super) welded: Vec<[u32; 3]>,
    /// Welded vertices and the earlier vertex each lies on.
    doubles: Vec<(u32, u32)>,
    /// Number of vertices of the caller.
    count: usize,
    pub(super) report: MeshReport,
}

/// Positions as vectors; the first number that is not finite is refused.
pub(super) fn finite_positions(positions: &[[f64; 3]]) -> Result<Vec<Vec3>> {
    if positions.len() > MAX_COUNT {
        return Err(Error::limit(format!(
            "{} vertices exceed the limit of {MAX_COUNT}",
            positions.len()
        )));
    }
    let positions: Vec<Vec3> = positions.iter().map(|p| Vec3::from(*p)).collect();
    check_finite(&positions)?;
    Ok(positions)
}

fn check_finite(positions: &[Vec3]) -> Result<()> {
    match positions
        .iter()
        .position(|p| p.iter().any(|c| c.is_nan() || c.abs() > 1e9))
    {
        Some(v) => Err(Error::argument(format!(
            "vertex {v} is ({}, {}, {}); coordinates must be finite and within 1e9 m",
            positions[v].x, positions[v].y, positions[v].z
        ))),
        None => Ok(()),
    }
}

impl Topology {
    pub(super) fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        if triangles.len() > MAX_COUNT {
            return Err(Error::limit(format!(
                "{} triangles exceed the limit of {MAX_COUNT}",
                triangles.len()
            )));
        }
        if triangles.len() < 4 {
            return Err(Error::geometry(format!(
                "{} triangles cannot close a body; at least 4 are needed",
                triangles.len()
            )));
        }
        for (t, tri) in triangles.iter().enumerate() {
            if let Some(&v) = tri.iter().find(|&&v| v as usize >= positions.len()) {
                return Err(Error::argument(format!(
                    "triangle {t} names vertex {v}, but there are {} vertices",
                    positions.len()
                )));
            }
        }
        let representative = weld(positions);
        let mut welded: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| t.map(|v| representative[v as usize]))
            .collect();
        let edges = Edges::new(&welded);
        edges.check_closed(positions)?;
        let (mut volume, area) = measure(positions, &welded);
        let size = extent(positions, &welded);
        if volume.is_nan() || volume.abs() <= 1e-9 * size * size * size {
            return Err(Error::geometry(format!(
                "the mesh encloses {volume} m^3 within an extent of {size} m; a body needs \
                 volume{}",
                edges.turned_part(positions, &welded)
            )));
        }
        let flipped = volume < 0.0;
        let mut own = triangles.to_vec();
        if flipped {
            own.iter_mut().for_each(|t| t.swap(1, 2));
            welded.iter_mut().for_each(|t| t.swap(1, 2));
            volume = -volume;
        }
        let doubles: Vec<(u32, u32)> = representative
            .iter()
            .enumerate()
            .filter(|&(v, &r)| v as u32 != r)
            .map(|(v, &r)| (v as u32, r))
            .collect();
        let (pinched, components, used) = edges.fans(&welded, positions.len());
        let mut lengths: Vec<f64> = edges
            .unique
            .iter()
            .map(|e| (positions[e.0 as usize] - positions[e.1 as usize]).norm())
            .collect();
        let middle = lengths.len() / 2;
        let median_edge = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
        let report = MeshReport {
            welded: doubles.len(),
            vertices: used,
            edges: edges.unique.len(),
            triangles: triangles.len(),
            crowded_edges: edges.crowded,
            pinched,
            components,
            flipped,
            volume,
            area,
            median_edge,
        };
        Ok(Self {
            triangles: own,
            welded,
            doubles,
            count: positions.len(),
            report,
        })
    }

    /// Refuses positions that this topology cannot take.
    pub(super) fn check_deformation(&self, positions: &[Vec3]) -> Result<()> {
        if positions.len() != self.count {
            return Err(Error::new(
                Status::Size,
                format!(
                    "{} vertices given, the body has {}",
                    positions.len(),
                    self.count
                ),
            ));
        }
        check_finite(positions)?;
        let size = extent(positions, &self.welded);
        for &(v, r) in &self.doubles {
            let gap = (positions[v as usize] - positions[r as usize]).norm();
            if gap > 1e-6 * size {
                return Err(Error::geometry(format!(
                    "vertices {r} and {v} were one point of the body and are now {gap} m apart; \
                     limit {} m",
                    1e-6 * size
                )));
            }
        }
        let (volume, _) = measure(positions, &self.welded);
        if volume.is_nan() || volume <= 1e-9 * size * size * size {
            return Err(Error::geometry(format!(
                "the deformed mesh encloses {volume} m^3 within an extent of {size} m; it is flat \
                 or inside out"
            )));
        }
        Ok(())
    }
}

/// For every vertex the first vertex at exactly the same place.
fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    // adding zero makes -0 and 0 the same place
    let key = |v: u32| positions[v as usize].map(|c| c + 0.0);
    let compare = |a: u32, b: u32| {
        let (p, q) = (key(a), key(b));
        p.x.total_cmp(&q.x)
            .then(p.y.total_cmp(&q.y))
            .then(p.z.total_cmp(&q.z))
    };
    order.sort_unstable_by(|&a, &b| compare(a, b).then(a.cmp(&b)));
    let mut first = vec![0; positions.len()];
    let mut head = 0;
    for (n, &v) in order.iter().enumerate() {
        if n == 0 || compare(head, v).is_ne() {
            head = v;
        }
        first[v as usize] = head;
    }
    first
}

/// Enclosed volume about the first corner, and area.
fn measure(positions: &[Vec3], triangles: &[[u32; 3]]) -> (f64, f64) {
    let o = positions[triangles[0][0] as usize];
    let (mut volume, mut area) = (0.0, 0.0);
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize] - o);
        volume += a.dot(&b.cross(&c)) / 6.0;
        area += (b - a).cross(&(c - a)).norm() / 2.0;
    }
    (volume, area)
}

/// Longest side of the box around the used vertices.
fn extent(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let first = positions[triangles[0][0] as usize];
    let (lo, hi) = triangles.iter().flatten().fold((first, first), |b, &v| {
        let p = &positions[v as usize];
        (b.0.inf(p), b.1.sup(p))
    });
    (hi - lo).max()
}

/// Sides of all triangles, grouped by undirected edge.
struct Edges {
    /// `(low, high, triangle, runs from low to high)`, sorted.
    sides: Vec<(u32, u32, u32, bool)>,
    unique: Vec<(u32, u32)>,
    crowded: usize,
}

impl Edges {
    fn new(triangles: &[[u32; 3]]) -> Self {
        let mut sides = Vec::with_capacity(3 * triangles.len());
        for (t, tri) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (tri[k], tri[(k + 1) % 3]);
                if a != b {
                    sides.push((a.min(b), a.max(b), t as u32, a < b));
                }
            }
        }
        sides.sort_unstable();
        let mut unique = Vec::with_capacity(sides.len() / 2);
        let mut crowded = 0;
        for group in sides.chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
            unique.push((group[0].0, group[0].1));
            crowded += usize::from(group.len() > 2);
        }
        Self {
            sides,
            unique,
            crowded,
        }
    }

    fn check_closed(&self, positions: &[Vec3]) -> Result<()> {
        let mut open = 0;
        let mut turned = 0;
        let mut example = None;
        for group in self.sides.chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
            let forward = group.iter().filter(|s| s.3).count();
            if 2 * forward == group.len() {
                continue;
            }
            if group.len() % 2 == 1 {
                open += 1;
            } else {
                turned += 1;
            }
            example.get_or_insert(group[0]);
        }
        let Some((a, b, t, _)) = example else {
            return Ok(());
        };
        let m = (positions[a as usize] + positions[b as usize]) * 0.5;
        // seams whose two sides were rounded differently
        let p = positions[a as usize];
        let near = (0..positions.len())
            .filter(|&v| v != a as usize && positions[v] != p)
            .map(|v| ((positions[v] - p).norm(), v))
            .min_by(|s, t| s.0.total_cmp(&t.0));
        let length = (positions[b as usize] - p).norm();
        let hint = match near {
            Some((gap, v)) if open > 0 && gap < 1e-2 * length => format!(
                "; vertex {v} is {gap:.3e} m from vertex {a}: vertices that are one point must \
                 have the same coordinates"
            ),
            _ => String::new(),
        };
        Err(Error::geometry(format!(
            "the mesh is not closed: {open} open edges and {turned} edges whose triangles run the \
             same way, limit 0; for example edge ({a}, {b}) of triangle {t} at ({:.6}, {:.6}, \
             {:.6}) m{hint}",
            m.x, m.y, m.z
        )))
    }

    /// Triangles that hang together by edges.
    fn parts(&self, count: usize) -> Union {
        let mut parts = Union::new(count);
        for group in self.sides.chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
            for pair in group.windows(2) {
                parts.join(pair[0].2 as usize, pair[1].2 as usize);
            }
        }
        parts
    }

    /// Names a part that is turned inward beside others that are not, for messages.
    fn turned_part(&self, positions: &[Vec3], triangles: &[[u32; 3]]) -> String {
        let mut parts = self.parts(triangles.len());
        let mut volumes = vec![0.0; triangles.len()];
        for (t, tri) in triangles.iter().enumerate() {
            let root = parts.root(t);
            let o = positions[triangles[root][0] as usize];
            let [a, b, c] = tri.map(|v| positions[v as usize] - o);
            volumes[root] += a.dot(&b.cross(&c)) / 6.0;
        }
        let positive = volumes.iter().filter(|&&v| v > 0.0).count();
        let negative = volumes.iter().filter(|&&v| v < 0.0).count();
        match volumes.iter().position(|&v| v < 0.0) {
            Some(t) if positive > 0 => format!(
                "; {positive} parts are turned outward and {negative} inward, for example that of \
                 triangle {t} with {} m^3",
                volumes[t]
            ),
            _ => String::new(),
        }
    }

    /// Pinched vertices, components, used vertices.
    fn fans(&self, triangles: &[[u32; 3]], vertices: usize) -> (usize, usize, usize) {
        // corners are joined when an edge at their vertex joins their triangles
        let mut corners = Union::new(3 * triangles.len());
        let mut parts = self.parts(triangles.len());
        let corner = |t: u32, v: u32| {
            let tri = &triangles[t as usize];
            3 * t as usize + tri.iter().position(|&w| w == v).unwrap_or(0)
        };
        for group in self.sides.chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
            for pair in group.windows(2) {
                for v in [pair[0].0, pair[0].1] {
                    corners.join(corner(pair[0].2, v), corner(pair[1].2, v));
                }
            }
        }
        let mut fans = vec![0u32; vertices];
        let mut used = vec![false; vertices];
        for (t, tri) in triangles.iter().enumerate() {
            for k in 0..3 {
                used[tri[k] as usize] = true;
                let c = 3 * t + k;
                // a corner of a collapsed triangle stands for its first equal corner
                let doubled = tri[..k].contains(&tri[k]);
                fans[tri[k] as usize] += u32::from(!doubled && corners.root(c) == c);
            }
        }
        let pinched = fans.iter().filter(|&&f| f > 1).count();
        let components = (0..triangles.len()).filter(|&t| parts.root(t) == t).count();
        (pinched, components, used.iter().filter(|&&u| u).count())
    }
}

/// Disjoint sets.
struct Union(Vec<u32>);

impl Union {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] as usize != i {
            self.0[i] = self.0[self.0[i] as usize];
            i = self.0[i] as usize;
        }
        i
    }

    fn join(&mut self, i: usize, j: usize) {
        let (i, j) = (self.root(i), self.root(j));
        self.0[i.max(j)] = i.min(j) as u32;
    }
}
