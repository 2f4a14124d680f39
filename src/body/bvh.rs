//! Bounding boxes over triangles: nearest triangle, triangles within a distance, segment crossings.
//!
//! The tree's shape comes from one set of positions (median of the centres along the longest axis)
//! and is refitted to others. Queries return the same bits whatever the shape: a box is left out only if it
//! is farther than the best found by more than a slack above rounding, so that the answer is the
//! minimum over all triangles of a number computed from that triangle alone.
//!
//! Nearest point of a triangle: Ericson, Real-Time Collision Detection, section 5.1.5. Segment and
//! triangle: signed volumes (ibid. 5.3.4), borders counted as hits.

use crate::math::Vec3;

const LEAF: usize = 4;

/// A triangle as the queries want it.
#[derive(Clone, Debug)]
pub(super) struct Tri {
    pub(super) a: Vec3,
    ab: Vec3,
    ac: Vec3,
    /// Sphere around it.
    center: Vec3,
    radius: f64,
    /// Unit normal; zero without area.
    normal: Vec3,
    /// Number in the mesh.
    pub(super) id: u32,
}

impl Tri {
    fn new(id: u32, [a, b, c]: [Vec3; 3]) -> Self {
        let center = (a + b + c) / 3.0;
        let r2 = [a, b, c]
            .iter()
            .map(|p| (p - center).norm_squared())
            .fold(0.0, f64::max);
        Self {
            a,
            ab: b - a,
            ac: c - a,
            center,
            radius: r2.sqrt(),
            normal: (b - a)
                .cross(&(c - a))
                .try_normalize(f64::MIN_POSITIVE)
                .unwrap_or_default(),
            id,
        }
    }

    /// Barycentric weights of `b` and `c` at the point of the triangle nearest to `p`.
    #[inline]
    pub(super) fn closest(&self, p: &Vec3) -> (f64, f64) {
        let ap = p - self.a;
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

    /// Whether the disc around it lies farther from `p` than `reach`.
    #[inline]
    fn beyond(&self, p: &Vec3, reach: f64) -> bool {
        disc_beyond(&(p - self.center), &self.normal, self.radius, reach)
    }

    /// Whether the closed segment meets the closed triangle. Segments in its plane do not count.
    fn crosses(&self, p: &Vec3, q: &Vec3) -> bool {
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

/// A triangle near a point, with what rejects it quickly.
pub(super) struct Near<'a> {
    /// Distance to the point.
    pub(super) far: f64,
    /// Disc around it.
    center: Vec3,
    radius: f64,
    normal: Vec3,
    pub(super) tri: &'a Tri,
}

impl Near<'_> {
    /// Whether the disc around it lies farther from `p` than `reach`.
    #[inline]
    pub(super) fn beyond(&self, p: &Vec3, reach: f64) -> bool {
        disc_beyond(&(p - self.center), &self.normal, self.radius, reach)
    }
}

/// Whether a disc lies farther than `reach` from the point at `e` from its centre: with height `z`
/// and `rho` off the axis its distance is `sqrt(z^2 + max(0, rho - radius)^2)`.
#[inline]
fn disc_beyond(e: &Vec3, normal: &Vec3, radius: f64, reach: f64) -> bool {
    let e2 = e.norm_squared();
    let z = normal.dot(e);
    let room = reach * reach - z * z;
    // the sphere first: it needs no root
    if room < 0.0 || e2 > (reach + radius) * (reach + radius) {
        return true;
    }
    let rho = radius + room.sqrt();
    e2 - z * z > rho * rho
}

#[derive(Clone, Debug)]
struct Node {
    lo: Vec3,
    hi: Vec3,
    /// First triangle of a leaf, else the right child (the left one follows its parent).
    link: u32,
    /// Triangles of a leaf; 0 for an inner node.
    count: u32,
}

impl Node {
    #[inline]
    fn distance2(&self, p: &Vec3) -> f64 {
        let mut d2 = 0.0;
        for d in 0..3 {
            let e = (self.lo[d] - p[d]).max(p[d] - self.hi[d]).max(0.0);
            d2 += e * e;
        }
        d2
    }
}

/// Tree over the triangles of one mesh.
#[derive(Clone, Debug)]
pub(super) struct Bvh {
    nodes: Vec<Node>,
    tris: Vec<Tri>,
    slack: f64,
}

impl Bvh {
    /// Tree over at least one triangle.
    pub(super) fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let mut tris = make(positions, triangles, 0..triangles.len() as u32);
        let mut nodes = Vec::with_capacity(tris.len());
        // (start, end, parent to be told of its right child)
        let mut work = vec![(0usize, tris.len(), usize::MAX)];
        while let Some((start, end, parent)) = work.pop() {
            let here = nodes.len();
            if parent != usize::MAX {
                let parent: &mut Node = &mut nodes[parent];
                parent.link = here as u32;
            }
            let count = end - start;
            let leaf = count <= LEAF;
            nodes.push(Node {
                lo: Vec3::zeros(),
                hi: Vec3::zeros(),
                link: start as u32,
                count: if leaf { count as u32 } else { 0 },
            });
            if leaf {
                continue;
            }
            let part = &mut tris[start..end];
            let mut lo = part[0].center;
            let mut hi = lo;
            for t in part.iter() {
                lo = lo.inf(&t.center);
                hi = hi.sup(&t.center);
            }
            let axis = (hi - lo).imax();
            part.select_nth_unstable_by(count / 2, |s, t| {
                s.center[axis]
                    .total_cmp(&t.center[axis])
                    .then(s.id.cmp(&t.id))
            });
            // the left child is popped next and so follows its parent
            work.push((start + count / 2, end, here));
            work.push((start, start + count / 2, usize::MAX));
        }
        let mut tree = Self {
            nodes,
            tris,
            slack: 0.0,
        };
        tree.fit(positions);
        tree
    }

