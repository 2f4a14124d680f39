//! Edges of the cloth that pass through triangles, of the cloth or of another mesh.
//!
//! An edge `p q` passes through a triangle `a b c` when `p` and `q` lie on different sides of its
//! plane and the line `p q` leaves `a b`, `b c` and `c a` on one side. The five signs are signs of
//! 4x4 determinants (`orient3d`), evaluated exactly (Shewchuk 1997, crate `robust`), so that the
//! answer is the one for the given f64 coordinates. A point in the plane counts as on its positive
//! side, a line through an edge of the triangle as inside: a surface that passes through a vertex
//! or an edge of another is found; one that only touches may be. Coplanar parts do not cross.
//!
//! Triangles that share a vertex with the edge, or a vertex glued to one of its ends, are left
//! out: the surface is continuous there.

use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::boxtree::{Aabb, BoxTree};
use crate::math::topology::edges;
use crate::tri::GarmentMesh;

/// An edge (smaller vertex first) and the triangle that it passes through.
pub type Crossing = ([u32; 2], u32);

/// Crossings of a surface with itself, at most `max` of them, sorted by edge, then triangle.
///
/// `glued` lists pairs of vertices that a seam ties together (see [`glued_pairs`]).
pub fn crossings(
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    glued: &[[u32; 2]],
    max: usize,
) -> Result<Vec<Crossing>> {
    check(triangles, positions)?;
    // Both directions, so that the partners of a vertex are a range.
    let mut partners: Vec<[u32; 2]> = glued.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
    partners.sort_unstable();
    partners.dedup();
    let near = |v: u32, triangle: &[u32; 3]| {
        if triangle.contains(&v) {
            return true;
        }
        let from = partners.partition_point(|p| p[0] < v);
        partners[from..]
            .iter()
            .take_while(|p| p[0] == v)
            .any(|p| triangle.contains(&p[1]))
    };
    Ok(search(
        &edges(triangles),
        positions,
        triangles,
        positions,
        max,
        |edge, t| edge.iter().any(|&v| near(v, t)),
    ))
}

/// Edges of the cloth through triangles of another mesh, at most `max`, sorted.
pub fn crossings_with(
    triangles: &[[u32; 3]],
    positions: &[Vec3],
    other_triangles: &[[u32; 3]],
    other_positions: &[Vec3],
    max: usize,
) -> Result<Vec<Crossing>> {
    check(triangles, positions)?;
    check(other_triangles, other_positions)?;
    Ok(search(
        &edges(triangles),
        positions,
        other_triangles,
        other_positions,
        max,
        |_, _| false,
    ))
}

/// Part of an edge within which a seam's link ties vertex to vertex.
const ONE_POINT: f64 = 1e-6;

/// Pairs of vertices that the seams of a garment tie together: a vertex and the ends of the edge that
/// it is sewn to, and all vertices that are sewn into one point, as where four panels meet.
pub fn glued_pairs(mesh: &GarmentMesh) -> Vec<[u32; 2]> {
    let links = || mesh.seams.iter().flat_map(|s| &s.links);
    let mut pairs: Vec<[u32; 2]> = links()
        .flat_map(|l| l.edge.map(|e| [l.vertex, e]))
        .collect();
    // the smallest vertex of each point stands for it
    let mut point: Vec<u32> = (0..mesh.uv.len() as u32).collect();
    let find = |point: &[u32], mut v: u32| {
        while point[v as usize] != v {
            v = point[v as usize];
        }
        v
    };
    let mut members = Vec::new();
    for link in links() {
        let other = match link.t {
            t if t <= ONE_POINT => link.edge[0],
            t if t >= 1.0 - ONE_POINT => link.edge[1],
            _ => continue,
        };
        let (a, b) = (find(&point, link.vertex), find(&point, other));
        point[a.max(b) as usize] = a.min(b);
        members.extend([link.vertex, other]);
    }
    members.sort_unstable();
    members.dedup();
    let mut groups: Vec<(u32, u32)> = members.iter().map(|&v| (find(&point, v), v)).collect();
    groups.sort_unstable();
    for group in groups.chunk_by(|a, b| a.0 == b.0) {
        for (i, (_, a)) in group.iter().enumerate() {
            pairs.extend(group[i + 1..].iter().map(|(_, b)| [*a, *b]));
        }
    }
    pairs
}

