//! What is read off a triangle surface: normals, stretch.
//!
//! Vertex normal: the sum of the incident triangles' `(b - a) x (c - a)`, normalized; the cross
//! product's length is twice the area, so the weights are the areas. Edge strain:
//! `|x_b - x_a| / |X_b - X_a| - 1` with `X` the flat coordinates, shape `[edge_count]`, without a
//! unit.

use crate::math::topology::edges;
use crate::math::{Vec2, Vec3};

/// Unit vertex normals, area-weighted; zero where every incident triangle is degenerate.
pub fn normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|i| positions.get(i as usize));
        let (Some(a), Some(b), Some(c)) = (a, b, c) else {
            continue;
        };
        let n = (b - a).cross(&(c - a));
        for &v in t {
            out[v as usize] += n;
        }
    }
    for n in &mut out {
        *n = n.try_normalize(1e-300).unwrap_or_else(Vec3::zeros);
    }
    out
}

/// Strain of each edge against the flat panel; an edge that names no vertex or has no flat length
/// counts as zero.
pub fn edge_strains(positions: &[Vec3], uv: &[Vec2], edges: &[[u32; 2]]) -> Vec<f64> {
    edges
        .iter()
        .map(|&[a, b]| {
            let (a, b) = (a as usize, b as usize);
            match (positions.get(a), positions.get(b), uv.get(a), uv.get(b)) {
                (Some(xa), Some(xb), Some(ua), Some(ub)) => {
                    let rest = (ub - ua).norm();
                    if rest > 0.0 {
                        (xb - xa).norm() / rest - 1.0
                    } else {
                        0.0
                    }
                }
                _ => 0.0,
            }
        })
        .collect()
}

/// Largest edge strain; 0 without edges.
pub fn max_edge_strain(positions: &[Vec3], uv: &[Vec2], triangles: &[[u32; 3]]) -> f64 {
    edge_strains(positions, uv, &edges(triangles))
        .into_iter()
        .fold(0.0, f64::max)
}

/// Strain at vertices: the largest of the incident edges in size, with its sign.
pub fn vertex_strains(positions: &[Vec3], uv: &[Vec2], triangles: &[[u32; 3]]) -> Vec<f64> {
    let edges = edges(triangles);
    let strains = edge_strains(positions, uv, &edges);
    let mut out = vec![0.0_f64; positions.len()];
    for (edge, &s) in edges.iter().zip(&strains) {
        for &v in edge {
            if let Some(o) = out.get_mut(v as usize)
                && s.abs() > o.abs()
            {
                *o = s;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> (Vec<Vec3>, Vec<Vec2>, Vec<[u32; 3]>) {
        let uv: Vec<Vec2> = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)]
            .map(|(x, y)| Vec2::new(x, y))
            .to_vec();
        let x = uv.iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect();
        (x, uv, vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn flat_square_has_unit_normals_and_no_strain() {
        let (x, uv, t) = square();
        for n in normals(&x, &t) {
            assert_eq!(n, Vec3::z());
        }
        assert_eq!(max_edge_strain(&x, &uv, &t), 0.0);
    }

    #[test]
    fn normals_are_weighted_by_area() {
        // a large triangle facing z and a small one facing x share an edge
        let x = vec![
            Vec3::new(0.0, 0.0, 0.0),
            Vec3::new(0.0, 1.0, 0.0),
            Vec3::new(-3.0, 0.0, 0.0),
            Vec3::new(0.0, 0.0, -1.0),
        ];
        let n = normals(&x, &[[0, 1, 2], [0, 3, 1]]);
        let expected = Vec3::new(-1.0, 0.0, 3.0);
        let got = n[0] * 10.0_f64.sqrt();
        assert!((got.z.abs() - expected.z).abs() < 1e-12, "{got}");
        assert!((got.x.abs() - 1.0).abs() < 1e-12, "{got}");
    }

    #[test]
    fn uniform_stretch_is_read_as_strain_along_the_stretch_only() {
        let (mut x, uv, t) = square();
        for p in &mut x {
            p.x *= 1.25;
        }
        let e = edges(&t);
        let s = edge_strains(&x, &uv, &e);
        for (edge, strain) in e.iter().zip(s) {
            let d = uv[edge[1] as usize] - uv[edge[0] as usize];
            let expected = ((1.25 * d.x).powi(2) + d.y.powi(2)).sqrt() / d.norm() - 1.0;
            assert!((strain - expected).abs() < 1e-14);
        }
        assert!((max_edge_strain(&x, &uv, &t) - 0.25).abs() < 1e-14);
        assert!((vertex_strains(&x, &uv, &t)[1] - 0.25).abs() < 1e-14);
    }
}