    /// The same tree on other positions of the same mesh.
    pub(super) fn refitted(&self, positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let mut tree = Self {
            nodes: self.nodes.clone(),
            tris: make(positions, triangles, self.tris.iter().map(|t| t.id)),
            slack: 0.0,
        };
        tree.fit(positions);
        tree
    }

    fn fit(&mut self, positions: &[Vec3]) {
        self.slack = 1e-12 * positions.iter().map(Vec3::amax).fold(0.0, f64::max);
        for n in (0..self.nodes.len()).rev() {
            let node = &self.nodes[n];
            let (lo, hi) = if node.count > 0 {
                let start = node.link as usize;
                let part = &self.tris[start..start + node.count as usize];
                let mut lo = part[0].a;
                let mut hi = lo;
                for t in part {
                    let (b, c) = (t.a + t.ab, t.a + t.ac);
                    lo = lo.inf(&t.a).inf(&b).inf(&c);
                    hi = hi.sup(&t.a).sup(&b).sup(&c);
                }
                (lo, hi)
            } else {
                let (l, r) = (&self.nodes[n + 1], &self.nodes[node.link as usize]);
                (l.lo.inf(&r.lo), l.hi.sup(&r.hi))
            };
            self.nodes[n].lo = lo;
            self.nodes[n].hi = hi;
        }
    }

