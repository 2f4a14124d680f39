//! Nodes carried by the triangles they lie in.
//!
//! ```text
//! x_n = sum_k b_k x_k + lift n
//! ```
//!
//! with the barycentric weights `b` of the node in its triangle of the flat panel (Casafranca et al.
//! 2020, equation 1, without displacements) and the triangle's normal `n`.

use crate::error::Result;
use crate::math::Vec3;
use crate::tri::{GarmentMesh, Transfer};
use crate::yarn::YarnMesh;

/// Places of the nodes of `yarns` on a mesh of the same garment whose vertices are at `x` [m].
pub fn carried(mesh: &GarmentMesh, x: &[Vec3], yarns: &YarnMesh) -> Result<Vec<Vec3>> {
    let map = Transfer::of_points(mesh, &yarns.node_panel, &yarns.uv)?;
    let mut nodes = map.apply(&mesh.triangles, x);
    for ((node, lift), t) in nodes.iter_mut().zip(&yarns.lift).zip(&map.triangle) {
        let [a, b, c] = mesh.triangles[*t as usize].map(|v| x[v as usize]);
        if let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) {
            *node += normal * *lift;
        }
    }
    Ok(nodes)
}
