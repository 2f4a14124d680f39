//! Counts edges of one mesh that pass through triangles of another.
//!
//! Triangles are put into a uniform grid whose cell is twice their mean extent; an edge is tested
//! (Moller and Trumbore 1997) against the triangles of the cells that its box touches. Touching
//! without passing through (a shared plane) does not count. Cost is linear in edges and triangles
//! while edges are not much longer than a cell.

use crate::math::Vec3;

/// Edges `[a, b]` of `positions` that cross at least one of `triangles` over `corners`.
pub fn crossing_edges(
    positions: &[Vec3],
    edges: &[[u32; 2]],
    corners: &[Vec3],
    triangles: &[[u32; 3]],
) -> Vec<usize> {
    let tris: Vec<[Vec3; 3]> = triangles
        .iter()
        .filter_map(|t| {
            Some([
                *corners.get(t[0] as usize)?,
                *corners.get(t[1] as usize)?,
                *corners.get(t[2] as usize)?,
            ])
        })
        .filter(|t| t.iter().all(finite))
        .collect();
    if tris.is_empty() {
        return Vec::new();
    }
    let mean = tris
        .iter()
        .map(|t| (t[1] - t[0]).amax().max((t[2] - t[0]).amax()))
        .sum::<f64>()
        / tris.len() as f64;
    // a triangle far larger than the mean (a ground square) goes into a list of its own
    let cell = (2.0 * mean).max(1e-6);
    let mut large = Vec::new();
    let mut cells: Vec<([i64; 3], u32)> = Vec::with_capacity(4 * tris.len());
    for (i, t) in tris.iter().enumerate() {
        let lo = key(&t[0].inf(&t[1]).inf(&t[2]), cell);
        let hi = key(&t[0].sup(&t[1]).sup(&t[2]), cell);
        if span(lo, hi) > 512 {
            large.push(i as u32);
            continue;
        }
        each_cell(lo, hi, |c| cells.push((c, i as u32)));
    }
    cells.sort_unstable();
    let mut out = Vec::new();
    for (e, &[a, b]) in edges.iter().enumerate() {
        let (Some(p), Some(q)) = (positions.get(a as usize), positions.get(b as usize)) else {
            continue;
        };
        if !(finite(p) && finite(q)) {
            continue;
        }
        let hit = |i: u32| crosses(p, q, &tris[i as usize]);
        let mut crossed = large.iter().any(|&i| hit(i));
        let (lo, hi) = (key(&p.inf(q), cell), key(&p.sup(q), cell));
        if !crossed && span(lo, hi) > 100_000 {
            crossed = (0..tris.len() as u32).any(hit);
        } else if !crossed {
            each_cell(lo, hi, |c| {
                let start = cells.partition_point(|x| x.0 < c);
                crossed = crossed
                    || cells[start..]
                        .iter()
                        .take_while(|x| x.0 == c)
                        .any(|x| hit(x.1));
            });
        }
        if crossed {
            out.push(e);
        }
    }
    out
}

fn finite(p: &Vec3) -> bool {
    p.iter().all(|c| c.is_finite())
}

fn key(p: &Vec3, cell: f64) -> [i64; 3] {
    [p.x, p.y, p.z].map(|c| (c / cell).floor().clamp(-1e15, 1e15) as i64)
}

fn span(lo: [i64; 3], hi: [i64; 3]) -> u128 {
    (0..3).map(|k| (hi[k] - lo[k] + 1) as u128).product()
}

fn each_cell(lo: [i64; 3], hi: [i64; 3], mut f: impl FnMut([i64; 3])) {
    for x in lo[0]..=hi[0] {
        for y in lo[1]..=hi[1] {
            for z in lo[2]..=hi[2] {
                f([x, y, z]);
            }
        }
    }
}

/// Whether the open segment from `p` to `q` passes through the triangle.
pub fn crosses(p: &Vec3, q: &Vec3, t: &[Vec3; 3]) -> bool {
    let d = q - p;
    let (e1, e2) = (t[1] - t[0], t[2] - t[0]);
    let h = d.cross(&e2);
    let det = e1.dot(&h);
    let scale = d.norm() * e1.norm() * e2.norm();
    if det.abs() <= 1e-14 * scale || scale <= 0.0 {
        return false;
    }
    let s = (p - t[0]) / det;
    let u = s.dot(&h);
    if !(0.0..=1.0).contains(&u) {
        return false;
    }
    let r = s.cross(&e1);
    let v = d.dot(&r);
    let at = e2.dot(&r);
    v >= 0.0 && u + v <= 1.0 && at > 0.0 && at < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sphere(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut x = Vec::new();
        let mut t = Vec::new();
        for i in 0..=n {
            for j in 0..2 * n {
                let (a, b) = (
                    std::f64::consts::PI * f64::from(i) / f64::from(n),
                    std::f64::consts::PI * f64::from(j) / f64::from(n),
                );
                x.push(Vec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin()));
                let k = |i: u32, j: u32| i * 2 * n + j % (2 * n);
                if i < n {
                    t.push([k(i, j), k(i + 1, j), k(i, j + 1)]);
                    t.push([k(i, j + 1), k(i + 1, j), k(i + 1, j + 1)]);
                }
            }
        }
        (x, t)
    }

    #[test]
    fn edges_across_a_sphere_are_found_and_those_beside_it_are_not() {
        let (x, t) = sphere(24);
        let mut points = Vec::new();
        let mut edges = Vec::new();
        let mut expected = Vec::new();
        for i in 0..400_u32 {
            // deterministic directions; radii 0.9 to 1.1 or both outside
            let a = f64::from(i) * 2.399_963;
            let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / 400.0;
            let r = (1.0 - y * y).sqrt();
            let d = Vec3::new(r * a.cos(), y, r * a.sin());
            let through = i % 2 == 0;
            points.push(d * if through { 0.9 } else { 1.01 });
            points.push(d * 1.1);
            edges.push([2 * i, 2 * i + 1]);
            if through {
                expected.push(i as usize);
            }
        }
        assert_eq!(crossing_edges(&points, &edges, &x, &t), expected);
    }

    #[test]
    fn a_large_ground_square_is_found_too() {
        let corners =
            [(-50., -50.), (50., -50.), (50., 50.), (-50., 50.)].map(|(x, z)| Vec3::new(x, 0.0, z));
        let mut triangles = vec![[0, 1, 2], [0, 2, 3]];
        let mut all = corners.to_vec();
        for i in 0..500_u32 {
            let x = Vec3::new(f64::from(i) * 0.01, 5.0, 0.0);
            triangles.push([all.len() as u32, all.len() as u32 + 1, all.len() as u32 + 2]);
            all.extend([x, x + Vec3::x() * 0.01, x + Vec3::y() * 0.01]);
        }
        let points = [Vec3::new(1.0, 0.1, 1.0), Vec3::new(1.0, -0.1, 1.2)];
        assert_eq!(crossing_edges(&points, &[[0, 1]], &all, &triangles), [0]);
    }
}
