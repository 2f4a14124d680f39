//! How wrong triangles may be, at every vertex, from their own state.
//!
//! Every criterion is an estimate of one thing, so that they can be put together and held against a tolerance: the error of
//! the gradient of the deformation, without a unit. A surface whose normal is wrong by an angle of 0.1 and a cloth whose
//! strain is wrong by 0.1 both have an error of 0.1. With the length `h` of a triangle's edges, the pitch `d` of the yarns, Green
//! strain `E` and stress `S` of a triangle (`1` weft, `2` warp), and a vertex `v` with its neighbours and theirs
//!
//! | criterion | estimate |
//! |---|---|
//! | wrinkle | `sqrt(2 e)`, `e = |E_n| (1 - N_cr/N)` where the pressure `N = -n.S n` is above `N_cr = D_n pi^2/h^2` |
//! | mesh | `rms(x - q)/h + (k h)^2/24`, the distance of the neighbours from the quadratic surface `q(u, v)` that fits them best, with its largest principal curvature `k` |
//! | curvature | `d max(0, k - k_fit)` |
//! | strain | beyond the range of the fit, and `3/2 E^2` of a stretched membrane without ridges |
//! | stress | `|E - E*|`, `E*` the mean of the triangles at the corners |
//! | seam | `atan(0.15 |k_n| min(sqrt(D_n/N), L/2))` at sewn vertices, with the curvature `k_n` of `q` across the seam |
//!
//! * **wrinkle**: a strip as long as an edge, held at its ends by the vertices, buckles at Euler's load `D pi^2/h^2` (Timoshenko and Gere
//!   1961, section 2.1; `e_cr = D pi^2/(C h^2)`), into a half wave `A sin(pi s/h)` which the triangles cannot have. It takes
//!   up the strain `e = (pi A/h)^2/4`, and its slope is `pi A/(sqrt(2) h) = sqrt(2 e)` in the mean. `D_n` is the rigidity along the pressure.
//! * **mesh**: what a mesh follows well is smooth over two edges; of a wave that is short against that, much is left. As in
//!   estimates by recovered gradients (Zienkiewicz and Zhu 1987) the better solution is made from the neighbours' own. And the arc of an
//!   edge is longer than its chord by `(k h)^2/24`.
//! * **curvature**: beyond the range of the tests that triangles are fitted to, `k_fit` ([`Range`], 0.15 over the pitch), yarns bend around
//!   each other. It knows no triangles: the same bend has the same error on every mesh that follows it.
//! * **strain**: yarns are linear in their length, Saint Venant-Kirchhoff membranes in Green strain: tensions differ by `3/2 E` of their
//!   size. Beyond the tests a material says nothing, and the strain that is beyond counts whole.
//! * **stress**: strain is constant in a triangle and jumps to the next, as far as it is not resolved (Zienkiewicz and Zhu 1987).
//! * **seam**: the seam of triangles bears a moment `D_n k_n`, that of yarns, a rod to which their ends are tied, none. Where it is let go the
//!   slope changes by `k_n` times the length over which the moment fades: `sqrt(D_n/N)` under a tension `N` across the seam (the boundary
//!   layer of a stretched plate), at most half the panel's width, `L` the root of its area. That is a strip free to turn; what else holds a
//!   panel leaves some 0.15 of it, a figure chosen on the comparisons of `docs/mixed.md`.
//!
//! ```text
//! error = sqrt(wrinkle^2 + mesh^2 + curvature^2 + strain^2 + stress^2 + seam^2)
//! ```
//!
//! Whoever asks may leave criteria out of that sum. Of a motion, every value is the largest of its states ([`Indicator::widen`]).
//!
//! Values of triangles are those of vertices by means of squares over the
//! area. A panel with fewer than eight vertices has no surface fitted, and a fabric without yarns no error.

use crate::cloth::Cloth;
use crate::error::Result;
use crate::fabric::fit::Range;
use crate::math::{Mat2, Vec2, Vec3, topology};
use crate::pattern::{Fabric, Garment};
use crate::system::membrane::{Membrane, material_rotation};
use crate::tri::GarmentMesh;
use nalgebra::{Cholesky, SMatrix, SVector};
use std::f64::consts::PI;

/// Names of the criteria, in the order of [`Indicator::criteria`].
pub const CRITERIA: [&str; 6] = ["wrinkle", "mesh", "curvature", "strain", "stress", "seam"];

/// Which of [`CRITERIA`] do not count.
pub type LeftOut = [bool; CRITERIA.len()];

