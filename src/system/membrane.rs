//! Orthotropic membrane on constant-strain triangles: Saint Venant-Kirchhoff and ridges.
//!
//! With material coordinates `X` (first axis weft, second axis warp), `F = dx/dX` (3x2) and the
//! Green strain `E = (F^T F - I) / 2`, the energy of a triangle of rest area `A` is
//!
//! ```text
//! V = A (1/2 e^T C e + sum_r phi_r(d_r . e)),   e = (E11, E22, 2 E12),   C = [weft c12 0; c12 warp 0; 0 0 shear]
//! ```
//!
//! with the ridges `phi_r` of the fabric, if it has any ([`Ridge`]). Its Hessian is `A (B_i^T T B_j + (g_i . S g_j) I)` with
//! `B_i = de/dx_i`, the tangent `T = C + sum_r phi_r'' d_r d_r^T`, which is positive definite, the gradients `g_i` of
//! the shape functions and the second Piola-Kirchhoff stress `S = C e + sum_r phi_r' d_r`. `Psd` takes the positive
//! part of `S` (stabilisation in compression, Umetani et al. 2011 section 5, after Teran et al.
//! 2005): the first part is positive by itself, so that only the stress of a compressed triangle
//! has to give way. Equilibria are not changed.
//!
//! Damping is Kelvin-Voigt, `beta/(2 dt) A (e - e0)^T T_0 (e - e0)` with the strain `e0` at the start
//! of the step and the tangent `T_0` without strain: no force under rigid motion. SI units; a triangle may be inverted or without area
//! in space (`F` is then singular, everything stays finite), not in its rest shape.

use super::term::{Configuration, HessianKind, RestChange, Stencils, Term};
use crate::cloth::Cloth;
use crate::math::geometry::cross2;
use crate::math::spd::project2;
use crate::math::{Mat2, Mat3, Vec2, Vec3};
use crate::pattern::{Fabric, Ridge};
use nalgebra::{Matrix3, Matrix3x2};

struct Element {
    /// Material gradients of the shape functions of vertices 1 and 2 [1/m], in the rows.
    inverse: Mat2,
    area: f64,
    stiffness: Mat3,
    damping: f64,
    fabric: usize,
    /// Square roots of the parts of the stiffness along weft and warp that are the triangle's own,
    /// and of their geometric mean.
    share: Vec3,
    /// Flat to material coordinates.
    rotation: Mat2,
}

/// The membrane of every triangle.
pub struct Membrane {
    vertices: Vec<u32>,
    elements: Vec<Element>,
    /// Ridges of each fabric.
    ridges: Vec<Vec<Ridge>>,
    /// Factor on all stiffness.
    factor: f64,
}

/// Flat to (weft, warp) coordinates for a warp at `grain` from `+v`.
pub fn material_rotation(grain: f64) -> Mat2 {
    let (s, c) = grain.sin_cos();
    Mat2::new(c, s, -s, c)
}

fn stiffness(f: &Fabric) -> Mat3 {
    Matrix3::new(
        f.weft, f.coupling, 0.0, f.coupling, f.warp, 0.0, 0.0, 0.0, f.shear,
    )
}

/// `D C D` with the diagonal `D` of `share`.
fn scaled(stiffness: &Mat3, share: &Vec3) -> Mat3 {
    stiffness.component_mul(&(share * share.transpose()))
}

fn shape_gradients(inverse: &Mat2) -> [Vec2; 3] {
    let g1 = Vec2::new(inverse[(0, 0)], inverse[(0, 1)]);
    let g2 = Vec2::new(inverse[(1, 0)], inverse[(1, 1)]);
    [-(g1 + g2), g1, g2]
}

fn strain(f: &Matrix3x2<f64>) -> Vec3 {
    let (a, b) = (f.column(0), f.column(1));
    Vec3::new(
        0.5 * (a.norm_squared() - 1.0),
        0.5 * (b.norm_squared() - 1.0),
        a.dot(&b),
    )
}

fn strain_rate(f: &Matrix3x2<f64>, df: &Matrix3x2<f64>) -> Vec3 {
    Vec3::new(
        f.column(0).dot(&df.column(0)),
        f.column(1).dot(&df.column(1)),
        f.column(0).dot(&df.column(1)) + f.column(1).dot(&df.column(0)),
    )
}

