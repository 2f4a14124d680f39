//! Sparse signed distance field of a closed mesh: nested levels of bricks, read as one C1 function.
//!
//! Level `l` has spacing `h_l = 4^l h` and nodes at `(i + 1/2) h_l`, in bricks of 4 x 4 x 4 nodes.
//! A brick is stored where its centre is within `BAND` spacings of the surface; the top level is
//! stored in the whole box. So the fine level spans the cloth's neighbourhood, the next one (4 h)
//! everything inside a person and some decimetres around it, all sampled with exact distances.
//!
//! A coefficient that a level does not store is the one by which the next level's spline is written
//! in the finer basis (the spaces are nested, see `spline`). The field is thus a single C1 function
//! across all levels without any blending weight: where no coefficient of a level is stored, it is
//! the next level's spline exactly.
//!
//! The lattice is fixed in the body's frame (multiples of `h`) and every stored number is a function
//! of the positions alone, so that a field updated near moved triangles has the same bits as one
//! built anew. Outside the box (the mesh's bounds and two top-level spacings) see
//! `spline::beyond_box`. Coefficients are f32: 6e-8 of the distance, far below the sampling error;
//! the function built on them is C1 all the same.

mod build;
mod plan;

use super::{Distance, floor, spline};
use crate::math::Vec3;

pub(in crate::body) use build::{Origin, Source};

const NONE: u32 = u32::MAX;

/// Coefficients or distances of a brick's nodes, `[(4 x + y) 4 + z]`.
type Brick = [f32; 64];

/// One spacing of the field.
#[derive(Clone, Debug)]
struct Level {
    h: f64,
    /// Brick coordinates of the box's first brick, and bricks per axis.
    lo: [i64; 3],
    n: [usize; 3],
    /// Slot of every brick of the box, `NONE` where it is not stored.
    slots: Vec<u32>,
    /// Place of every stored brick, ascending in `slots`.
    bricks: Vec<[i64; 3]>,
    coefficients: Vec<Brick>,
}

/// The field.
#[derive(Clone, Debug)]
pub(in crate::body) struct Field {
    levels: Vec<Level>,
    lo: Vec3,
    hi: Vec3,
}

impl Level {
    #[inline]
    fn slot(&self, brick: [i64; 3]) -> u32 {
        let x = brick[0].wrapping_sub(self.lo[0]) as u64;
        let y = brick[1].wrapping_sub(self.lo[1]) as u64;
        let z = brick[2].wrapping_sub(self.lo[2]) as u64;
        if x >= self.n[0] as u64 || y >= self.n[1] as u64 || z >= self.n[2] as u64 {
            return NONE;
        }
        self.slots[(x as usize * self.n[1] + y as usize) * self.n[2] + z as usize]
    }

    fn index(&self, brick: [i64; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|d| (brick[d] - self.lo[d]) as usize);
        (x * self.n[1] + y) * self.n[2] + z
    }

    fn node(&self, brick: [i64; 3], n: usize) -> Vec3 {
        let node = [
            4 * brick[0] + (n >> 4) as i64,
            4 * brick[1] + ((n >> 2) & 3) as i64,
            4 * brick[2] + (n & 3) as i64,
        ];
        Vec3::from_fn(|d, _| (node[d] as f64 + 0.5) * self.h)
    }

    fn center(&self, brick: [i64; 3]) -> Vec3 {
        Vec3::from_fn(|d, _| (brick[d] as f64 + 0.5) * 4.0 * self.h)
    }

    /// The 27 stored coefficients around a cell and how many of them are missing.
    #[inline]
    fn gather(&self, cell: [i64; 3], c: &mut [f64; 27], missing: &mut u32) -> usize {
        *missing = 0;
        let lo = cell.map(|i| (i - 1) >> 2);
        let hi = cell.map(|i| (i + 1) >> 2);
        if lo == hi {
            let slot = self.slot(lo);
            if slot == NONE {
                *missing = (1 << 27) - 1;
                return 27;
            }
            let brick = &self.coefficients[slot as usize];
            let base = cell.map(|i| ((i - 1) & 3) as usize);
            for i in 0..3 {
                for j in 0..3 {
                    let row = (base[0] + i) * 16 + (base[1] + j) * 4 + base[2];
                    for k in 0..3 {
                        c[(3 * i + j) * 3 + k] = f64::from(brick[row + k]);
                    }
                }
            }
            return 0;
        }
        let mut slots = [NONE; 8];
        for (s, slot) in slots.iter_mut().enumerate() {
            let pick = |d: usize| if s >> (2 - d) & 1 == 0 { lo[d] } else { hi[d] };
            // an axis that stays within one brick repeats the first half
            if (0..3).any(|d| lo[d] == hi[d] && s >> (2 - d) & 1 == 1) {
                continue;
            }
            *slot = self.slot([pick(0), pick(1), pick(2)]);
        }
        let mut count = 0;
        let side = |d: usize, i: usize| {
            let node = cell[d] + i as i64 - 1;
            (usize::from(node >> 2 != lo[d]), (node & 3) as usize)
        };
        let axes: [[(usize, usize); 3]; 3] =
            std::array::from_fn(|d| std::array::from_fn(|i| side(d, i)));
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    let (x, y, z) = (axes[0][i], axes[1][j], axes[2][k]);
                    let slot = slots[x.0 * 4 + y.0 * 2 + z.0];
                    let at = (3 * i + j) * 3 + k;
                    if slot == NONE {
                        *missing |= 1 << at;
                        count += 1;
                    } else {
                        let brick = &self.coefficients[slot as usize];
                        c[at] = f64::from(brick[x.1 * 16 + y.1 * 4 + z.1]);
                    }
                }
            }
        }
        count
    }
}

