//! Barycentric transfer from a coarse to a fine mesh of the same garment.
//!
//! A vertex on a panel's boundary is found by its fraction of arc length along its edge: it belongs
//! to the coarse triangle on the boundary piece that holds the same fraction, so that the two sides
//! of a slit are never mistaken and matching seam vertices stay matched. Other vertices are located
//! in a grid of buckets; a vertex outside the coarse outline (a curve cut coarsely) takes the nearest
//! triangle and extrapolates. Either way a field that is linear over a panel is carried exactly.

use super::{GarmentMesh, Transfer};
use crate::error::{Error, Result};
use crate::math::{Vec2, Vec3};
use crate::pattern::outline::point_distance;

impl Transfer {
    /// Locates every vertex of `fine` in `coarse`; the two must have the same panels and edges.
    pub fn new(coarse: &GarmentMesh, fine: &GarmentMesh) -> Result<Self> {
        let panels = coarse.panel_starts.len().saturating_sub(1);
        if fine.panel_starts.len() != coarse.panel_starts.len() {
            return Err(Error::argument(format!(
                "coarse mesh has {panels} panels, fine mesh {}",
                fine.panel_starts.len().saturating_sub(1)
            )));
        }
        let mut of_panel: Vec<Vec<u32>> = vec![Vec::new(); panels];
        for (k, panel) in coarse.triangle_panel.iter().enumerate() {
            of_panel[*panel as usize].push(k as u32);
        }
        let sides = Sides::new(coarse);
        let mut triangle = vec![u32::MAX; fine.uv.len()];
        for (panel, list) in of_panel.iter().enumerate() {
            if list.is_empty() {
                return Err(Error::argument(format!(
                    "panel {panel} has no triangles in the coarse mesh"
                )));
            }
            let (from, to) = (&coarse.edge_vertices[panel], &fine.edge_vertices[panel]);
            if from.len() != to.len() {
                return Err(Error::argument(format!(
                    "panel {panel} has {} edges in the coarse mesh, {} in the fine one",
                    from.len(),
                    to.len()
                )));
            }
            for (coarse_edge, fine_edge) in from.iter().zip(to) {
                if coarse_edge.len() < 2 || fine_edge.len() < 2 {
                    continue;
                }
                let (from, to) = (fractions(coarse, coarse_edge), fractions(fine, fine_edge));
                for (vertex, x) in fine_edge.iter().zip(&to) {
                    let piece = from.partition_point(|y| y <= x).clamp(1, from.len() - 1) - 1;
                    let ends = [coarse_edge[piece], coarse_edge[piece + 1]];
                    if let Some(t) = sides.find(ends) {
                        triangle[*vertex as usize] = t;
                    }
                }
            }
            let buckets = Buckets::new(coarse, list);
            let range = fine.panel_starts[panel] as usize..fine.panel_starts[panel + 1] as usize;
            for vertex in range {
                if triangle[vertex] == u32::MAX {
                    triangle[vertex] = buckets.locate(coarse, list, fine.uv[vertex]);
                }
            }
        }
        let weights = triangle
            .iter()
            .zip(&fine.uv)
            .map(|(t, p)| barycentric(corners(coarse, *t), *p))
            .collect();
        Ok(Self { triangle, weights })
    }

    /// Locates points of panels, by panel and flat coordinates [m], in a mesh.
    pub fn of_points(mesh: &GarmentMesh, panels: &[u32], uv: &[Vec2]) -> Result<Self> {
        let count = mesh.panel_starts.len().saturating_sub(1);
        let mut of_panel: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (k, panel) in mesh.triangle_panel.iter().enumerate() {
            of_panel[*panel as usize].push(k as u32);
        }
        let mut buckets: Vec<Option<Buckets>> = (0..count).map(|_| None).collect();
        let mut out = Self::default();
        for (panel, p) in panels.iter().zip(uv) {
            let list = of_panel.get(*panel as usize).filter(|l| !l.is_empty());
            let Some(list) = list else {
                return Err(Error::argument(format!("panel {panel} has no triangles")));
            };
            let grid = buckets[*panel as usize].get_or_insert_with(|| Buckets::new(mesh, list));
            let t = grid.locate(mesh, list, *p);
            out.triangle.push(t);
            out.weights.push(barycentric(corners(mesh, t), *p));
        }
        Ok(out)
    }

    /// Values at the fine vertices from values at the coarse vertices.
    pub fn apply(&self, coarse_triangles: &[[u32; 3]], coarse_values: &[Vec3]) -> Vec<Vec3> {
        self.triangle
            .iter()
            .zip(&self.weights)
            .map(|(t, w)| {
                let [a, b, c] = coarse_triangles[*t as usize].map(|v| coarse_values[v as usize]);
                w[0] * a + w[1] * b + w[2] * c
            })
            .collect()
    }
}

fn corners(mesh: &GarmentMesh, triangle: u32) -> [Vec2; 3] {
    mesh.triangles[triangle as usize].map(|v| mesh.uv[v as usize])
}

/// Fractions of the length of a chain of vertices.
fn fractions(mesh: &GarmentMesh, chain: &[u32]) -> Vec<f64> {
    let mut list = vec![0.0];
    let mut sum = 0.0;
    for w in chain.windows(2) {
        sum += (mesh.uv[w[1] as usize] - mesh.uv[w[0] as usize]).norm();
        list.push(sum);
    }
    list.iter().map(|x| x / sum).collect()
}

/// Triangles by their edges.
struct Sides(Vec<([u32; 2], u32)>);

