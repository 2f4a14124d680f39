//! Normal forces between the yarns stacked at a contact.
//!
//! `n` strands from back to front; `b_i` is the force on strand `i` along the normal, which points to the front, and
//! `lambda_i >= 0` the push between strands `i` and `i + 1`. What is left, `f_i = b_i + lambda_{i-1} - lambda_i`, is
//! least in the sense of squares (Cirio et al. 2017, section 4.3):
//!
//! ```text
//! M lambda >= r,  lambda >= 0,  lambda . (M lambda - r) = 0,   M = tridiag(-1, 2, -1),  r_i = b_i - b_{i+1}
//! ```
//!
//! `M` is an M-matrix: its inverse, and that of each of its principal parts, has no negative entry. So the contacts
//! with `r_i > 0` carry load, and whichever contact the loads of its neighbours close joins them; none ever
//! leaves, and the optimum is exact after at most `n` rounds. The paper's equation 4,
//! `M^-1 max(0, r)`, is the same for two strands only.

/// Largest number of yarns at a contact.
pub const MAX_STACK: usize = 16;

/// Which solution of the normal forces is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StackRule {
    /// The optimum.
    #[default]
    LeastSquares,
    /// Equation 4 of the paper.
    ClosedForm,
}

/// Normal forces of the contacts of a stack with the forces `b` on its strands; one more strand than
/// contacts, at most [`MAX_STACK`].
pub fn normal_forces(b: &[f64], rule: StackRule, lambda: &mut [f64]) {
    let n = lambda.len();
    let mut r = [0.0; MAX_STACK];
    for i in 0..n {
        r[i] = b[i] - b[i + 1];
    }
    let mut closed = [false; MAX_STACK];
    if rule == StackRule::ClosedForm {
        for v in &mut r[..n] {
            *v = v.max(0.0);
        }
        closed[..n].fill(true);
        solve(&r[..n], &closed[..n], lambda);
        return;
    }
    for i in 0..n {
        closed[i] = r[i] > 0.0;
    }
    for _ in 0..=n {
        solve(&r[..n], &closed[..n], lambda);
        let mut grown = false;
        for i in 0..n {
            let beside = if i > 0 { lambda[i - 1] } else { 0.0 }
                + if i + 1 < n { lambda[i + 1] } else { 0.0 };
            if !closed[i] && r[i] + beside > 0.0 {
                closed[i] = true;
                grown = true;
            }
        }
        if !grown {
            return;
        }
    }
}

/// `M lambda = r` on the closed contacts, 0 on the others.
fn solve(r: &[f64], closed: &[bool], lambda: &mut [f64]) {
    let n = r.len();
    // elimination without fill; an open contact cuts the chain
    let mut pivot = [2.0; MAX_STACK];
    for i in 0..n {
        lambda[i] = if closed[i] { r[i] } else { 0.0 };
        if i > 0 && closed[i] && closed[i - 1] {
            pivot[i] = 2.0 - 1.0 / pivot[i - 1];
            lambda[i] += lambda[i - 1] / pivot[i - 1];
        }
    }
    for i in (0..n).rev() {
        if closed[i] {
            let next = if i + 1 < n { lambda[i + 1] } else { 0.0 };
            lambda[i] = (lambda[i] + next) / pivot[i];
        }
    }
}

/// Same at a node that is held: the reaction, which no strand's force shows, balances the sum. It may act on
/// the strand at the back or on the one at the front; each contact carries the larger of the two.
pub fn held_normal_forces(b: &[f64], rule: StackRule, lambda: &mut [f64]) {
    let n = b.len();
    let sum: f64 = b.iter().sum();
    let mut other = [0.0; MAX_STACK];
    let mut balanced = [0.0; MAX_STACK];
    balanced[..n].copy_from_slice(b);
    balanced[0] -= sum;
    normal_forces(&balanced[..n], rule, &mut other[..n - 1]);
    balanced[0] = b[0];
    balanced[n - 1] -= sum;
    normal_forces(&balanced[..n], rule, lambda);
    for (l, o) in lambda.iter_mut().zip(&other) {
        *l = l.max(*o);
    }
}
