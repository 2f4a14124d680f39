//! Block incomplete Cholesky without fill, IC(0): `M = L L^T` with `L` on the pattern of the lower
//! triangle of the permuted matrix (Meijerink and van der Vorst 1977; Saad 2003, section 10.3).
//!
//! Column by column, with 3x3 blocks: `L_kk L_kk^T = A_kk`, `L_ik = A_ik L_kk^-T`, then
//! `A_ij -= L_ik L_jk^T` for the blocks `(i, j)` that exist. The list of these updates depends on
//! the pattern alone and is kept with it. It is exact where elimination makes no fill
//! (a block tridiagonal matrix, a tree).
//!
//! For a matrix that is positive definite but no M-matrix a pivot may still break down; then the
//! diagonal blocks are multiplied by `1 + shift` with a shift growing from 1e-3 to 1 (Manteuffel
//! 1980), always starting from zero so that the result is a function of the matrix. What breaks
//! down at shift 1 is refused as not positive definite. An indefinite matrix may survive this;
//! conjugate gradients find its negative curvature.
//!
//! The factor is computed in f64 and applied in f64 or from an f32 copy: applying it is bound by
//! memory, and rounding a preconditioner does not round the solution.

use super::ordering::reverse_cuthill_mckee;
use super::pcg::Preconditioner;
use super::{LinearError, Product};
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::{Mat3, Vec3};

/// A pivot below this fraction of its diagonal entry counts as broken down.
const BREAKDOWN: f64 = 1e-10;
/// Shifts that are tried in turn.
const SHIFTS: [f64; 7] = [0.0, 1e-3, 4e-3, 1.6e-2, 6.4e-2, 0.25, 1.0];

/// Order of elimination.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Order {
    /// As the unknowns are numbered.
    Natural,
    /// Reverse Cuthill-McKee.
    CuthillMckee,
    /// Smaller priorities first, then reverse Cuthill-McKee: one priority for each block row.
    Priorities(Vec<u8>),
    /// `order[new] = old`.
    Given(Vec<u32>),
}

/// Numbers that the factor is applied from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// 72 bytes a block.
    F64,
    /// 36 bytes a block, beside the f64 blocks that the next factorization works in.
    F32,
}

/// Block IC(0).
pub struct IncompleteCholesky {
    order: Order,
    storage: Storage,
    plan: Option<Plan>,
    /// Permuted lower triangle, then `L`; diagonal blocks hold the inverse of `L_kk`.
    blocks: Vec<Mat3>,
    rounded: Vec<[f32; 9]>,
    work: Vec<Vec3>,
    shift: f64,
}

/// What depends on the pattern.
struct Plan {
    pattern: BlockPattern,
    /// `order[new] = old`.
    order: Vec<u32>,
    starts: Vec<u32>,
    rows: Vec<u32>,
    /// `2 * slot + transposed` in the given matrix.
    source: Vec<u32>,
    /// Updates `(target, left, right)`: `target -= left right^T`, ordered by column.
    updates: Vec<[u32; 3]>,
    /// Start of each column in `updates`.
    update_starts: Vec<u32>,
}

impl IncompleteCholesky {
    /// Without a matrix yet.
    pub fn new(order: Order, storage: Storage) -> Self {
        Self {
            order,
            storage,
            plan: None,
            blocks: Vec::new(),
            rounded: Vec::new(),
            work: Vec::new(),
            shift: 0.0,
        }
    }

    /// Diagonal shift that the last factorization needed, 0 for none.
    pub fn shift(&self) -> f64 {
        self.shift
    }
}

impl Preconditioner for IncompleteCholesky {
    fn solver_name(&self) -> &'static str {
        "cg_ic0"
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        let plan = match self.plan.take() {
            Some(plan) if plan.pattern == matrix.pattern => plan,
            _ => Plan::new(&matrix.pattern, &self.order)?,
        };
        self.blocks.resize(plan.rows.len(), Mat3::zeros());
        self.work.resize(plan.order.len(), Vec3::zeros());
        let mut result = Err(LinearError::NotPositiveDefinite);
        for shift in SHIFTS {
            plan.load(matrix, shift, &mut self.blocks);
            if plan.factorize(&mut self.blocks) {
                self.shift = shift;
                result = Ok(());
                break;
            }
        }
        if self.storage == Storage::F32 {
            self.rounded.resize(plan.rows.len(), [0.0; 9]);
            for (r, b) in self.rounded.iter_mut().zip(&self.blocks) {
                for (r, b) in r.iter_mut().zip(b.iter()) {
                    *r = *b as f32;
                }
            }
        }
        self.plan = Some(plan);
        result
    }

    fn apply(&mut self, _product: Product<'_>, r: &[Vec3], z: &mut [Vec3]) {
        let Some(plan) = &self.plan else {
            z.copy_from_slice(r);
            return;
        };
        match self.storage {
            Storage::F64 => plan.solve(|k| self.blocks[k], r, z, &mut self.work),
            Storage::F32 => plan.solve(
                |k| Mat3::from_iterator(self.rounded[k].iter().map(|&v| f64::from(v))),
                r,
                z,
                &mut self.work,
            ),
        }
    }

    fn bytes(&self) -> usize {
        let plan = self.plan.as_ref().map_or(0, |p| {
            4 * (p.pattern.starts.len()
                + p.pattern.rows.len()
                + p.order.len()
                + p.starts.len()
                + p.rows.len()
                + p.source.len()
                + 3 * p.updates.len()
                + p.update_starts.len())
        });
        plan + 72 * self.blocks.len() + 36 * self.rounded.len() + 24 * self.work.len()
    }
}

