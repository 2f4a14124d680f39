//! Sums of terms: energy, gradient, Hessian.
//!
//! Kernels run in parallel over chunks of stencils into a buffer; what goes to one vertex or block is added in
//! the order of the stencils, blocks in ranges side by side, so that the result has the same bits for any number of threads.
//! What belongs to a point that rides on a triangle goes to the vertices that carry it. A matrix may be assembled
//! by its diagonal blocks alone; the product with the whole of it is then that of the stencils' Hessians.

use super::term::{Configuration, HessianKind, MAX_BLOCKS, Stencils, Term};
use crate::blend::Riders;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};

/// Blocks evaluated between two scatters.
const BATCH_BLOCKS: usize = 32_768;
/// Stencils of one parallel task.
const CHUNK: usize = 64;
/// Blocks of one task that looks for fixed rows.
const FIXED: usize = 4_096;
/// Ranges of slots for each thread.
const RANGES: usize = 2;
/// Blocks of a batch below which one thread adds them.
const FEW: usize = 2_048;
/// Set in a slot when the stored block is the transpose of the stencil's block.
const TRANSPOSED: u32 = 1 << 31;

/// Where the lower blocks of a batch of stencils go.
#[derive(Debug, Default)]
struct Plan {
    /// Slots, ascending, of those that go to one.
    slots: Vec<u32>,
    /// Which block of the batch goes to each.
    blocks: Vec<u16>,
    /// Blocks with riders, with their spreads.
    spreads: Vec<(u16, u32)>,
}

/// One of the blocks that a block with a rider goes to.
#[derive(Clone, Copy, Debug)]
struct Share {
    slot: u32,
    weight: f64,
    /// Whether the block and its transpose both go to this diagonal block.
    both: bool,
}

/// Where the blocks with riders go: shares of spread `k` are `starts[k]..starts[k + 1]`.
#[derive(Debug, Default)]
struct Spreads {
    starts: Vec<u32>,
    shares: Vec<Share>,
    /// How the block of each spread is turned from its left and its right; empty where none is.
    turns: Vec<[Mat3; 2]>,
}

/// The matrix of a system and where each stencil's blocks go in it.
#[derive(Debug)]
pub struct Assembler {
    matrix: BlockMatrix,
    /// Per term, per batch of stencils.
    plans: Vec<Vec<Plan>>,
    /// Whether stencils have changed since.
    outdated: bool,
    spreads: Spreads,
    riders: Riders,
    /// Whether the matrix has its diagonal blocks alone.
    diagonal: bool,
    gradients: Vec<Vec3>,
    blocks: Vec<Mat3>,
}

impl Assembler {
    /// Pattern and plans for the present stencils of the terms; `widths` has the unknown scalars of each block.
    pub fn new(widths: &[u8], terms: &[Box<dyn Term>], riders: &Riders) -> Self {
        Self::of(widths, terms, riders, false)
    }

    /// The same of the diagonal blocks alone.
    pub fn of_diagonal(widths: &[u8], terms: &[Box<dyn Term>], riders: &Riders) -> Self {
        Self::of(widths, terms, riders, true)
    }

    fn of(widths: &[u8], terms: &[Box<dyn Term>], riders: &Riders, diagonal: bool) -> Self {
        let mut assembler = Self {
            matrix: BlockMatrix::zeros(BlockPattern::from_stencils(0, |_| {})),
            plans: Vec::new(),
            outdated: false,
            spreads: Spreads::default(),
            riders: riders.clone(),
            diagonal,
            gradients: Vec::new(),
            blocks: Vec::new(),
        };
        assembler.rebuild(widths, terms, &Workers::default());
        assembler
    }

    /// Tells whether stencils or widths have changed.
    pub fn outdate(&mut self, changed: bool) {
        self.outdated |= changed;
    }

    /// Takes changed stencils and `widths` if there are any.
    pub fn refresh(
        &mut self,
        widths: impl FnOnce() -> Vec<u8>,
        terms: &[Box<dyn Term>],
        workers: &Workers,
    ) {
        if std::mem::take(&mut self.outdated) {
            self.rebuild(&widths(), terms, workers);
        }
    }

