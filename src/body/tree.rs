//! Tree over the triangles of a mesh: nearest triangle, moved triangles near a point, segment
//! crossings.
//!
//! Triangles stand in an order in which every 8 that follow each other, every 64, every 512 and so
//! on lie close together (halves along the longest axis, cut at multiples of the powers of 8), so
//! that the tree needs no links: group `g` of a level has the groups `8 g ..= 8 g + 7` of the level
//! below, down to single triangles (level 0). Groups and triangles are rejected eight at a time by
//! the f32 bounds of `bounds`, taken about the mesh's middle; `Probe::reach2` widens what they are
//! compared with beyond all rounding.
//!
//! Queries return the same bits whatever the order of the triangles: a group is left out only if it
//! is farther than the best found, so that the answer is the minimum over all triangles of an f64
//! number computed from that triangle alone.

use super::bounds::{Discs, Prism, Prisms, WIDE, lowest, within};
use super::triangle::Tri;
use crate::math::Vec3;
use crate::math::parallel::Workers;

/// Part of the mesh's size and of the distance from its middle that f32 bounds may be wrong by:
/// centres, normals and the point are rounded to 6e-8, and some ten operations follow.
const ROUNDING: f64 = 4e-6;
/// Part of the mesh's size that a prism may be thick.
const FLAT: f64 = 5e-7;

/// Which triangles have moved: per level of the tree and block of eight groups one bit per group.
#[derive(Debug)]
pub(super) struct Moved {
    levels: Vec<Vec<u8>>,
    count: usize,
}

impl Moved {
    /// Number of moved triangles.
    pub(super) fn count(&self) -> usize {
        self.count
    }
}

/// A point as the bounds want it.
#[derive(Clone, Copy)]
pub(super) struct Probe {
    pub(super) p: Vec3,
    pub(super) local: [f32; 3],
    margin: f64,
}

impl Probe {
    /// What squared bounds are compared with to find everything within a distance.
    #[inline]
    pub(super) fn reach2(&self, distance: f64) -> f32 {
        let r = ((distance + self.margin) * (1.0 + ROUNDING)) as f32;
        // above what squares lose by underflow
        r * r + f32::MIN_POSITIVE
    }
}

/// Tree over the triangles of one mesh.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    tris: Vec<Tri>,
    /// Bounds of the triangles one by one and eight at a time.
    singles: Vec<Prism>,
    prisms: Vec<Prisms>,
    /// Discs of the groups of 8 triangles, of 64 and so on; the last level is one block.
    discs: Vec<Vec<Discs>>,
    lo: Vec3,
    hi: Vec3,
    middle: Vec3,
    size: f64,
}

impl Tree {
    /// Tree over at least one triangle.
    pub(super) fn new(positions: &[Vec3], triangles: &[[u32; 3]], workers: &Workers) -> Self {
        let mut order: Vec<(Vec3, u32)> = triangles
            .iter()
            .zip(0..)
            .map(|(t, id)| {
                let [a, b, c] = t.map(|v| positions[v as usize]);
                ((a + b + c) / 3.0, id)
            })
            .collect();
        arrange(&mut order);
        let tris = order
            .iter()
            .map(|&(_, id)| Tri::new(id, triangles[id as usize].map(|v| positions[v as usize])))
            .collect();
        let mut groups = triangles.len().div_ceil(WIDE);
        let prisms = vec![Prisms::NONE; groups];
        let mut discs = Vec::new();
        loop {
            groups = groups.div_ceil(WIDE);
            discs.push(vec![Discs::NONE; groups]);
            if groups == 1 {
                break;
            }
        }
        let mut tree = Self {
            singles: Vec::new(),
            tris,
            prisms,
            discs,
            lo: Vec3::zeros(),
            hi: Vec3::zeros(),
            middle: Vec3::zeros(),
            size: 0.0,
        };
        tree.measure();
        tree.fit(None, workers);
        tree
    }

