//! One triangle: nearest point, distance, crossing with a segment.
//!
//! Nearest point: Ericson, Real-Time Collision Detection, section 5.1.5. Segment and triangle:
//! signed volumes (ibid. 5.3.4), borders counted as hits.

use crate::math::Vec3;

/// A triangle as the queries want it.
#[derive(Clone, Debug)]
pub(super) struct Tri {
    pub(super) a: Vec3,
    pub(super) ab: Vec3,
    pub(super) ac: Vec3,
    /// Number in the mesh.
    pub(super) id: u32,
    /// No wider than 1e-10 of its length: its edges stand for it, since the signs by which the
    /// nearest feature is found would be those of rounding errors.
    flat: bool,
}

impl Tri {
    pub(super) fn new(id: u32, [a, b, c]: [Vec3; 3]) -> Self {
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let longest = ab
            .norm_squared()
            .max(ac.norm_squared())
            .max(bc.norm_squared());
        // written so that lengths whose squares vanish count as flat too
        let wide = ab.cross(&ac).norm() > 1e-10 * longest;
        Self {
            a,
            ab,
            ac,
            id,
            flat: !wide,
        }
    }

    /// Barycentric weights of `b` and `c` at the point of the triangle nearest to `p`.
    #[inline]
    pub(super) fn closest(&self, p: &Vec3) -> (f64, f64) {
        let ap = p - self.a;
        if self.flat {
            return self.closest_edge(&ap);
        }
        let (ab, ac) = (&self.ab, &self.ac);
        let d1 = ab.dot(&ap);
        let d2 = ac.dot(&ap);
        if d1 <= 0.0 && d2 <= 0.0 {
            return (0.0, 0.0);
        }
        let (bb, bc, cc) = (ab.norm_squared(), ab.dot(ac), ac.norm_squared());
        let (d3, d4) = (d1 - bb, d2 - bc);
        if d3 >= 0.0 && d4 <= d3 {
            return (1.0, 0.0);
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (d1 / (d1 - d3), 0.0);
        }
        let (d5, d6) = (d1 - bc, d2 - cc);
        if d6 >= 0.0 && d5 <= d6 {
            return (0.0, 1.0);
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (0.0, d2 / (d2 - d6));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
            let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return (1.0 - w, w);
        }
        let sum = va + vb + vc;
        if sum > 0.0 && va >= 0.0 && vb >= 0.0 && vc >= 0.0 {
            return (vb / sum, vc / sum);
        }
        self.closest_edge(&ap)
    }

    /// The nearest point among the three edges, for triangles without area.
    #[cold]
    fn closest_edge(&self, ap: &Vec3) -> (f64, f64) {
        let along = |o: Vec3, e: Vec3| {
            let l = e.norm_squared();
            if l > 0.0 {
                ((ap - o).dot(&e) / l).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        let s = along(Vec3::zeros(), self.ab);
        let t = along(Vec3::zeros(), self.ac);
        let u = along(self.ab, self.ac - self.ab);
        let candidates = [(s, 0.0), (0.0, t), (1.0 - u, u)];
        let mut best = (f64::INFINITY, (0.0, 0.0));
        for (v, w) in candidates {
            let d2 = (ap - self.ab * v - self.ac * w).norm_squared();
            if d2 < best.0 {
                best = (d2, (v, w));
            }
        }
        best.1
    }

    /// Squared distance to `p`.
    #[inline]
    pub(super) fn distance2(&self, p: &Vec3) -> f64 {
        let (v, w) = self.closest(p);
        (p - self.a - self.ab * v - self.ac * w).norm_squared()
    }

    /// Whether the closed segment meets the closed triangle. Segments in its plane do not count.
    pub(super) fn crosses(&self, p: &Vec3, q: &Vec3) -> bool {
        let (b, c) = (self.a + self.ab, self.a + self.ac);
        let n = self.ab.cross(&self.ac);
        let (sp, sq) = (n.dot(&(p - self.a)), n.dot(&(q - self.a)));
        if (sp > 0.0 && sq > 0.0) || (sp < 0.0 && sq < 0.0) || (sp == 0.0 && sq == 0.0) {
            return false;
        }
        let d = q - p;
        let volume = |x: &Vec3, y: &Vec3| d.dot(&(x - p).cross(&(y - p)));
        let (u, v, w) = (volume(&self.a, &b), volume(&b, &c), volume(&c, &self.a));
        (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_without_area_have_distances() {
        // every way in which corners and edges can coincide
        let (a, b) = (Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.4, -0.1, 0.7));
        let m = a.lerp(&b, 0.25);
        for t in [
            [a, a, a],
            [a, a, b],
            [a, b, a],
            [b, a, a],
            [a, b, m],
            [m, a, b],
            [b, m, a],
        ] {
            let tri = Tri::new(0, t);
            let last = if t == [a, a, a] { a } else { b };
            for i in 0..1000 {
                let p = Vec3::from_fn(|d, _| f64::from(i / 10i32.pow(d as u32) % 10) / 5.0 - 0.9);
                let e = last - a;
                let s = if e.norm() > 0.0 {
                    ((p - a).dot(&e) / e.norm_squared()).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let want = (p - a - e * s).norm();
                let got = tri.distance2(&p).sqrt();
                assert!((got - want).abs() < 1e-7, "{t:?} {p:?}: {got} {want}");
            }
        }
    }
}
