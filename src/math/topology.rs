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
        assert!(edges(&[]).is_empty() && boundary_edges(&[]).is_empty());
    }
}
