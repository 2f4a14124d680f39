//! Bodies as signed distance, negative inside: analytic shapes, grids, triangle meshes; rigid
//! poses; deforming meshes.
//!
//! A shape is immutable and shared; a pose (and, for a deforming mesh, its vertices) belongs to the
//! simulation's State. Analytic shapes are exact; sampled ones are read through a C1 spline (see
//! `spline` for why it is not the trilinear interpolant, and for its error).

mod analytic;
mod bounds;
mod deform;
mod field;
mod grid;
pub mod mannequin;
mod mesh;
mod nearby;
mod obj;
mod sign;
mod spline;
mod surface_nets;
mod tree;
mod triangle;

pub use mesh::MeshReport;

use crate::error::{Error, Result};
use crate::math::hash::Hash;
use crate::math::parallel::Workers;
use crate::math::{Mat3, Rotation, Vec3};
use std::sync::Arc;

/// Largest whole number not above `x`, without the library call that `f64::floor` is where the
/// processor's instruction for it may not be used.
#[inline]
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from((whole as f64) > x)
}

/// Positions [m] and triangles of a Wavefront OBJ file, in the file's order; `scale` multiplies its
/// coordinates. The mesh need not be closed.
pub fn read_obj(path: &std::path::Path, scale: f64) -> Result<mannequin::Mesh> {
    let (positions, triangles) = obj::read(path, scale)?;
    Ok((positions.into_iter().map(Vec3::from).collect(), triangles))
}

/// Signed distance and its derivatives at a point of the body's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Signed distance [m], negative inside. Outside a sampled body's box it is a bound with the
    /// right sign whose magnitude is never larger than the true distance.
    pub value: f64,
    /// Gradient of `value`; unit length up to interpolation error.
    pub gradient: Vec3,
    /// Second derivative of `value` [1/m].
    pub hessian: Mat3,
}

/// Rigid placement of a body: `x_world = rotation * x_body + position`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pose {
    /// World position of the body's origin [m].
    pub position: Vec3,
    /// Rotation from body to world.
    pub rotation: Rotation,
}

impl Default for Pose {
    fn default() -> Self {
        Self {
            position: Vec3::zeros(),
            rotation: Rotation::identity(),
        }
    }
}

impl Pose {
    /// World point in the body's frame.
    pub fn to_body(&self, world: &Vec3) -> Vec3 {
        self.rotation
            .inverse_transform_vector(&(world - self.position))
    }

    /// Body point in the world.
    pub fn to_world(&self, body: &Vec3) -> Vec3 {
        self.rotation * body + self.position
    }

    /// The pose a fraction `t` of the way from `self` to `other` (straight line, great circle).
    pub fn toward(&self, other: &Pose, t: f64) -> Pose {
        if t >= 1.0 {
            return *other;
        }
        Pose {
            position: self.position.lerp(&other.position, t),
            rotation: self
                .rotation
                .try_slerp(&other.rotation, t, 1e-12)
                .unwrap_or(other.rotation),
        }
    }
}

/// A body's shape, cheap to clone and shared between simulations.
#[derive(Clone, Debug)]
pub struct Body {
    shape: Arc<Shape>,
}

#[derive(Debug)]
enum Shape {
    Sphere { radius: f64 },
    Capsule { half_length: f64, radius: f64 },
    Plane { normal: Vec3, offset: f64 },
    Grid(grid::Grid),
    Mesh(deform::MeshBody),
}

impl From<Shape> for Body {
    fn from(shape: Shape) -> Self {
        Self {
            shape: Arc::new(shape),
        }
    }
}

impl Body {
    /// Sphere around the origin.
    pub fn sphere(radius: f64) -> Result<Self> {
        let radius = analytic::positive("sphere radius", radius)?;
        Ok(Shape::Sphere { radius }.into())
    }

    /// Capsule along y: the segment from `-half_length` to `half_length`, thickened by `radius`.
    /// A half length of 0 is a sphere.
    pub fn capsule(half_length: f64, radius: f64) -> Result<Self> {
        let radius = analytic::positive("capsule radius", radius)?;
        if !(half_length.is_finite() && half_length >= 0.0) {
            return Err(Error::argument(format!(
                "capsule half length is {half_length}; it must be finite and not negative"
            )));
        }
        Ok(Shape::Capsule {
            half_length,
            radius,
        }
        .into())
    }

    /// Half space `normal . x <= offset` (inside); the normal need not be unit.
    pub fn plane(normal: [f64; 3], offset: f64) -> Result<Self> {
        let (normal, offset) = analytic::checked_plane(normal, offset)?;
        Ok(Shape::Plane { normal, offset }.into())
    }

