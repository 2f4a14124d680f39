//! What triangles are made of: their edges, and those at the border of the surface.

/// Every edge once, smaller vertex first, in ascending order.
pub fn edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut all = sides(triangles);
    all.dedup();
    all
}

/// Edges of exactly one triangle, smaller vertex first, in ascending order.
pub fn boundary_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    sides(triangles)
        .chunk_by(|a, b| a == b)
        .filter(|run| run.len() == 1)
        .map(|run| run[0])
        .collect()
}

/// Edges of two triangles, smaller vertex first, in ascending order, with the two.
pub fn inner_edges(triangles: &[[u32; 3]]) -> Vec<([u32; 2], [u32; 2])> {
    let mut sides: Vec<([u32; 2], u32)> = (0..)
        .zip(triangles)
        .flat_map(|(t, &[a, b, c])| {
            [[a, b], [b, c], [c, a]].map(|[i, j]| ([i.min(j), i.max(j)], t))
        })
        .collect();
    sides.sort_unstable();
    (sides.windows(2))
        .filter(|p| p[0].0 == p[1].0)
        .map(|p| (p[0].0, [p[0].1, p[1].1]))
        .collect()
}

/// Connected pieces of the items with `which`, neighbours given: pieces and the items of each in the order in which they are found, from
/// the first item on.
pub fn pieces(beside: &[Vec<u32>], which: &[bool]) -> Vec<Vec<u32>> {
    let mut seen: Vec<bool> = which.iter().map(|w| !w).collect();
    let mut pieces = Vec::new();
    for first in 0..which.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let mut piece = vec![first as u32];
        let mut next = 0;
        while next < piece.len() {
            for other in &beside[piece[next] as usize] {
                if !std::mem::replace(&mut seen[*other as usize], true) {
                    piece.push(*other);
                }
            }
            next += 1;
        }
        pieces.push(piece);
    }
    pieces
}

/// The three sides of every triangle, smaller vertex first, in ascending order.
fn sides(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut all = Vec::with_capacity(3 * triangles.len());
    for &[a, b, c] in triangles {
        for [i, j] in [[a, b], [b, c], [c, a]] {
            all.push([i.min(j), i.max(j)]);
        }
    }
    all.sort_unstable();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_of_two_triangles_has_five_edges_four_of_them_border() {
        let t = [[2, 0, 1], [0, 2, 3]];
        assert_eq!(edges(&t), [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]);
        assert_eq!(boundary_edges(&t), [[0, 1], [0, 3], [1, 2], [2, 3]]);
        assert_eq!(inner_edges(&t), [([0, 2], [0, 1])]);
        assert!(edges(&[]).is_empty() && boundary_edges(&[]).is_empty());
    }
}
