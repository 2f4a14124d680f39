//! The way of the yarn through a knitted piece, as one path of nodes.
//!
//! Every stitch that takes up a loop has two contacts with it, left and right, and each contact two
//! nodes (Cirio et al. 2017, section 3.2.2). With loops `w` wide in wale `x`, sides `s = -1, 1`:
//!
//! ```text
//! inner: (x + 0.17 s w, y + 0.1 w)   the new leg crosses the old head
//! outer: (x + 0.36 s w, y - 0.1 w)   the new sinker crosses the old leg
//! ```
//!
//! Knit: the new yarn lies in front at the inner node, behind at the outer one; purl the other way.
//! A course runs, for every stitch from the left: outer and inner node of its left contact, the four
//! nodes in which the stitch above holds its head, inner and outer node of its right contact.
//!
//! * Cast-on: one course below, of heads alone. Bind-off: one course above, of feet alone.
//! * Courses alternate their direction. In a turn the yarn passes two selvedge nodes beyond the last
//!   loop, one at the height of each course: a single one would lie on the axis of the contact.
//! * A yarn-over has no feet. Of a decrease all old loops pass the same four nodes, in the middle of their
//!   wales; of an increase all new loops share the old head, and its inner feet lie on the head.
//! * Tails: a node beyond each end of the yarn.

use super::builder::Place;
use super::piece::{CAST_ON_DEPTH, Piece, SELVEDGE};
use crate::math::Vec2;
use crate::pattern::chart::{Face, Stitch};

/// Places of the four nodes of a foot, from the left [loop widths].
const FOOT: [[f64; 2]; 4] = [[-0.36, -0.1], [-0.17, 0.1], [0.17, 0.1], [0.36, -0.1]];
/// From the outermost node of a course to the selvedge or the tail [loop widths].
const BEYOND: f64 = SELVEDGE - FOOT[3][0];

/// One passage of the path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
    pub node: u32,
    pub place: Place,
    /// Whether the yarn lies in front of the one that it crosses.
    pub front: bool,
}

/// The yarn of a piece before it is cut.
pub(super) struct Path {
    /// Places of the nodes, in the piece's frame [m]: first four for each foot, then single ones.
    pub points: Vec<Vec2>,
    /// Number of nodes in contacts. Nodes `2 k` and `2 k + 1` make contact `k`.
    pub contact_nodes: usize,
    pub passages: Vec<Passage>,
    /// Nodes of finished borders: selvedges, cast-on and bind-off.
    pub border: Vec<u32>,
}

/// Whether a node of a contact is the inner one, where the new leg crosses the old head.
pub(super) fn is_inner(node: u32) -> bool {
    matches!(node % 4, 1 | 2)
}

/// Loops that a stitch pulls through what it takes up; the bind-off is one such loop.
fn feet(stitch: &Stitch) -> usize {
    match stitch {
        Stitch::Into(fan) => fan.loops().iter().flatten().count(),
        other => usize::from(other.takes() > 0),
    }
}

/// Face of foot `k`.
fn face(stitch: &Stitch, k: usize) -> Face {
    match stitch {
        Stitch::Plain(face) | Stitch::Lifted(face) | Stitch::Together(face, _) => *face,
        Stitch::Into(fan) => fan
            .loops()
            .iter()
            .flatten()
            .nth(k)
            .copied()
            .unwrap_or(Face::Knit),
        Stitch::CastOn | Stitch::Over | Stitch::BindOff => Face::Knit,
    }
}