impl Plan {
    fn new(pattern: &BlockPattern, order: &Order) -> Result<Self, LinearError> {
        let n = pattern.n();
        let order = match order {
            Order::Natural => (0..n as u32).collect(),
            Order::CuthillMckee => reverse_cuthill_mckee(pattern, None),
            Order::Priorities(p) => reverse_cuthill_mckee(pattern, Some(p)),
            Order::Given(order) => order.clone(),
        };
        let mut place = vec![u32::MAX; n];
        for (new, &old) in order.iter().enumerate() {
            match place.get_mut(old as usize) {
                Some(p) if *p == u32::MAX => *p = new as u32,
                _ => return Err(LinearError::NoConvergence),
            }
        }
        if order.len() != n {
            return Err(LinearError::NoConvergence);
        }

        let mut entries = Vec::with_capacity(pattern.rows.len());
        for j in 0..n {
            for k in pattern.starts[j]..pattern.starts[j + 1] {
                let (p, q) = (place[pattern.rows[k as usize] as usize], place[j]);
                entries.push((p.min(q), p.max(q), 2 * k + u32::from(p < q)));
            }
        }
        entries.sort_unstable();
        let mut starts = vec![0_u32; n + 1];
        for e in &entries {
            starts[e.0 as usize + 1] += 1;
        }
        for j in 0..n {
            starts[j + 1] += starts[j];
        }
        let permuted = BlockPattern {
            starts,
            rows: entries.iter().map(|e| e.1).collect(),
            widths: Vec::new(),
        };

        let mut updates = Vec::new();
        let mut update_starts = vec![0_u32];
        for k in 0..n {
            let column = permuted.starts[k] + 1..permuted.starts[k + 1];
            for right in column.clone() {
                for left in right..column.end {
                    let (i, j) = (permuted.rows[left as usize], permuted.rows[right as usize]);
                    if let Some(target) = permuted.slot(i, j) {
                        updates.push([target as u32, left, right]);
                    }
                }
            }
            update_starts.push(updates.len() as u32);
        }
        Ok(Self {
            pattern: pattern.clone(),
            order,
            starts: permuted.starts,
            rows: permuted.rows,
            source: entries.iter().map(|e| e.2).collect(),
            updates,
            update_starts,
        })
    }

    fn load(&self, matrix: &BlockMatrix, shift: f64, blocks: &mut [Mat3]) {
        for (block, &source) in blocks.iter_mut().zip(&self.source) {
            let given = &matrix.blocks[source as usize >> 1];
            *block = if source & 1 == 1 {
                given.transpose()
            } else {
                *given
            };
        }
        if shift > 0.0 {
            for &d in &self.starts[..self.order.len()] {
                blocks[d as usize] *= 1.0 + shift;
            }
        }
    }

    /// Factors in place; false when a pivot breaks down.
    fn factorize(&self, blocks: &mut [Mat3]) -> bool {
        for k in 0..self.order.len() {
            let (from, to) = (self.starts[k] as usize, self.starts[k + 1] as usize);
            let Some(inverse) = inverse_root(&blocks[from]) else {
                return false;
            };
            blocks[from] = inverse;
            for block in &mut blocks[from + 1..to] {
                *block *= inverse.transpose();
            }
            let updates = self.update_starts[k] as usize..self.update_starts[k + 1] as usize;
            for &[target, left, right] in &self.updates[updates] {
                let product = blocks[left as usize] * blocks[right as usize].transpose();
                blocks[target as usize] -= product;
            }
        }
        true
    }

    /// `z = (L L^T)^-1 r` in the given numbering.
    fn solve(&self, block: impl Fn(usize) -> Mat3, r: &[Vec3], z: &mut [Vec3], y: &mut [Vec3]) {
        let n = self.order.len();
        for (y, &old) in y.iter_mut().zip(&self.order) {
            *y = r[old as usize];
        }
        for k in 0..n {
            let (from, to) = (self.starts[k] as usize, self.starts[k + 1] as usize);
            let yk = block(from) * y[k];
            y[k] = yk;
            for s in from + 1..to {
                y[self.rows[s] as usize] -= block(s) * yk;
            }
        }
        for k in (0..n).rev() {
            let (from, to) = (self.starts[k] as usize, self.starts[k + 1] as usize);
            let mut sum = y[k];
            for s in from + 1..to {
                sum -= block(s).tr_mul(&y[self.rows[s] as usize]);
            }
            y[k] = block(from).tr_mul(&sum);
        }
        for (y, &old) in y.iter().zip(&self.order) {
            z[old as usize] = *y;
        }
    }
}

/// Inverse of the lower Cholesky factor of a 3x3 block; `None` when a pivot breaks down.
fn inverse_root(a: &Mat3) -> Option<Mat3> {
    let ok = |pivot: f64, diagonal: f64| {
        (pivot.is_finite() && pivot > 0.0 && pivot > BREAKDOWN * diagonal).then(|| pivot.sqrt())
    };
    // The diagonal entries have been reduced by the columns before; what counts here is the loss
    // inside the block.
    let l00 = ok(a[(0, 0)], a[(0, 0)])?;
    let l10 = a[(1, 0)] / l00;
    let l20 = a[(2, 0)] / l00;
    let l11 = ok(a[(1, 1)] - l10 * l10, a[(1, 1)])?;
    let l21 = (a[(2, 1)] - l20 * l10) / l11;
    let l22 = ok(a[(2, 2)] - l20 * l20 - l21 * l21, a[(2, 2)])?;
    let (i00, i11, i22) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
    let i10 = -l10 * i00 * i11;
    let i21 = -l21 * i11 * i22;
    let i20 = -(l20 * i00 + l21 * i10) * i22;
    Some(Mat3::new(i00, 0.0, 0.0, i10, i11, 0.0, i20, i21, i22))
}