fn tensor(s: &Vec3) -> Mat2 {
    Mat2::new(s.x, s.z, s.z, s.y)
}

impl Membrane {
    /// The membrane of a cloth, its stiffness times a factor and each triangle's own share.
    pub fn new(cloth: &Cloth, factor: f64) -> Self {
        let mesh = &cloth.mesh;
        let elements = mesh
            .triangles
            .iter()
            .enumerate()
            .map(|(t, tri)| {
                let panel = mesh.triangle_panel[t] as usize;
                let rotation = material_rotation(cloth.panel_grain[panel]);
                let [a, b, c] = tri.map(|v| rotation * mesh.uv[v as usize]);
                let (p, q) = (b - a, c - a);
                let det = cross2(&p, &q);
                let fabric = cloth.fabric_of(t);
                let [weft, warp] = cloth.share[t].map(f64::sqrt);
                let share = Vec3::new(weft, warp, (weft * warp).sqrt());
                Element {
                    inverse: Mat2::new(q.y, -q.x, -p.y, p.x) / det,
                    area: 0.5 * det.abs(),
                    stiffness: factor * scaled(&stiffness(fabric), &share),
                    share,
                    damping: fabric.damping_stiffness,
                    fabric: cloth.panel_fabric[panel],
                    rotation,
                }
            })
            .collect();
        Self {
            vertices: mesh.triangles.iter().flatten().copied().collect(),
            elements,
            ridges: cloth.fabrics.iter().map(|f| f.ridges.clone()).collect(),
            factor,
        }
    }

    /// Ridges of a triangle with their weights: the factor and the part that is the triangle's own, of `d d^T` as of `C`.
    fn ridges<'a>(&'a self, element: &'a Element) -> impl Iterator<Item = (f64, &'a Ridge)> {
        self.ridges[element.fabric].iter().map(move |ridge| {
            let d = ridge.direction();
            let own = d.component_mul(&element.share).norm_squared() / d.norm_squared();
            (self.factor * own, ridge)
        })
    }

    /// Green strain `(E11, E22, 2 E12)` of a triangle at positions `x`, weft first.
    pub fn strain(&self, e: usize, x: &[Vec3]) -> Vec3 {
        strain(&self.deformation(e, x))
    }

    /// Second Piola-Kirchhoff stress `(S11, S22, S12)` of a triangle without damping [N/m].
    pub fn stress(&self, e: usize, x: &[Vec3]) -> Vec3 {
        let element = &self.elements[e];
        let strain = self.strain(e, x);
        let mut stress = element.stiffness * strain;
        for (weight, ridge) in self.ridges(element) {
            let d = ridge.direction();
            stress += d * (weight * ridge.at(d.dot(&strain)).slope);
        }
        stress
    }

    fn deformation(&self, e: usize, x: &[Vec3]) -> Matrix3x2<f64> {
        self.map(e, x, &self.elements[e].inverse)
    }

    fn map(&self, e: usize, x: &[Vec3], gradients: &Mat2) -> Matrix3x2<f64> {
        let v = &self.vertices[3 * e..3 * e + 3];
        let origin = x[v[0] as usize];
        Matrix3x2::from_columns(&[x[v[1] as usize] - origin, x[v[2] as usize] - origin]) * gradients
    }

    /// Strain, strain since the start of the step, stress with damping.
    fn state(&self, e: usize, f: &Matrix3x2<f64>, at: &Configuration<'_>) -> (Vec3, Vec3, Vec3) {
        let element = &self.elements[e];
        let strain_now = strain(f);
        let rate = element.damping * at.inv_dt;
        let since = if rate > 0.0 {
            strain_now - strain(&self.deformation(e, at.x0))
        } else {
            Vec3::zeros()
        };
        let mut stress = element.stiffness * (strain_now + since * rate);
        for (weight, ridge) in self.ridges(element) {
            let d = ridge.direction();
            let damped = ridge.at(0.0).stiffness * d.dot(&since) * rate;
            stress += d * (weight * (ridge.at(d.dot(&strain_now)).slope + damped));
        }
        (strain_now, since, stress)
    }
}

