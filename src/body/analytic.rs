//! Sphere, capsule and plane: exact signed distances with exact derivatives.
//!
//! Off the centre or axis by `r`, with the unit vector `n` away from it, the distance is `r - R`,
//! its gradient `n`, its Hessian `(P - n n^T) / r` where `P` projects out the axis of the capsule's
//! straight part (identity elsewhere). On the centre or axis itself the distance has no gradient;
//! there `r` is bounded below by `1e-9 R` and the direction is one fixed unit vector.

use super::Distance;
use crate::error::{Error, Result};
use crate::math::{Mat3, Vec3};

pub(super) fn positive(what: &str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(Error::argument(format!(
            "{what} is {value}; it must be positive and finite"
        )))
    }
}

fn round(offset: &Vec3, radius: f64, fallback: Vec3, projector: &Mat3) -> Distance {
    let r = offset.norm();
    let n = if r > 1e-9 * radius {
        offset / r
    } else {
        fallback
    };
    Distance {
        value: r - radius,
        gradient: n,
        hessian: (projector - n * n.transpose()) / r.max(1e-9 * radius),
    }
}

/// Sphere of `radius` around the origin.
pub(super) fn sphere(radius: f64, p: &Vec3) -> Distance {
    round(p, radius, Vec3::y(), &Mat3::identity())
}

/// Capsule along y.
pub(super) fn capsule(half_length: f64, radius: f64, p: &Vec3) -> Distance {
    let y = p.y.clamp(-half_length, half_length);
    let offset = Vec3::new(p.x, p.y - y, p.z);
    let projector = if p.y.abs() < half_length {
        Mat3::from_diagonal(&Vec3::new(1.0, 0.0, 1.0))
    } else {
        Mat3::identity()
    };
    round(&offset, radius, Vec3::x(), &projector)
}

/// Half space with unit `normal`.
pub(super) fn plane(normal: &Vec3, offset: f64, p: &Vec3) -> Distance {
    Distance {
        value: normal.dot(p) - offset,
        gradient: *normal,
        hessian: Mat3::zeros(),
    }
}

/// Unit normal and scaled offset of a half space.
pub(super) fn checked_plane(normal: [f64; 3], offset: f64) -> Result<(Vec3, f64)> {
    let n = Vec3::from(normal);
    // scale first: the square of a large component overflows
    let scale = n.amax();
    if !(scale.is_finite() && scale > 0.0) || n.iter().any(|c| !c.is_finite()) {
        return Err(Error::argument(format!(
            "plane normal {normal:?} must be finite and not zero"
        )));
    }
    let length = scale * (n / scale).norm();
    let offset_unit = offset / length;
    if !offset_unit.is_finite() {
        return Err(Error::argument(format!(
            "plane offset {offset} over the normal's length {length} is not finite"
        )));
    }
    Ok(((n / scale).normalize(), offset_unit))
}

/// Latitude-longitude mesh of a capsule (a sphere when `half_length` is 0), poles on y.
pub(super) fn capsule_mesh(half_length: f64, radius: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    const AROUND: u32 = 48;
    const RINGS: u32 = 24; // even: half of them on each cap
    let mut vertices = vec![Vec3::new(0.0, half_length + radius, 0.0)];
    let mut heights = Vec::new();
    for ring in 1..RINGS {
        let angle = std::f64::consts::PI * f64::from(ring) / f64::from(RINGS);
        let (s, c) = angle.sin_cos();
        if ring == RINGS / 2 {
            heights.push((radius, half_length));
            if half_length > 0.0 {
                heights.push((radius, -half_length));
            }
        } else {
            let lift = if ring < RINGS / 2 {
                half_length
            } else {
                -half_length
            };
            heights.push((radius * s, radius * c + lift));
        }
    }
    for &(r, y) in &heights {
        for k in 0..AROUND {
            let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
            vertices.push(Vec3::new(r * s, y, r * c));
        }
    }
    vertices.push(Vec3::new(0.0, -half_length - radius, 0.0));
    let rings = heights.len() as u32;
    let at = |ring: u32, k: u32| 1 + ring * AROUND + k % AROUND;
    let last = 1 + rings * AROUND;
    let mut triangles = Vec::new();
    for k in 0..AROUND {
        triangles.push([0, at(0, k), at(0, k + 1)]);
        for ring in 0..rings - 1 {
            let (a, b) = (at(ring, k), at(ring, k + 1));
            let (c, d) = (at(ring + 1, k), at(ring + 1, k + 1));
            triangles.push([a, c, b]);
            triangles.push([b, c, d]);
        }
        triangles.push([last, at(rings - 1, k + 1), at(rings - 1, k)]);
    }
    (vertices, triangles)
}

/// Square of 4 m around the plane's point nearest to the origin.
pub(super) fn plane_mesh(normal: &Vec3, offset: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let helper = if normal.x.abs() < 0.6 {
        Vec3::x()
    } else {
        Vec3::y()
    };
    let u = normal.cross(&helper).normalize() * 2.0;
    let v = normal.cross(&u);
    let c = normal * offset;
    (
        vec![c - u - v, c + u - v, c + u + v, c - u + v],
        vec![[0, 1, 2], [0, 2, 3]],
    )
}
