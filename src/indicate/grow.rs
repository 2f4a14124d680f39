//! From errors at vertices to a region: where they are above a tolerance, rounded.
//!
//! With the smoothed error `e_v`, a root mean square over a vertex and its neighbours, sewn ones included, taken four times, the region of
//! a tolerance is
//!
//! ```text
//! S0 = {v : e_v > tolerance},   S1 = close(cross(S0)),   full = triangles with three corners in S1
//! ```
//!
//! Smoothing moves the border to where triangles are good enough. `cross` adds the other sides of seams with their neighbours, since a seam is
//! wholly yarns or wholly triangles; `close` what lies between two parts that are two edges apart. Then pieces of fewer than [`LEAST_PIECE`] triangles are left out, and holes of fewer than [`LARGEST_HOLE`]
//! filled, and triangles whose corners are all those of others are added. Every step keeps subsets subsets, so that the region of a smaller tolerance holds that of a larger one.

use crate::math::topology;
use crate::tri::GarmentMesh;

/// Passes of smoothing.
const PASSES: usize = 4;
/// Least number of triangles of a piece.
const LEAST_PIECE: usize = 6;
/// Number of triangles from which a hole stays.
const LARGEST_HOLE: usize = 12;

/// What regions of a mesh grow from.
pub struct Growth<'a> {
    mesh: &'a GarmentMesh,
    /// Vertices at each vertex, those sewn to it included.
    near: Vec<Vec<u32>>,
    /// Pairs of sewn vertices.
    sewn: Vec<[u32; 2]>,
    /// Triangles that share an edge, or a seam's.
    beside: Vec<Vec<u32>>,
    /// Smoothed error of each vertex.
    error: Vec<f64>,
    /// Which triangles may give way to yarns.
    may: Vec<bool>,
}

impl<'a> Growth<'a> {
    /// Of the errors of the vertices.
    pub fn new(mesh: &'a GarmentMesh, errors: &[f64], may: Vec<bool>) -> Self {
        let mut near: Vec<Vec<u32>> = vec![Vec::new(); mesh.uv.len()];
        let mut join = |a: u32, b: u32| {
            near[a as usize].push(b);
            near[b as usize].push(a);
        };
        for [a, b] in topology::edges(&mesh.triangles) {
            join(a, b);
        }
        let links = mesh.seams.iter().flat_map(|s| &s.links);
        let sewn: Vec<[u32; 2]> = links
            .map(|l| [l.vertex, l.edge[usize::from(l.t > 0.5)]])
            .collect();
        for [a, b] in &sewn {
            join(*a, *b);
        }
        for list in &mut near {
            list.sort_unstable();
            list.dedup();
        }
        let mut error = errors.to_vec();
        for _ in 0..PASSES {
            let mean = |v: usize| {
                let sum: f64 = near[v].iter().map(|w| error[*w as usize].powi(2)).sum();
                ((error[v].powi(2) + sum) / (1 + near[v].len()) as f64).sqrt()
            };
            error = (0..error.len()).map(mean).collect();
        }
        Self {
            beside: neighbours(mesh, &sewn),
            sewn,
            mesh,
            near,
            error,
            may,
        }
    }

    /// Tolerances at which the region changes.
    pub fn levels(&self) -> impl Iterator<Item = f64> {
        self.error.iter().copied()
    }

    /// The triangles of a tolerance's region.
    pub fn full(&self, tolerance: f64) -> Vec<bool> {
        let above: Vec<bool> = self.error.iter().map(|e| *e > tolerance).collect();
        let both = self.crossed(above);
        let closed = self.eroded(&self.dilated(&both));
        let corners = |t: usize| self.mesh.triangles[t].iter().all(|v| closed[*v as usize]);
        let mut full: Vec<bool> = (0..self.may.len())
            .map(|t| self.may[t] && corners(t))
            .collect();
        for piece in topology::pieces(&self.beside, &full) {
            if piece.len() < LEAST_PIECE {
                piece.iter().for_each(|t| full[*t as usize] = false);
            }
        }
        let bare: Vec<bool> = full.iter().map(|f| !f).collect();
        for hole in topology::pieces(&self.beside, &bare) {
            // what borders on no yarns is no hole, however small
            let inside = |t: &u32| self.beside[*t as usize].iter().any(|o| full[*o as usize]);
            if hole.len() < LARGEST_HOLE
                && hole.iter().all(|t| self.may[*t as usize])
                && hole.iter().any(inside)
            {
                hole.iter().for_each(|t| full[*t as usize] = true);
            }
        }
        self.close(&mut full);
        full
    }

    /// Adds the triangles whose corners are all those of others.
    fn close(&self, full: &mut [bool]) {
        let mut corners = vec![false; self.near.len()];
        for (tri, _) in self.mesh.triangles.iter().zip(&*full).filter(|p| *p.1) {
            tri.iter().for_each(|v| corners[*v as usize] = true);
        }
        for (full, tri) in full.iter_mut().zip(&self.mesh.triangles) {
            *full |= tri.iter().all(|v| corners[*v as usize]);
        }
    }

    /// Adds the other sides of seams, with their neighbours.
    fn crossed(&self, mut set: Vec<bool>) -> Vec<bool> {
        let over: Vec<u32> = (self.sewn.iter())
            .flat_map(|&[a, b]| [[a, b], [b, a]])
            .filter(|[from, _]| set[*from as usize])
            .map(|[_, to]| to)
            .collect();
        for v in over {
            set[v as usize] = true;
            for w in &self.near[v as usize] {
                set[*w as usize] = true;
            }
        }
        set
    }

    fn dilated(&self, set: &[bool]) -> Vec<bool> {
        let any = |v: usize| set[v] || self.near[v].iter().any(|w| set[*w as usize]);
        (0..set.len()).map(any).collect()
    }

    fn eroded(&self, set: &[bool]) -> Vec<bool> {
        let all = |v: usize| set[v] && self.near[v].iter().all(|w| set[*w as usize]);
        (0..set.len()).map(all).collect()
    }
}

/// Triangles beside each triangle: across an edge, or with a vertex that is sewn to one of its own.
fn neighbours(mesh: &GarmentMesh, sewn: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut beside = vec![Vec::new(); mesh.triangles.len()];
    for (_, [a, b]) in topology::inner_edges(&mesh.triangles) {
        beside[a as usize].push(b);
        beside[b as usize].push(a);
    }
    let mut at = vec![Vec::new(); mesh.uv.len()];
    for (t, tri) in (0..).zip(&mesh.triangles) {
        tri.iter().for_each(|v| at[*v as usize].push(t));
    }
    for [one, other] in sewn {
        for a in &at[*one as usize] {
            for b in &at[*other as usize] {
                beside[*a as usize].push(*b);
                beside[*b as usize].push(*a);
            }
        }
    }
    beside
}
