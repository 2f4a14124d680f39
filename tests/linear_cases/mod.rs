//! Matrices of sewn cloth, as an implicit step meets them: strips of a wavy membrane, each with
//! vertices of its own, joined by stiff seam springs.

#![allow(dead_code, reason = "shared by several test programs and a bench")]
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "test code")]

use toile::math::block::{BlockMatrix, BlockPattern};
use toile::math::{Mat3, Vec2, Vec3};
use toile::solve::linear::ordering::{EMITTING, ORDINARY, RECEIVING};

/// A matrix and the seam priorities of its rows.
pub(crate) struct Case {
    pub(crate) matrix: BlockMatrix,
    pub(crate) priorities: Vec<u8>,
}

/// About `n` vertices over 1 m^2 of 0.2 kg/m^2 cloth: stretch 1000 N/m, shear 200 N/m, bending
/// 1e-5 N m, step `h` [s], cut into `strips` strips sewn by springs of 2e5 N/m^2.
pub(crate) fn sewn_cloth(n: usize, strips: usize, h: f64) -> Case {
    let rows = (n as f64).sqrt().round() as usize;
    let per_strip = (rows / strips).max(2);
    let spacing = 1.0 / rows as f64;
    let index = |s: usize, i: usize, j: usize| ((s * per_strip + i) * rows + j) as u32;
    let total = strips * per_strip * rows;
    let mut uv = vec![Vec2::zeros(); total];
    for s in 0..strips {
        for i in 0..per_strip {
            for j in 0..rows {
                // The second half of the strips is shifted, so that seams meet edges inside.
                let shift = if s % 2 == 1 && j > 0 && j + 1 < rows {
                    0.3
                } else {
                    0.0
                };
                let column = (s * (per_strip - 1) + i) as f64;
                uv[index(s, i, j) as usize] = Vec2::new(column, j as f64 + shift) * spacing;
            }
        }
    }
    let x: Vec<Vec3> = uv
        .iter()
        .map(|p| Vec3::new(p.x, p.y, 0.03 * (20.0 * p.x).sin() * (14.0 * p.y).cos()))
        .collect();

    let mut stencils: Vec<(Vec<u32>, Vec<Mat3>)> = Vec::new();
    let mut mass = vec![0.0; total];
    for s in 0..strips {
        for i in 0..per_strip - 1 {
            for j in 0..rows - 1 {
                let [a, b, c, d] = [
                    index(s, i, j),
                    index(s, i + 1, j),
                    index(s, i + 1, j + 1),
                    index(s, i, j + 1),
                ];
                for t in [[a, b, c], [a, c, d]] {
                    stencils.push(membrane(t, &uv, &x));
                    for v in t {
                        mass[v as usize] += 0.2 * 0.5 * spacing * spacing / 3.0;
                    }
                }
                stencils.push(hinge([a, c, b, d], spacing));
                if i + 2 < per_strip && j + 1 < rows {
                    stencils.push(hinge([b, c, a, index(s, i + 2, j + 1)], spacing));
                }
                if j + 2 < rows {
                    stencils.push(hinge([d, c, a, index(s, i + 1, j + 2)], spacing));
                }
            }
        }
    }
    let mut priorities = vec![ORDINARY; total];
    for s in 1..strips {
        for j in 0..rows {
            let v = index(s, 0, j);
            let k = j.min(rows - 2);
            let (e0, e1) = (
                index(s - 1, per_strip - 1, k),
                index(s - 1, per_strip - 1, k + 1),
            );
            let t = if j + 1 == rows { 1.0 } else { 0.3 };
            let weights = [1.0, t - 1.0, -t];
            let stiffness = 2e5 * spacing;
            stencils.push(outer(&[v, e0, e1], &weights, stiffness));
            priorities[v as usize] = EMITTING;
            for e in [e0, e1] {
                priorities[e as usize] = priorities[e as usize].min(RECEIVING);
            }
        }
    }

    let pattern = BlockPattern::from_stencils(total, |sink| {
        for (vertices, _) in &stencils {
            sink(vertices);
        }
    });
    let mut matrix = BlockMatrix::zeros(pattern);
    for (v, m) in mass.iter().enumerate() {
        let slot = matrix.pattern.starts[v] as usize;
        matrix.blocks[slot] += Mat3::identity() * (m / (h * h));
    }
    for (vertices, blocks) in &stencils {
        add(&mut matrix, vertices, blocks);
    }
    Case { matrix, priorities }
}

