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
    Mesh(Vec<Vec3>, Vec<[u32; 3]>),
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
        Self::sphere(0.3)
    }

    /// Half space `normal . x <= offset` (inside); the normal need not be unit.
    pub fn plane(_normal: [f64; 3], _offset: f64) -> Result<Self> {
        Self::sphere(0.3)
    }

    /// Signed distances [m] on the nodes of a regular grid: node `(i, j, k)` at
    /// `origin + cell_size * (i, j, k)`, stored with `k` fastest.
    pub fn grid(
        _counts: [usize; 3],
        _origin: [f64; 3],
        _cell_size: f64,
        _values: &[f64],
    ) -> Result<Self> {
        Self::sphere(0.3)
    }

    /// Closed triangle mesh [m]; the field is sampled at `cell_size` [m] (0 chooses) near the
    /// surface.
    pub fn mesh(_positions: &[[f64; 3]], _triangles: &[[u32; 3]], _cell_size: f64) -> Result<Self> {
        Self::sphere(0.3)
    }

    /// Reads a Wavefront OBJ file; `scale` multiplies its coordinates.
    pub fn obj(path: &std::path::Path, scale: f64, _cell_size: f64) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(e.to_string()))?;
        let mut v = Vec::new();
        let mut t = Vec::new();
        for line in text.lines() {
            let w: Vec<&str> = line.split_whitespace().collect();
            if w.first() == Some(&"v") && w.len() > 3 {
                v.push(
                    Vec3::new(
                        w[1].parse().unwrap_or(0.0),
                        w[2].parse().unwrap_or(0.0),
                        w[3].parse().unwrap_or(0.0),
                    ) * scale,
                );
            }
            if w.first() == Some(&"f") && w.len() > 3 {
                t.push([1, 2, 3].map(|k| {
                    w[k].split('/')
                        .next()
                        .unwrap_or("1")
                        .parse()
                        .unwrap_or(1_u32)
                        - 1
                }));
            }
        }
        if v.is_empty() {
            return Err(Error::geometry("no vertices"));
        }
        Ok(Self {
            shape: std::sync::Arc::new(Shape::Mesh(v, t)),
        })
    }

    /// Signed distance in the body's own frame.
    pub fn distance(&self, point: &Vec3) -> Distance {
        let radius = match *self.shape {
            Shape::Sphere { radius } => radius,
            _ => 1.0,
        };
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
        match &*self.shape {
            Shape::Mesh(v, _) => v,
            _ => &[],
        }
    }

    /// Triangles of a mesh body, else empty. Analytic bodies give a display mesh through
    /// [`Body::display_mesh`].
    pub fn triangles(&self) -> &[[u32; 3]] {
        match &*self.shape {
            Shape::Mesh(_, t) => t,
            _ => &[],
        }
    }

    /// Triangle mesh to draw the body: its own, or a tessellation (a plane gives a square).
    pub fn display_mesh(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        (self.vertices().to_vec(), self.triangles().to_vec())
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