    /// Box of the whole mesh.
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        (self.nodes[0].lo, self.nodes[0].hi)
    }

    /// Distances closer than this are not told apart by the search.
    pub(super) fn slack(&self, p: &Vec3) -> f64 {
        self.slack + 1e-12 * p.amax()
    }

    /// Smallest distance to `p`. `hint` is any place in the tree's list of triangles, best that of a
    /// triangle near `p`; it becomes the place of the nearest one. The result does not depend on it.
    pub(super) fn distance(&self, p: &Vec3, hint: &mut usize) -> f64 {
        let slack = self.slack(p);
        let mut best = self.tris[*hint].distance2(p);
        let mut reach = best.sqrt() + slack;
        self.visit(p, reach * reach, |i, t| {
            if !t.beyond(p, reach) {
                let d2 = t.distance2(p);
                if d2 < best {
                    best = d2;
                    reach = d2.sqrt() + slack;
                    *hint = i;
                }
            }
            reach * reach
        });
        best.sqrt()
    }

    /// Nearest triangle (the lowest number among equals) and its barycentric weights.
    pub(super) fn nearest(&self, p: &Vec3) -> (u32, [f64; 3]) {
        let slack = self.slack(p);
        let mut best = (f64::INFINITY, u32::MAX, (0.0, 0.0));
        self.visit(p, f64::INFINITY, |_, t| {
            let (v, w) = t.closest(p);
            let d2 = (p - t.a - t.ab * v - t.ac * w).norm_squared();
            if d2 < best.0 || (d2 == best.0 && t.id < best.1) {
                best = (d2, t.id, (v, w));
            }
            let reach = best.0.sqrt() + slack;
            reach * reach
        });
        let (v, w) = best.2;
        (best.1, [1.0 - v - w, v, w])
    }

    /// Calls `f` for triangles in boxes not farther than the squared reach, which `f` returns anew.
    fn visit<'a>(&'a self, p: &Vec3, mut reach2: f64, mut f: impl FnMut(usize, &'a Tri) -> f64) {
        // the median split keeps the depth below 33 for any count that fits u32
        let mut stack = [(0u32, 0.0f64); 64];
        let mut top = 1;
        stack[0] = (0, self.nodes[0].distance2(p));
        while top > 0 {
            top -= 1;
            let (n, d2) = stack[top];
            if d2 > reach2 {
                continue;
            }
            let node = &self.nodes[n as usize];
            if node.count > 0 {
                let start = node.link as usize;
                let part = &self.tris[start..start + node.count as usize];
                for (i, t) in part.iter().enumerate() {
                    reach2 = f(start + i, t);
                }
                continue;
            }
            let left = (n + 1, self.nodes[n as usize + 1].distance2(p));
            let right = (node.link, self.nodes[node.link as usize].distance2(p));
            let (near, far) = if left.1 <= right.1 {
                (left, right)
            } else {
                (right, left)
            };
            stack[top] = far;
            stack[top + 1] = near;
            top += 2;
        }
    }

    /// Collects every triangle within `reach` of `p` with its distance to `p`, nearest first. Stops and returns false beyond `limit` triangles.
    pub(super) fn within<'a>(
        &'a self,
        p: &Vec3,
        reach: f64,
        limit: usize,
        out: &mut Vec<Near<'a>>,
    ) -> bool {
        out.clear();
        let reach = reach + self.slack(p);
        self.visit(p, reach * reach, |_, tri| {
            if out.len() > limit {
                return -1.0;
            }
            if !tri.beyond(p, reach) {
                let far = tri.distance2(p).sqrt();
                if far <= reach {
                    out.push(Near {
                        far,
                        center: tri.center,
                        radius: tri.radius,
                        normal: tri.normal,
                        tri,
                    });
                }
            }
            reach * reach
        });
        if out.len() > limit {
            return false;
        }
        out.sort_unstable_by(|s, t| s.far.total_cmp(&t.far).then(s.tri.id.cmp(&t.tri.id)));
        true
    }

    /// Whether the segment meets a triangle.
    pub(super) fn segment_hits(&self, p: &Vec3, q: &Vec3) -> bool {
        let (mid, half) = ((p + q) * 0.5, (q - p) * 0.5);
        let pad = self.slack(p).max(self.slack(q));
        let mut stack = vec![0u32];
        while let Some(n) = stack.pop() {
            let node = &self.nodes[n as usize];
            let (c, e) = ((node.lo + node.hi) * 0.5, (node.hi - node.lo) * 0.5);
            let m = mid - c;
            let apart = (0..3).any(|d| m[d].abs() > e[d] + half[d].abs() + pad)
                || (0..3).any(|d| {
                    // separating axis: segment direction cross box axis
                    let (i, j) = ((d + 1) % 3, (d + 2) % 3);
                    (m[i] * half[j] - m[j] * half[i]).abs()
                        > (e[i] + pad) * half[j].abs() + (e[j] + pad) * half[i].abs()
                });
            if apart {
                continue;
            }
            if node.count > 0 {
                let start = node.link as usize;
                let part = &self.tris[start..start + node.count as usize];
                if part.iter().any(|t| t.crosses(p, q)) {
                    return true;
                }
            } else {
                stack.push(node.link);
                stack.push(n + 1);
            }
        }
        false
    }
}

fn make(positions: &[Vec3], triangles: &[[u32; 3]], ids: impl Iterator<Item = u32>) -> Vec<Tri> {
    ids.map(|id| Tri::new(id, triangles[id as usize].map(|v| positions[v as usize])))
        .collect()
}