/// Adds a stencil's full square of blocks.
pub(crate) fn add(matrix: &mut BlockMatrix, vertices: &[u32], blocks: &[Mat3]) {
    let m = vertices.len();
    for (p, &i) in vertices.iter().enumerate() {
        for (q, &j) in vertices.iter().enumerate() {
            if i >= j {
                let slot = matrix
                    .pattern
                    .slot(i, j)
                    .expect("stencil is in the pattern");
                matrix.blocks[slot] += blocks[p * m + q];
            }
        }
    }
}

fn membrane(t: [u32; 3], uv: &[Vec2], x: &[Vec3]) -> (Vec<u32>, Vec<Mat3>) {
    let [u0, u1, u2] = t.map(|v| uv[v as usize]);
    let [x0, x1, x2] = t.map(|v| x[v as usize]);
    let (e1, e2) = (u1 - u0, u2 - u0);
    let det = e1.x * e2.y - e1.y * e2.x;
    let g1 = Vec2::new(e2.y, -e2.x) / det;
    let g2 = Vec2::new(-e1.y, e1.x) / det;
    let g = [-g1 - g2, g1, g2];
    let normal = (x1 - x0).cross(&(x2 - x0)).normalize();
    let a = (x1 - x0).normalize();
    let b = normal.cross(&a);
    let (stretch, shear) = (1000.0, 200.0);
    let mut blocks = Vec::new();
    for gi in g {
        for gj in g {
            let area = 0.5 * det.abs();
            let m00 = stretch * gi.x * gj.x + shear * gi.y * gj.y;
            let m11 = stretch * gi.y * gj.y + shear * gi.x * gj.x;
            let (m01, m10) = (shear * gi.y * gj.x, shear * gi.x * gj.y);
            blocks.push(
                (a * a.transpose() * m00
                    + b * b.transpose() * m11
                    + a * b.transpose() * m01
                    + b * a.transpose() * m10)
                    * area,
            );
        }
    }
    (t.to_vec(), blocks)
}

fn hinge(v: [u32; 4], spacing: f64) -> (Vec<u32>, Vec<Mat3>) {
    outer(&v, &[1.0, 1.0, -1.0, -1.0], 3e-5 / (spacing * spacing))
}

fn outer(v: &[u32], w: &[f64], k: f64) -> (Vec<u32>, Vec<Mat3>) {
    let mut blocks = Vec::new();
    for wi in w {
        for wj in w {
            blocks.push(Mat3::identity() * (k * wi * wj));
        }
    }
    (v.to_vec(), blocks)
}

/// A right-hand side: gravity and a fixed pseudo-random part.
pub(crate) fn forces(n: usize, seed: u64) -> Vec<Vec3> {
    let mut random = Random(seed);
    (0..n)
        .map(|_| {
            Vec3::new(random.signed(), random.signed(), random.signed()) * 1e-3
                - Vec3::new(0.0, 2e-3, 0.0)
        })
        .collect()
}

/// SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In (-1, 1).
    pub(crate) fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub(crate) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// `|b - A x| / |b|`.
pub(crate) fn residual(matrix: &BlockMatrix, b: &[Vec3], x: &[Vec3]) -> f64 {
    let mut y = vec![Vec3::zeros(); b.len()];
    matrix.multiply(x, &mut y);
    let mut top = 0.0;
    let mut bottom = 0.0;
    for (y, b) in y.iter().zip(b) {
        top += (b - y).norm_squared();
        bottom += b.norm_squared();
    }
    (top / bottom).sqrt()
}