/// Part of the slope of a free strip that a seam's panels take when its moment is let go.
const FREED: f64 = 0.15;
/// Coefficients of a quadratic surface.
const UNKNOWNS: usize = 6;
/// Least number of points that one is fitted to.
const POINTS: usize = 8;

/// Errors of the triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Indicator {
    /// Estimate by each of [`CRITERIA`] at each vertex.
    pub criteria: Vec<[f64; CRITERIA.len()]>,
    /// Those that count, together.
    pub error: Vec<f64>,
    /// Flat area of each triangle [m^2].
    pub areas: Vec<f64>,
}

impl Indicator {
    /// Of a garment at these positions of its vertices, without some criteria in the error.
    pub fn new(
        garment: &Garment,
        mesh: &GarmentMesh,
        positions: &[Vec3],
        left_out: &LeftOut,
    ) -> Result<Self> {
        let cloth = Cloth::new(garment, mesh.clone())?;
        let near = Neighbours::new(mesh);
        let ranges: Vec<Option<Range>> = (garment.fabrics.iter())
            .map(|f| f.yarns.as_ref().map(Range::of))
            .collect();
        let membrane = Membrane::new(&cloth, 1.0);
        let triangles = triangles(&cloth, &membrane, &ranges, positions);
        let mut criteria = vec![[0.0; CRITERIA.len()]; mesh.uv.len()];
        let mut around = vec![0.0; mesh.uv.len()];
        let mut stresses = vec![Vec3::zeros(); mesh.uv.len()];
        for (t, tri) in mesh.triangles.iter().enumerate() {
            let (area, stress) = (cloth.areas[t], membrane.stress(t, positions));
            for v in tri.map(|v| v as usize) {
                around[v] += area;
                stresses[v] += stress * area;
                for (sum, value) in [(0, 0), (3, 1), (4, 2)] {
                    criteria[v][sum] += triangles[t][value].powi(2) * area;
                }
            }
        }
        let across = across_seams(mesh);
        let widths = widths(&cloth);
        for (v, values) in criteria.iter_mut().enumerate() {
            let panel = mesh.vertex_panel[v] as usize;
            let fabric = &garment.fabrics[cloth.panel_fabric[panel]];
            let Some(yarns) = &fabric.yarns else {
                *values = [0.0; CRITERIA.len()];
                continue;
            };
            let area = around[v].max(f64::MIN_POSITIVE);
            for k in [0, 3, 4] {
                values[k] = (values[k] / area).sqrt();
            }
            let Some(surface) = near.surface(mesh, positions, v) else {
                continue;
            };
            let [a, b] = yarns.structure.pitch();
            let k = surface.curvature.symmetric_eigenvalues().amax();
            values[1] = surface.rest + (k * surface.edge).powi(2) / 24.0;
            values[2] = (k - Range::of(yarns).curvature).max(0.0) * a.max(b);
            if let Some(n) = across[v].try_normalize(1e-12) {
                let m = material_rotation(cloth.panel_grain[panel]) * n;
                let tension = m.dot(&(tensor(&stresses[v]) * m)) / area;
                let fades = (rigidity(fabric, &m) / tension.max(f64::MIN_POSITIVE)).sqrt();
                let k = n.dot(&(surface.curvature * n)).abs();
                values[5] = (FREED * k * fades.min(0.5 * widths[panel])).atan();
            }
        }
        let norm = |c: &[f64; CRITERIA.len()]| {
            let counted = c.iter().zip(left_out).filter(|(_, left_out)| !**left_out);
            counted.map(|(x, _)| x * x).sum::<f64>().sqrt()
        };
        Ok(Self {
            error: criteria.iter().map(norm).collect(),
            criteria,
            areas: cloth.areas,
        })
    }

    /// Takes the larger of its own values and another state's.
    pub fn widen(&mut self, other: &Self) {
        for (own, other) in self.criteria.iter_mut().zip(&other.criteria) {
            for (own, other) in own.iter_mut().zip(other) {
                *own = own.max(*other);
            }
        }
        for (own, other) in self.error.iter_mut().zip(&other.error) {
            *own = own.max(*other);
        }
    }

