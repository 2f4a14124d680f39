//! Nonlinear elimination: Newton's method on the few blocks at which a correction of all of them fails.
//!
//! A quadratic model of a motion is good nearly everywhere; but here a contact opens, there friction turns, and the
//! line search of a whole garment waits for ten nodes. After a correction the energy that block `i` could still lose by
//! itself is
//!
//! ```text
//! e_i = g_i . H_ii^-1 g_i / 2
//! ```
//!
//! The blocks that hold nearly all of it are taken, as long as they are few, with their neighbours, and `Phi` is minimised
//! by them alone while all else is held (Lanzkron, Rose and Wilkes 1996; as a part of an inexact Newton method Yang,
//! Hwang and Cai 2016). Groups of such blocks that share no stencil do not know of each other and are solved side by
//! side.

use super::linear::LinearSolver;
use super::linear::direct::Direct;
use super::newton::Problem;
use super::pace::ALMOST;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};
use crate::system::assemble::complete;
use crate::system::term::{HessianKind, MAX_ARITY, MAX_BLOCKS, Term};

/// Part of the energy left that may stay outside.
const OUTSIDE: f64 = 0.05;
/// Part of it outside from which the trouble is everywhere.
const MUCH: f64 = 0.5;
/// Blocks that may be taken before their neighbours are, over all of them.
const FEW: f64 = 0.02;
/// Rings of neighbours.
const RINGS: usize = 1;
/// Corrections of a group.
const MOST: usize = 5;
/// Part of the first promised decrease below which a group is done.
const DONE: f64 = 1e-2;
/// Shortest correction of a group.
const SHORTEST: f64 = 1e-4;
/// Blocks of one task that looks for the worst.
const CHUNK: usize = 2_048;
/// Place of a block that is in no group.
const NOWHERE: u32 = u32::MAX;

/// Which stencils every block is in, and which blocks groups may have.
#[derive(Debug, Default)]
pub(super) struct Local {
    starts: Vec<u32>,
    /// Number of the term and of its stencil.
    stencils: Vec<(u16, u32)>,
    /// What every block could still lose by itself [J].
    energies: Vec<f64>,
    /// Whether a block is in no group: it is fixed, or a part of the coupling of yarns and triangles, of which groups do not know.
    held: Vec<bool>,
}

/// Blocks that are solved for together, in the order of their unknowns, and the stencils that they are in.
struct Group {
    blocks: Vec<u32>,
    stencils: Vec<(u16, u32)>,
    /// What `Phi` has lost by it [J].
    gain: f64,
}

/// Groups of one task, with positions of all blocks and the place of each in its group.
struct Task {
    groups: Vec<Group>,
    /// Blocks of them all.
    work: usize,
    x: Vec<Vec3>,
    place: Vec<u32>,
}