impl Sides {
    fn new(mesh: &GarmentMesh) -> Self {
        let mut list: Vec<([u32; 2], u32)> = mesh
            .triangles
            .iter()
            .enumerate()
            .flat_map(|(k, &[a, b, c])| [[a, b], [b, c], [c, a]].map(|edge| (edge, k as u32)))
            .map(|([a, b], k)| ([a.min(b), a.max(b)], k))
            .collect();
        list.sort_unstable();
        Self(list)
    }

    /// The first triangle with this edge.
    fn find(&self, [a, b]: [u32; 2]) -> Option<u32> {
        let edge = [a.min(b), a.max(b)];
        let k = self.0.partition_point(|(other, _)| *other < edge);
        self.0
            .get(k)
            .filter(|(other, _)| *other == edge)
            .map(|p| p.1)
    }
}

/// Barycentric coordinates, also outside; a triangle without area gives its first corner.
fn barycentric([a, b, c]: [Vec2; 3], p: Vec2) -> [f64; 3] {
    let cross = |u: Vec2, v: Vec2| u.x * v.y - u.y * v.x;
    let twice = cross(b - a, c - a);
    if twice == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (wb, wc) = (cross(p - a, c - a) / twice, cross(b - a, p - a) / twice);
    [1.0 - wb - wc, wb, wc]
}

/// Distance of a point from a triangle [m], zero inside.
fn distance(corners: [Vec2; 3], p: Vec2) -> f64 {
    if barycentric(corners, p).iter().all(|w| *w >= 0.0) {
        return 0.0;
    }
    let [a, b, c] = corners;
    point_distance(p, a, b)
        .min(point_distance(p, b, c))
        .min(point_distance(p, c, a))
}

/// Grid over one panel; every cell lists the triangles whose boxes meet it.
struct Buckets {
    low: Vec2,
    cell: f64,
    columns: usize,
    rows: usize,
    starts: Vec<usize>,
    /// Positions in the panel's list of triangles.
    entries: Vec<u32>,
}

impl Buckets {
    fn new(mesh: &GarmentMesh, list: &[u32]) -> Self {
        let boxes: Vec<(Vec2, Vec2)> = list
            .iter()
            .map(|t| {
                let [a, b, c] = corners(mesh, *t);
                (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
            })
            .collect();
        let (low, high) = boxes
            .iter()
            .copied()
            .reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)))
            .unwrap_or((Vec2::zeros(), Vec2::zeros()));
        let extent = high - low;
        // about one triangle to a cell, and never more than a few cells to a triangle
        let cell = (extent.x * extent.y / list.len() as f64)
            .sqrt()
            .max(extent.max() / 4000.0)
            .max(1e-12);
        let columns = (extent.x / cell) as usize + 1;
        let rows = (extent.y / cell) as usize + 1;
        let mut buckets = Self {
            low,
            cell,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            entries: Vec::new(),
        };
        // count, then fill, in the order of the triangles
        for b in &boxes {
            buckets.cells(b, |cell, starts, _| starts[cell + 1] += 1);
        }
        for k in 1..buckets.starts.len() {
            buckets.starts[k] += buckets.starts[k - 1];
        }
        let mut fill = buckets.starts.clone();
        buckets.entries = vec![0; buckets.starts[columns * rows]];
        for (k, b) in boxes.iter().enumerate() {
            buckets.cells(b, |cell, _, entries| {
                entries[fill[cell]] = k as u32;
                fill[cell] += 1;
            });
        }
        buckets
    }

    fn cell_of(&self, p: Vec2) -> (usize, usize) {
        let at = |x: f64, n: usize| ((x / self.cell).max(0.0) as usize).min(n - 1);
        (
            at(p.x - self.low.x, self.columns),
            at(p.y - self.low.y, self.rows),
        )
    }

    fn cells(&mut self, b: &(Vec2, Vec2), mut f: impl FnMut(usize, &mut [usize], &mut [u32])) {
        let ((i0, j0), (i1, j1)) = (self.cell_of(b.0), self.cell_of(b.1));
        for j in j0..=j1 {
            for i in i0..=i1 {
                f(j * self.columns + i, &mut self.starts, &mut self.entries);
            }
        }
    }

    /// The nearest triangle of the panel; the first of equals.
    fn locate(&self, mesh: &GarmentMesh, list: &[u32], p: Vec2) -> u32 {
        let (ci, cj) = self.cell_of(p);
        let mut best = (f64::INFINITY, u32::MAX);
        for ring in 0..=self.columns.max(self.rows) {
            // all further rings are at least this far away
            if best.0 <= (ring as f64 - 1.0) * self.cell {
                break;
            }
            let (i0, i1) = (ci.saturating_sub(ring), (ci + ring).min(self.columns - 1));
            let (j0, j1) = (cj.saturating_sub(ring), (cj + ring).min(self.rows - 1));
            for j in j0..=j1 {
                for i in i0..=i1 {
                    if i.abs_diff(ci).max(j.abs_diff(cj)) != ring {
                        continue;
                    }
                    let cell = j * self.columns + i;
                    for k in &self.entries[self.starts[cell]..self.starts[cell + 1]] {
                        let d = distance(corners(mesh, list[*k as usize]), p);
                        if d < best.0 || (d == best.0 && *k < best.1) {
                            best = (d, *k);
                        }
                    }
                }
            }
            if best.0 == 0.0 {
                break;
            }
        }
        list.get(best.1 as usize).copied().unwrap_or(list[0])
    }
}