    /// The pattern changes only where a new coupling asks for it.
    fn rebuild(&mut self, widths: &[u8], terms: &[Box<dyn Term>], workers: &Workers) {
        let riders = &self.riders;
        let diagonal = self.diagonal;
        let mut pattern = BlockPattern::from_stencils(widths.len(), |sink| {
            if diagonal {
                return;
            }
            let mut carriers = Vec::new();
            for term in terms {
                let stencils = term.stencils();
                for e in 0..stencils.count() {
                    let points = stencils.get(e);
                    if points.iter().any(|p| riders.rides(*p)) {
                        carriers.clear();
                        for p in points {
                            carriers.extend(carried_by(riders, *p).map(|(v, _)| v));
                        }
                        sink(&carriers);
                    } else {
                        sink(points);
                    }
                }
            }
        });
        if widths.iter().any(|w| *w < 3) {
            pattern.widths = widths.to_vec();
        }
        if pattern != self.matrix.pattern {
            self.matrix.take_pattern(pattern);
        }
        let mut spreads = Spreads {
            starts: vec![0],
            ..Spreads::default()
        };
        self.plans = terms
            .iter()
            .map(|t| {
                plans(
                    &self.matrix.pattern,
                    t.as_ref(),
                    riders,
                    &mut spreads,
                    workers,
                )
            })
            .collect();
        self.spreads = spreads;
        let (mut gradients, mut blocks) = (0, 0);
        for stencils in terms.iter().map(|term| term.stencils()) {
            let (arity, own) = (stencils.arity, stencils.arity * (stencils.arity + 1) / 2);
            let batch = stencils.count().min(BATCH_BLOCKS / own.max(1));
            gradients = gradients.max(batch * arity);
            blocks = blocks.max(batch * own);
        }
        self.gradients.resize(gradients, Vec3::zeros());
        self.blocks.resize(blocks, Mat3::zeros());
    }

    /// Whether the matrix has its diagonal blocks alone.
    pub fn is_of_diagonal(&self) -> bool {
        self.diagonal
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
        let plans = self.plans.iter().flatten();
        plans
            .map(|p| 6 * p.slots.len() + 8 * p.spreads.len())
            .sum::<usize>()
            + self.spreads.starts.len() * 4
            + self.spreads.shares.len() * size_of::<Share>()
            + size_of_val(&self.spreads.turns[..])
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
            let largest = BATCH_BLOCKS / block_count;
            for (first, plan) in (0..count).step_by(largest).zip(&self.plans[t]) {
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
                scatter(&self.riders, stencils, first, gradients, out);
                if kind.is_none() {
                    continue;
                }
                plan.scatter(&self.blocks, &mut self.matrix.blocks, workers);
                for (block, spread) in &plan.spreads {
                    let block = &self.blocks[usize::from(*block)];
                    self.spreads.add(*spread as usize, block, &mut self.matrix);
                }
            }
        }
    }
}

/// Products `y = H x` with the sum of the terms' Hessians, without its matrix.
pub struct Products<'a> {
    /// The terms.
    pub terms: &'a [Box<dyn Term>],
    /// Where the Hessian is taken.
    pub at: Configuration<'a>,
    /// Which Hessian.
    pub kind: HessianKind,
    /// Points that ride.
    pub riders: &'a Riders,
    /// Threads.
    pub workers: &'a Workers,
}