/// Places of foot `k` of `m` in one old head, about the middle of the head [loop widths].
fn foot(k: usize, m: usize) -> [[f64; 2]; 4] {
    if m == 1 {
        return FOOT;
    }
    // the head is widened to 0.92, so that two of them have room beside each other; between two feet the yarn crosses the head, not its legs
    let gap = 0.46 / (0.5 * (m - 1) as f64 + 0.6);
    let middle = (k as f64 - 0.5 * (m - 1) as f64) * gap;
    let outer = |last: bool| {
        if last {
            [0.6 * gap, -0.1]
        } else {
            [0.38 * gap, 0.0]
        }
    };
    let (left, right) = (outer(k == 0), outer(k + 1 == m));
    [
        [middle - left[0], left[1]],
        [middle - 0.22 * gap, 0.1],
        [middle + 0.22 * gap, 0.1],
        [middle + right[0], right[1]],
    ]
}

/// Place in the stack of the new yarn and of the old strand `old` of the loops taken up.
fn passage(stitch: &Stitch, k: usize, node: u32, old: Option<usize>) -> Passage {
    let new_in_front = (face(stitch, k) == Face::Knit) == is_inner(node);
    let count = stitch.takes();
    let (rank, front) = match old {
        None if new_in_front => (count, true),
        None => (0, false),
        Some(old) => {
            // places are listed from the front, ranks grow from the back
            let place = match stitch {
                Stitch::Together(_, stack) => stack
                    .order()
                    .iter()
                    .position(|o| *o as usize == old)
                    .unwrap_or(0),
                _ => 0,
            };
            let rank = count - 1 - place + usize::from(!new_in_front);
            (rank, !new_in_front)
        }
    };
    Passage {
        node,
        place: Place {
            rank: rank as u8,
            group: u8::from(old.is_none()),
        },
        front,
    }
}

/// Nodes that a piece will have.
pub(super) fn node_count(piece: &Piece) -> usize {
    let feet: usize = piece.rows.iter().flatten().map(feet).sum();
    4 * feet + 2 * piece.rows.len() + 2
}

impl Path {
    /// The path through a piece of loops `w` wide and `h` high [m]; its frame begins in the middle of the
    /// first wale of row 0.
    pub(super) fn new(piece: &Piece, w: f64, h: f64) -> Self {
        let mut path = Self {
            points: Vec::with_capacity(node_count(piece)),
            contact_nodes: 0,
            passages: Vec::new(),
            border: Vec::new(),
        };
        // first node of each row
        let mut bases = Vec::with_capacity(piece.rows.len());
        let mut below = piece.cast_on;
        for (r, row) in piece.rows.iter().enumerate() {
            bases.push(path.points.len() as u32);
            path.place_row(piece, row, below, w, r as f64 * h);
            below = row.iter().map(Stitch::makes).sum();
        }
        path.contact_nodes = path.points.len();
        path.border_courses(piece, &bases);
        let height = |course: usize| match course {
            0 => -CAST_ON_DEPTH * h,
            row => (row - 1) as f64 * h,
        };
        // course 0 is the cast-on, course r + 1 is row r
        let beyond = |path: &mut Self, near: u32, right: bool, y: f64| {
            let x = path.points[near as usize].x;
            let x = if right {
                x + BEYOND * w
            } else {
                x - BEYOND * w
            };
            path.single(Vec2::new(x, y))
        };
        let mut before: Option<u32> = None;
        for course in 0..=piece.rows.len() {
            // the cast-on runs to the right
            let to_right = course % 2 == 0;
            let mut list = course_passages(piece, &bases, course);
            if !to_right {
                list.reverse();
            }
            let (Some(first), Some(last)) = (list.first(), list.last()) else {
                continue;
            };
            let (first, last) = (first.node, last.node);
            let node = match before {
                None => {
                    let y = path.points[first as usize].y;
                    beyond(&mut path, first, !to_right, y)
                }
                Some(before) => {
                    let node = beyond(&mut path, before, !to_right, height(course - 1));
                    path.border.push(node);
                    path.passages.push(single(node));
                    let node = beyond(&mut path, first, !to_right, height(course));
                    path.border.push(node);
                    node
                }
            };
            path.passages.push(single(node));
            path.passages.extend(list);
            before = Some(last);
        }
        if let Some(last) = before {
            let y = path.points[last as usize].y;
            let node = beyond(&mut path, last, piece.rows.len().is_multiple_of(2), y);
            path.passages.push(single(node));
        }
        path
    }