    /// Which triangles of the tree's mesh are moved by going from `before` to `after`.
    pub(super) fn moved(&self, triangles: &[[u32; 3]], before: &[Vec3], after: &[Vec3]) -> Moved {
        let mut count = 0;
        let mut levels = vec![vec![0u8; self.prisms.len()]];
        levels.extend(self.discs.iter().map(|l| vec![0; l.len()]));
        for (i, tri) in self.tris.iter().enumerate() {
            let t = triangles[tri.id as usize].map(|v| v as usize);
            if t.iter().any(|&v| before[v] != after[v]) {
                levels[0][i / WIDE] |= 1 << (i % WIDE);
                count += 1;
            }
        }
        for l in 1..levels.len() {
            let (below, here) = levels.split_at_mut(l);
            for (i, _) in below[l - 1].iter().enumerate().filter(|b| *b.1 != 0) {
                here[0][i / WIDE] |= 1 << (i % WIDE);
            }
        }
        Moved { levels, count }
    }

    /// The same tree on other positions of the same mesh, of which only `moved` differ.
    pub(super) fn refitted(
        &self,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        moved: &Moved,
        workers: &Workers,
    ) -> Self {
        let mut tree = self.clone();
        for (i, tri) in tree.tris.iter_mut().enumerate() {
            if moved.levels[0][i / WIDE] >> (i % WIDE) & 1 == 1 {
                let corners = triangles[tri.id as usize].map(|v| positions[v as usize]);
                *tri = Tri::new(tri.id, corners);
            }
        }
        tree.measure();
        // discs stand in a frame about the middle; unless it is kept, all have moved
        let same = tree.middle == self.middle && tree.size.to_bits() == self.size.to_bits();
        tree.fit(Some(moved).filter(|_| same), workers);
        tree
    }

    /// Box and frame.
    fn measure(&mut self) {
        let first = self.tris[0].a;
        let (lo, hi) = self.tris.iter().fold((first, first), |(lo, hi), t| {
            let (b, c) = (t.a + t.ab, t.a + t.ac);
            (lo.inf(&t.a).inf(&b).inf(&c), hi.sup(&t.a).sup(&b).sup(&c))
        });
        (self.lo, self.hi) = (lo, hi);
        self.middle = (lo + hi) * 0.5;
        self.size = (hi - lo).norm();
    }

    /// Bounds the groups anew, all or those with moved triangles.
    fn fit(&mut self, moved: Option<&Moved>, workers: &Workers) {
        let (tris, middle) = (&self.tris, self.middle);
        let bits = |level: usize, block: usize| moved.map_or(u8::MAX, |m| m.levels[level][block]);
        let flat = FLAT * self.size;
        if self.singles.len() != tris.len() {
            self.singles = vec![Prism::default(); tris.len()];
        }
        workers.chunks(&mut self.singles, 512, |number, part| {
            for (i, prism) in part.iter_mut().enumerate() {
                let place = number * 512 + i;
                if bits(0, place / WIDE) >> (place % WIDE) & 1 == 1 {
                    *prism = Prism::new(&tris[place], &middle, flat);
                }
            }
        });
        let singles = &self.singles;
        workers.chunks(&mut self.prisms, 64, |number, part| {
            for (i, prisms) in part.iter_mut().enumerate() {
                let block = number * 64 + i;
                for lane in (0..WIDE).filter(|lane| bits(0, block) >> lane & 1 == 1) {
                    if let Some(prism) = singles.get(block * WIDE + lane) {
                        prisms.set(lane, prism);
                    }
                }
            }
        });
        let mut span = WIDE;
        for (l, blocks) in self.discs.iter_mut().enumerate() {
            let chunk = (512 / span).max(1);
            workers.chunks(blocks, chunk, |number, part| {
                for (i, discs) in part.iter_mut().enumerate() {
                    let block = number * chunk + i;
                    for lane in (0..WIDE).filter(|lane| bits(l + 1, block) >> lane & 1 == 1) {
                        let start = (block * WIDE + lane) * span;
                        if start < tris.len() {
                            let end = tris.len().min(start + span);
                            discs.bound(lane, &tris[start..end], &middle);
                        }
                    }
                }
            });
            span *= WIDE;
        }
    }