impl Products<'_> {
    /// Adds `H x` to `y`; riders have no part in either. `work` is memory that lives on between calls.
    pub fn add(&self, x: &[Vec3], y: &mut [Vec3], work: &mut Vec<Vec3>) {
        let place = |point: u32| match self.riders.of(point) {
            None => x[point as usize],
            Some(rider) => {
                let carriers = rider.vertices.iter().zip(&rider.weights);
                let place: Vec3 = carriers.map(|(v, w)| x[*v as usize] * *w).sum();
                self.riders.turn(point).map_or(place, |q| q * place)
            }
        };
        for term in self.terms {
            let stencils = term.stencils();
            let (count, arity) = (stencils.count(), stencils.arity);
            if count == 0 || term.is_idle(&self.at) || !term.has_hessian(self.kind) {
                continue;
            }
            let largest = BATCH_BLOCKS / arity;
            for first in (0..count).step_by(largest) {
                let length = largest.min(count - first) * arity;
                if work.len() < length {
                    work.resize(length, Vec3::zeros());
                }
                let products = &mut work[..length];
                self.workers.chunks(products, CHUNK * arity, |c, chunk| {
                    let mut blocks = [Mat3::zeros(); MAX_BLOCKS];
                    let blocks = &mut blocks[..arity * (arity + 1) / 2];
                    for (k, product) in chunk.chunks_mut(arity).enumerate() {
                        let e = first + c * CHUNK + k;
                        term.hessian(e, &self.at, self.kind, blocks);
                        product.fill(Vec3::zeros());
                        let mut block = blocks.iter();
                        for (i, a) in stencils.get(e).iter().enumerate() {
                            for (j, b) in stencils.get(e)[..=i].iter().enumerate() {
                                let Some(h) = block.next() else { break };
                                product[i] += h * place(*b);
                                if i != j {
                                    product[j] += h.tr_mul(&place(*a));
                                }
                            }
                        }
                    }
                });
                scatter(self.riders, stencils, first, products, y);
            }
        }
    }
}

