//! Bodies as signed distance, negative inside: analytic shapes, grids, triangle meshes; rigid
//! poses; deforming meshes.
//!
//! A [`Shape`] is immutable and shared; a pose (and, for a deforming mesh, a changed field) belongs
//! to the simulation's State.

pub mod mannequin;

use crate::math::{Mat3, Rotation, Vec3};

/// Signed distance and its derivatives at a point of the body's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Signed distance [m], negative inside. Beyond the stored band it is a bound with the right
    /// sign whose magnitude is never larger than the true distance.
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
    shape: std::sync::Arc<Shape>,
}

#[derive(Debug)]
enum Shape {
    Sphere { radius: f64 },
}

use crate::error::{Error, Result};

impl Body {
    /// Sphere around the origin.
    pub fn sphere(radius: f64) -> Result<Self> {
        if !(radius.is_finite() && radius > 0.0) {
            return Err(Error::argument(format!(
                "sphere radius {radius} must be positive"
            )));
        }
        Ok(Self {
            shape: std::sync::Arc::new(Shape::Sphere { radius }),
        })
    }

    /// Capsule along y: the segment from `-half_length` to `half_length`, thickened by `radius`.
    pub fn capsule(_half_length: f64, _radius: f64) -> Result<Self> {
        Err(Error::unsupported("capsule"))
    }

    /// Half space `normal . x <= offset` (inside); the normal need not be unit.
    pub fn plane(_normal: [f64; 3], _offset: f64) -> Result<Self> {
        Err(Error::unsupported("plane"))
    }

    /// Signed distances [m] on the nodes of a regular grid: node `(i, j, k)` at
    /// `origin + cell_size * (i, j, k)`, stored with `k` fastest.
    pub fn grid(
        _counts: [usize; 3],
        _origin: [f64; 3],
        _cell_size: f64,
        _values: &[f64],
    ) -> Result<Self> {
        Err(Error::unsupported("grid"))
    }

    /// Closed triangle mesh [m]; the field is sampled at `cell_size` [m] (0 chooses) near the
    /// surface.
    pub fn mesh(_positions: &[[f64; 3]], _triangles: &[[u32; 3]], _cell_size: f64) -> Result<Self> {
        Err(Error::unsupported("mesh"))
    }

    /// Reads a Wavefront OBJ file; `scale` multiplies its coordinates.
    pub fn obj(_path: &std::path::Path, _scale: f64, _cell_size: f64) -> Result<Self> {
        Err(Error::unsupported("obj"))
    }

    /// Signed distance in the body's own frame.
    pub fn distance(&self, point: &Vec3) -> Distance {
        let Shape::Sphere { radius } = *self.shape;
        let r = point.norm().max(1e-300);
        let n = point / r;
        Distance {
            value: r - radius,
            gradient: n,
            hessian: (Mat3::identity() - n * n.transpose()) / r,
        }
    }

    /// Signed distance only.
    pub fn value(&self, point: &Vec3) -> f64 {
        self.distance(point).value
    }

    /// Vertices of a mesh body as created, else empty.
    pub fn vertices(&self) -> &[Vec3] {
        &[]
    }

    /// Triangles of a mesh body, else empty. Analytic bodies give a display mesh through
    /// [`Body::display_mesh`].
    pub fn triangles(&self) -> &[[u32; 3]] {
        &[]
    }

    /// Triangle mesh to draw the body: its own, or a tessellation (a plane gives a square).
    pub fn display_mesh(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        (Vec::new(), Vec::new())
    }

    /// The same body with its mesh deformed: field recomputed near the triangles that moved.
    /// The result's bits depend on `vertices` alone, not on `self`'s own deformation.
    pub fn deformed(&self, _vertices: &[Vec3]) -> Result<Self> {
        Err(Error::unsupported("only mesh bodies deform"))
    }

    /// Nearest surface point of a mesh body: triangle and barycentric weights.
    pub fn nearest(&self, _point: &Vec3) -> Option<(u32, [f64; 3])> {
        None
    }
}
