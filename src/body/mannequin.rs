//! The project's own body: a person of 1.72 m standing on y = 0 and facing +z, arms held 45 degrees
//! down, as a smooth union of analytic shapes.
//!
//! Torso: ellipses whose half axes run along a cubic through a table of heights, with the
//! first-order distance `k0 (k0 - 1) / k1`, `k0 = |(x/a, z/b)|`, `k1 = |(x/a^2, z/b^2)|`. Limbs and
//! neck: cones with rounded ends; head: ellipsoid (distances as collected by Quilez,
//! iquilezles.org/articles/distfunctions). Union: `smin(a, b) = min(a, b) - k h^2 / 4` with
//! `h = max(0, 1 - |a - b| / k)`. The surface is meshed by surface nets.
//!
//! [`pose`] moves the mesh as in walking: smooth weights, rotations about the joints' x axes.

use super::Body;
use super::surface_nets::{MAX_SAMPLES, surface_nets};
use crate::error::{Error, Result};
use crate::math::Vec3;

/// Vertices [m] and triangles.
pub type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

/// Lattice spacing that a cell size of 0 stands for [m].
pub const DEFAULT_CELL: f64 = 0.022;
/// Smallest and largest spacing [m]: below the index would not fit, above legs and arms fuse.
const CELLS: (f64, f64) = (0.004, 0.03);

/// Height, half width, half depth and forward offset of the torso [m].
const TORSO: [[f64; 4]; 9] = [
    [0.77, 0.080, 0.070, -0.010],
    [0.82, 0.150, 0.112, -0.010],
    [0.88, 0.176, 0.131, -0.012],
    [0.96, 0.162, 0.119, -0.006],
    [1.06, 0.138, 0.102, 0.000],
    [1.17, 0.151, 0.117, 0.002],
    [1.27, 0.170, 0.130, 0.000],
    [1.38, 0.158, 0.095, -0.012],
    [1.45, 0.070, 0.055, -0.015],
];
const SHOULDER: Vec3 = Vec3::new(0.152, 1.392, -0.012);
const UPPER_ARM: f64 = 0.29;
const FOREARM: f64 = 0.25;
const HIP: Vec3 = Vec3::new(0.090, 0.840, -0.005);
const KNEE: Vec3 = Vec3::new(0.115, 0.480, 0.000);
const ANKLE: Vec3 = Vec3::new(0.138, 0.085, -0.020);
/// Width of the blends [m].
const BLEND: f64 = 0.03;

/// Direction of the left arm (+x side).
fn arm() -> Vec3 {
    Vec3::new(1.0, -1.0, 0.0) * std::f64::consts::FRAC_1_SQRT_2
}

fn smooth_min(a: f64, b: f64) -> f64 {
    let h = (1.0 - (a - b).abs() / BLEND).max(0.0);
    a.min(b) - 0.25 * BLEND * h * h
}

/// Cone from `a` to `b` with ends of radius `ra` and `rb`.
fn rounded_cone(p: &Vec3, a: &Vec3, b: &Vec3, ra: f64, rb: f64) -> f64 {
    let ba = b - a;
    let l2 = ba.norm_squared();
    let rr = ra - rb;
    let a2 = l2 - rr * rr;
    let pa = p - a;
    let y = pa.dot(&ba);
    let z = y - l2;
    let x2 = (pa * l2 - ba * y).norm_squared();
    let (y2, z2) = (y * y * l2, z * z * l2);
    let k = rr.signum() * rr * rr * x2;
    if z.signum() * a2 * z2 > k {
        (x2 + z2).sqrt() / l2 - rb
    } else if y.signum() * a2 * y2 < k {
        (x2 + y2).sqrt() / l2 - ra
    } else {
        ((x2 * a2 / l2).sqrt() + y * rr) / l2 - ra
    }
}

fn ellipsoid(p: &Vec3, r: &Vec3) -> f64 {
    let k0 = p.component_div(r).norm();
    let k1 = p.component_div(&r.component_mul(r)).norm();
    if k1 > 0.0 {
        k0 * (k0 - 1.0) / k1
    } else {
        -r.min()
    }
}

