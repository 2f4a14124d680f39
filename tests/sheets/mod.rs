//! Sheets of cloth on several kinds of mesh, and a world without bodies.

#![allow(dead_code, reason = "every test file uses a part of it")]

pub mod statics;

use spade::{DelaunayTriangulation, Point2, Triangulation};
use toile::body::Distance;
use toile::cloth::Cloth;
use toile::math::{Vec2, Vec3};
use toile::pattern::{Fabric, Garment, Panel, Placement};
use toile::system::term::{Bodies, ContactSettings, World};
use toile::tri::{GarmentMesh, SeamMesh};

/// A small deterministic generator (xorshift64*).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Uniform in [-1, 1].
    pub fn signed(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        2.0 * bits as f64 / (1_u64 << 53) as f64 - 1.0
    }

    pub fn vec3(&mut self, size: f64) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed()) * size
    }

    pub fn vec2(&mut self, size: f64) -> Vec2 {
        Vec2::new(self.signed(), self.signed()) * size
    }
}

/// How a rectangle is cut into triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// Squares, all diagonals parallel.
    Squares,
    /// Squares, diagonals alternating.
    UnionJack,
    /// Squares at 45 degrees, split across the strip.
    DiagonalAcross,
    /// Squares at 45 degrees, split along the strip.
    DiagonalAlong,
    /// Squares at 45 degrees, split across and along in turn.
    DiagonalJack,
    /// Delaunay triangulation of a jittered grid.
    Delaunay,
    /// Same with a small jitter.
    FairDelaunay,
}

pub const PATTERNS: [Pattern; 7] = [
    Pattern::Squares,
    Pattern::UnionJack,
    Pattern::DiagonalAcross,
    Pattern::DiagonalAlong,
    Pattern::DiagonalJack,
    Pattern::Delaunay,
    Pattern::FairDelaunay,
];

pub struct Flat {
    pub points: Vec<Vec2>,
    pub triangles: Vec<[u32; 3]>,
}

fn cross(a: Vec2, b: Vec2, c: Vec2) -> f64 {
    (b - a).perp(&(c - a))
}

/// `length` x `width` rectangle with about `n` edges along the length, counter-clockwise.
pub fn rectangle(pattern: Pattern, length: f64, width: f64, n: usize) -> Flat {
    let h = length / n as f64;
    let m = ((width / h).round() as usize).max(2);
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    match pattern {
        Pattern::Squares | Pattern::UnionJack => {
            for j in 0..=m {
                for i in 0..=n {
                    points.push(Vec2::new(i as f64 * h, width * j as f64 / m as f64));
                }
            }
            let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
            for j in 0..m {
                for i in 0..n {
                    let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                    if pattern == Pattern::Squares || (i + j) % 2 == 0 {
                        triangles.extend([[a, b, c], [a, c, d]]);
                    } else {
                        triangles.extend([[a, b, d], [b, c, d]]);
                    }
                }
            }
        }
        Pattern::DiagonalAcross | Pattern::DiagonalAlong | Pattern::DiagonalJack => {
            // lattice points with i + j even; the border that the diagonals miss is filled in
            let s = h / std::f64::consts::SQRT_2;
            let nx = ((length / s / 2.0).round() as usize).max(1) * 2;
            let ny = ((width / s / 2.0).round() as usize).max(1) * 2;
            let mut index = std::collections::BTreeMap::new();
            let is_across = |i: usize| match pattern {
                Pattern::DiagonalAcross => true,
                Pattern::DiagonalAlong => false,
                _ => i.is_multiple_of(2),
            };
            for j in 0..=ny {
                for i in 0..=nx {
                    let border = if is_across(i) {
                        j == 0 || j == ny
                    } else {
                        i == 0 || i == nx
                    };
                    if (i + j) % 2 == 0 || border {
                        index.insert((i as i64, j as i64), points.len() as u32);
                        points.push(Vec2::new(
                            length * i as f64 / nx as f64,
                            width * j as f64 / ny as f64,
                        ));
                    }
                }
            }
            let get = |i: i64, j: i64| index.get(&(i, j)).copied();
            for j in 0..=ny as i64 {
                for i in 0..=nx as i64 {
                    if (i + j) % 2 == 0 {
                        continue;
                    }
                    let center = get(i, j);
                    let (l, r, d, u) = (get(i - 1, j), get(i + 1, j), get(i, j - 1), get(i, j + 1));
                    let halves = if is_across(i as usize) {
                        let (d, u) = (d.or(center), u.or(center));
                        [[d, r, u], [d, u, l]]
                    } else {
                        let (l, r) = (l.or(center), r.or(center));
                        [[l, r, u], [l, d, r]]
                    };
                    for half in halves {
                        if let [Some(a), Some(b), Some(c)] = half {
                            triangles.push([a, b, c]);
                        }
                    }
                }
            }
        }
        Pattern::Delaunay | Pattern::FairDelaunay => {
            let jitter = if pattern == Pattern::Delaunay {
                0.3
            } else {
                0.15
            };
            let mut random = Random::new(7);
            let mut t = DelaunayTriangulation::<Point2<f64>>::new();
            for j in 0..=m {
                for i in 0..=n {
                    let mut p = Vec2::new(i as f64 * h, width * j as f64 / m as f64);
                    let move_by = random.vec2(jitter * h);
                    if 0 < i && i < n {
                        p.x += move_by.x;
                    }
                    if 0 < j && j < m {
                        p.y += move_by.y;
                    }
                    t.insert(Point2::new(p.x, p.y)).expect("finite point");
                    points.push(p);
                }
            }
            for v in t.vertices() {
                let p = v.position();
                points[v.index()] = Vec2::new(p.x, p.y);
            }
            for f in t.inner_faces() {
                triangles.push(f.vertices().map(|v| v.index() as u32));
            }
        }
    }
    triangles.retain(|t| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        cross(a, b, c).abs() > 1e-6 * h * h
    });
    for t in &mut triangles {
        let [a, b, c] = t.map(|v| points[v as usize]);
        if cross(a, b, c) < 0.0 {
            t.swap(1, 2);
        }
    }
    Flat { points, triangles }
}