    fn single(&mut self, point: Vec2) -> u32 {
        self.points.push(point);
        self.points.len() as u32 - 1
    }

    /// Nodes of a row's feet in the heads of the row below, which has `below` loops.
    fn place_row(&mut self, piece: &Piece, row: &[Stitch], below: usize, w: f64, y: f64) {
        let mut taken = 0;
        for stitch in row {
            let takes = stitch.takes();
            let sum: f64 = (taken..taken + takes).map(|i| piece.wale(i, below)).sum();
            let middle = sum / takes.max(1) as f64;
            taken += takes;
            let count = feet(stitch);
            for k in 0..count {
                for [dx, dy] in foot(k, count) {
                    self.points.push(Vec2::new((middle + dx) * w, y + dy * w));
                }
            }
        }
    }

    /// Outer nodes under the first row, inner nodes of the last.
    fn border_courses(&mut self, piece: &Piece, bases: &[u32]) {
        let end = |r: usize| {
            bases
                .get(r + 1)
                .copied()
                .unwrap_or(self.contact_nodes as u32)
        };
        let last = piece.rows.len() - 1;
        let bottom = bases[0]..end(0);
        let top = bases[last]..end(last);
        self.border.extend(bottom.filter(|n| !is_inner(*n)));
        self.border.extend(top.filter(|n| is_inner(*n)));
    }
}

fn single(node: u32) -> Passage {
    Passage {
        node,
        place: Place::default(),
        front: false,
    }
}

/// Passages of a course from the left: 0 is the cast-on, `r + 1` is row `r`.
fn course_passages(piece: &Piece, bases: &[u32], course: usize) -> Vec<Passage> {
    let mut heads = Heads {
        row: piece.rows.get(course).map_or(&[], Vec::as_slice),
        at: 0,
        used: 0,
        node: bases.get(course).copied().unwrap_or(0),
    };
    let mut out = Vec::new();
    let Some(r) = course.checked_sub(1) else {
        for _ in 0..piece.cast_on {
            heads.next(&mut out);
        }
        return out;
    };
    let mut node = bases[r];
    for stitch in &piece.rows[r] {
        let mut k = 0;
        let mut made = |has_foot: bool, has_head: bool, out: &mut Vec<Passage>| {
            if has_foot {
                out.extend([0, 1].map(|n| passage(stitch, k, node + n, None)));
            }
            if has_head {
                heads.next(out);
            }
            if has_foot {
                out.extend([2, 3].map(|n| passage(stitch, k, node + n, None)));
                node += 4;
                k += 1;
            }
        };
        match stitch {
            Stitch::Into(fan) => {
                for face in fan.loops() {
                    made(face.is_some(), true, &mut out);
                }
            }
            Stitch::Over | Stitch::CastOn => made(false, true, &mut out),
            Stitch::BindOff => made(true, false, &mut out),
            Stitch::Plain(_) | Stitch::Lifted(_) | Stitch::Together(..) => {
                made(true, true, &mut out);
            }
        }
    }
    out
}

/// Walks the heads of a course through the stitches of the row above.
struct Heads<'a> {
    row: &'a [Stitch],
    at: usize,
    /// Heads that the stitch has taken up already.
    used: usize,
    /// First node of the stitch.
    node: u32,
}

impl Heads<'_> {
    fn next(&mut self, out: &mut Vec<Passage>) {
        while let Some(stitch) = self.row.get(self.at) {
            let count = feet(stitch);
            if self.used < stitch.takes() {
                for k in 0..count {
                    for n in 0..4 {
                        let node = self.node + 4 * k as u32 + n;
                        out.push(passage(stitch, k, node, Some(self.used)));
                    }
                }
                self.used += 1;
                return;
            }
            self.node += 4 * count as u32;
            self.used = 0;
            self.at += 1;
        }
    }
}
