//! Depth-buffered triangles.
//!
//! A triangle's screen vertices carry a nearness `q` that is affine on the screen (`1 / w` in a
//! perspective view, minus the depth in a parallel one); the pixel keeps the largest.

/// Nearness and triangle of each pixel, row by row.
pub(crate) struct Buffer {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) nearness: Vec<f32>,
    pub(crate) triangle: Vec<u32>,
}

/// No triangle at this pixel.
pub(crate) const NONE: u32 = u32::MAX;

impl Buffer {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            nearness: vec![f32::NEG_INFINITY; width * height],
            triangle: vec![NONE; width * height],
        }
    }

    pub(crate) fn clear(&mut self) {
        self.nearness.fill(f32::NEG_INFINITY);
        self.triangle.fill(NONE);
    }

    /// Draws a triangle `[x, y, q]` into columns `columns[0]..columns[1]`, both orientations.
    pub(crate) fn triangle(&mut self, p: [[f64; 3]; 3], id: u32, columns: [usize; 2]) {
        let [a, b, c] = p;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if !area.is_finite() || area.abs() < 1e-12 {
            return;
        }
        let lo = |k: usize| a[k].min(b[k]).min(c[k]);
        let hi = |k: usize| a[k].max(b[k]).max(c[k]);
        let clip = |v: f64, max: usize| v.clamp(0.0, max as f64) as usize;
        let x0 = clip((lo(0) - 0.5).ceil(), self.width).max(columns[0]);
        let x1 = clip((hi(0) - 0.5).floor() + 1.0, self.width).min(columns[1]);
        let y0 = clip((lo(1) - 0.5).ceil(), self.height);
        let y1 = clip((hi(1) - 0.5).floor() + 1.0, self.height);
        let inv = 1.0 / area;
        for y in y0..y1 {
            let py = y as f64 + 0.5;
            for x in x0..x1 {
                let px = x as f64 + 0.5;
                let wa = ((b[0] - px) * (c[1] - py) - (b[1] - py) * (c[0] - px)) * inv;
                let wb = ((c[0] - px) * (a[1] - py) - (c[1] - py) * (a[0] - px)) * inv;
                let wc = 1.0 - wa - wb;
                if wa < 0.0 || wb < 0.0 || wc < 0.0 {
                    continue;
                }
                let q = (wa * a[2] + wb * b[2] + wc * c[2]) as f32;
                let i = y * self.width + x;
                if q > self.nearness[i] {
                    self.nearness[i] = q;
                    self.triangle[i] = id;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_triangle_wins_whatever_the_order() {
        let near = [[0.0, 0.0, 2.0], [10.0, 0.0, 2.0], [0.0, 10.0, 2.0]];
        let far = [[0.0, 0.0, 1.0], [0.0, 10.0, 1.0], [10.0, 0.0, 1.0]];
        for order in [[0, 1], [1, 0]] {
            let mut b = Buffer::new(8, 8);
            for k in order {
                b.triangle([near, far][k], k as u32, [0, 8]);
            }
            assert_eq!(b.triangle[0], 0);
            assert_eq!(b.nearness[0], 2.0);
            assert_eq!(b.triangle[63], NONE);
        }
    }

    #[test]
    fn two_triangles_of_a_square_cover_each_pixel_and_none_outside() {
        let mut b = Buffer::new(16, 16);
        let q = [[2.0, 3.0], [13.0, 3.0], [13.0, 12.0], [2.0, 12.0]].map(|[x, y]| [x, y, 1.0]);
        b.triangle([q[0], q[1], q[2]], 0, [0, 16]);
        b.triangle([q[0], q[2], q[3]], 1, [0, 16]);
        let count = b.triangle.iter().filter(|&&t| t != NONE).count();
        assert_eq!(count, 11 * 9);
    }
}