pub fn panel(name: &str, fabric: usize, grain: f64) -> Panel {
    Panel {
        name: name.into(),
        vertices: Vec::new(),
        outline: Vec::new(),
        holes: Vec::new(),
        placement: Placement::default(),
        fabric,
        grain,
        edge_length: None,
        label: None,
    }
}

/// A mesh with one panel for each flat piece.
pub fn mesh(pieces: &[Flat], seams: Vec<SeamMesh>) -> GarmentMesh {
    let mut mesh = GarmentMesh {
        seams,
        panel_starts: vec![0],
        ..GarmentMesh::default()
    };
    for (p, piece) in pieces.iter().enumerate() {
        let first = mesh.uv.len() as u32;
        mesh.uv.extend(&piece.points);
        mesh.vertex_panel
            .extend(piece.points.iter().map(|_| p as u32));
        mesh.triangles
            .extend(piece.triangles.iter().map(|t| t.map(|v| v + first)));
        mesh.triangle_panel
            .extend(piece.triangles.iter().map(|_| p as u32));
        mesh.panel_starts.push(mesh.uv.len() as u32);
    }
    mesh.placed = mesh.uv.iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect();
    mesh
}

/// One rectangle of one fabric as a cloth.
pub fn sheet(pattern: Pattern, length: f64, width: f64, n: usize, fabric: Fabric) -> Cloth {
    let garment = Garment {
        panels: vec![panel("sheet", 0, 0.0)],
        fabrics: vec![fabric],
        ..Garment::default()
    };
    let flat = rectangle(pattern, length, width, n);
    Cloth::new(&garment, mesh(&[flat], Vec::new())).expect("valid sheet")
}

/// No body at all.
pub struct NoBodies;

impl Bodies for NoBodies {
    fn count(&self) -> usize {
        0
    }
    fn distance(&self, body: usize, _: &Vec3) -> Distance {
        panic!("body {body} of none")
    }
    fn value(&self, body: usize, _: &Vec3) -> f64 {
        panic!("body {body} of none")
    }
    fn carried(&self, body: usize, _: &Vec3) -> Vec3 {
        panic!("body {body} of none")
    }
    fn contact(&self, body: usize) -> &ContactSettings {
        panic!("body {body} of none")
    }
}

/// Gravity, wind and pressure that are all not zero.
pub fn windy() -> World<'static> {
    World {
        gravity: Vec3::new(0.3, -0.2, -9.81),
        wind: Vec3::new(2.0, -1.0, 0.7),
        pressure: 15.0,
        bodies: &NoBodies,
    }
}
