//! The graph of a symmetric pattern: which block rows share a block, and how to cut it in parts.

use crate::math::block::BlockPattern;
use std::collections::VecDeque;

/// Neighbours of every block row, without itself.
pub struct Graph {
    starts: Vec<usize>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// Both directions of a pattern.
    pub fn new(pattern: &BlockPattern) -> Self {
        let n = pattern.n();
        let mut starts = vec![0_usize; n + 1];
        let each = |visit: &mut dyn FnMut(usize, usize)| {
            for j in 0..n {
                for k in pattern.starts[j] as usize + 1..pattern.starts[j + 1] as usize {
                    visit(pattern.rows[k] as usize, j);
                }
            }
        };
        each(&mut |i, j| {
            starts[i + 1] += 1;
            starts[j + 1] += 1;
        });
        for v in 0..n {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut neighbours = vec![0_u32; starts[n]];
        each(&mut |i, j| {
            neighbours[next[i]] = j as u32;
            next[i] += 1;
            neighbours[next[j]] = i as u32;
            next[j] += 1;
        });
        Self { starts, neighbours }
    }

    /// Neighbours of a row.
    pub fn of(&self, v: u32) -> &[u32] {
        &self.neighbours[self.starts[v as usize]..self.starts[v as usize + 1]]
    }

    /// How many they are.
    pub fn degree(&self, v: u32) -> usize {
        self.of(v).len()
    }

    /// Sets of at most `most` rows that together have each row once: the graph is halved by the order of a breadth-first
    /// walk from a row far out, and the halves again.
    pub fn halved(&self, most: usize) -> Vec<Vec<u32>> {
        let n = self.starts.len() - 1;
        // the set of each row, and the last walk that has seen it
        let (mut set, mut seen) = (vec![0_u32; n], vec![0_u32; n]);
        let mut walks = 0;
        let mut sets = 1;
        let mut open = vec![(0..n as u32).collect::<Vec<u32>>()];
        let mut done = Vec::new();
        while let Some(rows) = open.pop() {
            if rows.len() <= most.max(1) {
                done.push(rows);
                continue;
            }
            let mut order = rows;
            // twice from the last row of the walk before: it starts far out
            for _ in 0..3 {
                order.reverse();
                walks += 1;
                order = self.walk(&order, &set, walks, &mut seen);
            }
            let second = order.split_off(order.len() / 2);
            for v in &second {
                set[*v as usize] = sets;
            }
            sets += 1;
            open.extend([second, order]);
        }
        done
    }

    /// The rows of one set by distance from the first of them; what is not joined to it follows likewise.
    fn walk(&self, rows: &[u32], set: &[u32], walk: u32, seen: &mut [u32]) -> Vec<u32> {
        let mut order = Vec::with_capacity(rows.len());
        let mut front = VecDeque::new();
        for &row in rows {
            if seen[row as usize] == walk {
                continue;
            }
            seen[row as usize] = walk;
            front.push_back(row);
            while let Some(v) = front.pop_front() {
                order.push(v);
                for &w in self.of(v) {
                    if seen[w as usize] != walk && set[w as usize] == set[row as usize] {
                        seen[w as usize] = walk;
                        front.push_back(w);
                    }
                }
            }
        }
        order
    }
}