impl Field {
    /// Coefficient of a node, from the first level that stores it.
    fn coefficient(&self, level: usize, node: [i64; 3]) -> f64 {
        let here = &self.levels[level];
        let slot = here.slot(node.map(|i| i >> 2));
        if slot != NONE {
            let [x, y, z] = node.map(|i| (i & 3) as usize);
            return f64::from(here.coefficients[slot as usize][x * 16 + y * 4 + z]);
        }
        if level + 1 == self.levels.len() {
            // not reached from within the box
            return 0.0;
        }
        let cell = node.map(|i| i >> 2);
        let w = node.map(|i| spline::refined_weights((i & 3) as usize));
        let mut c = [0.0; 27];
        self.fill(level + 1, cell, &mut c);
        let mut sum = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                let r = &c[(3 * i + j) * 3..(3 * i + j) * 3 + 3];
                sum += w[0][i] * w[1][j] * (r[0] * w[2][0] + r[1] * w[2][1] + r[2] * w[2][2]);
            }
        }
        sum
    }

    /// The 27 coefficients around a cell; true if the level stores none of them.
    fn fill(&self, level: usize, cell: [i64; 3], c: &mut [f64; 27]) -> bool {
        let mut missing = 0;
        let count = self.levels[level].gather(cell, c, &mut missing);
        if count == 27 && level + 1 < self.levels.len() {
            return true;
        }
        while missing != 0 {
            let at = missing.trailing_zeros() as usize;
            missing &= missing - 1;
            let node = [
                cell[0] + (at / 9) as i64 - 1,
                cell[1] + (at / 3 % 3) as i64 - 1,
                cell[2] + (at % 3) as i64 - 1,
            ];
            c[at] = self.coefficient(level, node);
        }
        false
    }

    /// Coefficients, place in the knot interval and one over the spacing at a point of the box.
    #[inline]
    fn locate(&self, q: &Vec3) -> ([f64; 27], [f64; 3], f64) {
        let mut c = [0.0; 27];
        for level in 0..self.levels.len() {
            let inv = 1.0 / self.levels[level].h;
            let u = [q.x * inv, q.y * inv, q.z * inv];
            let cell = u.map(floor);
            if self.fill(level, cell, &mut c) {
                continue;
            }
            let t = [0, 1, 2].map(|d| u[d] - cell[d] as f64 - 0.5);
            return (c, t, inv);
        }
        (c, [0.0; 3], 1.0)
    }

    pub(in crate::body) fn distance(&self, p: &Vec3) -> Distance {
        let q = p.sup(&self.lo).inf(&self.hi);
        let (c, t, inv) = self.locate(&q);
        let at = spline::evaluate(&c, &t, inv);
        if q == *p {
            at
        } else {
            spline::beyond_box(&at, &(p - q))
        }
    }

    pub(in crate::body) fn value(&self, p: &Vec3) -> f64 {
        let q = p.sup(&self.lo).inf(&self.hi);
        let (c, t, _) = self.locate(&q);
        let at = spline::value(&c, &t);
        if q == *p {
            at
        } else {
            at.signum() * (at * at + (p - q).norm_squared()).sqrt()
        }
    }

    /// Spacing of the finest level [m].
    pub(in crate::body) fn cell_size(&self) -> f64 {
        self.levels[0].h
    }

    /// Memory held [bytes].
    pub(in crate::body) fn bytes(&self) -> usize {
        self.levels
            .iter()
            .map(|l| l.slots.len() * 4 + l.bricks.len() * (24 + 256))
            .sum()
    }

    /// Bricks stored per level, finest first.
    pub(in crate::body) fn bricks(&self) -> Vec<usize> {
        self.levels.iter().map(|l| l.bricks.len()).collect()
    }
}