/// Adds what stencils from the `first` on have for each of their points.
fn scatter(
    riders: &Riders,
    stencils: Stencils<'_>,
    first: usize,
    parts: &[Vec3],
    out: &mut [Vec3],
) {
    for (k, parts) in parts.chunks_exact(stencils.arity).enumerate() {
        for (v, g) in stencils.get(first + k).iter().zip(parts) {
            match riders.of(*v) {
                None => out[*v as usize] += g,
                Some(rider) => {
                    let g = riders.turn(*v).map_or(*g, |q| q.transpose() * g);
                    for (v, w) in rider.vertices.iter().zip(&rider.weights) {
                        out[*v as usize] += g * *w;
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

/// Vertices that carry a point, with weights: itself, unless it rides.
fn carried_by(riders: &Riders, point: u32) -> impl Iterator<Item = (u32, f64)> {
    let (vertices, weights, count) = match riders.of(point) {
        Some(rider) => (rider.vertices, rider.weights, 3),
        None => ([point; 3], [1.0; 3], 1),
    };
    vertices.into_iter().zip(weights).take(count)
}

impl Spreads {
    /// Takes block `(i, j)` of a stencil, in which something rides; its number.
    fn plan(&mut self, pattern: &BlockPattern, riders: &Riders, i: u32, j: u32) -> u32 {
        for (p, wp) in carried_by(riders, i) {
            for (q, wq) in carried_by(riders, j) {
                // of a diagonal block the other half is the transpose of this one
                if i == j && p < q {
                    continue;
                }
                let Some(slot) = pattern.slot(p.max(q), p.min(q)) else {
                    continue;
                };
                let slot = slot as u32;
                self.shares.push(Share {
                    slot: if p >= q { slot } else { slot | TRANSPOSED },
                    weight: wp * wq,
                    both: i != j && p == q,
                });
            }
        }
        self.starts.push(self.shares.len() as u32);
        if let (Some(left), Some(right)) = (riders.turn(i), riders.turn(j)) {
            self.turns.push([left.transpose(), right]);
        }
        self.starts.len() as u32 - 2
    }

    fn add(&self, k: usize, block: &Mat3, matrix: &mut BlockMatrix) {
        let range = self.starts[k] as usize..self.starts[k + 1] as usize;
        let turned = self.turns.get(k).map(|[left, right]| left * block * right);
        let block = turned.as_ref().unwrap_or(block);
        for share in &self.shares[range] {
            let target = &mut matrix.blocks[(share.slot & !TRANSPOSED) as usize];
            let part = block * share.weight;
            if share.both || share.slot & TRANSPOSED != 0 {
                *target += part.transpose();
            }
            if share.both || share.slot & TRANSPOSED == 0 {
                *target += part;
            }
        }
    }
}

impl Plan {
    /// Adds the blocks of the batch to those of the matrix, ranges of slots side by side; those of one slot come in the order of
    /// the batch.
    fn scatter(&self, blocks: &[Mat3], targets: &mut [Mat3], workers: &Workers) {
        let slot = |k: usize| (self.slots[k] & !TRANSPOSED) as usize;
        let count = match workers.count() {
            1 => 1,
            _ if self.slots.len() < FEW => 1,
            threads => RANGES * threads,
        };
        let mut tasks = Vec::with_capacity(count);
        let (mut rest, mut at, mut from) = (targets, 0, 0);
        for c in 1..=count {
            let mut to = self.slots.len() * c / count;
            while to > from && to < self.slots.len() && slot(to - 1) == slot(to) {
                to += 1;
            }
            if to <= from {
                continue;
            }
            let end = slot(to - 1) + 1;
            let (own, after) = std::mem::take(&mut rest).split_at_mut(end - at);
            tasks.push((from..to, at, own));
            (rest, at, from) = (after, end, to);
        }
        workers.chunks(&mut tasks, 1, |_, tasks| {
            for (entries, first, targets) in tasks {
                let slots = &self.slots[entries.clone()];
                for (slot, block) in slots.iter().zip(&self.blocks[entries.clone()]) {
                    let block = &blocks[usize::from(*block)];
                    let target = &mut targets[(slot & !TRANSPOSED) as usize - *first];
                    if slot & TRANSPOSED == 0 {
                        *target += block;
                    } else {
                        *target += block.transpose();
                    }
                }
            }
        });
    }
}

/// Plans of the batches of a term, side by side.
fn plans(
    pattern: &BlockPattern,
    term: &dyn Term,
    riders: &Riders,
    spreads: &mut Spreads,
    workers: &Workers,
) -> Vec<Plan> {
    let stencils = term.stencils();
    let (count, arity) = (stencils.count(), stencils.arity);
    if count == 0 {
        return Vec::new();
    }
    let largest = BATCH_BLOCKS / (arity * (arity + 1) / 2);
    let mut out = Vec::new();
    out.resize_with(count.div_ceil(largest), || (Plan::default(), Vec::new()));
    workers.chunks(&mut out, 1, |c, out| {
        for (plan, ridden) in out {
            let mut entries = Vec::new();
            let mut block = 0_u16;
            for e in c * largest..((c + 1) * largest).min(count) {
                let points = stencils.get(e);
                for (a, &i) in points.iter().enumerate() {
                    for &j in &points[..=a] {
                        if riders.rides(i) || riders.rides(j) {
                            ridden.push((block, i, j));
                        } else if let Some(slot) = pattern.slot(i.max(j), i.min(j)) {
                            let turned = u64::from(i < j);
                            entries.push((slot as u64) << 32 | u64::from(block) << 1 | turned);
                        }
                        block += 1;
                    }
                }
            }
            entries.sort_unstable();
            plan.blocks = entries.iter().map(|entry| (entry >> 1) as u16).collect();
            let slot = |entry: &u64| (entry >> 32) as u32 | (*entry as u32 & 1) << 31;
            plan.slots = entries.iter().map(slot).collect();
        }
    });
    let plan = |(mut plan, ridden): (Plan, Vec<(u16, u32, u32)>)| {
        let spread = |(block, i, j)| (block, spreads.plan(pattern, riders, i, j));
        plan.spreads = ridden.into_iter().map(spread).collect();
        plan
    };
    out.into_iter().map(plan).collect()
}

/// Gives what is no unknown of a block row the row of the identity.
pub fn complete(matrix: &mut BlockMatrix) {
    for (j, width) in matrix.pattern.widths.iter().enumerate() {
        let block = &mut matrix.blocks[matrix.pattern.starts[j] as usize];
        for c in usize::from(*width)..3 {
            block[(c, c)] = 1.0;
        }
    }
}

/// Makes pinned vertices keep their place: their rows and columns become the identity.
pub fn fix_rows(matrix: &mut BlockMatrix, fixed: &[bool], workers: &Workers) {
    if !fixed.contains(&true) {
        return;
    }
    let pattern = &matrix.pattern;
    workers.chunks(&mut matrix.blocks, FIXED, |c, blocks| {
        let first = c * FIXED;
        let mut column = pattern.starts.partition_point(|s| *s as usize <= first) - 1;
        for (k, block) in (first..).zip(blocks) {
            while pattern.starts[column + 1] as usize <= k {
                column += 1;
            }
            let row = pattern.rows[k] as usize;
            if fixed[row] || fixed[column] {
                *block = if row == column {
                    Mat3::identity()
                } else {
                    Mat3::zeros()
                };
            }
        }
    });
}
