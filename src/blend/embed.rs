//! Nodes carried by the triangles they lie in.
//!
//! ```text
//! x_n = sum_k b_k x_k + lift n
//! ```
//!
//! with the barycentric weights `b` of the node in its triangle of the flat panel (Casafranca et al.
//! 2020, equation 1, without displacements) and the triangle's normal `n`. With the edges `e`, `f` of the triangle and
//! `m = e x f` the normal turns at `dn/dt = (I - n n^T) (de/dt x f + e x df/dt) / |m|`.

use crate::error::Result;
use crate::math::Vec3;
use crate::tri::{GarmentMesh, Transfer};
use crate::yarn::YarnMesh;

/// Places of the nodes of `yarns` on a mesh of the same garment whose vertices are at `x` [m].
pub fn carried(mesh: &GarmentMesh, x: &[Vec3], yarns: &YarnMesh) -> Result<Vec<Vec3>> {
    let still = vec![Vec3::zeros(); x.len()];
    Ok(carried_along(mesh, x, &still, yarns)?.0)
}

/// Their places and velocities on vertices that move with the velocities `v` [m/s].
pub fn carried_along(
    mesh: &GarmentMesh,
    x: &[Vec3],
    v: &[Vec3],
    yarns: &YarnMesh,
) -> Result<(Vec<Vec3>, Vec<Vec3>)> {
    let map = Transfer::of_points(mesh, &yarns.node_panel, &yarns.uv)?;
    let mut places = map.apply(&mesh.triangles, x);
    let mut rates = map.apply(&mesh.triangles, v);
    for (node, (lift, t)) in yarns.lift.iter().zip(&map.triangle).enumerate() {
        let edges = |values: &[Vec3]| {
            let [a, b, c] = mesh.triangles[*t as usize].map(|v| values[v as usize]);
            [b - a, c - a]
        };
        let ([e, f], [de, df]) = (edges(x), edges(v));
        let m = e.cross(&f);
        if let Some(n) = m.try_normalize(0.0) {
            let turned = (de.cross(&f) + e.cross(&df)) / m.norm();
            places[node] += n * *lift;
            rates[node] += (turned - n * n.dot(&turned)) * *lift;
        }
    }
    Ok((places, rates))
}