    /// Box of the whole mesh.
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        (self.lo, self.hi)
    }

    /// The level at which the mesh is one group.
    pub(super) fn root(&self) -> usize {
        self.discs.len() + 1
    }

    /// Number of groups of a level.
    pub(super) fn count(&self, level: usize) -> usize {
        (self.tris.len() + (1 << (3 * level)) - 1) >> (3 * level)
    }

    /// The groups of which group `group` of `level` (2 or more) consists.
    #[inline]
    pub(super) fn children(&self, level: usize, group: usize) -> &Discs {
        &self.discs[level - 2][group]
    }

    #[inline]
    pub(super) fn probe(&self, p: &Vec3) -> Probe {
        let e = p - self.middle;
        Probe {
            p: *p,
            local: [e.x as f32, e.y as f32, e.z as f32],
            margin: ROUNDING * (self.size + e.norm()),
        }
    }

    /// Bounds of the triangles of a group of eight.
    #[inline]
    pub(super) fn triangles(&self, group: usize) -> &Prisms {
        &self.prisms[group]
    }

    /// Bound of a triangle, by its place in the tree's order.
    #[inline]
    pub(super) fn triangle(&self, place: usize) -> &Prism {
        &self.singles[place]
    }

    /// Squared distance of a triangle, by its place in the tree's order.
    #[inline]
    pub(super) fn distance2(&self, place: usize, p: &Vec3) -> f64 {
        self.tris[place].distance2(p)
    }

    /// Smallest distance to `p`. `hint` is any place in the tree's order, best that of a triangle
    /// near `p`; it becomes the place of the nearest one. The result does not depend on it.
    pub(super) fn distance(&self, p: &Vec3, hint: &mut usize) -> f64 {
        let probe = self.probe(p);
        let mut best = self.distance2(*hint, p);
        self.improve(&probe, self.root(), 0, &mut best, hint);
        best.sqrt()
    }

    /// Lowers a squared distance by what lies in one group.
    #[inline]
    pub(super) fn improve(
        &self,
        probe: &Probe,
        level: usize,
        group: usize,
        best: &mut f64,
        place: &mut usize,
    ) {
        let reach2 = probe.reach2(best.sqrt());
        let lower = |i: usize, tri: &Tri| {
            let d2 = tri.distance2(&probe.p);
            if d2 < *best {
                *best = d2;
                *place = i;
            }
            probe.reach2(best.sqrt())
        };
        if level == 1 {
            self.visit_triangles(probe, group, reach2, lower);
        } else {
            self.visit(probe, (level, group), reach2, lower);
        }
    }

    /// Nearest triangle (the lowest number among equals) and its barycentric weights.
    pub(super) fn nearest(&self, p: &Vec3) -> (u32, [f64; 3]) {
        let probe = self.probe(p);
        let mut best = (f64::INFINITY, self.tris[0].id, (0.0, 0.0));
        self.visit(&probe, (self.root(), 0), f32::INFINITY, |_, t| {
            let (v, w) = t.closest(p);
            let d2 = (p - t.a - t.ab * v - t.ac * w).norm_squared();
            if d2 < best.0 || (d2 == best.0 && t.id < best.1) {
                best = (d2, t.id, (v, w));
            }
            probe.reach2(best.0.sqrt())
        });
        let (v, w) = best.2;
        (best.1, [1.0 - v - w, v, w])
    }

    /// Calls `f` for those of eight triangles whose bounds do not exceed the squared reach, which `f`
    /// returns anew.
    #[inline]
    fn visit_triangles(
        &self,
        probe: &Probe,
        group: usize,
        mut reach2: f32,
        mut f: impl FnMut(usize, &Tri) -> f32,
    ) -> f32 {
        let bounds = self.prisms[group].bounds(&probe.local);
        let mut bits = within(&bounds, reach2);
        // the bounds are nearly the distances: after the lowest one few are left to look at
        let mut lane = lowest(&bounds).trailing_zeros() as usize;
        while bits != 0 {
            bits &= !(1 << lane);
            let place = group * WIDE + lane;
            if !(bounds[lane] > reach2) && place < self.tris.len() {
                reach2 = f(place, &self.tris[place]);
            }
            lane = bits.trailing_zeros() as usize;
        }
        reach2
    }

    /// Calls `f` for triangles of a group whose bounds do not exceed the squared reach, which `f`
    /// returns anew, near ones first.
    #[inline]
    fn visit(
        &self,
        probe: &Probe,
        (level, group): (usize, usize),
        mut reach2: f32,
        mut f: impl FnMut(usize, &Tri) -> f32,
    ) {
        // at most 7 groups wait on each of at most 11 levels
        let mut stack = [(0.0f32, 0u32, 0u32); 96];
        let mut top = 1;
        stack[0] = (0.0, level as u32, group as u32);
        while top > 0 {
            top -= 1;
            let (bound, level, group) = stack[top];
            if bound > reach2 {
                continue;
            }
            if level == 1 {
                reach2 = self.visit_triangles(probe, group as usize, reach2, &mut f);
                continue;
            }
            let discs = self.children(level as usize, group as usize);
            let bounds = discs.bounds(&probe.local);
            let mut bits = within(&bounds, reach2);
            let count = self.count(level as usize - 1) as u32;
            // the nearest on top
            let floor = top;
            while bits != 0 {
                let lane = bits.trailing_zeros();
                bits &= bits - 1;
                let child = (bounds[lane as usize], level - 1, group * WIDE as u32 + lane);
                if child.2 >= count {
                    continue;
                }
                let mut at = top;
                while at > floor && stack[at - 1].0 < child.0 {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = child;
                top += 1;
            }
        }
    }

    /// Whether a moved triangle may lie within `reach` of `p`; never a wrong no.
    pub(super) fn moved_within(&self, p: &Vec3, reach: f64, moved: &Moved) -> bool {
        let probe = self.probe(p);
        let reach2 = probe.reach2(reach);
        let mut stack = [(0u32, 0u32); 96];
        let mut top = 1;
        stack[0] = (self.root() as u32, 0);
        while top > 0 {
            top -= 1;
            let (level, group) = stack[top];
            let flags = u32::from(moved.levels[level as usize - 1][group as usize]);
            if flags == 0 {
                continue;
            }
            if level == 1 {
                let bounds = self.prisms[group as usize].bounds(&probe.local);
                if within(&bounds, reach2) & flags != 0 {
                    return true;
                }
                continue;
            }
            let discs = self.children(level as usize, group as usize);
            let mut bits = within(&discs.bounds(&probe.local), reach2) & flags;
            while bits != 0 {
                let lane = bits.trailing_zeros();
                bits &= bits - 1;
                stack[top] = (level - 1, group * WIDE as u32 + lane);
                top += 1;
            }
        }
        false
    }

    /// Whether the segment meets a triangle.
    pub(super) fn segment_hits(&self, p: &Vec3, q: &Vec3) -> bool {
        let (from, to) = (p - self.middle, q - self.middle);
        let d = to - from;
        let l2 = d.norm_squared();
        let margin = ROUNDING * (self.size + from.norm() + to.norm());
        let mut stack = vec![(self.root(), 0usize)];
        while let Some((level, group)) = stack.pop() {
            if level == 1 {
                let start = group * WIDE;
                let end = self.tris.len().min(start + WIDE);
                if self.tris[start..end].iter().any(|tri| tri.crosses(p, q)) {
                    return true;
                }
                continue;
            }
            let discs = self.children(level, group);
            for lane in 0..WIDE {
                let (c, radius) = discs.ball(lane);
                let t = if l2 > 0.0 {
                    ((c - from).dot(&d) / l2).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let child = group * WIDE + lane;
                if (from + d * t - c).norm() <= radius + margin && child < self.count(level - 1) {
                    stack.push((level - 1, child));
                }
            }
        }
        false
    }
}

/// Puts triangles in the tree's order: halves along the longest axis of their centres, the first
/// half a multiple of the largest power of 8 below the count.
fn arrange(order: &mut [(Vec3, u32)]) {
    let mut work = vec![(0, order.len())];
    while let Some((start, end)) = work.pop() {
        let count = end - start;
        if count <= 2 {
            continue;
        }
        let part = &mut order[start..end];
        let first = part[0].0;
        let (lo, hi) = part
            .iter()
            .fold((first, first), |b, p| (b.0.inf(&p.0), b.1.sup(&p.0)));
        let axis = (hi - lo).imax();
        let mut unit = 1;
        while unit * WIDE < count {
            unit *= WIDE;
        }
        let half = (count / 2).next_multiple_of(unit);
        let half = if half < count { half } else { half - unit };
        if half == 0 {
            continue;
        }
        part.select_nth_unstable_by(half, |s, t| {
            s.0[axis].total_cmp(&t.0[axis]).then(s.1.cmp(&t.1))
        });
        work.push((start, start + half));
        work.push((start + half, end));
    }
}