fn check(triangles: &[[u32; 3]], positions: &[Vec3]) -> Result<()> {
    for (t, triangle) in triangles.iter().enumerate() {
        for &v in triangle {
            let Some(p) = positions.get(v as usize) else {
                return Err(Error::geometry(format!(
                    "triangle {t} names vertex {v} of {}",
                    positions.len()
                )));
            };
            if !p.iter().all(|c| c.is_finite()) {
                return Err(Error::geometry(format!(
                    "vertex {v} of triangle {t} is not finite"
                )));
            }
        }
    }
    Ok(())
}

fn search(
    edges: &[[u32; 2]],
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    corners: &[Vec3],
    max: usize,
    ignore: impl Fn(&[u32; 2], &[u32; 3]) -> bool,
) -> Vec<Crossing> {
    let corner = |t: &[u32; 3]| t.map(|v| corners[v as usize]);
    let item_boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(&corner(t))).collect();
    let centres: Vec<Vec3> = item_boxes.iter().map(|b| 0.5 * (b.min + b.max)).collect();
    let tree = BoxTree::new(&centres);
    let boxes = tree.fit(|t| item_boxes[t as usize]);
    let mut found = Vec::new();
    let mut hits = Vec::new();
    for edge in edges {
        if found.len() >= max {
            break;
        }
        let ends = edge.map(|v| positions[v as usize]);
        let query = Aabb::of(&ends);
        hits.clear();
        tree.query(&boxes, &query, |t| {
            let triangle = &triangles[t as usize];
            if item_boxes[t as usize].overlaps(&query)
                && !ignore(edge, triangle)
                && passes(&ends, &corner(triangle))
            {
                hits.push(t);
            }
        });
        hits.sort_unstable();
        let room = max - found.len();
        found.extend(hits.iter().take(room).map(|&t| (*edge, t)));
    }
    found
}

/// Whether a segment passes through a triangle.
pub fn passes([p, q]: &[Vec3; 2], [a, b, c]: &[Vec3; 3]) -> bool {
    if (side(a, b, c, p) >= 0.0) == (side(a, b, c, q) >= 0.0) {
        return false;
    }
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    let inside = around.iter().all(|&s| s >= 0.0) || around.iter().all(|&s| s <= 0.0);
    // All three zero: the line lies in the plane of a triangle without area.
    inside && around.iter().any(|&s| s != 0.0)
}

fn side(a: &Vec3, b: &Vec3, c: &Vec3, d: &Vec3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|v| robust::Coord3D {
        x: v.x,
        y: v.y,
        z: v.z,
    });
    robust::orient3d(a, b, c, d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;
    use crate::tri::{SeamLink, SeamMesh};

    #[test]
    fn all_vertices_sewn_into_one_point_are_glued() {
        let link = |vertex, edge, t| SeamLink {
            vertex,
            edge,
            t,
            length: 0.01,
        };
        // four panels meet: 0 with 2, 2 with 4, 6 with 4; 8 is sewn into the middle of an edge
        let links = vec![
            link(0, [2, 3], 0.0),
            link(2, [5, 4], 1.0),
            link(6, [4, 7], 0.0),
            link(8, [2, 3], 0.5),
        ];
        let mesh = GarmentMesh {
            uv: vec![Vec2::zeros(); 9],
            seams: vec![SeamMesh {
                links,
                ..SeamMesh::default()
            }],
            ..GarmentMesh::default()
        };
        let pairs = glued_pairs(&mesh);
        let has = |a: u32, b: u32| pairs.contains(&[a, b]) || pairs.contains(&[b, a]);
        for (a, b) in [
            (0, 2),
            (0, 4),
            (0, 6),
            (2, 4),
            (2, 6),
            (4, 6),
            (8, 2),
            (8, 3),
        ] {
            assert!(has(a, b), "{a} and {b}");
        }
        for (a, b) in [(8, 0), (8, 4), (0, 8), (0, 7)] {
            assert!(!has(a, b), "{a} and {b}");
        }
    }
}
