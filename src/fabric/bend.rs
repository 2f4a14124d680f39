//! A periodic cell on a cylinder, and what carries the images of a cell.
//!
//! With the axis `c` along one of the lattice vectors, `A`, and the turn `Q` about it by `kappa |a|`, the image `n` repeats around and
//! `m` along is `Q^n (x - c) + c + m A`; a plane one is `x + n_1 A_1 + n_2 A_2`. SI units.

use crate::blend::Rider;
use crate::error::{Error, Result};
use crate::math::{Mat3, Vec2, Vec3};
use crate::yarn::periodic::NodeImage;
use nalgebra::{Matrix3x2, Rotation3, Unit};

/// How a cell is bent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bend {
    /// Direction of the layout that is curved.
    pub(super) axis: usize,
    /// Curvature [1/m].
    pub(super) curvature: f64,
    /// Deformation gradient before.
    pub(super) plane: Matrix3x2<f64>,
}

/// Repeats around a cylinder that images are away.
const TURNS: [i32; 4] = [-2, -1, 1, 2];

impl Bend {
    /// A plane point on the cylinder.
    pub(super) fn apply(&self, x: &Vec3) -> Vec3 {
        let radius = 1.0 / self.curvature;
        let (sine, cosine) = (self.curvature * x[self.axis]).sin_cos();
        let out = radius - x.z;
        let mut y = *x;
        y[self.axis] = out * sine;
        y.z = radius - out * cosine;
        y
    }

    /// Turn about the axis over `n` repeats of a cell of this size.
    fn turn(&self, size: Vec2, n: i32) -> Mat3 {
        let length = size[self.axis] * self.plane.column(self.axis).norm();
        // the far end rises to the front
        let about = if self.axis == 0 {
            -Vec3::y()
        } else {
            Vec3::x()
        };
        let angle = f64::from(n) * self.curvature * length;
        Rotation3::from_axis_angle(&Unit::new_unchecked(about), angle).into_inner()
    }
}

/// Points of the lattice: its vectors, or of a bent cell the one along the axis and what the turns leave.
pub(super) fn lattice(size: Vec2, bend: Option<&Bend>) -> Vec<Vec3> {
    let Some(bend) = bend else {
        return vec![Vec3::x() * size.x, Vec3::y() * size.y];
    };
    let along = 1 - bend.axis;
    let centre = Vec3::z() / bend.curvature;
    let left = |n: &i32| (bend.turn(size, *n).transpose() - Mat3::identity()) * centre;
    let mut out: Vec<Vec3> = vec![bend.plane.column(along) * size[along]];
    out.extend(TURNS.iter().map(left));
    out
}

/// What carries an image; `first` points are the lattice's.
pub(super) fn rider(
    image: &NodeImage,
    first: u32,
    size: Vec2,
    bend: Option<&Bend>,
) -> Result<Rider> {
    let (point, of) = (first + image.node, first + image.of);
    let [m, n] = image.steps.map(f64::from);
    let Some(bend) = bend else {
        return Ok(Rider {
            point,
            vertices: [of, 0, 1],
            weights: [1.0, m, n],
            turn: Mat3::identity(),
        });
    };
    let around = image.steps[bend.axis];
    let place = TURNS.iter().position(|t| *t == around);
    if place.is_none() && around != 0 {
        return Err(Error::material(format!(
            "a bent cell has images {around} repeats away, at most 2 can be: take more repeats"
        )));
    }
    let part = f64::from(u8::from(place.is_some()));
    Ok(Rider {
        point,
        vertices: [of, 0, 1 + place.unwrap_or(0) as u32],
        weights: [1.0, f64::from(image.steps[1 - bend.axis]), part],
        turn: bend.turn(size, around),
    })
}