    /// Root mean square over the area, and the largest, of values at vertices in those triangles that are `kept`; the value of a
    /// triangle is the mean of its corners'. Zero where none is.
    pub fn over(
        &self,
        mesh: &GarmentMesh,
        value: impl Fn(usize) -> f64,
        kept: impl Fn(usize) -> bool,
    ) -> [f64; 2] {
        let [mut sum, mut area, mut largest] = [0.0_f64; 3];
        for (t, tri) in mesh.triangles.iter().enumerate().filter(|p| kept(p.0)) {
            let mean = tri.iter().map(|v| value(*v as usize)).sum::<f64>() / 3.0;
            sum += mean * mean * self.areas[t];
            area += self.areas[t];
            largest = largest.max(mean);
        }
        let rms = if area > 0.0 { (sum / area).sqrt() } else { 0.0 };
        [rms, largest]
    }
}

/// Wrinkle, strain and stress of each triangle.
fn triangles(
    cloth: &Cloth,
    membrane: &Membrane,
    ranges: &[Option<Range>],
    x: &[Vec3],
) -> Vec<[f64; 3]> {
    let mesh = &cloth.mesh;
    let strains: Vec<Vec3> = (0..mesh.triangles.len())
        .map(|t| membrane.strain(t, x))
        .collect();
    let mut means = vec![(Vec3::zeros(), 0.0); mesh.uv.len()];
    for (t, tri) in mesh.triangles.iter().enumerate() {
        for v in tri {
            let (sum, area) = &mut means[*v as usize];
            *sum += strains[t] * cloth.areas[t];
            *area += cloth.areas[t];
        }
    }
    (mesh.triangles.iter().enumerate())
        .map(|(t, tri)| {
            let panel = mesh.triangle_panel[t] as usize;
            let Some(range) = &ranges[cloth.panel_fabric[panel]] else {
                return [0.0; 3];
            };
            let edge = edge_of(cloth.areas[t]);
            let stress = membrane.stress(t, x);
            let recovered: Vec3 = (tri.iter().map(|v| &means[*v as usize]))
                .map(|(sum, area)| sum / *area)
                .sum::<Vec3>()
                / 3.0;
            [
                hidden_slope(cloth.fabric_of(t), &strains[t], &stress, edge),
                beyond(cloth.fabric_of(t), range, &strains[t]),
                size(&(strains[t] - recovered)),
            ]
        })
        .collect()
}

/// Edge of the equilateral triangle with this area.
fn edge_of(area: f64) -> f64 {
    (4.0 * area / 3.0_f64.sqrt()).sqrt()
}

/// Norm of a strain `(11, 22, 2 12)` as a tensor.
fn size(e: &Vec3) -> f64 {
    (e.x * e.x + e.y * e.y + 0.5 * e.z * e.z).sqrt()
}

/// A stress `(11, 22, 12)`.
fn tensor(s: &Vec3) -> Mat2 {
    Mat2::new(s.x, s.z, s.z, s.y)
}

/// Rigidity of a bend that curves the direction `n`, in the frame of the yarns.
fn rigidity(fabric: &Fabric, n: &Vec2) -> f64 {
    fabric.bending_weft * n.x * n.x + fabric.bending_warp * n.y * n.y
}

/// Root of the area of each panel [m].
fn widths(cloth: &Cloth) -> Vec<f64> {
    let mut areas = vec![0.0; cloth.panel_fabric.len()];
    for (panel, area) in cloth.mesh.triangle_panel.iter().zip(&cloth.areas) {
        areas[*panel as usize] += area;
    }
    areas.into_iter().map(f64::sqrt).collect()
}

/// Direction across the seam at each sewn vertex, zero at the others.
fn across_seams(mesh: &GarmentMesh) -> Vec<Vec2> {
    let sewn = mesh.sewn();
    let mut across = vec![Vec2::zeros(); mesh.uv.len()];
    for side in topology::boundary_edges(&mesh.triangles) {
        let [a, b] = side.map(|v| v as usize);
        if sewn[a] && sewn[b] {
            let along = mesh.uv[b] - mesh.uv[a];
            let normal = Vec2::new(-along.y, along.x);
            for v in [a, b] {
                // a direction has no sign
                let sign = if across[v].dot(&normal) < 0.0 {
                    -1.0
                } else {
                    1.0
                };
                across[v] += normal * sign;
            }
        }
    }
    across
}

