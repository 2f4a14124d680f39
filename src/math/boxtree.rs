//! Tree of boxes over points, triangles or whatever has a centre.
//!
//! The tree is split at the median along the longest side of the centres' box, ties by number, so
//! that it depends on the centres alone. Boxes are kept apart from the tree: several sets of boxes
//! (places and displacements, say) can be fitted to one tree.

use super::Vec3;

/// Items in a leaf.
const LEAF: usize = 4;

/// Box between two corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box of nothing: joining it changes nothing.
    pub const EMPTY: Self = Self {
        min: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The box of some points.
    pub fn of(points: &[Vec3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| Self {
            min: b.min.inf(p),
            max: b.max.sup(p),
        })
    }

    /// The box of both.
    #[must_use]
    pub fn join(&self, other: &Self) -> Self {
        Self {
            min: self.min.inf(&other.min),
            max: self.max.sup(&other.max),
        }
    }

    /// Whether they share a point.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Items `order[from..to]`.
    from: u32,
    to: u32,
    /// Second child; the first one follows the node. 0 in a leaf.
    second: u32,
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl BoxTree {
    /// A tree over items with these centres.
    pub fn new(centres: &[Vec3]) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * centres.len() / LEAF + 2),
            order: (0..centres.len() as u32).collect(),
        };
        if !centres.is_empty() {
            tree.split(centres, 0, centres.len());
        }
        tree
    }

    fn split(&mut self, centres: &[Vec3], from: usize, to: usize) {
        let node = self.nodes.len();
        self.nodes.push(Node {
            from: from as u32,
            to: to as u32,
            second: 0,
        });
        if to - from <= LEAF {
            return;
        }
        let items = &mut self.order[from..to];
        let side = items.iter().fold(Aabb::EMPTY, |b, &i| {
            b.join(&Aabb::of(&[centres[i as usize]]))
        });
        let axis = (side.max - side.min).imax();
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |&a, &b| {
            centres[a as usize][axis]
                .total_cmp(&centres[b as usize][axis])
                .then(a.cmp(&b))
        });
        self.split(centres, from, from + half);
        self.nodes[node].second = self.nodes.len() as u32;
        self.split(centres, from + half, to);
    }

    /// Box of every node, from the boxes of the items.
    pub fn fit(&self, item: impl Fn(u32) -> Aabb) -> Vec<Aabb> {
        let mut boxes = vec![Aabb::EMPTY; self.nodes.len()];
        for (n, node) in self.nodes.iter().enumerate().rev() {
            boxes[n] = if node.second == 0 {
                self.items(node)
                    .iter()
                    .fold(Aabb::EMPTY, |b, &i| b.join(&item(i)))
            } else {
                boxes[n + 1].join(&boxes[node.second as usize])
            };
        }
        boxes
    }

    fn items(&self, node: &Node) -> &[u32] {
        &self.order[node.from as usize..node.to as usize]
    }

    /// Calls `visit` for every item of every leaf whose box overlaps `query`.
    pub fn query(&self, boxes: &[Aabb], query: &Aabb, mut visit: impl FnMut(u32)) {
        let mut stack = [0_u32; 64];
        let mut top = usize::from(!self.nodes.is_empty());
        while top > 0 {
            top -= 1;
            let n = stack[top] as usize;
            if !boxes[n].overlaps(query) {
                continue;
            }
            let node = &self.nodes[n];
            if node.second == 0 {
                self.items(node).iter().for_each(|&i| visit(i));
            } else {
                stack[top] = node.second;
                stack[top + 1] = n as u32 + 1;
                top += 2;
            }
        }
    }

    /// Calls `visit` once for every pair of items whose leaves are reached through nodes that
    /// `meet(node, node)` holds for.
    pub fn pairs(&self, meet: impl Fn(usize, usize) -> bool, mut visit: impl FnMut(u32, u32)) {
        let mut stack: Vec<(u32, u32)> = Vec::new();
        if !self.nodes.is_empty() {
            stack.push((0, 0));
        }
        while let Some((p, q)) = stack.pop() {
            let (a, b) = (&self.nodes[p as usize], &self.nodes[q as usize]);
            if !meet(p as usize, q as usize) {
                continue;
            }
            match (a.second, b.second) {
                (0, 0) => {
                    for (k, &i) in self.items(a).iter().enumerate() {
                        let skip = if p == q { k + 1 } else { 0 };
                        self.items(b)[skip..].iter().for_each(|&j| visit(i, j));
                    }
                }
                (second, _) if p == q => {
                    stack.extend([(p + 1, p + 1), (second, second), (p + 1, second)]);
                }
                (second, other) => {
                    // The larger of the two is opened.
                    if other == 0 || (second != 0 && a.to - a.from >= b.to - b.from) {
                        stack.extend([(p + 1, q), (second, q)]);
                    } else {
                        stack.extend([(p, q + 1), (p, other)]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_is_visited_once_and_queries_find_what_overlaps() {
        let points: Vec<Vec3> = (0..101)
            .map(|i| {
                let t = f64::from(i);
                Vec3::new((t * 1.7).sin(), (t * 0.9).cos(), (t * 0.31).sin())
            })
            .collect();
        let tree = BoxTree::new(&points);
        let mut seen = std::collections::BTreeSet::new();
        tree.pairs(
            |_, _| true,
            |i, j| assert!(seen.insert((i.min(j), i.max(j)))),
        );
        assert_eq!(seen.len(), 101 * 100 / 2);
        let boxes = tree.fit(|i| Aabb::of(&[points[i as usize]]));
        let query = Aabb {
            min: Vec3::new(-0.2, -0.5, -0.9),
            max: Vec3::new(0.6, 0.4, 0.3),
        };
        let mut found = Vec::new();
        tree.query(&boxes, &query, |i| found.push(i));
        for (i, p) in points.iter().enumerate() {
            if Aabb::of(&[*p]).overlaps(&query) {
                assert!(found.contains(&(i as u32)));
            }
        }
        assert!(found.len() < 101);
    }
}
