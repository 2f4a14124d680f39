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
use crate::tri::{GarmentMesh, SeamLink};

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

/// A garment as one surface: all vertices that seams tie into one point are that point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SewnSurface {
    /// Positions; a sewn vertex has the mean of all that are sewn with it [m].
    pub positions: Vec<Vec3>,
    /// Triangles on the vertices that stand for their points.
    pub triangles: Vec<[u32; 3]>,
    /// Vertices that are sewn to points between vertices, with those.
    pub glued: Vec<[u32; 2]>,
    /// Largest distance of a vertex from the point that it is sewn into [m].
    pub moved: f64,
}

impl SewnSurface {
    /// The surface of a garment at some positions. A seam holds its two rims together only to its
    /// gap, within which they overlap or gape: of the surface, not of the rims, it can be said whether
    /// it passes through itself.
    pub fn new(mesh: &GarmentMesh, positions: &[Vec3]) -> Self {
        let point = sewn_points(mesh);
        let mut sums = vec![(Vec3::zeros(), 0.0); positions.len()];
        for (p, x) in point.iter().zip(positions) {
            let sum = &mut sums[*p as usize];
            *sum = (sum.0 + x, sum.1 + 1.0);
        }
        let middles = point
            .iter()
            .map(|&p| sums[p as usize].0 / sums[p as usize].1);
        let sewn: Vec<Vec3> = middles.collect();
        let moves = sewn.iter().zip(positions).map(|(a, b)| (a - b).norm());
        let between = links(mesh).filter(|l| one_point(l).is_none());
        Self {
            triangles: mesh
                .triangles
                .iter()
                .map(|t| t.map(|v| point[v as usize]))
                .collect(),
            glued: between
                .flat_map(|l| {
                    l.edge
                        .map(|e| [point[l.vertex as usize], point[e as usize]])
                })
                .collect(),
            moved: moves.fold(0.0, f64::max),
            positions: sewn,
        }
    }

    /// Its crossings with itself, see [`crossings`].
    pub fn crossings(&self, max: usize) -> Result<Vec<Crossing>> {
        crossings(&self.triangles, &self.positions, &self.glued, max)
    }
}

fn links(mesh: &GarmentMesh) -> impl Iterator<Item = &SeamLink> {
    mesh.seams.iter().flat_map(|s| &s.links)
}

/// The vertex that a link ties its vertex to, if it is one.
fn one_point(link: &SeamLink) -> Option<u32> {
    match link.t {
        t if t <= ONE_POINT => Some(link.edge[0]),
        t if t >= 1.0 - ONE_POINT => Some(link.edge[1]),
        _ => None,
    }
}

/// For each vertex the smallest one that is sewn into the same point.
fn sewn_points(mesh: &GarmentMesh) -> Vec<u32> {
    let mut point: Vec<u32> = (0..mesh.uv.len() as u32).collect();
    let find = |point: &[u32], mut v: u32| {
        while point[v as usize] != v {
            v = point[v as usize];
        }
        v
    };
    for link in links(mesh) {
        if let Some(other) = one_point(link) {
            let (a, b) = (find(&point, link.vertex), find(&point, other));
            point[a.max(b) as usize] = a.min(b);
        }
    }
    (0..point.len() as u32).map(|v| find(&point, v)).collect()
}

/// Pairs of vertices that the seams of a garment tie together: a vertex and the ends of the edge that
/// it is sewn to, and all vertices that are sewn into one point, as where four panels meet.
pub fn glued_pairs(mesh: &GarmentMesh) -> Vec<[u32; 2]> {
    let mut pairs: Vec<[u32; 2]> = links(mesh)
        .flat_map(|l| l.edge.map(|e| [l.vertex, e]))
        .collect();
    let mut groups: Vec<(u32, u32)> = sewn_points(mesh).into_iter().zip(0..).collect();
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
    use crate::tri::SeamMesh;

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

    #[test]
    fn rims_that_overlap_within_a_seam_are_no_crossing_of_the_sewn_surface() {
        // two triangles, sewn along an edge; the second one's rim reaches over the first one's
        let x = [
            Vec3::new(0.0, 0.0, 0.0),
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(0.5, -1.0, 0.02),
            Vec3::new(0.0, -0.01, 0.01),
            Vec3::new(1.0, -0.01, -0.01),
            Vec3::new(0.5, 1.0, 0.0),
        ];
        let link = |vertex, edge| SeamLink {
            vertex,
            edge,
            t: 0.0,
            length: 0.5,
        };
        let mesh = GarmentMesh {
            uv: vec![Vec2::zeros(); 6],
            triangles: vec![[0, 2, 1], [3, 4, 5]],
            seams: vec![SeamMesh {
                links: vec![link(0, [3, 4]), link(1, [4, 3])],
                ..SeamMesh::default()
            }],
            ..GarmentMesh::default()
        };
        let rims = crossings(&mesh.triangles, &x, &[], 10).unwrap();
        assert!(!rims.is_empty());
        let sewn = SewnSurface::new(&mesh, &x);
        assert!(sewn.crossings(10).unwrap().is_empty());
        assert_eq!(sewn.triangles, [[0, 2, 1], [0, 1, 5]]);
        assert!((sewn.moved - 0.5 * 2e-4_f64.sqrt()).abs() < 1e-12);
        // a third one through both of them is
        let mut through = mesh.clone();
        through.triangles.push([6, 7, 8]);
        through.uv = vec![Vec2::zeros(); 9];
        let more = [(0.4, -1.0), (0.4, 1.0), (0.6, 1.0)].map(|(a, z)| Vec3::new(a, -0.2, z));
        let x = [&x[..], &more].concat();
        assert!(
            !SewnSurface::new(&through, &x)
                .crossings(10)
                .unwrap()
                .is_empty()
        );
    }
}