/// Slope of the half wave that a pressed triangle would have between its vertices.
fn hidden_slope(fabric: &Fabric, strain: &Vec3, stress: &Vec3, edge: f64) -> f64 {
    let eigen = Mat2::new(strain.x, 0.5 * strain.z, 0.5 * strain.z, strain.y).symmetric_eigen();
    let k = eigen.eigenvalues.imin();
    let pressed = -eigen.eigenvalues[k];
    let n: Vec2 = eigen.eigenvectors.column(k).into_owned();
    let pressure = -n.dot(&(tensor(stress) * n));
    let critical = rigidity(fabric, &n) * (PI / edge).powi(2);
    if pressed > 0.0 && pressure > critical {
        (2.0 * pressed * (1.0 - critical / pressure)).sqrt()
    } else {
        0.0
    }
}

/// Strain beyond what the material is made for, and what a membrane's law misses within.
fn beyond(fabric: &Fabric, range: &Range, strain: &Vec3) -> f64 {
    let plane = |e: f64| {
        let linear = if fabric.ridges.is_empty() {
            1.5 * e.max(0.0).powi(2)
        } else {
            0.0
        };
        let press = if range.press > 0.0 {
            (-e - range.press).max(0.0)
        } else {
            0.0
        };
        (e - range.stretch).max(0.0) + press + linear
    };
    let shear = (strain.z.abs() - range.shear).max(0.0);
    size(&Vec3::new(plane(strain.x), plane(strain.y), shear))
}

/// The quadratic surface that fits a vertex and its neighbours best.
struct Surface {
    /// Root mean square of the distances from it, over the edge.
    rest: f64,
    /// Curvature in flat coordinates [1/m].
    curvature: Mat2,
    /// Mean length of the edges at the vertex [m].
    edge: f64,
}

/// Vertices at each vertex of the same panel.
struct Neighbours {
    starts: Vec<usize>,
    list: Vec<u32>,
}

impl Neighbours {
    fn new(mesh: &GarmentMesh) -> Self {
        let edges = topology::edges(&mesh.triangles);
        let mut pairs: Vec<[u32; 2]> = edges.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        pairs.sort_unstable();
        let mut starts = vec![0; mesh.uv.len() + 1];
        for [v, _] in &pairs {
            starts[*v as usize + 1] += 1;
        }
        for v in 0..mesh.uv.len() {
            starts[v + 1] += starts[v];
        }
        Self {
            starts,
            list: pairs.iter().map(|p| p[1]).collect(),
        }
    }

    fn of(&self, v: usize) -> &[u32] {
        &self.list[self.starts[v]..self.starts[v + 1]]
    }

    /// A vertex and those within so many edges of it, in ascending order.
    fn within(&self, v: usize, rings: usize) -> Vec<u32> {
        let mut all = vec![v as u32];
        for _ in 0..rings {
            let next: Vec<u32> = all
                .iter()
                .flat_map(|w| self.of(*w as usize))
                .copied()
                .collect();
            all.extend(next);
            all.sort_unstable();
            all.dedup();
        }
        all
    }

    fn surface(&self, mesh: &GarmentMesh, x: &[Vec3], v: usize) -> Option<Surface> {
        let near = self.of(v);
        let length = |w: &u32| (mesh.uv[*w as usize] - mesh.uv[v]).norm();
        let edge = near.iter().map(length).sum::<f64>() / near.len().max(1) as f64;
        let points = [2, 3].map(|rings| self.within(v, rings));
        let points = points.into_iter().find(|p| p.len() >= POINTS)?;
        let row = |w: &u32| {
            let p = (mesh.uv[*w as usize] - mesh.uv[v]) / edge;
            SVector::<f64, UNKNOWNS>::from([
                1.0,
                p.x,
                p.y,
                0.5 * p.x * p.x,
                p.x * p.y,
                0.5 * p.y * p.y,
            ])
        };
        let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
        let mut right = SMatrix::<f64, UNKNOWNS, 3>::zeros();
        for w in &points {
            let r = row(w);
            normal += r * r.transpose();
            right += r * (x[*w as usize] - x[v]).transpose();
        }
        let fit = Cholesky::new(normal)?.solve(&right);
        let rest: f64 = (points.iter())
            .map(|w| {
                ((x[*w as usize] - x[v]).transpose() - row(w).transpose() * fit).norm_squared()
            })
            .sum();
        let derivative = |k: usize| fit.row(k).transpose();
        let normal = derivative(1).cross(&derivative(2)).try_normalize(1e-300)?;
        let second = |k: usize| derivative(k).dot(&normal) / (edge * edge);
        Some(Surface {
            rest: (rest / (points.len() - UNKNOWNS) as f64).sqrt() / edge,
            curvature: Mat2::new(second(3), second(4), second(4), second(5)),
            edge,
        })
    }
}
