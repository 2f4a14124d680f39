//! Sums of terms: energy, gradient, Hessian.
//!
//! Kernels run in parallel over chunks of stencils into a buffer; the scatter into vertices and
//! blocks runs in stencil order, so that the result has the same bits for any number of threads.

use super::term::{Configuration, HessianKind, Term};
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};

/// Blocks evaluated between two scatters.
const BATCH_BLOCKS: usize = 40_960;
/// Stencils of one parallel task.
const CHUNK: usize = 128;
/// Set in a slot when the stored block is the transpose of the stencil's block.
const TRANSPOSED: u32 = 1 << 31;

/// The matrix of a system and where each stencil's blocks go in it.
#[derive(Debug)]
pub struct Assembler {
    matrix: BlockMatrix,
    /// Per term, per stencil: slots of its lower blocks.
    plans: Vec<Vec<u32>>,
    gradients: Vec<Vec3>,
    blocks: Vec<Mat3>,
}

impl Assembler {
    /// Pattern and plans for the present stencils of the terms.
    pub fn new(vertex_count: usize, terms: &[Box<dyn Term>]) -> Self {
        let mut assembler = Self {
            matrix: BlockMatrix::zeros(BlockPattern::from_stencils(0, |_| {})),
            plans: Vec::new(),
            gradients: vec![Vec3::zeros(); BATCH_BLOCKS],
            blocks: vec![Mat3::zeros(); BATCH_BLOCKS],
        };
        assembler.rebuild(vertex_count, terms);
        assembler
    }

    /// Takes changed stencils. The pattern changes only where a new coupling asks for it.
    pub fn rebuild(&mut self, vertex_count: usize, terms: &[Box<dyn Term>]) {
        let pattern = BlockPattern::from_stencils(vertex_count, |sink| {
            for term in terms {
                let stencils = term.stencils();
                for e in 0..stencils.count() {
                    sink(stencils.get(e));
                }
            }
        });
        if pattern != self.matrix.pattern {
            self.matrix = BlockMatrix::zeros(pattern);
        }
        self.plans = terms
            .iter()
            .map(|t| plan(&self.matrix.pattern, t.as_ref()))
            .collect();
    }

    /// The matrix last assembled.
    pub fn matrix(&self) -> &BlockMatrix {
        &self.matrix
    }

    /// The matrix, to add inertia or take out pinned rows.
    pub fn matrix_mut(&mut self) -> &mut BlockMatrix {
        &mut self.matrix
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.plans.iter().map(|p| p.len() * 4).sum::<usize>()
            + self.matrix.blocks.len() * 76
            + self.gradients.len() * 24
            + self.blocks.len() * 72
    }

    /// Adds the gradient of every term to `out` and, if asked for, its Hessian to the matrix.
    pub fn add(
        &mut self,
        terms: &[Box<dyn Term>],
        at: &Configuration<'_>,
        hessian: Option<HessianKind>,
        workers: &Workers,
        out: &mut [Vec3],
    ) {
        for (t, term) in terms.iter().enumerate() {
            let stencils = term.stencils();
            let (count, arity) = (stencils.count(), stencils.arity);
            if count == 0 || term.is_idle(at) {
                continue;
            }
            let block_count = arity * (arity + 1) / 2;
            let largest = (BATCH_BLOCKS / block_count).max(1);
            for first in (0..count).step_by(largest) {
                let batch = largest.min(count - first);
                let kind = hessian.filter(|kind| term.has_hessian(*kind));
                let gradients = &mut self.gradients[..batch * arity];
                let blocks = &mut self.blocks[..batch * block_count];
                match kind {
                    Some(kind) => workers.chunks_of_two(
                        (gradients, CHUNK * arity),
                        (blocks, CHUNK * block_count),
                        |c, gradients, blocks| {
                            let stencils = gradients.chunks_mut(arity);
                            for (k, (g, h)) in
                                stencils.zip(blocks.chunks_mut(block_count)).enumerate()
                            {
                                term.derivatives(first + c * CHUNK + k, at, kind, g, h);
                            }
                        },
                    ),
                    None => workers.chunks(gradients, CHUNK * arity, |c, chunk| {
                        for (k, g) in chunk.chunks_mut(arity).enumerate() {
                            term.gradient(first + c * CHUNK + k, at, g);
                        }
                    }),
                }
                for k in 0..batch {
                    let vertices = stencils.get(first + k);
                    for (v, g) in vertices.iter().zip(&self.gradients[k * arity..]) {
                        out[*v as usize] += g;
                    }
                }
                if kind.is_none() {
                    continue;
                }
                let slots = &self.plans[t][first * block_count..(first + batch) * block_count];
                for (slot, block) in slots.iter().zip(&self.blocks) {
                    let target = &mut self.matrix.blocks[(slot & !TRANSPOSED) as usize];
                    if slot & TRANSPOSED == 0 {
                        *target += block;
                    } else {
                        *target += block.transpose();
                    }
                }
            }
        }
    }
}

/// Sum of the energies of the terms [J], in a fixed order.
pub fn energy(terms: &[Box<dyn Term>], at: &Configuration<'_>, workers: &Workers) -> f64 {
    terms
        .iter()
        .filter(|term| !term.is_idle(at))
        .map(|term| workers.sum(term.stencils().count(), |e| term.value(e, at)))
        .sum()
}

fn plan(pattern: &BlockPattern, term: &dyn Term) -> Vec<u32> {
    let stencils = term.stencils();
    let mut slots =
        Vec::with_capacity(stencils.count() * stencils.arity * (stencils.arity + 1) / 2);
    for e in 0..stencils.count() {
        let vertices = stencils.get(e);
        for (a, &i) in vertices.iter().enumerate() {
            for &j in &vertices[..=a] {
                let slot = pattern.slot(i.max(j), i.min(j)).map_or(0, |s| s as u32);
                slots.push(if i >= j { slot } else { slot | TRANSPOSED });
            }
        }
    }
    slots
}

/// Makes pinned vertices keep their place: their rows and columns become the identity.
pub fn fix_rows(matrix: &mut BlockMatrix, fixed: &[bool]) {
    for j in 0..matrix.n() {
        let (from, to) = (
            matrix.pattern.starts[j] as usize,
            matrix.pattern.starts[j + 1] as usize,
        );
        for k in from..to {
            let i = matrix.pattern.rows[k] as usize;
            if fixed[i] || fixed[j] {
                matrix.blocks[k] = if i == j {
                    Mat3::identity()
                } else {
                    Mat3::zeros()
                };
            }
        }
    }
}