    /// Signed distances [m] on the nodes of a regular grid: node `(i, j, k)` at
    /// `origin + cell_size * (i, j, k)`, stored with `k` fastest.
    pub fn grid(
        counts: [usize; 3],
        origin: [f64; 3],
        cell_size: f64,
        values: &[f64],
    ) -> Result<Self> {
        Ok(Shape::Grid(grid::Grid::new(counts, origin, cell_size, values)?).into())
    }

    /// Closed triangle mesh [m]; the field is sampled at `cell_size` [m] (0 chooses) near the
    /// surface and at 4 times that and so on farther away.
    pub fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]], cell_size: f64) -> Result<Self> {
        Self::mesh_with(positions, triangles, cell_size, &Workers::new(1))
    }

    /// [`Body::mesh`] on several threads; the same bits for any number of them.
    pub fn mesh_with(
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        cell_size: f64,
        workers: &Workers,
    ) -> Result<Self> {
        let mesh = deform::MeshBody::new(positions, triangles, cell_size, workers)?;
        Ok(Shape::Mesh(mesh).into())
    }

    /// Reads a Wavefront OBJ file; `scale` multiplies its coordinates. Vertices keep the file's
    /// order and count.
    pub fn obj(path: &std::path::Path, scale: f64, cell_size: f64) -> Result<Self> {
        let (positions, triangles) = obj::read(path, scale)?;
        Self::mesh(&positions, &triangles, cell_size).map_err(|e| e.at(path.display()))
    }

    /// [`Body::obj`] from bytes in memory.
    pub fn obj_bytes(bytes: &[u8], scale: f64, cell_size: f64) -> Result<Self> {
        let (positions, triangles) = obj::parse(bytes, scale)?;
        Self::mesh(&positions, &triangles, cell_size)
    }

    /// Signed distance in the body's own frame.
    pub fn distance(&self, point: &Vec3) -> Distance {
        match &*self.shape {
            Shape::Sphere { radius } => analytic::sphere(*radius, point),
            Shape::Capsule {
                half_length,
                radius,
            } => analytic::capsule(*half_length, *radius, point),
            Shape::Plane { normal, offset } => analytic::plane(normal, *offset, point),
            Shape::Grid(grid) => grid.distance(point),
            Shape::Mesh(mesh) => mesh.field.distance(point),
        }
    }

    /// Signed distance only.
    pub fn value(&self, point: &Vec3) -> f64 {
        match &*self.shape {
            Shape::Mesh(mesh) => mesh.field.value(point),
            _ => self.distance(point).value,
        }
    }

    /// Vertices of a mesh body at its present deformation, else empty.
    pub fn vertices(&self) -> &[Vec3] {
        self.as_mesh().map_or(&[], deform::MeshBody::vertices)
    }

    /// Triangles of a mesh body (turned outward if they were not), else empty. Other bodies give a
    /// display mesh through [`Body::display_mesh`].
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.as_mesh().map_or(&[], deform::MeshBody::triangles)
    }

    /// Triangle mesh to draw the body: its own, or a tessellation (a plane gives a square of 4 m).
    pub fn display_mesh(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        match &*self.shape {
            Shape::Sphere { radius } => analytic::capsule_mesh(0.0, *radius),
            Shape::Capsule {
                half_length,
                radius,
            } => analytic::capsule_mesh(*half_length, *radius),
            Shape::Plane { normal, offset } => analytic::plane_mesh(normal, *offset),
            Shape::Grid(grid) => {
                let (lo, hi) = grid.bounds();
                // a coarser lattice for a grid too fine to draw
                let size = hi - lo;
                let limit = (size.product() / 2e6).cbrt();
                let cell = grid.cell_size().max(limit);
                let border = Vec3::repeat(1.5 * cell);
                surface_nets::surface_nets(
                    &|p| grid.distance(p).value,
                    &(lo - border),
                    &(hi + border),
                    cell,
                )
            }
            Shape::Mesh(mesh) => (mesh.vertices().to_vec(), mesh.triangles().to_vec()),
        }
    }

    /// The same body with its mesh deformed: field recomputed near the triangles that moved since
    /// the body was created. The result's bits depend on `vertices` alone, not on `self`'s own
    /// deformation.
    pub fn deformed(&self, vertices: &[Vec3]) -> Result<Self> {
        self.deformed_with(vertices, &Workers::new(1))
    }

    /// [`Body::deformed`] on several threads; the same bits for any number of them.
    pub fn deformed_with(&self, vertices: &[Vec3], workers: &Workers) -> Result<Self> {
        match self.as_mesh() {
            Some(mesh) => Ok(Shape::Mesh(mesh.deformed(vertices, workers)?).into()),
            None => Err(Error::unsupported("only mesh bodies deform")),
        }
    }

    /// Nearest surface point of a mesh body: triangle and barycentric weights.
    pub fn nearest(&self, point: &Vec3) -> Option<(u32, [f64; 3])> {
        self.as_mesh().map(|m| m.nearest(point))
    }

    /// Where a point of the body's frame goes when the mesh moves from its present vertices to
    /// `to`: it takes the displacement of the nearest material point of the surface. `None` for
    /// bodies without a mesh and for another number of vertices.
    pub fn carried(&self, to: &[Vec3], point: &Vec3) -> Option<Vec3> {
        self.as_mesh()?.carried(to, point)
    }

    /// Whether a point lies inside, without the field: a mesh is asked for its generalized winding
    /// number (one solid angle per triangle, slow and exact).
    pub fn is_inside(&self, point: &Vec3) -> bool {
        match &*self.shape {
            Shape::Mesh(mesh) => mesh.is_inside(point),
            _ => self.distance(point).value < 0.0,
        }
    }

    /// Signed distance without the field: exact to the triangles of a mesh, signed by
    /// [`Body::is_inside`]; other bodies give [`Body::value`].
    pub fn exact_distance(&self, point: &Vec3) -> f64 {
        match &*self.shape {
            Shape::Mesh(mesh) => mesh.exact_distance(point),
            _ => self.distance(point).value,
        }
    }

    /// Which of the segments meet the body's surface. A mesh is tested triangle by triangle. Other
    /// bodies are walked along by their distance; a graze that stays shorter than a thousandth of
    /// the segment may be missed there.
    pub fn intersections(&self, segments: &[(Vec3, Vec3)]) -> Vec<usize> {
        let hits = |s: &(Vec3, Vec3)| match &*self.shape {
            Shape::Mesh(mesh) => mesh.segment_hits(&s.0, &s.1),
            _ => self.changes_sign(&s.0, &s.1),
        };
        (0..segments.len())
            .filter(|&i| hits(&segments[i]))
            .collect()
    }

    fn changes_sign(&self, p: &Vec3, q: &Vec3) -> bool {
        let length = (q - p).norm();
        if !length.is_finite() {
            return false;
        }
        let first = self.value(p);
        let (mut t, mut d) = (0.0, first);
        while t < length {
            // the distance changes by at most the way gone
            t = (t + d.abs().max(1e-3 * length)).min(length);
            d = self.value(&p.lerp(q, t / length));
            if (d < 0.0) != (first < 0.0) {
                return true;
            }
        }
        false
    }

    /// What was found in a mesh body's mesh.
    pub fn mesh_report(&self) -> Option<&MeshReport> {
        self.as_mesh().map(deform::MeshBody::report)
    }

    /// Finest spacing of a sampled body's field [m].
    pub fn cell_size(&self) -> Option<f64> {
        match &*self.shape {
            Shape::Grid(grid) => Some(grid.cell_size()),
            Shape::Mesh(mesh) => Some(mesh.field.cell_size()),
            _ => None,
        }
    }

    /// Bricks (of 4 x 4 x 4 nodes) of a mesh body's field per level, finest first, and the bytes
    /// they take.
    pub fn field_size(&self) -> Option<(Vec<usize>, usize)> {
        self.as_mesh().map(|m| (m.field.bricks(), m.field.bytes()))
    }

    /// A number that two bodies share only if their shapes are the same, bit by bit.
    pub fn fingerprint(&self) -> u64 {
        let mut hash = Hash::default();
        match &*self.shape {
            Shape::Sphere { radius } => {
                hash.add(b"sphere");
                hash.numbers([*radius]);
            }
            Shape::Capsule {
                half_length,
                radius,
            } => {
                hash.add(b"capsule");
                hash.numbers([*half_length, *radius]);
            }
            Shape::Plane { normal, offset } => {
                hash.add(b"plane");
                hash.numbers([normal.x, normal.y, normal.z, *offset]);
            }
            Shape::Grid(grid) => grid.add_to(&mut hash),
            Shape::Mesh(mesh) => mesh.add_to(&mut hash),
        }
        hash.value()
    }

    fn as_mesh(&self) -> Option<&deform::MeshBody> {
        match &*self.shape {
            Shape::Mesh(mesh) => Some(mesh),
            _ => None,
        }
    }
}