/// Cubic through the table with the slopes of its chords (Catmull-Rom for uneven heights).
fn profile(y: f64) -> [f64; 3] {
    let n = TORSO.len();
    let y = y.clamp(TORSO[0][0], TORSO[n - 1][0]);
    let i = (1..n - 1).find(|&i| y < TORSO[i][0]).unwrap_or(n - 1) - 1;
    let slope = |k: usize, c: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
        (TORSO[b][c] - TORSO[a][c]) / (TORSO[b][0] - TORSO[a][0])
    };
    let w = TORSO[i + 1][0] - TORSO[i][0];
    let t = (y - TORSO[i][0]) / w;
    [1, 2, 3].map(|c| {
        let (h0, h1) = (
            (1.0 + 2.0 * t) * (1.0 - t) * (1.0 - t),
            t * (1.0 - t) * (1.0 - t),
        );
        let (g0, g1) = (t * t * (3.0 - 2.0 * t), t * t * (t - 1.0));
        h0 * TORSO[i][c] + g0 * TORSO[i + 1][c] + w * (h1 * slope(i, c) + g1 * slope(i + 1, c))
    })
}

fn torso(p: &Vec3) -> f64 {
    let [a, b, forward] = profile(p.y);
    let (x, z) = (p.x, p.z - forward);
    let k0 = (x / a).hypot(z / b);
    let k1 = (x / (a * a)).hypot(z / (b * b));
    let side = if k1 > 0.0 {
        k0 * (k0 - 1.0) / k1
    } else {
        -a.min(b)
    };
    let (low, high) = (TORSO[0][0], TORSO[TORSO.len() - 1][0]);
    let cap = (low - p.y).max(p.y - high);
    if side > 0.0 && cap > 0.0 {
        side.hypot(cap)
    } else {
        -smooth_min(-side, -cap)
    }
}

/// Arm of the +x side.
fn left_arm(p: &Vec3) -> f64 {
    let d = arm();
    let elbow = SHOULDER + d * UPPER_ARM;
    let wrist = elbow + d * FOREARM;
    let upper = rounded_cone(p, &SHOULDER, &elbow, 0.052, 0.041);
    let lower = rounded_cone(p, &elbow, &wrist, 0.041, 0.029);
    let hand = rounded_cone(p, &(wrist + d * 0.03), &(wrist + d * 0.11), 0.036, 0.03);
    smooth_min(upper.min(lower), hand)
}

/// Leg of the +x side.
fn left_leg(p: &Vec3) -> f64 {
    let heel = Vec3::new(ANKLE.x, 0.042, -0.035);
    let toe = Vec3::new(ANKLE.x + 0.02, 0.034, 0.125);
    let thigh = rounded_cone(p, &HIP, &KNEE, 0.084, 0.056);
    let shin = rounded_cone(p, &KNEE, &ANKLE, 0.056, 0.038);
    let foot = rounded_cone(p, &heel, &toe, 0.042, 0.034);
    smooth_min(thigh.min(shin), foot)
}

fn head(p: &Vec3) -> f64 {
    let neck = rounded_cone(
        p,
        &Vec3::new(0.0, 1.40, -0.015),
        &Vec3::new(0.0, 1.56, 0.0),
        0.0615,
        0.055,
    );
    let skull = ellipsoid(
        &(p - Vec3::new(0.0, 1.605, 0.012)),
        &Vec3::new(0.076, 0.115, 0.096),
    );
    smooth_min(neck, skull)
}

/// The point and its mirror image, the one on the +x side first.
fn sides(p: &Vec3) -> [Vec3; 2] {
    [*p, Vec3::new(-p.x, p.y, p.z)]
}

/// The implicit function: negative inside, near the surface about the distance [m].
pub fn implicit(p: &Vec3) -> f64 {
    let mut d = smooth_min(torso(p), head(p));
    let [l, r] = sides(p);
    // the same order for a point and its mirror image
    let legs = smooth_min(left_leg(&l), left_leg(&r));
    let arms = left_arm(&l).min(left_arm(&r));
    d = smooth_min(d, legs);
    smooth_min(d, arms)
}

