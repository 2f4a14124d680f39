//! Ties between the two sides of a seam.
//!
//! Every vertex of side a is tied to the point of side b at the same fraction of arc length (run
//! backwards unless the seam has the same direction). Vertices of b that meet no vertex of a are tied
//! to a in turn. A tie stands for half of the seam to each side of it (trapezoid rule), so the
//! lengths sum to the seam's.
//!
//! A dart's two edges share the corner at its tip: that corner would be tied to itself. It is left
//! out and its length goes to the tie beside it.

use super::SeamLink;

/// Fractions nearer than this are the same point.
const SAME: f64 = 1e-9;

/// One side of a seam: vertices and their fractions of arc length, both in the seam's direction.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    /// Vertices, at least 2.
    pub vertices: &'a [u32],
    /// Fractions from 0 to 1, ascending, one for each vertex.
    pub fractions: &'a [f64],
}

/// Ties of side a to side b, and of what is left of b to a; `length` of the whole seam [m].
pub fn link(a: Side<'_>, b: Side<'_>, length: f64) -> Vec<SeamLink> {
    if a.vertices.len() < 2 || b.vertices.len() < 2 {
        return Vec::new();
    }
    let mut raw: Vec<(f64, SeamLink)> = Vec::with_capacity(a.vertices.len());
    for (vertex, x) in a.vertices.iter().zip(a.fractions) {
        raw.push((*x, tie(*vertex, *x, b)));
    }
    for (vertex, x) in b.vertices.iter().zip(b.fractions) {
        let k = a.fractions.partition_point(|y| *y < x - SAME);
        if a.fractions.get(k).is_none_or(|y| *y > x + SAME) {
            raw.push((*x, tie(*vertex, *x, a)));
        }
    }
    raw.sort_by(|p, q| p.0.total_cmp(&q.0));
    let mut shares = vec![0.0; raw.len()];
    for k in 1..raw.len() {
        let half = 0.5 * (raw[k].0 - raw[k - 1].0);
        shares[k - 1] += half;
        shares[k] += half;
    }
    // a corner that both sides share is no tie
    let own = |link: &SeamLink| link.edge.contains(&link.vertex);
    let last = raw.len() - 1;
    if own(&raw[0].1) {
        shares[1] += shares[0];
    }
    if own(&raw[last].1) {
        shares[last - 1] += shares[last];
    }
    raw.iter()
        .zip(&shares)
        .filter(|((_, link), _)| !own(link))
        .map(|((_, link), share)| SeamLink {
            length: share * length,
            ..*link
        })
        .collect()
}

/// Tie of `vertex` to the point of `side` at fraction `x`.
fn tie(vertex: u32, x: f64, side: Side<'_>) -> SeamLink {
    let pieces = side.vertices.len() - 1;
    let k = side
        .fractions
        .partition_point(|y| *y <= x + SAME)
        .clamp(1, pieces)
        - 1;
    let (from, to) = (side.fractions[k], side.fractions[k + 1]);
    let t = if x <= from + SAME {
        0.0
    } else if x >= to - SAME {
        1.0
    } else {
        (x - from) / (to - from)
    };
    SeamLink {
        vertex,
        edge: [side.vertices[k], side.vertices[k + 1]],
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

    fn even(vertices: &[u32]) -> Vec<f64> {
        let n = vertices.len() - 1;
        (0..=n).map(|k| k as f64 / n as f64).collect()
    }

    fn tied(a: &[u32], b: &[u32], length: f64) -> Vec<SeamLink> {
        link(
            Side {
                vertices: a,
                fractions: &even(a),
            },
            Side {
                vertices: b,
                fractions: &even(b),
            },
            length,
        )
    }

    #[test]
    fn equal_fractions_tie_vertex_to_vertex() {
        let (a, b) = ([0, 1, 2, 3], [10, 11, 12, 13]);
        let links = tied(&a, &b, 0.3);
        assert_eq!(links.len(), 4);
        for (k, l) in links.iter().enumerate() {
            let met = l.edge[usize::from(l.t != 0.0)];
            assert!(l.t == 0.0 || l.t == 1.0);
            assert_eq!((l.vertex, met), (a[k], b[k]));
        }
        assert!((sum(&links) - 0.3).abs() < 1e-15);
        assert!((links[0].length - 0.05).abs() < 1e-15);
    }

    #[test]
    fn unequal_fractions_tie_every_vertex_of_both_sides() {
        for (na, nb) in [(3, 2), (2, 3), (5, 7), (6, 3), (1, 4), (4, 1)] {
            let a: Vec<u32> = (0..=na).collect();
            let b: Vec<u32> = (100..=100 + nb).collect();
            let links = tied(&a, &b, 2.0);
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
        // a runs from the mouth to the tip 5, b has been turned to do so too
        let links = tied(&[3, 4, 5], &[7, 6, 5], 0.1);
        assert_eq!(links.len(), 2);
        assert!(links.iter().all(|l| !l.edge.contains(&l.vertex)));
        assert!((sum(&links) - 0.1).abs() < 1e-15);
        // one piece: only the mouth is tied, with all the length
        let links = tied(&[3, 5], &[7, 5], 0.1);
        assert_eq!(links.len(), 1);
        assert!((links[0].length - 0.1).abs() < 1e-15);
        // a lens sewn to itself shares both ends
        let links = tied(&[3, 4, 5], &[3, 6, 5], 0.1);
        assert_eq!(links.len(), 1);
        assert!((sum(&links) - 0.1).abs() < 1e-15);
    }
}