impl Term for Membrane {
    fn name(&self) -> &'static str {
        "membrane"
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: 3,
            vertices: &self.vertices,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.elements[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let element = &self.elements[e];
        let (now, since, _) = self.state(e, &self.deformation(e, at.x), at);
        let quadratic = |s: &Vec3| s.dot(&(element.stiffness * s));
        let rate = element.damping * at.inv_dt;
        let mut energy = 0.5 * element.area * (quadratic(&now) + rate * quadratic(&since));
        for (weight, ridge) in self.ridges(element) {
            let d = ridge.direction();
            let damped = 0.5 * rate * ridge.at(0.0).stiffness * d.dot(&since).powi(2);
            energy += element.area * weight * (ridge.at(d.dot(&now)).energy + damped);
        }
        energy
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let element = &self.elements[e];
        let f = self.deformation(e, at.x);
        let (_, _, stress) = self.state(e, &f, at);
        let p = f * tensor(&stress) * element.area;
        for (o, g) in out.iter_mut().zip(shape_gradients(&element.inverse)) {
            *o = p * g;
        }
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, kind: HessianKind, out: &mut [Mat3]) {
        let element = &self.elements[e];
        let f = self.deformation(e, at.x);
        let (now, _, stress) = self.state(e, &f, at);
        let full = tensor(&stress);
        let positive = project2(&full);
        let s = positive + (full - positive) * kind.exactness();
        let rate = element.damping * at.inv_dt;
        let mut c = element.stiffness * (element.area * (1.0 + rate));
        for (weight, ridge) in self.ridges(element) {
            let d = ridge.direction();
            let tangent = ridge.at(d.dot(&now)).stiffness + rate * ridge.at(0.0).stiffness;
            c += d * d.transpose() * (element.area * weight * tangent);
        }
        let g = shape_gradients(&element.inverse);
        let (f1, f2) = (f.column(0), f.column(1));
        let b = g.map(|g| {
            Matrix3::from_rows(&[
                (f1 * g.x).transpose(),
                (f2 * g.y).transpose(),
                (f2 * g.x + f1 * g.y).transpose(),
            ])
        });
        let mut k = 0;
        for i in 0..3 {
            let left = b[i].transpose() * c;
            for j in 0..=i {
                let geometric = element.area * g[i].dot(&(s * g[j]));
                out[k] = left * b[j] + Mat3::from_diagonal_element(geometric);
                k += 1;
            }
        }
    }

    fn rest_gradient(
        &self,
        e: usize,
        at: &Configuration<'_>,
        change: &RestChange<'_>,
        out: &mut [Vec3],
    ) {
        let element = &self.elements[e];
        let v = &self.vertices[3 * e..3 * e + 3];
        let [a, b, c] = [0, 1, 2].map(|k| element.rotation * change.uv[v[k] as usize]);
        let rate = Mat2::from_columns(&[b - a, c - a]);
        let dinverse = -(element.inverse * rate * element.inverse);
        let darea = element.area * (element.inverse * rate).trace();
        let fabric = &change.fabrics[element.fabric];

        let f = self.deformation(e, at.x);
        let df = self.map(e, at.x, &dinverse);
        let (now, since, stress) = self.state(e, &f, at);
        let dnow = strain_rate(&f, &df);
        let (damping, ddamping) = (
            element.damping * at.inv_dt,
            fabric.damping_stiffness * at.inv_dt,
        );
        // the strain since the start of the step is also wanted where the damping is still zero
        let (since, dsince) = if damping > 0.0 || ddamping != 0.0 {
            let f0 = self.deformation(e, at.x0);
            let df0 = self.map(e, at.x0, &dinverse);
            (now - strain(&f0), dnow - strain_rate(&f0, &df0))
        } else {
            (since, Vec3::zeros())
        };
        let mut dstress = scaled(&stiffness(fabric), &element.share) * (now + since * damping)
            + element.stiffness * (dnow + dsince * damping + since * ddamping);
        for (weight, ridge) in self.ridges(element) {
            let d = ridge.direction();
            let damped = d.dot(&dsince) * damping + d.dot(&since) * ddamping;
            let tangent = ridge.at(d.dot(&now)).stiffness * d.dot(&dnow);
            dstress += d * (weight * (tangent + ridge.at(0.0).stiffness * damped));
        }
        let p = f * tensor(&stress);
        let dp = df * tensor(&stress) + f * tensor(&dstress);
        let (g, dg) = (
            shape_gradients(&element.inverse),
            shape_gradients(&dinverse),
        );
        for i in 0..3 {
            out[i] = p * g[i] * darea + (dp * g[i] + p * dg[i]) * element.area;
        }
    }
}
