//! Which columns of `E` are well enough supported, and the Cholesky factor of `G = E^T E` over those.
//!
//! Full rank is not enough: where a vertex of the triangles has hardly a node of its own, `G` is regular and `B^+ =
//! G^-1 B^T` still throws the vertex about. So columns with less than a tenth of the median of `diag G` go first, and
//! then those whose pivot falls below [`PIVOT`] in the Cholesky factorization of `G` scaled to a unit diagonal with the
//! largest pivot taken first. What has gone leaves the others exact: a regularised `G` would not make a projector.

use crate::error::{Error, Result, Status};
use crate::math::Vec3;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::Llt;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};

/// Least pivot of a column of `B`, and of a triangle's mean beside those.
const PIVOT: f64 = 0.1;
const MEAN_PIVOT: f64 = 1e-2;
/// Least diagonal entry over the median.
const SMALL: f64 = 0.1;

/// `G` as a list of entries `(row, column, value)` with `row >= column`, several for one place being added.
pub(super) type Entries = Vec<(u32, u32, f64)>;

/// For each of `n` columns whether it is supported; the first `vertices` of them belong to vertices.
pub(super) fn supported(n: usize, vertices: usize, entries: &Entries) -> Vec<bool> {
    let mut gram = vec![0.0; n * n];
    for (i, j, value) in entries {
        gram[*i as usize * n + *j as usize] += value;
    }
    let diagonal: Vec<f64> = (0..n).map(|k| gram[k * n + k]).collect();
    let scale: Vec<f64> = (diagonal.iter())
        .map(|d| if *d > 0.0 { 1.0 / d.sqrt() } else { 0.0 })
        .collect();
    let mut sorted: Vec<f64> = diagonal[..vertices].to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let median = sorted.get(vertices / 2).copied().unwrap_or(0.0);
    let mut left: Vec<f64> = (0..n)
        .map(|k| f64::from(u8::from(scale[k] > 0.0)))
        .collect();
    let mut kept = vec![false; n];
    // rows of the factor, in the order of the pivots
    let mut factor: Vec<Vec<f64>> = Vec::new();
    for (range, least) in [(0..vertices, PIVOT), (vertices..n, MEAN_PIVOT)] {
        let mut open: Vec<usize> = range
            .filter(|k| *k >= vertices || diagonal[*k] >= SMALL * median)
            .collect();
        while let Some((at, pivot)) = open
            .iter()
            .enumerate()
            .map(|(at, k)| (at, left[*k]))
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
            && pivot >= least
        {
            let p = open.swap_remove(at);
            kept[p] = true;
            let root = pivot.sqrt();
            let mut row: Vec<f64> = (0..n)
                .map(|k| gram[p.max(k) * n + p.min(k)] * scale[p] * scale[k])
                .collect();
            for earlier in factor.iter().filter(|r| r[p] != 0.0) {
                let by = earlier[p];
                for (r, e) in row.iter_mut().zip(earlier) {
                    *r -= by * e;
                }
            }
            for (r, left) in row.iter_mut().zip(&mut left) {
                *r /= root;
                *left -= *r * *r;
            }
            factor.push(row);
        }
    }
    kept
}

/// The factor of `G` over its supported columns.
#[derive(Clone, Debug)]
pub(super) struct Factor {
    n: usize,
    llt: Option<Llt<usize, f64>>,
}

impl Factor {
    /// `number[k]` is the number of column `k` among the supported ones.
    pub(super) fn new(n: usize, entries: &Entries, number: &[u32]) -> Result<Self> {
        let triplets: Vec<_> = entries
            .iter()
            .filter_map(|(i, j, value)| {
                let (i, j) = (number[*i as usize], number[*j as usize]);
                let both = (i as usize) < n && (j as usize) < n;
                both.then(|| Triplet::new(i.max(j) as usize, i.min(j) as usize, *value))
            })
            .collect();
        if n == 0 {
            return Ok(Self { n, llt: None });
        }
        let failed = |what: String| Error::new(Status::LinearSolve, format!("filter: {what}"));
        let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &triplets)
            .map_err(|e| failed(e.to_string()))?;
        let llt = matrix
            .sp_cholesky(Side::Lower)
            .map_err(|e| failed(e.to_string()))?;
        Ok(Self { n, llt: Some(llt) })
    }

    /// `r = G^-1 r`.
    pub(super) fn solve(&self, r: &mut [Vec3]) {
        let Some(llt) = &self.llt else {
            return;
        };
        let mut columns = Mat::from_fn(self.n, 3, |i, c| r[i][c]);
        llt.solve_in_place(columns.as_mut());
        for (i, r) in r.iter_mut().enumerate() {
            *r = Vec3::from_fn(|c, _| columns[(i, c)]);
        }
    }

    /// Column `k` of `G^-1`.
    pub(super) fn column(&self, k: usize) -> Vec<f64> {
        let mut column = Mat::from_fn(self.n, 1, |i, _| f64::from(u8::from(i == k)));
        if let Some(llt) = &self.llt {
            llt.solve_in_place(column.as_mut());
        }
        (0..self.n).map(|i| column[(i, 0)]).collect()
    }
}
