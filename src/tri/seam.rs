//! Ties between the two sides of a seam.
//!
//! Both sides are cut at equal steps of arc length. Every vertex of side a is tied to the point of
//! side b at the same fraction of arc length (run backwards unless `same_direction`). Where the
//! counts differ, the vertices of b that meet no vertex of a are tied to a in turn. A tie stands for
//! half of the seam to each side of it (trapezoid rule), so the lengths sum to the seam's.
//!
//! A dart's two edges share the corner at its tip: that corner would be tied to itself. It is left
//! out and its length goes to the tie beside it.

use super::SeamLink;

/// Fractions nearer than this are the same point.
const SAME: f64 = 1e-9;

/// A tie before its length is known: fraction along a, and the tie.
type Raw = (f64, SeamLink);

/// Ties of side a (vertices from start to end) to side b; `length` of the whole seam [m].
pub fn link(a: &[u32], b: &[u32], same_direction: bool, length: f64) -> Vec<SeamLink> {
    if a.len() < 2 || b.len() < 2 {
        return Vec::new();
    }
    let b: Vec<u32> = if same_direction {
        b.to_vec()
    } else {
        b.iter().rev().copied().collect()
    };
    let (na, nb) = (a.len() - 1, b.len() - 1);
    let mut raw: Vec<Raw> = (0..=na)
        .map(|k| (k as f64 / na as f64, tie(a[k], k, na, &b)))
        .collect();
    if na != nb {
        for k in 1..nb {
            // fractions k / nb and j / na agree exactly in integers
            if (k * na) % nb != 0 {
                raw.push((k as f64 / nb as f64, tie(b[k], k, nb, a)));
            }
        }
        raw.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.vertex.cmp(&q.1.vertex)));
    }
    // a corner tied to itself or to an edge that it bounds is no tie
    let fractions: Vec<f64> = raw.iter().map(|r| r.0).collect();
    let mut shares = vec![0.0; raw.len()];
    for k in 1..raw.len() {
        let half = 0.5 * (fractions[k] - fractions[k - 1]);
        shares[k - 1] += half;
        shares[k] += half;
    }
    let own = |r: &Raw| r.1.edge.contains(&r.1.vertex);
    let last = raw.len() - 1;
    if own(&raw[0]) {
        shares[1] += shares[0];
    }
    if own(&raw[last]) {
        shares[last - 1] += shares[last];
    }
    raw.iter()
        .zip(&shares)
        .filter(|(r, _)| !own(r))
        .map(|(r, share)| SeamLink {
            length: share * length,
            ..r.1
        })
        .collect()
}

/// Tie of `vertex` at fraction `k / n` to the side whose vertices are `other`.
fn tie(vertex: u32, k: usize, n: usize, other: &[u32]) -> SeamLink {
    let m = other.len() - 1;
    // position k m / n on the other side, in pieces
    let whole = (k * m) / n;
    let rest = (k * m) % n;
    let (piece, t) = if whole == m {
        (m - 1, 1.0)
    } else {
        (whole, rest as f64 / n as f64)
    };
    debug_assert!(t > SAME || rest == 0);
    SeamLink {
        vertex,
        edge: [other[piece], other[piece + 1]],
        t,
        length: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(links: &[SeamLink]) -> f64 {
        links.iter().map(|l| l.length).sum()
    }

    #[test]
    fn equal_counts_tie_vertex_to_vertex() {
        let (a, b) = ([0, 1, 2, 3], [10, 11, 12, 13]);
        let links = link(&a, &b, false, 0.3);
        assert_eq!(links.len(), 4);
        for (k, l) in links.iter().enumerate() {
            let met = l.edge[if l.t == 0.0 { 0 } else { 1 }];
            assert!(l.t == 0.0 || l.t == 1.0);
            assert_eq!((l.vertex, met), (a[k], b[3 - k]));
        }
        assert!((sum(&links) - 0.3).abs() < 1e-15);
        assert!((links[0].length - 0.05).abs() < 1e-15);
        let met: Vec<u32> = link(&a, &b, true, 0.3)
            .iter()
            .map(|l| l.edge[if l.t == 0.0 { 0 } else { 1 }])
            .collect();
        assert_eq!(met, b);
    }

    #[test]
    fn unequal_counts_tie_every_vertex_of_both_sides_once() {
        for (na, nb) in [(3, 2), (2, 3), (5, 7), (6, 3), (1, 4), (4, 1)] {
            let a: Vec<u32> = (0..=na).collect();
            let b: Vec<u32> = (100..=100 + nb).collect();
            let links = link(&a, &b, true, 2.0);
            assert!((sum(&links) - 2.0).abs() < 1e-14);
            // fraction of the vertex equals that of the point it is tied to
            let fraction = |v: u32| {
                if v < 100 {
                    f64::from(v) / f64::from(na)
                } else {
                    f64::from(v - 100) / f64::from(nb)
                }
            };
            for l in &links {
                let point = (1.0 - l.t) * fraction(l.edge[0]) + l.t * fraction(l.edge[1]);
                assert!((fraction(l.vertex) - point).abs() < 1e-14);
                assert_ne!(l.vertex < 100, l.edge[0] < 100);
            }
            for v in a.iter().chain(&b) {
                assert!(links.iter().any(|l| l.vertex == *v
                    || (l.t == 0.0 && l.edge[0] == *v)
                    || (l.t == 1.0 && l.edge[1] == *v)));
            }
        }
    }

    #[test]
    fn the_tip_of_a_dart_is_not_tied_to_itself() {
        // a runs mouth to tip 5, b from the tip back to the mouth
        let links = link(&[3, 4, 5], &[5, 6, 7], false, 0.1);
        assert_eq!(links.len(), 2);
        assert!(links.iter().all(|l| !l.edge.contains(&l.vertex)));
        assert!((sum(&links) - 0.1).abs() < 1e-15);
        // one piece: only the mouth is tied, with all the length
        let links = link(&[3, 5], &[5, 7], false, 0.1);
        assert_eq!(links.len(), 1);
        assert!((links[0].length - 0.1).abs() < 1e-15);
        // a lens sewn to itself shares both ends
        let links = link(&[3, 4, 5], &[5, 6, 3], false, 0.1);
        assert_eq!(links.len(), 1);
        assert!((sum(&links) - 0.1).abs() < 1e-15);
    }
}