/// Closed triangle mesh of the mannequin. `cell` is the lattice spacing [m] of the meshing, 0 takes
/// [`DEFAULT_CELL`] (about 10,000 triangles).
pub fn mesh(cell: f64) -> Result<Mesh> {
    let cell = if cell == 0.0 { DEFAULT_CELL } else { cell };
    if !(CELLS.0..=CELLS.1).contains(&cell) {
        return Err(Error::argument(format!(
            "mannequin cell {cell} m must be within {} to {} m",
            CELLS.0, CELLS.1
        )));
    }
    // the lattice is symmetric about x = 0, which lies between two of its planes
    let half = ((0.75 / cell).ceil() - 0.5) * cell;
    let lo = Vec3::new(-half, -2.5 * cell, -0.22);
    let hi = Vec3::new(half, 1.72 + 2.5 * cell, 0.24);
    let samples = (hi - lo).map(|e| e / cell + 2.0).product();
    if samples > MAX_SAMPLES {
        return Err(Error::limit(format!(
            "mannequin cell {cell} m needs {samples:.0} samples, limit {MAX_SAMPLES:.0}"
        )));
    }
    Ok(surface_nets(&implicit, &lo, &hi, cell))
}

/// The mannequin as a body; `cell` as in [`mesh`].
pub fn body(cell: f64) -> Result<Body> {
    let (vertices, triangles) = mesh(cell)?;
    let positions: Vec<[f64; 3]> = vertices.iter().map(|p| [p.x, p.y, p.z]).collect();
    Body::mesh(&positions, &triangles, 0.0)
}

fn smoothstep(lo: f64, hi: f64, x: f64) -> f64 {
    let t = ((x - lo) / (hi - lo)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Turns `p` about the x axis through `joint`; a positive angle moves what hangs below it forward.
fn turn(p: Vec3, joint: &Vec3, angle: f64) -> Vec3 {
    let (s, c) = angle.sin_cos();
    let d = p - joint;
    joint + Vec3::new(d.x, c * d.y + s * d.z, -s * d.y + c * d.z)
}

/// Vertices of the mannequin at a phase [rad] of a walk in place; `rest` are those of [`mesh`].
/// Period 2 pi; phases 0 and pi are the standing mannequin. Legs swing by 0.4 rad, arms against
/// them by 0.35 rad; knees and elbows bend where their limb is in front.
pub fn pose(rest: &[Vec3], phase: f64) -> Vec<Vec3> {
    rest.iter().map(|p| posed(p, phase.sin())).collect()
}

fn posed(p: &Vec3, swing: f64) -> Vec3 {
    let side = if p.x < 0.0 { -1.0 } else { 1.0 };
    let l = Vec3::new(p.x.abs(), p.y, p.z);
    let (from_arm, from_leg) = (left_arm(&l), left_leg(&l));
    let other = head(p);
    // how far off the torso a point of the limb is
    let off = torso(p);
    let s = swing * side;
    let moved = if from_leg < from_arm && from_leg < other {
        let w = smoothstep(0.0, 0.12, off);
        let bend = smoothstep(-0.09, 0.09, KNEE.y - p.y);
        let l = turn(l, &KNEE, -0.35 * s * s * (1.0 + s) * bend * w);
        turn(l, &HIP, 0.4 * s * w)
    } else if from_arm < other {
        let w = smoothstep(0.0, 0.12, off);
        let elbow = SHOULDER + arm() * UPPER_ARM;
        let bend = smoothstep(-0.07, 0.07, (l - elbow).dot(&arm()));
        let l = turn(l, &elbow, 0.25 * s * s * (1.0 - s) * bend * w);
        turn(l, &SHOULDER, -0.35 * s * w)
    } else {
        l
    };
    Vec3::new(moved.x * side, moved.y, moved.z)
}