impl Local {
    /// Forgets stencils and coupling.
    pub(super) fn forget(&mut self) {
        self.starts.clear();
        self.held.clear();
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.starts[..])
            + size_of_val(&self.stencils[..])
            + size_of_val(&self.energies[..])
            + size_of_val(&self.held[..])
    }

    fn know(&mut self, terms: &[Box<dyn Term>], n: usize) {
        self.starts.clear();
        self.starts.resize(n + 1, 0);
        let each = |visit: &mut dyn FnMut(u32, u16, u32)| {
            for (t, term) in terms.iter().enumerate() {
                let stencils = term.stencils();
                for e in 0..stencils.count() {
                    for v in stencils.get(e) {
                        visit(*v, t as u16, e as u32);
                    }
                }
            }
        };
        each(&mut |v, _, _| self.starts[v as usize + 1] += 1);
        for v in 0..n {
            self.starts[v + 1] += self.starts[v];
        }
        let mut next = self.starts.clone();
        self.stencils.clear();
        self.stencils.resize(self.starts[n] as usize, (0, 0));
        each(&mut |v, t, e| {
            self.stencils[next[v as usize] as usize] = (t, e);
            next[v as usize] += 1;
        });
    }

    fn of(&self, block: u32) -> &[(u16, u32)] {
        let block = block as usize;
        &self.stencils[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// Lowers `Phi` by the worst blocks, and tells by how much; `matrix` was assembled nearby, `gradient` is that at `x`.
    pub(super) fn settle(
        &mut self,
        problem: &Problem<'_>,
        matrix: &BlockMatrix,
        gradient: &[Vec3],
        x: &mut [Vec3],
    ) -> f64 {
        let n = x.len();
        if self.held.is_empty() {
            self.held.extend_from_slice(problem.fixed);
            (problem.coupling).joined(|point| self.held[point as usize] = true);
        }
        let Some(worst) = self.worst(problem.workers, matrix, gradient) else {
            return 0.0;
        };
        if self.starts.len() != n + 1 {
            self.know(problem.terms, n);
        }
        let mut place = vec![NOWHERE; n];
        let mut groups = self.groups(problem, worst, &mut place);
        // the largest first, each to the task with the least work
        groups.sort_by_key(|group| std::cmp::Reverse(group.blocks.len()));
        let count = problem.workers.count().min(groups.len());
        let task = || Task {
            groups: Vec::new(),
            work: 0,
            x: x.to_vec(),
            place: place.clone(),
        };
        let mut tasks: Vec<Task> = std::iter::repeat_with(task).take(count).collect();
        for group in groups {
            if let Some(task) = tasks.iter_mut().min_by_key(|task| task.work) {
                task.work += group.blocks.len();
                task.groups.push(group);
            }
        }
        problem.workers.chunks(&mut tasks, 1, |_, tasks| {
            for Task {
                groups, x, place, ..
            } in tasks
            {
                for group in groups {
                    group.gain = group.minimise(problem, &matrix.pattern, place, x);
                }
            }
        });
        let mut gains = Vec::new();
        for task in &tasks {
            for group in &task.groups {
                gains.push((group.blocks[0], group.gain));
                for b in &group.blocks {
                    x[*b as usize] = task.x[*b as usize];
                }
            }
        }
        // one order for any number of threads
        gains.sort_unstable_by_key(|(block, _)| *block);
        gains.iter().map(|(_, gain)| gain).sum()
    }

    /// The blocks that hold nearly all of the energy left, none if they are many.
    fn worst(
        &mut self,
        workers: &Workers,
        matrix: &BlockMatrix,
        gradient: &[Vec3],
    ) -> Option<Vec<u32>> {
        self.energies.resize(gradient.len(), 0.0);
        let held = &self.held;
        workers.chunks(&mut self.energies, CHUNK, |c, energies| {
            for (i, energy) in (c * CHUNK..).zip(energies) {
                let (diagonal, g) = (
                    matrix.blocks[matrix.pattern.starts[i] as usize],
                    gradient[i],
                );
                let free = !held[i] && g != Vec3::zeros();
                let factor = free.then(|| diagonal.cholesky()).flatten();
                *energy = factor.map_or(0.0, |factor| 0.5 * g.dot(&factor.solve(&g)));
            }
        });
        let all: f64 = self.energies.iter().sum();
        let mut energies: Vec<(f64, u32)> = (self.energies.iter().copied().zip(0..))
            .filter(|(energy, _)| *energy != 0.0)
            .collect();
        let few = energies.len().min((FEW * gradient.len() as f64) as usize);
        if few == 0 || !all.is_finite() {
            return None;
        }
        let order = |a: &(f64, u32), b: &(f64, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        energies.select_nth_unstable_by(few - 1, order);
        energies.truncate(few);
        energies.sort_unstable_by(order);
        let mut left = all;
        let mut out = Vec::new();
        for (energy, block) in energies {
            if left <= OUTSIDE * all {
                break;
            }
            left -= energy;
            out.push(block);
        }
        (left <= MUCH * all).then_some(out)
    }

    /// Takes neighbours into `blocks` and finds groups that share no stencil; `place` is [`NOWHERE`] at every
    /// block, before and after.
    fn groups(&self, problem: &Problem<'_>, mut blocks: Vec<u32>, place: &mut [u32]) -> Vec<Group> {
        let members = |(t, e): &(u16, u32)| {
            let stencils = problem.terms[usize::from(*t)].stencils();
            stencils.get(*e as usize)
        };
        for b in &blocks {
            place[*b as usize] = 0;
        }
        let mut from = 0;
        for _ in 0..RINGS {
            let to = blocks.len();
            for k in from..to {
                for v in self.of(blocks[k]).iter().flat_map(members) {
                    if place[*v as usize] == NOWHERE && !self.held[*v as usize] {
                        place[*v as usize] = 0;
                        blocks.push(*v);
                    }
                }
            }
            from = to;
        }
        let mut groups = Vec::new();
        for seed in blocks {
            if place[seed as usize] == NOWHERE {
                continue;
            }
            place[seed as usize] = NOWHERE;
            let (mut blocks, mut stencils) = (vec![seed], Vec::new());
            let mut k = 0;
            while k < blocks.len() {
                let own = self.of(blocks[k]);
                stencils.extend_from_slice(own);
                for v in own.iter().flat_map(members) {
                    if place[*v as usize] != NOWHERE {
                        place[*v as usize] = NOWHERE;
                        blocks.push(*v);
                    }
                }
                k += 1;
            }
            stencils.sort_unstable();
            stencils.dedup();
            groups.push(Group {
                blocks,
                stencils,
                gain: 0.0,
            });
        }
        groups
    }
}

impl Group {
    /// What `Phi` has of the group [J].
    fn value(&self, problem: &Problem<'_>, x: &[Vec3]) -> f64 {
        let at = problem.at(x);
        let inertia = |b: &u32| {
            let i = *b as usize;
            0.5 * problem.inertia.weight[i] * (x[i] - problem.inertia.center[i]).norm_squared()
        };
        let mut sum: f64 = self.blocks.iter().map(inertia).sum();
        for (t, e) in &self.stencils {
            let term = &problem.terms[usize::from(*t)];
            if !term.is_idle(&at) {
                sum += term.value(*e as usize, &at);
            }
        }
        sum
    }

    /// Derivatives of that by the group's blocks.
    fn derivatives(
        &self,
        problem: &Problem<'_>,
        x: &[Vec3],
        place: &[u32],
        kind: HessianKind,
        gradient: &mut [Vec3],
        matrix: &mut BlockMatrix,
    ) {
        let at = problem.at(x);
        for block in &mut matrix.blocks {
            block.fill(0.0);
        }
        for (k, b) in self.blocks.iter().enumerate() {
            let i = *b as usize;
            let w = problem.inertia.weight[i];
            gradient[k] = (x[i] - problem.inertia.center[i]) * w;
            matrix.blocks[matrix.pattern.starts[k] as usize] = Mat3::identity() * w;
        }
        let mut first = [Vec3::zeros(); MAX_ARITY];
        let mut second = [Mat3::zeros(); MAX_BLOCKS];
        for (t, e) in &self.stencils {
            let term = &problem.terms[usize::from(*t)];
            if term.is_idle(&at) {
                continue;
            }
            let (stencils, e) = (term.stencils(), *e as usize);
            let arity = stencils.arity;
            let (first, second) = (&mut first[..arity], &mut second[..arity * (arity + 1) / 2]);
            let has = term.has_hessian(kind);
            if has {
                term.derivatives(e, &at, kind, first, second);
            } else {
                term.gradient(e, &at, first);
            }
            let vertices = stencils.get(e);
            let mut blocks = second.iter();
            for (a, v) in vertices.iter().enumerate() {
                let i = place[*v as usize];
                if i != NOWHERE {
                    gradient[i as usize] += first[a];
                }
                for (w, block) in vertices[..=a].iter().zip(&mut blocks) {
                    let j = place[*w as usize];
                    if has
                        && i != NOWHERE
                        && j != NOWHERE
                        && let Some(slot) = matrix.pattern.slot(i.max(j), i.min(j))
                    {
                        if i >= j {
                            matrix.blocks[slot] += block;
                        } else {
                            matrix.blocks[slot] += block.transpose();
                        }
                    }
                }
            }
        }
        complete(matrix);
    }

    /// Newton's method by the blocks of the group; what it gains [J]. `place` is [`NOWHERE`] at every block, before and after.
    fn minimise(
        &self,
        problem: &Problem<'_>,
        whole: &BlockPattern,
        place: &mut [u32],
        x: &mut [Vec3],
    ) -> f64 {
        for (k, b) in self.blocks.iter().enumerate() {
            place[*b as usize] = k as u32;
        }
        let start = self.value(problem, x);
        let end = self.corrections(start, problem, whole, place, x);
        for b in &self.blocks {
            place[*b as usize] = NOWHERE;
        }
        start - end
    }

    /// From `value` on; the value at the end.
    fn corrections(
        &self,
        mut value: f64,
        problem: &Problem<'_>,
        whole: &BlockPattern,
        place: &[u32],
        x: &mut [Vec3],
    ) -> f64 {
        let n = self.blocks.len();
        let mut pattern = BlockPattern::from_stencils(n, |sink| {
            let mut inside = Vec::new();
            for (t, e) in &self.stencils {
                let stencils = problem.terms[usize::from(*t)].stencils();
                let places = stencils.get(*e as usize).iter().map(|v| place[*v as usize]);
                inside.clear();
                inside.extend(places.filter(|place| *place != NOWHERE));
                sink(&inside);
            }
        });
        if !whole.widths.is_empty() {
            pattern.widths = self.blocks.iter().map(|b| whole.width(*b)).collect();
        }
        let mut matrix = BlockMatrix::zeros(pattern);
        let mut solver = Direct::new(&Workers::default());
        let zeros = vec![Vec3::zeros(); n];
        let (mut force, mut direction, mut start) = (zeros.clone(), zeros.clone(), zeros);
        let (mut exactness, mut promised) = (0.0, 0.0);
        for count in 0..MOST {
            loop {
                let kind = HessianKind::Part(exactness);
                self.derivatives(problem, x, place, kind, &mut force, &mut matrix);
                for g in &mut force {
                    g.neg_mut();
                }
                let solved = solver
                    .prepare(&matrix)
                    .and_then(|()| solver.solve(&matrix, &force, &mut direction, 0.0));
                match solved {
                    Ok(_) => break,
                    Err(_) if exactness > 0.0 => exactness = 0.0,
                    // what ails this matrix, the next one of all blocks has too and tells of it
                    Err(_) => return value,
                }
            }
            let gain: f64 = force.iter().zip(&direction).map(|(f, d)| f.dot(d)).sum();
            if count == 0 {
                promised = gain;
            }
            if gain.is_nan() || gain <= DONE * promised {
                return value;
            }
            for (start, b) in start.iter_mut().zip(&self.blocks) {
                *start = x[*b as usize];
            }
            let mut length = 1.0;
            loop {
                for ((start, d), b) in start.iter().zip(&direction).zip(&self.blocks) {
                    x[*b as usize] = start + d * length;
                }
                let trial = self.value(problem, x);
                if trial <= value - 1e-4 * length * gain {
                    value = trial;
                    break;
                }
                length *= 0.5;
                if length < SHORTEST {
                    for (start, b) in start.iter().zip(&self.blocks) {
                        x[*b as usize] = *start;
                    }
                    return value;
                }
            }
            exactness = if length < 1.0 { 0.0 } else { ALMOST };
        }
        value
    }
}
