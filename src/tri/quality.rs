//! What a mesh looks like: smallest angle, edge lengths, hinges.

use super::GarmentMesh;
use crate::math::{Vec2, topology};

/// Smallest angle of all triangles in flat coordinates [rad]; half a turn for no triangles.
pub fn min_angle(mesh: &GarmentMesh) -> f64 {
    let mut least = std::f64::consts::PI;
    for t in &mesh.triangles {
        for angle in angles(t.map(|v| mesh.uv[v as usize])) {
            least = least.min(angle);
        }
    }
    least
}

/// Angles at the three corners [rad].
pub fn angles(corners: [Vec2; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (p, q, r) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let (a, b) = (q - p, r - p);
        (a.x * b.y - a.y * b.x).abs().atan2(a.dot(&b))
    })
}

/// Interior edges with their two opposite vertices, in ascending order of the edge.
///
/// `[v0, v1, v2, v3]`: edge `v0 v1` with `v0 < v1`, `v2` opposite in the triangle `(v0, v1, v2)`,
/// `v3` opposite in the triangle `(v1, v0, v3)`. Edges of one triangle, or of more than two, or of
/// two that disagree in orientation, make no hinge.
pub fn hinges(mesh: &GarmentMesh) -> Vec<[u32; 4]> {
    // (smaller, larger, runs from larger to smaller, opposite)
    let mut sides: Vec<(u32, u32, bool, u32)> = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b, c), (b, c, a), (c, a, b)])
        .map(|(a, b, c)| (a.min(b), a.max(b), a > b, c))
        .collect();
    sides.sort_unstable();
    sides
        .chunk_by(|p, q| (p.0, p.1) == (q.0, q.1))
        .filter_map(|group| match group {
            [(v0, v1, false, v2), (_, _, true, v3)] => Some([*v0, *v1, *v2, *v3]),
            _ => None,
        })
        .collect()
}

/// Lengths of edges in flat coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EdgeLengths {
    /// Shortest [m].
    pub min: f64,
    /// Mean [m].
    pub mean: f64,
    /// Longest [m].
    pub max: f64,
    /// Number of edges in each of equal bins from 0 to `max`.
    pub histogram: Vec<usize>,
}

/// Lengths of all edges with a histogram of `bins` (at least 1).
pub fn edge_lengths(mesh: &GarmentMesh, bins: usize) -> EdgeLengths {
    let lengths: Vec<f64> = topology::edges(&mesh.triangles)
        .iter()
        .map(|[a, b]| (mesh.uv[*a as usize] - mesh.uv[*b as usize]).norm())
        .collect();
    let bins = bins.max(1);
    let mut result = EdgeLengths {
        histogram: vec![0; bins],
        ..EdgeLengths::default()
    };
    if lengths.is_empty() {
        return result;
    }
    result.min = lengths.iter().copied().fold(f64::INFINITY, f64::min);
    result.max = lengths.iter().copied().fold(0.0, f64::max);
    result.mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    for length in lengths {
        let bin = (length / result.max * bins as f64) as usize;
        result.histogram[bin.min(bins - 1)] += 1;
    }
    result
}
