//! The second level: triangles everywhere, `W (W^T A W)^-1 W^T`, where `W` lets nodes ride on their triangles, be these
//! simulated or not. Held vertices stay, as the constraints have them. Coordinates that slide are not in it.

use super::super::LinearError;
use super::super::cholesky::Cholesky;
use crate::blend::Filter;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};
use std::sync::Arc;

/// What is added to the diagonal, over itself: triangles that hardly a node lies in leave no pivot.
const SHIFT: f64 = 1e-9;

/// The matrix of the triangles and its factor.
pub(super) struct Triangles {
    filter: Arc<Filter>,
    /// Pattern and held blocks that `carriers` and `matrix` were made for.
    pattern: Option<(BlockPattern, Vec<bool>)>,
    starts: Vec<u32>,
    /// Vertices that each block rides on, with weights.
    carriers: Vec<(u32, f64)>,
    matrix: BlockMatrix,
    factor: Option<Cholesky<f64>>,
    right: Vec<Vec3>,
    answer: Vec<Vec3>,
    workers: Workers,
}

impl Triangles {
    pub(super) fn new(filter: &Arc<Filter>, workers: &Workers) -> Self {
        Self {
            filter: filter.clone(),
            pattern: None,
            starts: Vec::new(),
            carriers: Vec::new(),
            matrix: BlockMatrix::zeros(BlockPattern::from_stencils(0, |_| {})),
            factor: None,
            right: Vec::new(),
            answer: Vec::new(),
            workers: workers.clone(),
        }
    }

    fn of(&self, block: usize) -> &[(u32, f64)] {
        &self.carriers[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// What carries each block, and the pattern of `W^T A W`.
    fn lay(&mut self, pattern: &BlockPattern, fixed: &[bool]) {
        let count = self.filter.vertex_count();
        // under yarns vertices are fixed in the system and move here
        let held = |v: u32| fixed[v as usize] && self.filter.is_covered(v);
        self.starts = vec![0];
        self.carriers.clear();
        for (block, fixed) in fixed.iter().enumerate() {
            if *fixed {
            } else if block < count {
                self.carriers.push((block as u32, 1.0));
            } else if let Some(rider) = self.filter.carrier(block as u32) {
                let all = rider.vertices.into_iter().zip(rider.weights);
                self.carriers.extend(all.filter(|(v, _)| !held(*v)));
            }
            self.starts.push(self.carriers.len() as u32);
        }
        let coarse = BlockPattern::from_stencils(count, |sink| {
            let mut both = Vec::with_capacity(6);
            for j in 0..pattern.n() {
                for k in pattern.starts[j] as usize..pattern.starts[j + 1] as usize {
                    let i = pattern.rows[k] as usize;
                    both.clear();
                    both.extend(self.of(i).iter().chain(self.of(j)).map(|p| p.0));
                    sink(&both);
                }
            }
        });
        self.matrix = BlockMatrix::zeros(coarse);
        self.pattern = Some((pattern.clone(), fixed.to_vec()));
        for list in [&mut self.right, &mut self.answer] {
            list.clear();
            list.resize(count, Vec3::zeros());
        }
    }

    pub(super) fn prepare(
        &mut self,
        matrix: &BlockMatrix,
        fixed: &[bool],
    ) -> Result<(), LinearError> {
        let same = |(pattern, held): &(BlockPattern, Vec<bool>)| {
            *pattern == matrix.pattern && held == fixed
        };
        if !self.pattern.as_ref().is_some_and(same) {
            self.lay(&matrix.pattern, fixed);
        }
        let mut coarse = std::mem::take(&mut self.matrix.blocks);
        coarse.fill(Mat3::zeros());
        let pattern = &self.matrix.pattern;
        for j in 0..matrix.n() {
            for k in matrix.pattern.starts[j] as usize..matrix.pattern.starts[j + 1] as usize {
                let i = matrix.pattern.rows[k] as usize;
                for (p, wp) in self.of(i) {
                    for (q, wq) in self.of(j) {
                        if i == j && p < q {
                            continue;
                        }
                        let part = matrix.blocks[k] * (wp * wq);
                        let Some(slot) = pattern.slot(*p.max(q), *p.min(q)) else {
                            continue;
                        };
                        coarse[slot] += if p < q { part.transpose() } else { part };
                        if i != j && p == q {
                            coarse[slot] += part.transpose();
                        }
                    }
                }
            }
        }
        for v in 0..pattern.n() {
            let block = &mut coarse[pattern.starts[v] as usize];
            for c in 0..3 {
                block[(c, c)] *= 1.0 + SHIFT;
            }
            if *block == Mat3::zeros() {
                *block = Mat3::identity();
            }
        }
        self.matrix.blocks = coarse;
        Cholesky::for_pattern(&mut self.factor, &self.matrix.pattern)?
            .prepare(&self.matrix, &self.workers)
    }

    /// `z += sign W (W^T A W)^-1 W^T r`.
    pub(super) fn add(&mut self, sign: f64, r: &[Vec3], z: &mut [Vec3]) -> Result<(), LinearError> {
        let mut right = std::mem::take(&mut self.right);
        right.fill(Vec3::zeros());
        for (i, r) in r.iter().enumerate() {
            for (v, w) in self.of(i) {
                right[*v as usize] += r * *w;
            }
        }
        let factor = self.factor.as_mut().ok_or(LinearError::NoConvergence)?;
        let solved = factor.solve(&right, &mut self.answer, &self.workers);
        self.right = right;
        for (i, z) in z.iter_mut().enumerate() {
            for (v, w) in self.of(i) {
                *z += self.answer[*v as usize] * (sign * *w);
            }
        }
        solved
    }

    pub(super) fn bytes(&self) -> usize {
        let pattern = self.pattern.as_ref().map_or(0, |(p, held)| {
            4 * (p.rows.len() + p.starts.len()) + held.len()
        });
        pattern
            + 16 * self.carriers.len()
            + size_of_val(&self.matrix.blocks[..])
            + self.factor.as_ref().map_or(0, Cholesky::bytes)
    }
}
