//! Triangle mesh of a level set by naive surface nets (Gibson 1998): one vertex in every cell that
//! the surface passes, one quadrilateral around every lattice edge that it cuts.
//!
//! The vertex is the mean of the cell's cut edges and is then drawn onto the surface by a few
//! Newton steps along the gradient, never farther than half a cell. The mesh is closed where the
//! surface stays inside the box, and always a manifold: a cell through which two sheets pass (its
//! corners inside, or those outside, do not hang together along its edges) would join them in one
//! vertex, so its outside corner nearest to the surface is first moved inside. That only adds to the
//! inside and therefore ends; it bridges gaps thinner than a cell.

use crate::math::Vec3;

/// Largest number of samples.
pub(super) const MAX_SAMPLES: f64 = 5e7;

/// Mesh of `f = 0` within a box, triangles turned toward growing `f`.
pub(super) fn surface_nets(
    f: &dyn Fn(&Vec3) -> f64,
    lo: &Vec3,
    hi: &Vec3,
    cell: f64,
) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let n = [0, 1, 2].map(|d| ((hi[d] - lo[d]) / cell).ceil() as usize + 1);
    let strides = [n[1] * n[2], n[2], 1];
    let at = |i: [usize; 3]| lo + Vec3::new(i[0] as f64, i[1] as f64, i[2] as f64) * cell;
    let mut values = Vec::with_capacity(n[0] * n[1] * n[2]);
    for x in 0..n[0] {
        for y in 0..n[1] {
            for z in 0..n[2] {
                values.push(f(&at([x, y, z])));
            }
        }
    }
    merge_sheets(&mut values, n);
    let mut vertices = Vec::new();
    let mut number = vec![u32::MAX; values.len()];
    for x in 0..n[0] - 1 {
        for y in 0..n[1] - 1 {
            for z in 0..n[2] - 1 {
                let base = x * strides[0] + y * strides[1] + z;
                let corner = |c: usize| {
                    values[base + (c >> 2) * strides[0] + (c >> 1 & 1) * strides[1] + (c & 1)]
                };
                let mut sum = Vec3::zeros();
                let mut cuts = 0;
                for a in 0..8usize {
                    for bit in [1usize, 2, 4] {
                        let b = a | bit;
                        if a & bit != 0 || (corner(a) < 0.0) == (corner(b) < 0.0) {
                            continue;
                        }
                        let t = corner(a) / (corner(a) - corner(b));
                        let place = |c: usize| {
                            Vec3::new((c >> 2) as f64, (c >> 1 & 1) as f64, (c & 1) as f64)
                        };
                        sum += place(a).lerp(&place(b), t);
                        cuts += 1;
                    }
                }
                if cuts > 0 {
                    number[base] = vertices.len() as u32;
                    vertices.push(project(
                        f,
                        at([x, y, z]) + sum * (cell / f64::from(cuts)),
                        cell,
                    ));
                }
            }
        }
    }
    let mut triangles = Vec::new();
    for d in 0..3 {
        let (a, b) = ((d + 1) % 3, (d + 2) % 3);
        let mut i = [0usize; 3];
        for x in 0..n[d] - 1 {
            for y in 1..n[a] - 1 {
                for z in 1..n[b] - 1 {
                    (i[d], i[a], i[b]) = (x, y, z);
                    let base = i[0] * strides[0] + i[1] * strides[1] + i[2];
                    let below = values[base] < 0.0;
                    if below == (values[base + strides[d]] < 0.0) {
                        continue;
                    }
                    let (sa, sb) = (strides[a], strides[b]);
                    let q = [base - sa - sb, base - sb, base, base - sa].map(|c| number[c]);
                    // counter-clockwise about +d when the inside lies below
                    let q = if below { q } else { [q[3], q[2], q[1], q[0]] };
                    let p = q.map(|v| vertices[v as usize]);
                    // the shorter diagonal
                    if (p[0] - p[2]).norm_squared() <= (p[1] - p[3]).norm_squared() {
                        triangles.push([q[0], q[1], q[2]]);
                        triangles.push([q[0], q[2], q[3]]);
                    } else {
                        triangles.push([q[0], q[1], q[3]]);
                        triangles.push([q[1], q[2], q[3]]);
                    }
                }
            }
        }
    }
    (vertices, triangles)
}

/// Whether the corners inside and the corners outside of a cell each hang together.
fn single_sheet(mask: u8) -> bool {
    let connected = |set: u8| {
        let mut reached = set & set.wrapping_neg();
        loop {
            let mut next = reached;
            for c in (0..8).filter(|c| reached >> c & 1 == 1) {
                next |= (1 << (c ^ 1) | 1 << (c ^ 2) | 1 << (c ^ 4)) & set;
            }
            if next == reached {
                return reached == set;
            }
            reached = next;
        }
    };
    connected(mask) && connected(!mask)
}

fn merge_sheets(values: &mut [f64], n: [usize; 3]) {
    let good: Vec<bool> = (0..=255).map(single_sheet).collect();
    let strides = [n[1] * n[2], n[2], 1];
    let offsets: [usize; 8] =
        std::array::from_fn(|c| (c >> 2) * strides[0] + (c >> 1 & 1) * strides[1] + (c & 1));
    let mut again = true;
    while again {
        again = false;
        for x in 0..n[0] - 1 {
            for y in 0..n[1] - 1 {
                for z in 0..n[2] - 1 {
                    let base = x * strides[0] + y * strides[1] + z;
                    let mask = (0..8).fold(0, |m, c| {
                        m | usize::from(values[base + offsets[c]] < 0.0) << c
                    });
                    if good[mask] {
                        continue;
                    }
                    let outside = offsets
                        .iter()
                        .map(|o| base + o)
                        .filter(|&i| values[i] >= 0.0);
                    if let Some(i) = outside.min_by(|&i, &j| values[i].total_cmp(&values[j])) {
                        values[i] = -values[i].max(1e-12);
                        again = true;
                    }
                }
            }
        }
    }
}

fn project(f: &dyn Fn(&Vec3) -> f64, start: Vec3, cell: f64) -> Vec3 {
    let mut p = start;
    let e = 1e-4 * cell;
    for _ in 0..8 {
        let value = f(&p);
        let g = Vec3::from_fn(|d, _| {
            let mut s = Vec3::zeros();
            s[d] = e;
            (f(&(p + s)) - f(&(p - s))) / (2.0 * e)
        });
        let g2 = g.norm_squared();
        if g2.is_nan() || g2 <= 1e-12 || value.abs() < 1e-10 * cell {
            break;
        }
        let next = p - g * (value / g2);
        let off = next - start;
        if off.norm() > 0.5 * cell {
            return start + off * (0.5 * cell / off.norm());
        }
        p = next;
    }
    p
}
