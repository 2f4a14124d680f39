//! A small static solver of its own: Newton with the exact Hessian where it is positive definite,
//! the projected one elsewhere, faer's sparse Cholesky, a line search on the energy.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Mat, Side};
use toile::math::block::{BlockMatrix, BlockPattern};
use toile::math::{Mat3, Vec3};
use toile::system::term::{Configuration, HessianKind, MAX_ARITY, MAX_BLOCKS, Term, World};

pub struct Outcome {
    pub residual: f64,
}

pub fn energy(terms: &[Box<dyn Term>], x: &[Vec3], world: &World<'_>) -> f64 {
    let at = Configuration {
        x,
        x0: x,
        u: &[],
        inv_dt: 0.0,
        world,
    };
    terms
        .iter()
        .map(|t| {
            (0..t.stencils().count())
                .map(|e| t.value(e, &at))
                .sum::<f64>()
        })
        .sum()
}

pub fn gradient(terms: &[Box<dyn Term>], x: &[Vec3], world: &World<'_>) -> Vec<Vec3> {
    let at = Configuration {
        x,
        x0: x,
        u: &[],
        inv_dt: 0.0,
        world,
    };
    let mut g = vec![Vec3::zeros(); x.len()];
    let mut out = [Vec3::zeros(); MAX_ARITY];
    for t in terms {
        let s = t.stencils();
        for e in 0..s.count() {
            t.gradient(e, &at, &mut out[..s.arity]);
            for (&v, o) in s.get(e).iter().zip(&out) {
                g[v as usize] += o;
            }
        }
    }
    g
}

fn assemble(
    terms: &[Box<dyn Term>],
    x: &[Vec3],
    world: &World<'_>,
    kind: HessianKind,
    fixed: &[bool],
    a: &mut BlockMatrix,
) {
    let at = Configuration {
        x,
        x0: x,
        u: &[],
        inv_dt: 0.0,
        world,
    };
    a.blocks.fill(Mat3::zeros());
    let mut out = [Mat3::zeros(); MAX_BLOCKS];
    for t in terms {
        let s = t.stencils();
        for e in 0..s.count() {
            t.hessian(e, &at, kind, &mut out);
            let v = s.get(e);
            for i in 0..s.arity {
                for j in 0..=i {
                    if fixed[v[i] as usize] || fixed[v[j] as usize] {
                        continue;
                    }
                    let b = out[i * (i + 1) / 2 + j];
                    if v[i] >= v[j] {
                        let k = a.pattern.slot(v[i], v[j]).expect("in the pattern");
                        a.blocks[k] += b;
                    } else {
                        let k = a.pattern.slot(v[j], v[i]).expect("in the pattern");
                        a.blocks[k] += b.transpose();
                    }
                }
            }
        }
    }
    for (v, _) in fixed.iter().enumerate().filter(|(_, f)| **f) {
        let k = a.pattern.starts[v] as usize;
        a.blocks[k] = Mat3::identity();
    }
}

struct Direct {
    structure: SymbolicSparseColMat<usize>,
    symbolic: SymbolicLlt<usize>,
}

impl Direct {
    fn new(p: &BlockPattern) -> Self {
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for j in 0..p.n() {
            let column = &p.rows[p.starts[j] as usize..p.starts[j + 1] as usize];
            for c in 0..3 {
                for &i in column {
                    for r in 0..3 {
                        if i as usize != j || r >= c {
                            rows.push(3 * i as usize + r);
                        }
                    }
                }
                starts.push(rows.len());
            }
        }
        let structure = SymbolicSparseColMat::new_checked(3 * p.n(), 3 * p.n(), starts, None, rows);
        let symbolic = SymbolicLlt::try_new(structure.as_ref(), Side::Lower).expect("memory");
        Self {
            structure,
            symbolic,
        }
    }

    fn solve(&self, a: &BlockMatrix, b: &[Vec3]) -> Option<Vec<Vec3>> {
        let p = &a.pattern;
        let mut values = Vec::with_capacity(self.structure.row_idx().len());
        for j in 0..p.n() {
            for c in 0..3 {
                for k in p.starts[j] as usize..p.starts[j + 1] as usize {
                    for r in 0..3 {
                        if p.rows[k] as usize != j || r >= c {
                            values.push(a.blocks[k][(r, c)]);
                        }
                    }
                }
            }
        }
        let matrix = SparseColMat::new(self.structure.clone(), values);
        let factor =
            Llt::try_new_with_symbolic(self.symbolic.clone(), matrix.as_ref(), Side::Lower).ok()?;
        let mut rhs = Mat::from_fn(3 * b.len(), 1, |i, _| b[i / 3][i % 3]);
        factor.solve_in_place(&mut rhs);
        Some(
            (0..b.len())
                .map(|v| Vec3::new(rhs[(3 * v, 0)], rhs[(3 * v + 1, 0)], rhs[(3 * v + 2, 0)]))
                .collect(),
        )
    }
}

/// Moves `x` to rest: largest free nodal force below `tolerance` [N].
pub fn relax(
    terms: &[Box<dyn Term>],
    x: &mut Vec<Vec3>,
    fixed: &[bool],
    world: &World<'_>,
    tolerance: f64,
    limit: usize,
) -> Outcome {
    let pattern = BlockPattern::from_stencils(x.len(), |sink| {
        for t in terms {
            let s = t.stencils();
            (0..s.count()).for_each(|e| sink(s.get(e)));
        }
    });
    let direct = Direct::new(&pattern);
    let mut a = BlockMatrix::zeros(pattern);
    let mut now = energy(terms, x, world);
    let mut shift = 0.0;
    let mut residual = f64::INFINITY;
    for _ in 0..limit {
        let mut g = gradient(terms, x, world);
        for (g, f) in g.iter_mut().zip(fixed) {
            if *f {
                *g = Vec3::zeros();
            }
        }
        residual = g.iter().map(|g| g.amax()).fold(0.0, f64::max);
        if residual < tolerance {
            return Outcome { residual };
        }
        let step = [HessianKind::Exact, HessianKind::Psd]
            .into_iter()
            .find_map(|kind| {
                assemble(terms, x, world, kind, fixed, &mut a);
                if kind == HessianKind::Psd {
                    for v in 0..x.len() {
                        let k = a.pattern.starts[v] as usize;
                        a.blocks[k] += Mat3::from_diagonal_element(shift + 1e-9);
                    }
                }
                direct.solve(&a, &g)
            })
            .expect("the projected Hessian is positive definite");
        let slope: f64 = step.iter().zip(&g).map(|(s, g)| s.dot(g)).sum();
        let mut length = 1.0;
        let accepted = (0..30).any(|_| {
            let tried: Vec<Vec3> = x.iter().zip(&step).map(|(x, s)| x - s * length).collect();
            let then = energy(terms, &tried, world);
            let rounding = 1e-12 * now.abs();
            if then <= now - 1e-4 * length * slope + rounding {
                *x = tried;
                now = then;
                return true;
            }
            length *= 0.5;
            false
        });
        // the projected Hessian alone sees no geometric stiffness: trust it less after short steps
        shift = if length < 0.2 {
            (4.0 * shift).max(1e-6)
        } else {
            shift * 0.25
        };
        if !accepted {
            break;
        }
    }
    Outcome { residual }
}
